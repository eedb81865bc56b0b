//! Lumels while their light is computed.

mod backs;
mod fill;
mod filter;
mod places;
mod points;

use std::sync::Arc;

use glam::Vec3;
use lumencast_charts::LaidOut;
use lumencast_gather::{Budget, Gathered, Job, Receiver};
use lumencast_light::{FieldId, Lightmap, luminance};
use lumencast_scene::Snapshot;

pub use backs::with_backs;
use filter::{Noisy, filter};
use places::{LumelPlace, lumel_places};
pub use points::spread;

/// Share of backs, by winding, above which a lumel lies within something: its light is that of the
/// lumels about it.
const BURIED_ABOVE: f32 = 0.5;

/// What makes light of lumels' sums.
#[derive(Clone, Debug)]
pub struct LightmapSolver {
    texel: f32,
    places: Vec<LumelPlace>,
    receivers: Arc<[Receiver]>,
    sums: Vec<Sum>,
    lightmap: Lightmap,
}

/// What has arrived at a lumel.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    /// Sum over samples of irradiance, lux.
    sum: Vec3,
    /// Sum over samples of the square of its luminance.
    squares: f32,
    samples: f32,
    /// Samples that met the back of a surface first.
    backs: f32,
}

impl LightmapSolver {
    /// Lumels of a scene, dark.
    pub fn new(id: FieldId, scene: &Snapshot, laid_out: &LaidOut) -> Self {
        let places = lumel_places(scene, &laid_out.layout);
        let receiver = |place: &LumelPlace| Receiver::point(place.position, place.normal);
        Self {
            texel: laid_out.texel,
            receivers: places.iter().map(receiver).collect(),
            sums: vec![Sum::default(); places.len()],
            places,
            lightmap: Lightmap::dark(id, Arc::new(laid_out.layout.clone())),
        }
    }

    /// Number of lumels that lie on surfaces.
    pub fn lumel_count(&self) -> usize {
        self.places.len()
    }

    /// Number of lumels within something.
    pub fn buried_count(&self) -> usize {
        self.sums.iter().filter(|sum| sum.is_buried()).count()
    }

    /// What to gather: so many samples a lumel.
    pub fn job(&self, scene: Arc<Snapshot>, samples: u32) -> Job {
        Job::new(scene, self.receivers.clone(), samples)
    }

    /// Adds what was gathered; `budgets` are those of the job. What is not finite does not count.
    pub fn take(&mut self, gathered: &Gathered, budgets: &[Budget]) {
        for (budget, found) in budgets.iter().zip(gathered.sums.iter()) {
            let (Some(sum), Some(squares)) = (found.sum.first(), found.squares.first()) else {
                continue;
            };
            if sum.is_finite() && squares.is_finite() {
                let known = &mut self.sums[budget.receiver as usize];
                known.sum += *sum;
                known.squares += squares;
                known.samples += found.count as f32;
                known.backs += found.back_face_fraction * found.count as f32;
            }
        }
    }

    /// Makes light of what has been taken in: filtered on the surface where `filtered`, and spread to
    /// where nothing is known.
    pub fn solve(&mut self, filtered: bool) {
        let Self { places, sums, texel, lightmap, .. } = self;
        let size = lightmap.layout.page_size;
        let page_lumels = (size as usize).pow(2);
        let mut lumels: Vec<Option<Noisy>> = vec![None; lightmap.irradiance.len()];
        for (place, sum) in places.iter().zip(sums.iter()) {
            lumels[place.lumel as usize] = sum.known().map(|(irradiance, variance)| Noisy {
                position: place.position,
                normal: place.normal,
                irradiance,
                variance,
            });
        }
        for (page, light) in
            lumels.chunks(page_lumels).zip(lightmap.irradiance.chunks_mut(page_lumels))
        {
            let mut page = page.to_vec();
            if filtered {
                filter(&mut page, size, *texel);
            }
            for (light, lumel) in light.iter_mut().zip(&page) {
                *light = lumel.map_or(Vec3::ZERO, |lumel| lumel.irradiance);
            }
            fill::fill(light, size, |number| page[number].is_some());
        }
    }

    /// The light as it was last solved.
    pub fn lightmap(&self) -> &Lightmap {
        &self.lightmap
    }
}

impl Sum {
    fn is_buried(&self) -> bool {
        self.backs > BURIED_ABOVE * self.samples
    }

    /// Irradiance and the variance of its luminance; nothing where that is unknown.
    fn known(&self) -> Option<(Vec3, f32)> {
        if self.samples == 0.0 || self.is_buried() {
            return None;
        }
        let mean = self.sum / self.samples;
        let scatter = (self.squares / self.samples - luminance(mean).powi(2)).max(0.0);
        Some((mean, scatter / self.samples))
    }
}
