//! Probes inside walls.
//!
//! A probe inside a wall sees the backs of its surfaces, which reflect nothing: it is black, and a
//! trilinear blend would carry that black into the room. Such a probe is known by the share of its
//! rays that meet a back face first (Majercik et al. 2019, "Dynamic Diffuse Global Illumination with
//! Ray-Traced Irradiance Fields", classify probes likewise). In what is published it holds the mean
//! of its valid neighbours instead: of the up to 26 around it, each weighted by the inverse of its
//! distance; probes deeper inside follow ring by ring. A wall thicker than two cells so carries light
//! from each side only up to its middle; in a thinner one both sides mix, which only visibility can
//! avoid. Where no probe of a volume is valid, all stay as they are.

use glam::{IVec3, Vec3};
use lumencast_light::ProbeVolume;

/// Share of back faces above which a probe is taken to be inside a wall, and below which it is
/// taken to be outside again; between the two it stays what it was, so that noise does not make it
/// blink. Nothing needs more than a few tens of samples to tell such shares apart.
pub(crate) const BURIED_ABOVE: f32 = 0.3;
const OPEN_BELOW: f32 = 0.2;
/// Weight of one tick in the running mean of the share, once the first ticks have been averaged.
const MEMORY: f32 = 0.1;

/// Which probes of a volume are inside walls.
#[derive(Clone, Debug)]
pub(crate) struct Buried {
    share: Vec<f32>,
    buried: Vec<bool>,
    ticks: u32,
}

impl Buried {
    /// Nothing is known of any probe yet: none counts as buried.
    pub(crate) fn new(probes: usize) -> Self {
        Self { share: vec![0.0; probes], buried: vec![false; probes], ticks: 0 }
    }

    /// Takes in the share of back faces that each probe met in one tick.
    pub(crate) fn record(&mut self, shares: impl IntoIterator<Item = f32>) {
        self.ticks = self.ticks.saturating_add(1);
        let weight = MEMORY.max(1.0 / self.ticks as f32);
        for ((mean, buried), share) in self.share.iter_mut().zip(&mut self.buried).zip(shares) {
            *mean += (share.clamp(0.0, 1.0) - *mean) * weight;
            *buried = *mean > if *buried { OPEN_BELOW } else { BURIED_ABOVE };
        }
    }

    /// Number of probes inside walls.
    pub(crate) fn count(&self) -> usize {
        self.buried.iter().filter(|b| **b).count()
    }

    /// Whether each probe is outside of walls.
    pub(crate) fn open(&self) -> impl Iterator<Item = bool> {
        self.buried.iter().map(|buried| !buried)
    }

    /// Fills the probes inside walls from their neighbours, ring by ring.
    pub(crate) fn fill(&self, volume: &mut ProbeVolume) {
        let mut valid: Vec<bool> = self.buried.iter().map(|b| !b).collect();
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
    use lumencast_light::{Grid, Order, VolumeId};

    use super::*;

    fn volume(resolution: UVec3) -> ProbeVolume {
        let grid = Grid {
            center: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            size: resolution.as_vec3(),
            resolution,
        };
        ProbeVolume::dark(VolumeId(0), grid, Order::L1)
    }

    /// A row of cells, bright on the left, dim on the right, a wall of `wall` between.
    fn row(length: u32, wall: std::ops::Range<usize>) -> (ProbeVolume, Buried) {
        let mut v = volume(UVec3::new(length, 1, 1));
        for i in 0..length as usize {
            let light = if i < wall.start { 8.0 } else { 2.0 };
            v.probe_mut(i)[0] = if wall.contains(&i) { Vec3::ZERO } else { Vec3::splat(light) };
        }
        let mut buried = Buried::new(length as usize);
        buried.record((0..length as usize).map(|i| if wall.contains(&i) { 0.9 } else { 0.0 }));
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
        buried.record([1.0; 27]);
        buried.fill(&mut v);
        assert!(v.coefficients.iter().all(|c| *c == Vec3::ONE));
    }

    #[test]
    fn blinks_neither_on_noise_nor_for_ever() {
        let mut buried = Buried::new(1);
        for i in 0..200 {
            buried.record([if i % 2 == 0 { 0.35 } else { 0.15 }]);
            if i > 20 {
                assert_eq!(buried.count(), 1, "noise around the threshold, tick {i}");
            }
        }
        for _ in 0..60 {
            buried.record([0.0]);
        }
        assert_eq!(buried.count(), 0, "the wall has moved away");
    }
}
