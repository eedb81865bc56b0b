//! Test vectors that several crates or kinds of test read.

use std::path::Path;

use glam::Vec3;
use serde::Deserialize;

/// `vectors/ggx_albedo.json`: what single-scatter GGX reflects of light from everywhere, integrated
/// by other means. For roughness i and cosine j, `by_f0[i][j] · F0 + by_f90[i][j]`.
#[derive(Debug, Deserialize)]
pub struct GgxAlbedo {
    /// Perceptual, 0 to 1.
    pub roughness: Vec<f32>,
    /// Of the angle between view and normal.
    pub cos: Vec<f32>,
    /// Share that grows with the reflectance at normal incidence.
    pub by_f0: Vec<Vec<f64>>,
    /// The rest, at a grazing reflectance of 1.
    pub by_f90: Vec<Vec<f64>>,
}

impl GgxAlbedo {
    /// Reads the file.
    ///
    /// # Panics
    /// Where it is not there, or not such a table.
    pub fn load() -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vectors/ggx_albedo.json");
        let text = std::fs::read_to_string(path).expect("vectors/ggx_albedo.json");
        serde_json::from_str(&text).expect("a table of albedos")
    }
}

/// What vectors hold in place of long lists: the FNV-1a hash (32 bits) of little-endian f32 bits, x, y, z
/// by turns.
pub fn fnv(values: &[Vec3]) -> u32 {
    values
        .iter()
        .flat_map(|value| value.to_array())
        .flat_map(f32::to_le_bytes)
        .fold(0x811C_9DC5, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
}
