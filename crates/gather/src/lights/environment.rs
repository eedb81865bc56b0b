//! The environment: its radiance, and for pictures a table to sample directions from.

use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;

use glam::{Vec2, Vec3};
use lumencast_scene::{Environment, HdrImage};

use crate::sampling::{Grid2, luminance};

/// Upper limit of the number of columns of the table over a picture.
const TABLE_WIDTH: usize = 1024;

/// The sampling table of the last environment picture, reused while the picture is the same.
#[derive(Debug, Default)]
pub(crate) struct SkyCache(Option<(Arc<HdrImage>, Arc<Grid2>)>);

/// An environment, ready to be evaluated and sampled.
#[derive(Clone, Debug)]
pub(crate) enum Sky {
    /// The same radiance from everywhere, cd/m².
    Constant(Vec3),
    /// Radiance that depends on elevation only, cd/m².
    Gradient {
        /// From straight above.
        zenith: Vec3,
        /// From the horizon.
        horizon: Vec3,
        /// From straight below.
        ground: Vec3,
    },
    /// A picture in latitude and longitude.
    Picture {
        /// The picture's texels.
        image: Arc<HdrImage>,
        /// Factor that turns texels into cd/m².
        intensity: f32,
        /// Rotation about +Y, as a fraction of a full turn.
        turn: f32,
        /// Density to sample directions from, over the picture.
        table: Arc<Grid2>,
    },
}

impl Sky {
    pub(crate) fn new(environment: &Environment, cache: &mut SkyCache) -> Self {
        match environment {
            Environment::Constant { radiance } => Self::Constant(*radiance),
            Environment::Sky { zenith, horizon, ground } => {
                Self::Gradient { zenith: *zenith, horizon: *horizon, ground: *ground }
            }
            Environment::Image { image: Some(image), intensity, rotation, .. } => {
                let table = cache.table(image);
                Self::Picture {
                    image: image.clone(),
                    intensity: *intensity,
                    turn: rotation / TAU,
                    table,
                }
            }
            Environment::Image { image: None, .. } => Self::Constant(Vec3::ZERO),
        }
    }

    /// Radiance from a direction, cd/m². Pictures are looked up without filtering, so that a sun of
    /// one texel is met as often as the table says.
    pub(crate) fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Constant(radiance) => *radiance,
            Self::Gradient { zenith, horizon, ground } => {
                let end = if direction.y >= 0.0 { zenith } else { ground };
                horizon.lerp(*end, direction.y.abs().min(1.0))
            }
            Self::Picture { image, intensity, turn, .. } => {
                let at = picture_from_direction(direction, *turn);
                let x = ((at.x * image.width as f32) as usize).min(image.width as usize - 1);
                let y = ((at.y * image.height as f32) as usize).min(image.height as usize - 1);
                *intensity * image.texels[y * image.width as usize + x]
            }
        }
    }

    /// Whether [`Sky::sample`] finds its light; otherwise only rays that the BSDF chose do.
    pub(crate) fn is_sampled(&self) -> bool {
        matches!(self, Self::Picture { table, .. } if !table.is_empty())
    }

    /// Samples a direction; returns it with its radiance and density per steradian.
    pub(crate) fn sample(&self, u: Vec2) -> Option<(Vec3, Vec3, f32)> {
        let Self::Picture { table, turn, .. } = self else { return None };
        let (at, density) = table.sample(u);
        let direction = direction_from_picture(at, *turn);
        let pdf = per_steradian(density, at.y);
        (pdf > 0.0).then(|| (direction, self.radiance(direction), pdf))
    }

    /// The density per steradian of [`Sky::sample`].
    pub(crate) fn pdf(&self, direction: Vec3) -> f32 {
        let Self::Picture { table, turn, .. } = self else { return 0.0 };
        let at = picture_from_direction(direction, *turn);
        per_steradian(table.density(at), at.y)
    }
}

impl SkyCache {
    fn table(&mut self, image: &Arc<HdrImage>) -> Arc<Grid2> {
        match &self.0 {
            Some((kept, table)) if Arc::ptr_eq(kept, image) => table.clone(),
            _ => {
                let table = Arc::new(table(image));
                self.0 = Some((image.clone(), table.clone()));
                table
            }
        }
    }
}

/// Luminance times solid angle of each texel, averaged to at most [`TABLE_WIDTH`] columns.
fn table(image: &HdrImage) -> Grid2 {
    let (w, h) = (image.width as usize, image.height as usize);
    let (columns, rows) = (w.min(TABLE_WIDTH), h.min(TABLE_WIDTH / 2));
    let mut weights = vec![0.0; columns * rows];
    for row in 0..rows {
        let sin = (PI * (row as f32 + 0.5) / rows as f32).sin();
        for column in 0..columns {
            // A cell averages all texels that reach into it, so that none is left out.
            let (y0, y1) = (row * h / rows, ((row + 1) * h).div_ceil(rows));
            let (x0, x1) = (column * w / columns, ((column + 1) * w).div_ceil(columns));
            let sum: f32 = (y0..y1)
                .flat_map(|y| &image.texels[y * w + x0..y * w + x1])
                .map(|&t| luminance(t))
                .sum();
            weights[row * columns + column] = sum / ((y1 - y0) * (x1 - x0)) as f32 * sin;
        }
    }
    Grid2::new(&weights, columns)
}

/// u = 0.5 + atan2(x, −z)/2π, v = acos(y)/π, the picture turned about +Y.
fn picture_from_direction(d: Vec3, turn: f32) -> Vec2 {
    // A turn by +φ about +Y takes atan2(x, −z) to itself less φ.
    let u = 0.5 + d.x.atan2(-d.z) / TAU + turn;
    // This is acos(y), but exact near the poles too.
    Vec2::new(u - u.floor(), d.x.hypot(d.z).atan2(d.y) * FRAC_1_PI)
}

fn direction_from_picture(at: Vec2, turn: f32) -> Vec3 {
    let azimuth = (at.x - turn - 0.5) * TAU;
    let polar = at.y * PI;
    Vec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos())
}

/// Converts a density over the picture (unit square) to one per steradian.
fn per_steradian(density: f32, v: f32) -> f32 {
    let sin = (PI * v).sin();
    if sin > 0.0 { density / (2.0 * PI * PI * sin) } else { 0.0 }
}
