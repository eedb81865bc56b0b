//! Embree 4 (Wald et al. 2014, "Embree: a kernel framework for efficient CPU ray tracing") as an oracle
//! for hits and a contender for speed. Its shared library is loaded at run time and never linked:
//! `LUMENCAST_EMBREE` names the file, for instance libembree4 out of PyPI's wheel `embreex`.
//!
//! Structures and constants are those of Embree 4's C interface (rtcore_ray.h, rtcore_buffer.h).
#![expect(unsafe_code, reason = "a C library that is loaded at run time")]

use std::ffi::{c_char, c_uint, c_void};
use std::mem::ManuallyDrop;
use std::path::Path;

use glam::Vec3;
use libloading::Library;

type Handle = *mut c_void;

const GEOMETRY_TRIANGLE: c_uint = 0;
const BUFFER_INDEX: c_uint = 0;
const BUFFER_VERTEX: c_uint = 1;
const FORMAT_UINT3: c_uint = 0x5003;
const FORMAT_FLOAT3: c_uint = 0x9003;
const SCENE_ROBUST: c_uint = 1 << 2;
const NONE: u32 = u32::MAX;

/// How much trouble Embree takes over building.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// Its default.
    Medium = 1,
    /// With spatial splits.
    High = 2,
}

/// RTCRay and after it RTCHit, with room for fields that newer versions append.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct RayHit {
    origin: [f32; 3],
    t_near: f32,
    direction: [f32; 3],
    time: f32,
    t_far: f32,
    mask: u32,
    id: u32,
    flags: u32,
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: u32,
    geometry: u32,
    instances: [u32; 9],
}

/// A hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmbreeHit {
    /// In lengths of the direction.
    pub t: f32,
    /// Index of the triangle.
    pub triangle: u32,
}

/// A scene of triangles in Embree.
pub struct Embree {
    scene: Handle,
    device: Handle,
    intersect: unsafe extern "C" fn(Handle, *mut RayHit, *const c_void),
    occluded: unsafe extern "C" fn(Handle, *mut RayHit, *const c_void),
    release_scene: unsafe extern "C" fn(Handle),
    release_device: unsafe extern "C" fn(Handle),
    /// Never unloaded: threads of its own may still run its code.
    _library: ManuallyDrop<Library>,
}

// SAFETY: queries on a committed scene may run on any number of threads (Embree's manual, "Ray
// queries"); everything else happens while it is built and dropped.
unsafe impl Send for Embree {}
// SAFETY: as above.
unsafe impl Sync for Embree {}

impl Embree {
    /// Loads the library and builds a scene with as many threads. `robust` asks for its watertight
    /// mode.
    ///
    /// # Errors
    /// Where the file is no Embree 4, or Embree finds fault with the triangles.
    pub fn new(
        library: &Path,
        triangles: &[[Vec3; 3]],
        quality: Quality,
        robust: bool,
        threads: usize,
    ) -> Result<Self, libloading::Error> {
        // SAFETY: the caller names an Embree 4; the signatures are those of its headers. Buffers are
        // written within the lengths that they were made with, and their copies are Embree's own.
        unsafe {
            let library = Library::new(library)?;
            macro_rules! function {
                ($name:literal, fn($($argument:ty),*) $(-> $result:ty)?) => {
                    *library.get::<unsafe extern "C" fn($($argument),*) $(-> $result)?>($name)?
                };
            }
            let new_device = function!(b"rtcNewDevice", fn(*const c_char) -> Handle);
            let new_scene = function!(b"rtcNewScene", fn(Handle) -> Handle);
            let set_quality = function!(b"rtcSetSceneBuildQuality", fn(Handle, c_uint));
            let set_flags = function!(b"rtcSetSceneFlags", fn(Handle, c_uint));
            let new_geometry = function!(b"rtcNewGeometry", fn(Handle, c_uint) -> Handle);
            let new_buffer = function!(
                b"rtcSetNewGeometryBuffer",
                fn(Handle, c_uint, c_uint, c_uint, usize, usize) -> Handle
            );
            let commit_geometry = function!(b"rtcCommitGeometry", fn(Handle));
            let attach = function!(b"rtcAttachGeometry", fn(Handle, Handle) -> c_uint);
            let release_geometry = function!(b"rtcReleaseGeometry", fn(Handle));
            let commit_scene = function!(b"rtcCommitScene", fn(Handle));

            let options = format!("threads={threads}\0");
            let device = new_device(options.as_ptr().cast());
            let scene = new_scene(device);
            set_quality(scene, quality as c_uint);
            set_flags(scene, if robust { SCENE_ROBUST } else { 0 });
            let geometry = new_geometry(device, GEOMETRY_TRIANGLE);
            let corners =
                new_buffer(geometry, BUFFER_VERTEX, 0, FORMAT_FLOAT3, 12, 3 * triangles.len());
            let corners: *mut [[f32; 3]; 3] = corners.cast();
            let indices = new_buffer(geometry, BUFFER_INDEX, 0, FORMAT_UINT3, 12, triangles.len());
            let indices: *mut [u32; 3] = indices.cast();
            for (i, triangle) in triangles.iter().enumerate() {
                let first = 3 * i as u32;
                corners.add(i).write(triangle.map(|c| c.to_array()));
                indices.add(i).write([first, first + 1, first + 2]);
            }
            commit_geometry(geometry);
            attach(scene, geometry);
            release_geometry(geometry);
            commit_scene(scene);
            Ok(Self {
                scene,
                device,
                intersect: function!(b"rtcIntersect1", fn(Handle, *mut RayHit, *const c_void)),
                occluded: function!(b"rtcOccluded1", fn(Handle, *mut RayHit, *const c_void)),
                release_scene: function!(b"rtcReleaseScene", fn(Handle)),
                release_device: function!(b"rtcReleaseDevice", fn(Handle)),
                _library: ManuallyDrop::new(library),
            })
        }
    }

    fn ray(origin: Vec3, direction: Vec3, t_max: f32) -> RayHit {
        RayHit {
            origin: origin.to_array(),
            t_near: 0.0,
            direction: direction.to_array(),
            time: 0.0,
            t_far: t_max,
            mask: NONE,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            u: 0.0,
            v: 0.0,
            primitive: NONE,
            geometry: NONE,
            instances: [NONE; 9],
        }
    }

    /// The nearest triangle on a ray.
    #[inline]
    #[must_use]
    pub fn closest(&self, origin: Vec3, direction: Vec3, t_max: f32) -> Option<EmbreeHit> {
        let mut ray = Self::ray(origin, direction, t_max);
        // SAFETY: the scene is committed; the ray is aligned and as large as Embree wants it. No
        // arguments means the default ones.
        unsafe { (self.intersect)(self.scene, &raw mut ray, std::ptr::null()) };
        (ray.geometry != NONE).then_some(EmbreeHit { t: ray.t_far, triangle: ray.primitive })
    }

    /// Whether any triangle lies on a ray.
    #[inline]
    #[must_use]
    pub fn occluded(&self, origin: Vec3, direction: Vec3, t_max: f32) -> bool {
        let mut ray = Self::ray(origin, direction, t_max);
        // SAFETY: as in `closest`; only the ray's part is used.
        unsafe { (self.occluded)(self.scene, &raw mut ray, std::ptr::null()) };
        ray.t_far < 0.0
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // SAFETY: both were made by this library, and nobody else has them.
        unsafe {
            (self.release_scene)(self.scene);
            (self.release_device)(self.device);
        }
    }
}
