//! Lumels while their light is computed.

mod backs;
mod fill;
mod filter;
mod places;
mod points;
mod seams;

use std::sync::Arc;

use glam::Vec3;
use lumencast_charts::LaidOut;
use lumencast_gather::{Budget, Gathered, Job, Receiver};
use lumencast_light::{Field, FieldId, Light, Lightmap, luminance};
use lumencast_scene::Snapshot;

pub use backs::with_backs;
use filter::{Noisy, filter};
use places::lumel_places;
pub use points::spread;
use seams::Seams;
pub use seams::seam_differences;

/// Share of backs, by winding, above which a lumel lies within something: its light is that of the
/// lumels about it.
const BURIED_ABOVE: f32 = 0.5;

/// Samples that lumels count as resting on, at most, once a change is expected.
const EXPECTING: f32 = 32.0;

/// What makes light of lumels' sums.
#[derive(Clone, Debug)]
pub struct LightmapSolver {
    /// Least weight of an update ([`crate::blend::BlendSettings::ratio`]).
    ratio: f32,
    texel: f32,
    /// Lumels that lie on surfaces, by their index among those of all pages; one a receiver.
    lumels: Vec<u32>,
    receivers: Arc<[Receiver]>,
    sums: Vec<Sum>,
    seams: Arc<Seams>,
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
    /// Lumels of a scene, dark. Updates are averaged, and weigh no less than `ratio`.
    pub fn new(id: FieldId, scene: &Snapshot, laid_out: &LaidOut, ratio: f32) -> Self {
        let places = lumel_places(scene, &laid_out.layout);
        Self {
            ratio: ratio.clamp(f32::MIN_POSITIVE, 1.0),
            texel: laid_out.texel,
            lumels: places.iter().map(|place| place.lumel).collect(),
            receivers: places.iter().map(|p| Receiver::point(p.position, p.normal)).collect(),
            sums: vec![Sum::default(); places.len()],
            seams: Arc::new(Seams::new(scene, &laid_out.layout)),
            lightmap: Lightmap::dark(id, Arc::new(laid_out.layout.clone())),
        }
    }

    pub(crate) fn id(&self) -> FieldId {
        self.lightmap.id
    }

    /// Number of lumels that lie on surfaces.
    pub fn lumel_count(&self) -> usize {
        self.lumels.len()
    }

    /// Number of lumels within something.
    pub fn buried_count(&self) -> usize {
        self.sums.iter().filter(|sum| sum.is_buried()).count()
    }

    /// What to gather: so many samples a lumel.
    pub fn job(&self, scene: Arc<Snapshot>, samples: u32) -> Job {
        Job::new(scene, self.receivers.clone(), samples)
    }

    /// The scene was edited: what is known counts less from now on.
    pub(crate) fn expect_change(&mut self) {
        self.sums.iter_mut().for_each(|sum| sum.keep(EXPECTING));
    }

    /// Adds what was gathered; `budgets` are those of the job. What is not finite does not count.
    pub fn take(&mut self, gathered: &Gathered, budgets: &[Budget]) {
        for (budget, found) in budgets.iter().zip(gathered.sums.iter()) {
            let (Some(sum), Some(squares)) = (found.sum.first(), found.squares.first()) else {
                continue;
            };
            if sum.is_finite() && squares.is_finite() {
                let samples = found.count as f32;
                let known = &mut self.sums[budget.receiver as usize];
                known.keep(samples * (1.0 - self.ratio) / self.ratio);
                known.sum += *sum;
                known.squares += squares;
                known.samples += samples;
                known.backs += found.back_face_fraction * samples;
            }
        }
    }

    /// Makes light of what has been taken in: filtered on the surface where `filtered`, spread to where
    /// nothing is known, and the same on both sides of seams.
    pub fn solve(&mut self, filtered: bool) {
        let Self { lumels, receivers, sums, texel, lightmap, .. } = self;
        let size = lightmap.layout.page_size;
        let mut known: Vec<Option<Noisy>> = vec![None; lightmap.irradiance.len()];
        for ((lumel, receiver), sum) in lumels.iter().zip(receivers.iter()).zip(sums.iter()) {
            let Receiver::Lumel { position, normal, .. } = *receiver else { continue };
            known[*lumel as usize] = sum.known().map(|(irradiance, variance)| Noisy {
                position,
                normal,
                irradiance,
                variance,
            });
        }
        let page_lumels = (size as usize).pow(2);
        let pages = known.chunks(page_lumels).zip(lightmap.irradiance.chunks_mut(page_lumels));
        for (page, light) in pages {
            let mut page = page.to_vec();
            if filtered {
                filter(&mut page, size, *texel);
            }
            for (light, lumel) in light.iter_mut().zip(&page) {
                *light = lumel.map_or(Vec3::ZERO, |lumel| lumel.irradiance);
            }
            fill::fill(light, size, |number| page[number].is_some());
        }
        self.seams.apply(&mut lightmap.irradiance, |lumel| known[lumel].is_some());
    }

    /// Irradiances that light has at the lumels that surfaces cover.
    pub(crate) fn seen(&self, light: &Light) -> Vec<Vec3> {
        let lightmap = light.field(self.id()).and_then(Field::as_lightmap).into_iter();
        lightmap
            .flat_map(|lightmap| self.lumels.iter().map(|l| lightmap.irradiance[*l as usize]))
            .collect()
    }

    /// The light as it was last solved.
    pub fn lightmap(&self) -> &Lightmap {
        &self.lightmap
    }
}

impl Sum {
    /// Counts as resting on so many samples at most.
    fn keep(&mut self, most: f32) {
        if self.samples > most {
            let share = most / self.samples;
            self.sum *= share;
            self.squares *= share;
            self.backs *= share;
            self.samples = most;
        }
    }

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
