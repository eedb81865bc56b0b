//! What the path tracer finds at points, and how near other light comes to it.

use glam::Vec3;

use super::display::{code, most};

/// Irradiance at points, and how far to trust it.
pub(super) struct Reference {
    /// Lux; nothing for points within something.
    pub(super) irradiance: Vec<Option<Vec3>>,
    /// What is displayed as white, lux.
    pub(super) white: f32,
    /// How far noise alone takes it from what is right, decibels.
    pub(super) noise: f64,
    /// Samples a point.
    pub(super) samples: u32,
}

impl Reference {
    /// Points that light is judged at.
    pub(super) fn judged(&self) -> usize {
        self.irradiance.iter().flatten().count()
    }

    /// How near light that is read comes at the points, decibels.
    pub(super) fn psnr<P>(&self, places: &[P], read: impl Fn(&P) -> Option<Vec3>) -> f64 {
        let pairs = places.iter().zip(&self.irradiance);
        psnr(pairs.filter_map(|(place, right)| Some((read(place)?, (*right)?))), self.white)
    }
}

/// The 99th percentile of the largest channels.
pub(super) fn white<'a>(irradiances: impl Iterator<Item = &'a Vec3>) -> f32 {
    most(irradiances.map(|e| f64::from(e.max_element())).collect()).unwrap_or(0.0) as f32
}

/// PSNR of displayed values: gamma 2.2, clamped.
pub(super) fn psnr(pairs: impl Iterator<Item = (Vec3, Vec3)>, white: f32) -> f64 {
    let shown = |e: Vec3| e.map(|channel| code(channel, white) / 255.0);
    let (mut squares, mut count) = (0.0, 0);
    for (a, b) in pairs {
        squares += f64::from((shown(a) - shown(b)).length_squared());
        count += 3;
    }
    -10.0 * (squares / f64::from(count)).log10()
}
