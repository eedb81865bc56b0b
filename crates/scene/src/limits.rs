//! Limits of what a scene may hold, so that no file exhausts a server's memory. They are checked
//! before memory is allocated. They cover the scene's own file and all files that edits add.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::Fault;

/// Size of one file in bytes.
pub(crate) const FILE_BYTES: u64 = 4 << 30;
/// Size in bytes of a file that an edit names, and of each file that it refers to.
pub(crate) const ADDED_FILE_BYTES: u64 = 512 << 20;
/// Size in bytes of one glTF's JSON.
pub(crate) const JSON_BYTES: u64 = 256 << 20;
/// Number of triangles.
pub(crate) const TRIANGLES: u64 = 64 << 20;
/// Decoded size in bytes of vertices, indices, morph targets and key frames.
pub(crate) const GEOMETRY_BYTES: u64 = 4 << 30;
/// Number of texels of all images together.
pub(crate) const TEXELS: u64 = 512 << 20;
/// Number of texels along an image's side.
pub(crate) const IMAGE_SIDE: u32 = 16_384;
/// Number of elements of an accessor without a buffer (all zeros, or sparse).
pub(crate) const ZERO_ELEMENTS: u64 = 1 << 24;
/// Number of nodes at a time, together with their instances.
pub(crate) const NODES: usize = 1_000_000;
/// Number of glTF files that edits add.
pub(crate) const FILES: usize = 1_024;
/// Number of probes of one volume.
pub(crate) const PROBES: u64 = 65_536;
/// Number of cells along z of a volume on the wire; deeper volumes are split. Clients draw every
/// order as L2, whose atlas has to fit the 256 slices that WebGL2 guarantees: 7 · (34 + 2) = 252.
pub(crate) const VOLUME_DEPTH: u32 = 34;
/// Number of volumes of a scene.
pub(crate) const VOLUMES: usize = 64;
/// Number of lumels along a page's side: below, there is no room for padding; above, devices have no
/// such textures.
pub(crate) const PAGE_SIZES: std::ops::RangeInclusive<u32> = 64..=4096;
/// Largest radiance (cd/m²), luminous intensity (cd) and illuminance (lx); the sun's disc has 2·10⁹
/// cd/m².
pub(crate) const LIGHT: f32 = 1e12;
/// Largest coordinate (metres) and scale.
pub(crate) const EXTENT: f32 = 1e9;

/// Amounts of the limited quantities that files use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Taken {
    triangles: u64,
    geometry: u64,
    texels: u64,
}

impl Taken {
    /// Returns an error that names the limit exceeded, if any.
    pub(crate) fn check(self) -> Result<(), Fault> {
        let limits = [
            (self.triangles, TRIANGLES, WHAT_TRIANGLES),
            (self.geometry, GEOMETRY_BYTES, WHAT_GEOMETRY),
            (self.texels, TEXELS, WHAT_TEXELS),
        ];
        match limits.into_iter().find(|(taken, limit, _)| taken > limit) {
            None => Ok(()),
            Some((_, limit, what)) => Err(Fault::TooLarge { what: what.into(), limit }),
        }
    }
}

#[cfg(test)]
impl Taken {
    pub(crate) fn of_texels(texels: u64) -> Self {
        Self { texels, ..Self::default() }
    }
}

impl std::iter::Sum for Taken {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), |sum, taken| sum + taken)
    }
}

impl std::ops::Add for Taken {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            triangles: self.triangles + other.triangles,
            geometry: self.geometry + other.geometry,
            texels: self.texels + other.texels,
        }
    }
}

impl std::ops::Sub for Taken {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self {
            triangles: self.triangles - other.triangles,
            geometry: self.geometry - other.geometry,
            texels: self.texels - other.texels,
        }
    }
}

const WHAT_TRIANGLES: &str = "triangles";
const WHAT_GEOMETRY: &str = "bytes of geometry and animation";
const WHAT_TEXELS: &str = "texels";

/// Amounts used while several threads read files.
#[derive(Debug, Default)]
pub(crate) struct Budget {
    triangles: AtomicU64,
    geometry: AtomicU64,
    texels: AtomicU64,
}

impl Budget {
    /// A budget of which these amounts are used.
    pub(crate) fn starting_at(taken: Taken) -> Self {
        Self {
            triangles: taken.triangles.into(),
            geometry: taken.geometry.into(),
            texels: taken.texels.into(),
        }
    }

    pub(crate) fn taken(&self) -> Taken {
        Taken {
            triangles: self.triangles.load(Ordering::Relaxed),
            geometry: self.geometry.load(Ordering::Relaxed),
            texels: self.texels.load(Ordering::Relaxed),
        }
    }

    pub(crate) fn triangles(&self, n: usize) -> Result<(), Fault> {
        take(&self.triangles, n as u64, TRIANGLES, WHAT_TRIANGLES)
    }

    /// Uses room for `n` values of type T.
    pub(crate) fn geometry<T>(&self, n: usize) -> Result<(), Fault> {
        let bytes = (n as u64).saturating_mul(size_of::<T>() as u64);
        take(&self.geometry, bytes, GEOMETRY_BYTES, WHAT_GEOMETRY)
    }

    pub(crate) fn texels(&self, width: u32, height: u32) -> Result<(), Fault> {
        take(&self.texels, u64::from(width) * u64::from(height), TEXELS, WHAT_TEXELS)
    }
}

fn take(taken: &AtomicU64, n: u64, limit: u64, what: &str) -> Result<(), Fault> {
    let add = |t: u64| t.checked_add(n).filter(|t| *t <= limit);
    match taken.fetch_update(Ordering::Relaxed, Ordering::Relaxed, add) {
        Ok(_) => Ok(()),
        Err(_) => Err(Fault::TooLarge { what: what.into(), limit }),
    }
}
