//! Numbers for vectors that are the same on every machine.

use glam::Vec3;

/// Numbers that only look random (splitmix64).
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Three numbers from −1 to 1.
    pub(crate) fn vector(&mut self) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|_| {
            (self.next() >> 40) as f32 / (1 << 23) as f32 - 1.0
        }))
    }
}
