//! Whether a picture's paths should be connected to what the sun was followed to, and where to follow it.
//!
//! A few paths without connections show where the sun's light counts; as many with them, whether they
//! are worth their rays: where the squared error by the same number of rays is less.

use glam::UVec2;

use super::Renderer;
use crate::path_trace::beam::{Beam, Found};
use crate::path_trace::paths::{Paths, Shortcuts};
use crate::sampling::{Sampler, luminance, mix};

/// Pixels that are looked at, each twice; some more often where a picture has fewer.
const PIXELS: u32 = 1 << 14;
/// Pixels of which a thread follows the paths together.
const BATCH: u32 = 128;

/// What some paths have shown.
#[derive(Default)]
struct Trial {
    found: Vec<Found>,
    /// Of indirect light's luminance, summed over pixels; twice that of a single path.
    squared_error: f64,
    rays: u64,
}

impl Trial {
    /// Squared error of as many paths as share a given number of rays.
    fn cost(&self) -> f64 {
        self.squared_error * self.rays as f64
    }
}

impl Renderer {
    /// The rays of a light to connect paths to, where that is worth it.
    pub(super) fn find_beam(&self) -> Option<Beam> {
        let s = &self.settings;
        let is_seen = s.follow_sun && s.bounces > 1 && s.parts != super::Parts::Direct;
        let light = Beam::light(&self.world).filter(|_| is_seen)?;
        let without =
            self.trial(self.paths(Shortcuts { learn: Some(light), ..Shortcuts::default() }));
        let beam = Beam::new(&self.world, light, &without.found)?;
        let with = self.trial(self.paths(Shortcuts { beam: Some(&beam), ..Shortcuts::default() }));
        (with.cost() < without.cost()).then_some(beam)
    }

    fn trial(&self, paths: Paths<'_>) -> Trial {
        let size = self.settings.size;
        // Other paths than the picture's own.
        let seed = mix(self.settings.seed);
        let look = self.look(seed);
        let batches = self.batches(paths, PIXELS / BATCH, |integrator, batch| {
            let looks = (batch * BATCH..(batch + 1) * BATCH).flat_map(|n| {
                let place = Sampler::new(seed, u32::MAX, n).square() * size.as_vec2();
                [2 * n, 2 * n + 1]
                    .map(|sample| look(place.as_uvec2().min(size - UVec2::ONE), sample))
            });
            let before = integrator.rays;
            let light: Vec<f32> =
                integrator.radiance(looks).map(|s| luminance(s.indirect)).collect();
            let squared_error =
                light.chunks_exact(2).map(|pair| f64::from(pair[0] - pair[1]).powi(2)).sum();
            let found = std::mem::take(&mut integrator.found);
            Trial { found, squared_error, rays: integrator.rays - before }
        });
        batches.into_iter().fold(Trial::default(), |mut all, batch| {
            all.found.extend(batch.found);
            all.squared_error += batch.squared_error;
            all.rays += batch.rays;
            all
        })
    }
}
