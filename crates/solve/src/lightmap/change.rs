//! How the light of lumels has changed.
//!
//! A glance takes the same samples of a lumel each time (common random numbers; Schied et al. 2018 take
//! such gradients of pictures). So two glances differ by what has changed in the scene: noise that both
//! have cancels. What has changed at the lumels of glances is spread over those about them on the surface,
//! by weights that never change, and what is known there follows. Thus errors do not add up from glance to
//! glance: what a lumel shows is the mean of what arrived beyond glances, and the glances of now.
//!
//! Light that became darker keeps the share that glances find left, lest bright spots outlast what lit
//! them: shares of parts multiply as differences add up.
//!
//! Where glances nearby disagree about how light has changed since what is known was gathered, its
//! pattern is another. The more they disagree, the less what is known weighs.

use glam::{IVec2, Vec3};

use super::filter::STRETCH;
use super::point::Point;

/// A glance tells of lumels so far off on the page, or a little less far: no farther than the next cell.
const REACH: f32 = 10.0;
/// What it weighs for a lumel of another surface: next to nothing.
const ELSEWHERE: f32 = 1e-4;
/// Power of the cosine between normals.
const NORMAL_POWER: i32 = 8;
/// What is known weighs as many samples as leave the square of this share of the glances' disagreement as
/// variance: the filter takes noise from lumels that stays where their pattern is wrong.
const DISAGREEMENT: f32 = 2.0;
/// Glances may agree by chance: they disagree by this share of the change at least.
const LEAST: f32 = 0.25;

/// A lumel, and what a glance has found there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Glanced {
    /// Place on the page.
    pub(crate) at: IVec2,
    /// World, metres.
    pub(crate) position: Vec3,
    /// World, unit.
    pub(crate) normal: Vec3,
    /// The irradiance that the newest glance has found, lux.
    pub(crate) now: Vec3,
    /// By how much that has changed since the glance before it.
    pub(crate) change: Vec3,
    /// By how much its luminance has changed since what is known was gathered.
    pub(crate) since: f32,
}

/// How the light of a lumel has changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Change {
    /// By how much irradiance has, lux.
    pub(crate) by: Vec3,
    /// The share of it that is left where it has become darker, and one elsewhere. What is brighter
    /// than its surroundings loses more, and nothing becomes darker than black.
    pub(crate) left: Vec3,
    /// The variance of luminance beyond which what is known tells nothing more.
    pub(crate) variance: f32,
}

impl Default for Change {
    fn default() -> Self {
        Self { by: Vec3::ZERO, left: Vec3::ONE, variance: 0.0 }
    }
}

impl Change {
    /// The change of a lumel at a place of a page, and in the world, among all lumels about it that
    /// glances take. Lumels are `texel` metres large.
    pub(crate) fn of<'a>(
        at: IVec2,
        point: &Point,
        glances: impl Iterator<Item = &'a Glanced>,
        texel: f32,
    ) -> Self {
        let normal = point.normal();
        let (mut weights, mut since, mut squares) = (0.0, 0.0, 0.0);
        let (mut now, mut by) = (Vec3::ZERO, Vec3::ZERO);
        for glance in glances {
            let off = (glance.at - at).as_vec2().length_squared();
            let near = 1.0 - off / (REACH * REACH);
            if near <= 0.0 {
                continue;
            }
            let apart = glance.position.distance_squared(point.position);
            let is_beside = apart <= (STRETCH * texel).powi(2) * off.max(1.0);
            let facing = glance.normal.dot(normal).max(0.0).powi(NORMAL_POWER);
            let weight = near * near * if is_beside { facing.max(ELSEWHERE) } else { ELSEWHERE };
            weights += weight;
            now += weight * glance.now;
            by += weight * glance.change;
            since += weight * glance.since;
            squares += weight * glance.since.powi(2);
        }
        if weights == 0.0 {
            return Self::default();
        }
        let square = (since / weights).powi(2);
        let apart = (squares / weights - square).max(0.0) + LEAST * LEAST * square;
        let was = now - by;
        let left = Vec3::select(was.cmpgt(now), now / was, Vec3::ONE).max(Vec3::ZERO);
        Self { by: by / weights, left, variance: DISAGREEMENT * DISAGREEMENT * apart }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What glances found at first.
    const WAS: f32 = 100.0;

    /// Glances at every fourth lumel of a floor whose lumels are 0.1 m large.
    fn floor(change: impl Fn(IVec2) -> f32) -> Vec<Glanced> {
        let glanced = |k: i32| {
            let at = 4 * IVec2::new(k % 12, k / 12);
            let change = change(at);
            Glanced {
                at,
                position: 0.1 * Vec3::new(at.x as f32, 0.0, at.y as f32),
                normal: Vec3::Y,
                now: Vec3::splat(WAS + change),
                change: Vec3::splat(change),
                since: change,
            }
        };
        (0..144).map(glanced).collect()
    }

    fn of(at: IVec2, normal: Vec3, glances: &[Glanced]) -> Change {
        let position = 0.1 * Vec3::new(at.x as f32, 0.0, at.y as f32);
        Change::of(at, &Point::new(position, normal), glances.iter(), 0.1)
    }

    #[test]
    fn changes_are_spread_smoothly() {
        let even = floor(|_| 2.0);
        let slope = floor(|at| at.x as f32);
        for x in 10..34 {
            let at = IVec2::new(x, 21);
            assert!((of(at, Vec3::Y, &even).by - 2.0).abs().max_element() < 1e-5);
            let by = of(at, Vec3::Y, &slope).by.x;
            assert!((by - x as f32).abs() < 0.5, "{by} at {x}");
        }
        assert_eq!(of(IVec2::splat(99), Vec3::Y, &even), Change::default(), "far off");
    }

    /// A change that is told cell by cell is the same in the end as one that is told at once.
    #[test]
    fn parts_add_up() {
        let whole = |at: IVec2| (at.x * at.y) as f32;
        let left = floor(|at| if at.x < 20 { whole(at) } else { 0.0 });
        let right = floor(|at| if at.x < 20 { 0.0 } else { whole(at) });
        for x in 12..30 {
            let by = |glances: &[Glanced]| of(IVec2::new(x, 20), Vec3::Y, glances).by.x;
            let (parts, all) = (by(&left) + by(&right), by(&floor(whole)));
            assert!((parts / all - 1.0).abs() < 1e-5, "{parts}, {all}");
        }
    }

    /// What becomes darker by parts is as dark in the end as what does so at once.
    #[test]
    fn shares_multiply() {
        let is_left = |at: IVec2| at.x < 20;
        let first = floor(|at| if is_left(at) { -75.0 } else { 0.0 });
        let mut then = floor(|at| if is_left(at) { 0.0 } else { -50.0 });
        let left = then.iter_mut().filter(|glanced| is_left(glanced.at));
        left.for_each(|glanced| glanced.now -= 75.0);
        let whole = floor(|at| if is_left(at) { -75.0 } else { -50.0 });
        for x in 12..30 {
            let left = |glances: &[Glanced]| of(IVec2::new(x, 20), Vec3::Y, glances).left.x;
            assert!((left(&first) * left(&then) - left(&whole)).abs() < 1e-5, "at {x}");
        }
        let at = IVec2::splat(20);
        assert_eq!(of(at, Vec3::Y, &floor(|_| -WAS)).left, Vec3::ZERO);
        assert_eq!(of(at, Vec3::Y, &floor(|_| 9.0)).left, Vec3::ONE, "it is brighter");
    }

    #[test]
    fn glances_at_other_surfaces_hardly_count() {
        let mut two = floor(|at| if at.x < 20 { 1.0 } else { 5.0 });
        let wall = two.iter_mut().filter(|glanced| glanced.at.x >= 20);
        wall.for_each(|glanced| glanced.normal = Vec3::X);
        let by = of(IVec2::new(19, 20), Vec3::Y, &two).by.x;
        assert!((by - 1.0).abs() < 0.01, "{by}");
    }

    /// What is known weighs less where a shadow's edge has come than where all has become as dark.
    #[test]
    fn patterns_that_are_others_are_doubted() {
        let at = IVec2::splat(20);
        let even = of(at, Vec3::Y, &floor(|_| -1.0)).variance;
        let edge = of(at, Vec3::Y, &floor(|at| if at.x < 20 { 0.0 } else { -1.0 })).variance;
        assert!(even > 0.0 && edge > 3.0 * even, "{even}, {edge}");
        assert_eq!(of(at, Vec3::Y, &floor(|_| 0.0)), Change::default());
    }
}
