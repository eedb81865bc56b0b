//! What a scene may hold, so that no file takes a server down. Counted before memory is asked for,
//! over the scene's own file and all that edits add to it.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::Fault;

/// Bytes of one file.
pub(crate) const FILE_BYTES: u64 = 4 << 30;
/// Bytes of one glTF's JSON.
pub(crate) const JSON_BYTES: u64 = 256 << 20;
/// Triangles.
pub(crate) const TRIANGLES: u64 = 64 << 20;
/// Bytes of vertices, indices, morph targets and key frames, decoded.
pub(crate) const GEOMETRY_BYTES: u64 = 4 << 30;
/// Texels of all images together.
pub(crate) const TEXELS: u64 = 512 << 20;
/// Texels along an image's side.
pub(crate) const IMAGE_SIDE: u32 = 16_384;
/// Elements of an accessor that no buffer stands behind (all zeros, or sparse).
pub(crate) const ZERO_ELEMENTS: u64 = 1 << 24;
/// Nodes at a time, and their instances.
pub(crate) const NODES: usize = 1_000_000;
/// glTF files that edits add.
pub(crate) const FILES: usize = 1_024;
/// Probes of one volume.
pub(crate) const PROBES: u64 = 65_536;
/// Cells along z of a volume as it is sent; deeper ones are split. Its atlas at L2, as which every
/// order is drawn, has to fit the 256 slices that WebGL2 guarantees: 7 · (34 + 2) = 252.
pub(crate) const VOLUME_DEPTH: u32 = 34;
/// Volumes of a scene.
pub(crate) const VOLUMES: usize = 64;
/// Largest radiance (cd/m²), luminous intensity (cd) and illuminance (lx); the sun's disc has 2·10⁹.
pub(crate) const LIGHT: f32 = 1e12;
/// Largest coordinate (metres) and scale.
pub(crate) const EXTENT: f32 = 1e9;

/// What has been taken of the limits.
#[derive(Debug, Default)]
pub(crate) struct Budget {
    triangles: AtomicU64,
    geometry: AtomicU64,
    texels: AtomicU64,
}

impl Clone for Budget {
    fn clone(&self) -> Self {
        let copy = |n: &AtomicU64| AtomicU64::new(n.load(Ordering::Relaxed));
        Self {
            triangles: copy(&self.triangles),
            geometry: copy(&self.geometry),
            texels: copy(&self.texels),
        }
    }
}

impl Budget {
    pub(crate) fn triangles(&self, n: usize) -> Result<(), Fault> {
        take(&self.triangles, n as u64, TRIANGLES, "triangles")
    }

    /// Room for `n` values of type T.
    pub(crate) fn geometry<T>(&self, n: usize) -> Result<(), Fault> {
        let bytes = (n as u64).saturating_mul(size_of::<T>() as u64);
        take(&self.geometry, bytes, GEOMETRY_BYTES, "bytes of geometry and animation")
    }

    pub(crate) fn texels(&self, width: u32, height: u32) -> Result<(), Fault> {
        take(&self.texels, u64::from(width) * u64::from(height), TEXELS, "texels")
    }
}

fn take(taken: &AtomicU64, n: u64, limit: u64, what: &str) -> Result<(), Fault> {
    let add = |t: u64| t.checked_add(n).filter(|t| *t <= limit);
    match taken.fetch_update(Ordering::Relaxed, Ordering::Relaxed, add) {
        Ok(_) => Ok(()),
        Err(_) => Err(Fault::TooLarge { what: what.into(), limit }),
    }
}
