//! Selects the instruction set for a whole batch of rays. This is the one place that calls code
//! compiled for a particular processor.

use super::item_buffer::ItemBuffer;
use super::kernel::Kernel;
use super::kernel_portable::{boxes_portable, triangles_portable};
use super::light_buffer::LightBuffer;
use super::walk::{Stacks, put, trace_with};
use super::{Accel, Hit, Ray};

/// Calls the twin of a function that is compiled for the kernel's instructions.
macro_rules! dispatch {
    ($kernel:expr, $twin:ident$(::<$($generic:ident),*>)?($($argument:expr),*), $portable:expr) => {
        match $kernel {
            Kernel::Portable => $portable,
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx2(_) => {
                #[expect(unsafe_code, reason = "calls code compiled for AVX2")]
                // SAFETY: only `Kernel::detect` makes `Avx2`, after the check for what it needs.
                unsafe {
                    super::kernel_avx2::$twin$(::<$($generic),*>)?($($argument),*);
                }
            }
            #[cfg(target_arch = "aarch64")]
            Kernel::Neon => {
                #[expect(unsafe_code, reason = "calls code compiled for NEON")]
                // SAFETY: `kernel_neon` does not compile for a target without NEON.
                unsafe {
                    super::kernel_neon::$twin$(::<$($generic),*>)?($($argument),*);
                }
            }
        }
    };
}

impl Kernel {
    /// Runs `work`, compiled for the kernel's instructions. It has to be a closure that is always
    /// inlined and calls only such functions; other functions keep the target's instructions.
    #[inline(always)]
    pub(crate) fn run(self, work: impl FnOnce()) {
        dispatch!(self, run(work), work());
    }
}

/// Finds the nearest hit of each ray, or with `ANY` the first hit found. It reports each ray as
/// soon as the ray is done. The value that comes with a ray is passed to `accept` and `found`.
#[inline]
pub(super) fn trace<const ANY: bool, T: Copy>(
    accel: &Accel,
    rays: impl Iterator<Item = (Ray, T)>,
    stacks: &mut Stacks,
    accept: impl Fn(&T, &Hit) -> bool,
    found: impl FnMut(T, Option<Hit>),
) {
    dispatch!(
        accel.kernel,
        trace::<ANY, T>(accel, rays, stacks, accept, found),
        trace_with::<ANY, T>(
            accel,
            rays,
            stacks,
            accept,
            found,
            |node, ray, t_max, stack| {
                put::<ANY>(node, ray, &boxes_portable(node, ray, t_max), stack)
            },
            triangles_portable,
        )
    );
}

impl ItemBuffer {
    /// Finds the nearest surface on each ray that `accept` accepts, like [`Accel::closest`]. Rays
    /// that it cannot decide go to `undecided`.
    #[inline]
    pub(crate) fn closest<T: Copy>(
        &self,
        rays: impl Iterator<Item = (Ray, T)>,
        accept: impl Fn(&T, &Hit) -> bool,
        found: impl FnMut(T, Option<Hit>),
        undecided: impl FnMut(Ray, T),
    ) {
        dispatch!(
            self.kernel(),
            closest_seen::<T>(self, rays, accept, found, undecided),
            self.closest_with(rays, accept, found, undecided, triangles_portable)
        );
    }
}

impl LightBuffer {
    /// Tells whether any surface that `accept` accepts lies on each ray; otherwise like
    /// [`Accel::occluded`]. The buffer must answer the rays ([`Self::answers`]). Rays that it
    /// cannot decide go to `undecided`.
    #[inline]
    pub(crate) fn occluded<T: Copy>(
        &self,
        rays: impl Iterator<Item = (Ray, T)>,
        accept: impl Fn(&T, &Hit) -> bool,
        found: impl FnMut(T, bool),
        undecided: impl FnMut(Ray, T),
    ) {
        dispatch!(
            self.kernel(),
            occluded::<T>(self, rays, accept, found, undecided),
            self.occluded_with(rays, accept, found, undecided, triangles_portable)
        );
    }
}
