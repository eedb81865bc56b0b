//! Probes inside walls.
//!
//! A probe inside a wall sees the backs of its surfaces: it is black, and a trilinear blend would carry
//! that black into the room. Such a probe is known by the share of its rays that meet a back face first
//! (Majercik et al. 2019, "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields",
//! classify probes likewise). Backs of double-sided materials count only where no light comes from
//! them: a closed thing has none within, a room whose walls are wound outwards does. In what is
//! published it holds the mean of its valid neighbours instead: of the up to 26 around it, each
//! weighted by the inverse of its distance; probes deeper inside follow ring by ring. A wall thicker
//! than two cells so carries light from each side only up to its middle; in a thinner one both sides
//! mix, which only visibility can avoid. Where no probe of a volume is valid, all stay as they are.

use glam::{IVec3, Vec3};
use lumencast_gather::SumsAt;
use lumencast_light::ProbeVolume;

/// Share of backs above which a probe is taken to be inside a wall, and below which it is
/// taken to be outside again; between the two it stays what it was, so that noise does not make it
/// blink. Nothing needs more than a few tens of samples to tell such shares apart.
pub(crate) const BURIED_ABOVE: f32 = 0.3;
const OPEN_BELOW: f32 = 0.2;
/// After so many samples without any light a probe counts as dark.
const DARK_AFTER: u32 = 256;
/// Weight of one tick in the running mean of the share, once the first ticks have been averaged.
const MEMORY: f32 = 0.1;

/// What a probe saw in one tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    /// [`SumsAt::dark_back_fraction`] and [`SumsAt::culled_fraction`].
    backs: f32,
    culled: f32,
    samples: u32,
    /// Whether any sample brought light.
    lit: bool,
}

impl Sight {
    pub(crate) fn of(sums: &SumsAt<'_>) -> Self {
        Self {
            backs: sums.dark_back_fraction,
            culled: sums.culled_fraction,
            samples: sums.count,
            lit: sums.sum.first().is_some_and(|c0| *c0 != Vec3::ZERO),
        }
    }
}

/// Which probes of a volume are inside walls.
#[derive(Clone, Debug)]
pub(crate) struct Buried {
    probes: Vec<Known>,
    ticks: u32,
}

/// What is known of a probe.
#[derive(Clone, Copy, Debug, Default)]
struct Known {
    /// Running means.
    backs: f32,
    culled: f32,
    /// Samples since one brought light.
    dark_samples: u32,
    buried: bool,
}

impl Buried {
    /// Nothing is known of any probe yet: none counts as buried.
    pub(crate) fn new(probes: usize) -> Self {
        Self { probes: vec![Known::default(); probes], ticks: 0 }
    }

    /// Takes in what each probe saw in one tick.
    pub(crate) fn record(&mut self, sights: impl IntoIterator<Item = Sight>) {
        self.ticks = self.ticks.saturating_add(1);
        let weight = MEMORY.max(1.0 / self.ticks as f32);
        for (probe, sight) in self.probes.iter_mut().zip(sights) {
            for (mean, share) in
                [(&mut probe.backs, sight.backs), (&mut probe.culled, sight.culled)]
            {
                *mean += (share.clamp(0.0, 1.0) - *mean) * weight;
            }
            let more = probe.dark_samples.saturating_add(sight.samples);
            probe.dark_samples = if sight.lit { 0 } else { more };
            let is_dark = probe.dark_samples >= DARK_AFTER;
            let share = if is_dark { probe.backs } else { probe.culled };
            probe.buried = share > if probe.buried { OPEN_BELOW } else { BURIED_ABOVE };
        }
    }

    /// Number of probes inside walls.
    pub(crate) fn count(&self) -> usize {
        self.probes.iter().filter(|probe| probe.buried).count()
    }

    /// Whether each probe is outside of walls.
    pub(crate) fn open(&self) -> impl Iterator<Item = bool> {
        self.probes.iter().map(|probe| !probe.buried)
    }

    /// Fills the probes inside walls from their neighbours, ring by ring.
    pub(crate) fn fill(&self, volume: &mut ProbeVolume) {
        let mut valid: Vec<bool> = self.open().collect();
        let mut waiting: Vec<usize> = (0..valid.len()).filter(|&i| !valid[i]).collect();
        loop {
            let ring: Vec<(usize, Vec<Vec3>)> = waiting
                .iter()
                .filter_map(|&i| Some((i, neighbours_mean(volume, &valid, i)?)))
                .collect();
            if ring.is_empty() {
                return;
            }
            for (i, mean) in ring {
                volume.probe_mut(i).copy_from_slice(&mean);
                valid[i] = true;
            }
            waiting.retain(|&i| !valid[i]);
        }
    }
}

/// The mean of the valid probes around a probe, weighted by the inverse of their distance.
fn neighbours_mean(volume: &ProbeVolume, valid: &[bool], index: usize) -> Option<Vec<Vec3>> {
    let grid = &volume.grid;
    let spacing = grid.size / grid.resolution.as_vec3();
    let cell = grid.cell(index).as_ivec3();
    let mut sum = vec![Vec3::ZERO; volume.order.coefficients()];
    let mut weights = 0.0;
    for step in steps() {
        let neighbour = cell + step;
        let inside =
            neighbour.cmpge(IVec3::ZERO).all() && neighbour.cmplt(grid.resolution.as_ivec3()).all();
        if !inside {
            continue;
        }
        let neighbour = grid.index(neighbour.as_uvec3());
        if valid[neighbour] {
            let weight = 1.0 / (step.as_vec3() * spacing).length();
            weights += weight;
            for (sum, c) in sum.iter_mut().zip(volume.probe(neighbour)) {
                *sum += *c * weight;
            }
        }
    }
    (weights > 0.0).then(|| sum.into_iter().map(|c| c / weights).collect())
}

/// The 26 steps to the cells around a cell.
fn steps() -> impl Iterator<Item = IVec3> {
    (0..27).map(|i| IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)).filter(|s| *s != IVec3::ZERO)
}

#[cfg(test)]
mod tests {
    use glam::{Quat, UVec3};
    use lumencast_light::{FieldId, Grid, Order};

    use super::*;

    fn volume(resolution: UVec3) -> ProbeVolume {
        let grid = Grid {
            center: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            size: resolution.as_vec3(),
            resolution,
        };
        ProbeVolume::dark(FieldId(0), grid, Order::L1)
    }

    /// Single-sided backs in so many of 16 directions, and light from the others.
    fn seen(culled: f32) -> Sight {
        Sight { backs: culled, culled, samples: 16, lit: culled < 1.0 }
    }

    /// A row of cells, bright on the left, dim on the right, a wall of `wall` between.
    fn row(length: u32, wall: std::ops::Range<usize>) -> (ProbeVolume, Buried) {
        let mut v = volume(UVec3::new(length, 1, 1));
        for i in 0..length as usize {
            let light = if i < wall.start { 8.0 } else { 2.0 };
            v.probe_mut(i)[0] = if wall.contains(&i) { Vec3::ZERO } else { Vec3::splat(light) };
        }
        let mut buried = Buried::new(length as usize);
        buried
            .record((0..length as usize).map(|i| seen(if wall.contains(&i) { 0.9 } else { 0.0 })));
        (v, buried)
    }

    #[test]
    fn thick_wall_takes_light_from_its_own_side() {
        let (mut v, buried) = row(8, 2..6);
        assert_eq!(buried.count(), 4);
        buried.fill(&mut v);
        let c0: Vec<f32> = (0..8).map(|i| v.probe(i)[0].x).collect();
        assert_eq!(c0, [8.0, 8.0, 8.0, 8.0, 2.0, 2.0, 2.0, 2.0]);
    }

    #[test]
    fn thin_wall_is_no_darker_than_the_rooms_around_it() {
        let (mut v, buried) = row(5, 2..3);
        buried.fill(&mut v);
        assert_eq!(v.probe(2)[0].x, 5.0);
    }

    #[test]
    fn all_buried_stay_as_they_are() {
        let mut v = volume(UVec3::splat(3));
        v.coefficients.fill(Vec3::ONE);
        let mut buried = Buried::new(27);
        buried.record([seen(1.0); 27]);
        buried.fill(&mut v);
        assert!(v.coefficients.iter().all(|c| *c == Vec3::ONE));
    }

    #[test]
    fn blinks_neither_on_noise_nor_for_ever() {
        let mut buried = Buried::new(1);
        for i in 0..200 {
            buried.record([seen(if i % 2 == 0 { 0.35 } else { 0.15 })]);
            if i > 20 {
                assert_eq!(buried.count(), 1, "noise around the threshold, tick {i}");
            }
        }
        for _ in 0..60 {
            buried.record([seen(0.0)]);
        }
        assert_eq!(buried.count(), 0, "the wall has moved away");
    }

    #[test]
    fn backs_that_may_be_seen_bury_a_probe_where_it_is_dark() {
        let mut buried = Buried::new(2);
        let dark = Sight { backs: 1.0, culled: 0.0, samples: 64, lit: false };
        for tick in 0..20 {
            // A room whose walls are wound outwards gets some light, if not in every tick.
            buried.record([dark, Sight { lit: tick % 3 == 0, ..dark }]);
        }
        assert_eq!(buried.open().collect::<Vec<_>>(), [false, true]);
        buried.record([Sight { lit: true, ..dark }; 2]);
        assert_eq!(buried.count(), 0, "somebody has lit a lamp within");
    }
}
