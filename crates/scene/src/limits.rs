//! What a scene may hold, so that no file takes a server down. Counted before memory is asked for,
//! over the scene's own file and all that edits add to it.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::Fault;

/// Bytes of one file.
pub(crate) const FILE_BYTES: u64 = 4 << 30;
/// Bytes of a file that an edit names, and of each file that this one refers to.
pub(crate) const ADDED_FILE_BYTES: u64 = 512 << 20;
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

/// How much of the limits files take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Taken {
    triangles: u64,
    geometry: u64,
    texels: u64,
}

impl Taken {
    /// An error that says which limit it exceeds.
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

/// What is taken of the limits while files are read, by several threads.
#[derive(Debug, Default)]
pub(crate) struct Budget {
    triangles: AtomicU64,
    geometry: AtomicU64,
    texels: AtomicU64,
}

impl Budget {
    /// What is left of the limits once so much is taken.
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

    /// Room for `n` values of type T.
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
