//! Embree 4 (Wald et al. 2014, "Embree: a kernel framework for efficient CPU ray tracing") as an oracle
//! for hits and a contender for speed. Its shared library is loaded at run time and never linked:
//! `LUMENCAST_EMBREE` names the file, for instance libembree4 out of PyPI's wheel `embreex`.
//!
//! Structures and constants are those of Embree 4's C interface (rtcore_ray.h, rtcore_buffer.h).
#![expect(unsafe_code, reason = "a C library that is loaded at run time")]

use std::ffi::{c_char, c_uint, c_void};
use std::mem::ManuallyDrop;
use std::path::Path;

use glam::{Affine3A, Vec3};
use libloading::Library;

type Handle = *mut c_void;

const GEOMETRY_TRIANGLE: c_uint = 0;
const GEOMETRY_INSTANCE: c_uint = 121;
const BUFFER_INDEX: c_uint = 0;
const BUFFER_VERTEX: c_uint = 1;
const FORMAT_UINT3: c_uint = 0x5003;
const FORMAT_FLOAT3: c_uint = 0x9003;
const FORMAT_FLOAT3X4_COLUMN_MAJOR: c_uint = 0x9234;
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

impl RayHit {
    fn new(origin: Vec3, direction: Vec3, t_max: f32) -> Self {
        Self {
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
}

/// A hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmbreeHit {
    /// In lengths of the direction.
    pub t: f32,
    /// Index of the triangle.
    pub triangle: u32,
}

macro_rules! api {
    ($($field:ident = $name:literal: fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// The functions of the library that are used.
        struct Api {
            $($field: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
            /// Never unloaded: threads of its own may still run its code.
            _library: ManuallyDrop<Library>,
        }

        impl Api {
            fn load(library: &Path) -> Result<Self, libloading::Error> {
                // SAFETY: the caller names an Embree 4; the signatures are those of its headers.
                unsafe {
                    let library = Library::new(library)?;
                    Ok(Self {
                        $($field: *library.get($name)?,)*
                        _library: ManuallyDrop::new(library),
                    })
                }
            }
        }
    };
}

api! {
    new_device = b"rtcNewDevice": fn(*const c_char) -> Handle;
    release_device = b"rtcReleaseDevice": fn(Handle);
    new_scene = b"rtcNewScene": fn(Handle) -> Handle;
    set_quality = b"rtcSetSceneBuildQuality": fn(Handle, c_uint);
    set_flags = b"rtcSetSceneFlags": fn(Handle, c_uint);
    commit_scene = b"rtcCommitScene": fn(Handle);
    release_scene = b"rtcReleaseScene": fn(Handle);
    new_geometry = b"rtcNewGeometry": fn(Handle, c_uint) -> Handle;
    new_buffer = b"rtcSetNewGeometryBuffer":
        fn(Handle, c_uint, c_uint, c_uint, usize, usize) -> *mut c_void;
    set_instanced = b"rtcSetGeometryInstancedScene": fn(Handle, Handle);
    set_transform = b"rtcSetGeometryTransform": fn(Handle, c_uint, c_uint, *const f32);
    commit_geometry = b"rtcCommitGeometry": fn(Handle);
    attach = b"rtcAttachGeometry": fn(Handle, Handle) -> c_uint;
    release_geometry = b"rtcReleaseGeometry": fn(Handle);
    intersect = b"rtcIntersect1": fn(Handle, *mut RayHit, *const c_void);
    occluded = b"rtcOccluded1": fn(Handle, *mut RayHit, *const c_void);
}

impl Api {
    fn device(&self, threads: usize) -> Handle {
        let options = format!("threads={threads}\0");
        // SAFETY: the string ends with a zero.
        unsafe { (self.new_device)(options.as_ptr().cast()) }
    }

    /// The nearest triangle on a ray through a committed scene.
    #[inline]
    fn closest(&self, scene: Handle, mut ray: RayHit) -> Option<EmbreeHit> {
        // SAFETY: the scene is committed; the ray is aligned and as large as Embree wants it. No
        // arguments means the default ones.
        unsafe { (self.intersect)(scene, &raw mut ray, std::ptr::null()) };
        (ray.geometry != NONE).then_some(EmbreeHit { t: ray.t_far, triangle: ray.primitive })
    }

    /// Whether any triangle of a committed scene lies on a ray.
    #[inline]
    fn occluded(&self, scene: Handle, mut ray: RayHit) -> bool {
        // SAFETY: as in `closest`; only the ray's part is used.
        unsafe { (self.occluded)(scene, &raw mut ray, std::ptr::null()) };
        ray.t_far < 0.0
    }

    /// A committed scene of triangles, made by `device`.
    fn triangles(
        &self,
        device: Handle,
        triangles: &[[Vec3; 3]],
        quality: Quality,
        robust: bool,
    ) -> Handle {
        // SAFETY: buffers are written within the lengths that they were made with, and their copies
        // are Embree's own.
        unsafe {
            let scene = (self.new_scene)(device);
            (self.set_quality)(scene, quality as c_uint);
            (self.set_flags)(scene, if robust { SCENE_ROBUST } else { 0 });
            let geometry = (self.new_geometry)(device, GEOMETRY_TRIANGLE);
            let buffer =
                |kind, format, count| (self.new_buffer)(geometry, kind, 0, format, 12, count);
            let corners = buffer(BUFFER_VERTEX, FORMAT_FLOAT3, 3 * triangles.len());
            let corners: *mut [[f32; 3]; 3] = corners.cast();
            let indices: *mut [u32; 3] = buffer(BUFFER_INDEX, FORMAT_UINT3, triangles.len()).cast();
            for (i, triangle) in triangles.iter().enumerate() {
                let first = 3 * i as u32;
                corners.add(i).write(triangle.map(|c| c.to_array()));
                indices.add(i).write([first, first + 1, first + 2]);
            }
            (self.commit_geometry)(geometry);
            (self.attach)(scene, geometry);
            (self.release_geometry)(geometry);
            (self.commit_scene)(scene);
            scene
        }
    }
}

/// A scene of triangles in Embree.
pub struct Embree {
    scene: Handle,
    device: Handle,
    api: Api,
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
    /// Where the file is no Embree 4.
    pub fn new(
        library: &Path,
        triangles: &[[Vec3; 3]],
        quality: Quality,
        robust: bool,
        threads: usize,
    ) -> Result<Self, libloading::Error> {
        let api = Api::load(library)?;
        let device = api.device(threads);
        let scene = api.triangles(device, triangles, quality, robust);
        Ok(Self { scene, device, api })
    }

    /// The nearest triangle on a ray.
    #[inline]
    #[must_use]
    pub fn closest(&self, origin: Vec3, direction: Vec3, t_max: f32) -> Option<EmbreeHit> {
        self.api.closest(self.scene, RayHit::new(origin, direction, t_max))
    }

    /// Whether any triangle lies on a ray.
    #[inline]
    #[must_use]
    pub fn occluded(&self, origin: Vec3, direction: Vec3, t_max: f32) -> bool {
        self.api.occluded(self.scene, RayHit::new(origin, direction, t_max))
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // SAFETY: both were made by this library, and nobody else has them.
        unsafe {
            (self.api.release_scene)(self.scene);
            (self.api.release_device)(self.device);
        }
    }
}

/// Meshes and their instances in Embree, as two levels.
pub struct EmbreeInstances {
    meshes: Vec<Handle>,
    top: Handle,
    instances: Vec<Handle>,
    device: Handle,
    api: Api,
}

// SAFETY: as for `Embree`; the top level is built anew through `&mut` alone.
unsafe impl Send for EmbreeInstances {}
// SAFETY: as above.
unsafe impl Sync for EmbreeInstances {}

impl EmbreeInstances {
    /// Loads the library and builds instances, each a mesh (its index) and its place, with Embree's
    /// default quality.
    ///
    /// # Errors
    /// Where the file is no Embree 4.
    pub fn new(
        library: &Path,
        meshes: &[Vec<[Vec3; 3]>],
        instances: &[(usize, Affine3A)],
        robust: bool,
        threads: usize,
    ) -> Result<Self, libloading::Error> {
        let api = Api::load(library)?;
        let device = api.device(threads);
        let meshes: Vec<Handle> =
            meshes.iter().map(|m| api.triangles(device, m, Quality::Medium, robust)).collect();
        // SAFETY: all handles are of this device.
        let top = unsafe {
            let top = (api.new_scene)(device);
            (api.set_quality)(top, Quality::Medium as c_uint);
            (api.set_flags)(top, if robust { SCENE_ROBUST } else { 0 });
            top
        };
        let place = |&(mesh, _): &(usize, Affine3A)| {
            let mesh = meshes[mesh];
            // SAFETY: as above.
            unsafe {
                let instance = (api.new_geometry)(device, GEOMETRY_INSTANCE);
                (api.set_instanced)(instance, mesh);
                (api.attach)(top, instance);
                instance
            }
        };
        let handles = instances.iter().map(place).collect();
        let mut all = Self { meshes, top, instances: handles, device, api };
        all.place(instances.iter().map(|(_, world_from_object)| *world_from_object));
        Ok(all)
    }

    /// Moves the instances, and builds the top level anew.
    pub fn place(&mut self, world_from_object: impl IntoIterator<Item = Affine3A>) {
        // SAFETY: Embree reads twelve numbers before it returns.
        unsafe {
            for (&instance, to) in self.instances.iter().zip(world_from_object) {
                let columns = to.to_cols_array();
                let format = FORMAT_FLOAT3X4_COLUMN_MAJOR;
                (self.api.set_transform)(instance, 0, format, columns.as_ptr());
                (self.api.commit_geometry)(instance);
            }
            (self.api.commit_scene)(self.top);
        }
    }

    /// The nearest triangle on a ray, numbered within its mesh.
    #[inline]
    #[must_use]
    pub fn closest(&self, origin: Vec3, direction: Vec3, t_max: f32) -> Option<EmbreeHit> {
        self.api.closest(self.top, RayHit::new(origin, direction, t_max))
    }

    /// Whether any triangle lies on a ray.
    #[inline]
    #[must_use]
    pub fn occluded(&self, origin: Vec3, direction: Vec3, t_max: f32) -> bool {
        self.api.occluded(self.top, RayHit::new(origin, direction, t_max))
    }
}

impl Drop for EmbreeInstances {
    fn drop(&mut self) {
        // SAFETY: all were made by this library, and nobody else has them.
        unsafe {
            for &instance in &self.instances {
                (self.api.release_geometry)(instance);
            }
            (self.api.release_scene)(self.top);
            for &mesh in &self.meshes {
                (self.api.release_scene)(mesh);
            }
            (self.api.release_device)(self.device);
        }
    }
}
