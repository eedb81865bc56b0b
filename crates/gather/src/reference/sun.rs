//! Decides whether a picture's paths connect to points that the sun lights, and where the sun's
//! rays go.
//!
//! A few paths without connections show where the sun's light counts. As many paths with
//! connections show whether these are worth their rays. They are if the squared error for a given
//! number of rays is smaller.

use glam::UVec2;

use super::Renderer;
use crate::path_trace::beam::{Beam, Found};
use crate::path_trace::paths::{Paths, Shortcuts};
use crate::sampling::{Sampler, luminance, mix};

/// Number of pixels in a trial, each with two paths. Small pictures use some pixels more often.
const PIXELS: u32 = 1 << 14;
/// Number of pixels whose paths a thread follows together.
const BATCH: u32 = 128;

/// Results of the paths of a trial.
#[derive(Default)]
struct Trial {
    found: Vec<Found>,
    /// Squared difference of the luminance of indirect light between a pixel's two paths, summed
    /// over pixels. Its mean is twice the variance of one path.
    squared_error: f64,
    rays: u64,
}

impl Trial {
    /// The squared error that a given number of rays leaves, up to a factor.
    fn cost(&self) -> f64 {
        self.squared_error * self.rays as f64
    }
}

impl Renderer {
    /// The beam to connect paths to, where that is worth its rays.
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
        // Another seed makes the trial's paths independent of the picture's.
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
