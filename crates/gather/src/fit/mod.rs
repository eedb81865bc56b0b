//! Fitting probes to surfaces.
//!
//! A client reads a volume by trilinear interpolation, which knows no walls: where cells are as large
//! as rooms, light of the bright side reaches the dark one, and probes inside walls darken both. But
//! what a volume publishes need not be the light that arrives at its probes. Here its coefficients c
//! are chosen so that what clients read on surfaces is as near as possible to what arrives there:
//! they minimise
//!
//! Σₚ wₚ |Eₚ − Rₚ c|² + Σⱼ sⱼ/4π Σₖ A²ₖ |cⱼₖ − gⱼₖ|²
//!
//! - Eₚ is the irradiance at point p of a surface, and Rₚ reads it from the volume just as a client
//!   does: trilinear, off the surface by the volume's [offset](lumencast_light::Offset), convolved by
//!   the cosine. The two sides of a wall are read from other places and in other directions, so that
//!   even a wall within a cell keeps them apart.
//! - Points are those that are [seen](Surroundings) from the probes themselves, so that a surface
//!   counts by how much of it is seen from around the volume, and the insides of walls not at all.
//! - wₚ makes differences count as they are displayed: the square of the slope of the code v^(1/2.2)
//!   at what the volume shows at p. It is found from the fit itself, in rounds: found from the noisy
//!   Eₚ, it would favour points that are too dark by chance.
//! - The second sum keeps a probe by the light g that was gathered at it, where surfaces leave it
//!   free: Aₖ are the cosine's factors, so that it is the squared error of irradiance, over all
//!   normals, as if sⱼ points of a surface had been there. Free space and moving things are lit by it.
//!
//! Bands above 2 stay what was gathered: irradiance hardly depends on them, specular light does.
//!
//! The idea of choosing the coefficients of an interpolated light map by least squares is Kavan,
//! Bargteil and Sloan's (2011, "Least Squares Vertex Baking"). A client has nothing to do for it, and
//! pays nothing.

mod solve;

use glam::Vec3;
use lumencast_light::{ProbeVolume, sh};

use crate::sampling::luminance;
use crate::{Place, Receiver, Sums, SurfacePoint};
use solve::{FREE, Row, System};

/// Share of its directions in which a probe sees backs above which it counts as being inside of
/// something.
const INSIDE: f32 = 0.3;
/// How much such a probe's own light counts beside that of others.
const INSIDE_TRUST: f32 = 0.05;
/// Darkness, relative to the mean irradiance, below which differences count no more than there.
const DARKEST: f32 = 0.05;
/// 2 (1 − 1/2.2): the squared slope of v^(1/2.2) falls with this power of v.
const SLOPE: f32 = 2.0 * (1.0 - 1.0 / 2.2);

/// How probes are fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitSettings {
    /// s of a probe that is not inside of anything: as many points of surfaces its own light is
    /// worth.
    pub stiffness: f32,
    /// Rounds of weighing points and solving, at least 1.
    pub rounds: u32,
    /// Steps of conjugate gradients a round, at most.
    pub steps: u32,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self { stiffness: 1.0, rounds: 4, steps: 64 }
    }
}

/// What is seen from a volume's probes: for each of them as many directions, and the point of a
/// surface that each meets.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surroundings {
    points: Vec<Option<SurfacePoint>>,
    /// Which probes are inside of something; what they see does not count.
    inside: Vec<bool>,
}

impl Surroundings {
    /// Of the sums of all probes, in index order, of a job that asked for
    /// [`surfaces`](crate::Job::surfaces).
    pub fn new(probes: &[Sums]) -> Self {
        let backs = |sums: &Sums| sums.surfaces.iter().flatten().filter(|at| !at.front).count();
        let inside =
            probes.iter().map(|sums| backs(sums) as f32 > INSIDE * sums.count as f32).collect();
        let points = probes.iter().flat_map(|sums| sums.surfaces.iter().copied()).collect();
        Self { points, inside }
    }

    /// The points, probe by probe, direction by direction; `None` where a direction meets nothing.
    pub fn points(&self) -> &[Option<SurfacePoint>] {
        &self.points
    }

    /// Whether a point is to be lit rightly: it is there, and seen from outside of things.
    pub fn counts(&self, point: usize) -> bool {
        let directions = self.points.len() / self.inside.len().max(1);
        self.points[point].is_some() && !self.inside[point / directions.max(1)]
    }

    /// The points that [count](Self::counts) as receivers of light, with their numbers.
    pub fn receivers(&self, samples: u32) -> impl Iterator<Item = (usize, Receiver)> + '_ {
        let counting = self.points.iter().enumerate().filter(|(number, _)| self.counts(*number));
        counting.filter_map(move |(number, point)| {
            let SurfacePoint { position, normal, .. } = (*point)?;
            let place = Place::Lumel { position, normal, footprint: [Vec3::ZERO; 2] };
            Some((number, Receiver { place, samples }))
        })
    }

    /// Fits a volume. `volume` holds what the fit begins from, such as the last one or the light that
    /// was gathered, and then the result; `gathered` the light at the probes; `irradiance` tells what
    /// arrives at a point, lux, where that is known.
    ///
    /// Where no light arrives anywhere, the volume is what was gathered.
    pub fn fit(
        &self,
        volume: &mut ProbeVolume,
        gathered: &ProbeVolume,
        irradiance: impl Fn(usize) -> Option<Vec3>,
        settings: &FitSettings,
    ) {
        let point = |number: usize| {
            let at = self.points[number].filter(|_| self.counts(number))?;
            Some((at, irradiance(number).filter(|irradiance| irradiance.is_finite())?))
        };
        let points: Vec<(SurfacePoint, Vec3)> = (0..self.points.len()).filter_map(point).collect();
        let mean = points.iter().map(|(_, irradiance)| luminance(*irradiance)).sum::<f32>()
            / points.len() as f32;
        if !(mean > 0.0 && mean.is_finite()) {
            volume.coefficients.copy_from_slice(&gathered.coefficients);
            return;
        }
        let worth = |irradiance: f32| (irradiance.max(0.0) / mean + DARKEST).powf(-SLOPE);
        let stiffness = |(probe, inside): (usize, &bool)| {
            let trust = if *inside { INSIDE_TRUST } else { 1.0 };
            trust * settings.stiffness * worth(mean_irradiance(gathered.probe(probe)))
        };
        let stiffness: Vec<f32> = self.inside.iter().enumerate().map(stiffness).collect();
        for probe in 0..stiffness.len() {
            let own = gathered.probe(probe).iter().zip(sh::BAND);
            for (c, (g, band)) in volume.probe_mut(probe).iter_mut().zip(own) {
                if band > FREE {
                    *c = *g;
                }
            }
        }
        let row = |(at, irradiance): (SurfacePoint, Vec3)| {
            let corners = volume.corners(at.position, at.normal);
            corners.inside.then(|| Row {
                probes: corners.probes.map(|probe| probe as u32),
                shares: corners.shares,
                normal: at.normal,
                weight: 0.0,
                target: irradiance / mean,
            })
        };
        let rows = points.into_iter().filter_map(row).collect();
        let mut system = System::new(volume.order, rows, &stiffness);
        for _ in 0..settings.rounds.max(1) {
            system.weigh(&volume.coefficients, |shown| worth(luminance(shown)));
            system.solve(&mut volume.coefficients, &gathered.coefficients, mean, settings.steps);
        }
    }
}

/// Luminance of a probe's irradiance, averaged over all normals.
fn mean_irradiance(probe: &[Vec3]) -> f32 {
    sh::cosine_basis(sh::Order::L1, Vec3::Y)[0] * luminance(probe[0])
}
