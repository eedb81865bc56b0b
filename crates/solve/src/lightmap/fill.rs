//! Lumels that nothing is known of get the light of those about them.
//!
//! Those beside known ones, which filtering reads, take the mean of these and of nothing farther off:
//! light from beyond a wall, or of another chart, is not to show beside it. The rest is filled by
//! push-pull (Gortler et al. 1996, "The Lumigraph", section 3.4): means of what is known go up a
//! pyramid of halves, and down again to where nothing is known. What comes of it is smooth, costs few
//! bits, and is the nearest neighbour's light beside a chart.

use glam::{UVec2, Vec2, Vec3, Vec4};

/// A level of the pyramid: sums of what is known, and their weights.
struct Level {
    side: u32,
    lumels: Vec<(Vec3, f32)>,
}

impl Level {
    /// The mean at a lumel; nothing where nothing is known.
    fn mean(&self, at: UVec2) -> Option<Vec3> {
        let (sum, weight) = self.lumels[(at.y * self.side + at.x) as usize];
        (weight > 0.0).then(|| sum / weight)
    }

    fn halved(&self) -> Self {
        let side = self.side.div_ceil(2);
        let mut lumels = vec![(Vec3::ZERO, 0.0); (side * side) as usize];
        for (number, (sum, weight)) in (0..).zip(&self.lumels) {
            let at = UVec2::new(number % self.side, number / self.side) / 2;
            let (into, with) = &mut lumels[(at.y * side + at.x) as usize];
            (*into, *with) = (*into + *sum, *with + *weight);
        }
        // Where much is known below, it counts as one lumel.
        for (sum, weight) in lumels.iter_mut().filter(|(_, weight)| *weight > 1.0) {
            (*sum, *weight) = (*sum / *weight, 1.0);
        }
        Self { side, lumels }
    }

    /// What the level tells of a lumel of the next finer one, from the four about it.
    fn interpolated(&self, at: UVec2) -> Option<Vec3> {
        let place = 0.5 * (at.as_vec2() + 0.5) - 0.5;
        let low = place.floor();
        let share = place - low;
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let most = Vec2::splat((self.side - 1) as f32);
            let tap = (low + Vec2::new(x, y)).clamp(Vec2::ZERO, most).as_uvec2();
            let weight = (1.0 - (share.x - x).abs()) * (1.0 - (share.y - y).abs());
            if let Some(mean) = self.mean(tap) {
                (sum, weights) = (sum + weight * mean, weights + weight);
            }
        }
        (weights > 0.0).then(|| sum / weights)
    }
}

/// Rings of lumels about known ones that take their light alone: filtering reads the first, and the
/// chroma of video the second.
const RINGS: u32 = 2;

/// Fills the lumels of a page, `side` a side, that are not known. A page of which nothing is known
/// stays as it is.
pub(crate) fn fill(page: &mut [Vec3], side: u32, is_known: impl Fn(usize) -> bool) {
    let mut known: Vec<bool> = (0..page.len()).map(is_known).collect();
    for _ in 0..RINGS {
        grow(page, &mut known, side);
    }
    push_pull(page, side, |number| known[number]);
}

/// Gives lumels beside known ones the mean of these, which are known from then on.
fn grow(page: &mut [Vec3], known: &mut [bool], side: u32) {
    // Light, and whether it is known.
    let own = |(known, light): (&bool, &Vec3)| if *known { light.extend(1.0) } else { Vec4::ZERO };
    let own: Vec<Vec4> = known.iter().zip(page.iter()).map(own).collect();
    let side = side as usize;
    let of_row = |number: usize| {
        let column = number % side;
        let left = if column > 0 { own[number - 1] } else { Vec4::ZERO };
        let right = if column + 1 < side { own[number + 1] } else { Vec4::ZERO };
        left + own[number] + right
    };
    let rows: Vec<Vec4> = (0..own.len()).map(of_row).collect();
    for (number, (light, known)) in page.iter_mut().zip(known).enumerate() {
        if !*known {
            let above = if number >= side { rows[number - side] } else { Vec4::ZERO };
            let sum = above + rows[number] + rows.get(number + side).copied().unwrap_or_default();
            if sum.w > 0.0 {
                (*light, *known) = (sum.truncate() / sum.w, true);
            }
        }
    }
}

fn push_pull(page: &mut [Vec3], side: u32, is_known: impl Fn(usize) -> bool) {
    let own =
        |number: usize| if is_known(number) { (page[number], 1.0) } else { (Vec3::ZERO, 0.0) };
    let mut levels = vec![Level { side, lumels: (0..page.len()).map(own).collect() }];
    while let Some(last) = levels.last().filter(|level| level.side > 1) {
        let next = last.halved();
        levels.push(next);
    }
    let mut coarser: Option<Level> = None;
    for mut level in levels.into_iter().rev() {
        if let Some(coarser) = &coarser {
            for number in 0..level.lumels.len() as u32 {
                let at = UVec2::new(number % level.side, number / level.side);
                let (sum, weight) = &mut level.lumels[number as usize];
                // What is little known is made up for.
                if *weight < 1.0
                    && let Some(light) = coarser.interpolated(at)
                {
                    (*sum, *weight) = (*sum + (1.0 - *weight) * light, 1.0);
                }
            }
        }
        coarser = Some(level);
    }
    let Some(filled) = coarser else { return };
    for (number, (light, weight)) in filled.lumels.into_iter().enumerate() {
        if weight > 0.0 && !is_known(number) {
            page[number] = light / weight;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: u32 = 48;

    #[test]
    fn what_is_known_stays_and_the_rest_is_between() {
        let known = |number: usize| number.is_multiple_of(37);
        let value = |number: usize| Vec3::new(1.0 + (number % 5) as f32, 2.0, 0.0);
        let mut page: Vec<Vec3> = (0..(SIDE * SIDE) as usize)
            .map(|number| if known(number) { value(number) } else { Vec3::splat(1e4) })
            .collect();
        fill(&mut page, SIDE, known);
        for (number, light) in page.iter().enumerate() {
            if known(number) {
                assert_eq!(*light, value(number));
            }
            assert!((1.0..=5.0).contains(&light.x) && (light.y - 2.0).abs() < 1e-4, "{light}");
            assert_eq!(light.z, 0.0);
        }
    }

    /// Beside a chart there is the chart's light, not that of one at the other end of the page.
    #[test]
    fn the_nearest_counts_most() {
        let side = SIDE as usize;
        let known = |number: usize| number % side < 8 || number % side >= side - 8;
        let own = |number: usize| if number % side < side / 2 { 1.0 } else { 9.0 };
        let mut page: Vec<Vec3> = (0..side * side).map(|number| Vec3::splat(own(number))).collect();
        fill(&mut page, SIDE, known);
        for row in 0..side {
            assert!((page[row * side + 8].x - 1.0).abs() < 1.0, "{}", page[row * side + 8]);
            assert!((page[row * side + side - 9].x - 9.0).abs() < 1.0);
        }
    }

    /// Lumels beside known ones take the light of these alone, however near others are.
    #[test]
    fn what_is_read_beside_a_border_is_of_its_own_side() {
        let side = SIDE as usize;
        let known = |number: usize| !(20..25).contains(&(number % side));
        let own = |number: usize| if number % side < 22 { 1.0 } else { 9.0 };
        let mut page: Vec<Vec3> = (0..side * side).map(|number| Vec3::splat(own(number))).collect();
        fill(&mut page, SIDE, known);
        for row in page.chunks(side) {
            let values = [20, 21, 23, 24].map(|column: usize| row[column].x);
            assert_eq!(values, [1.0, 1.0, 9.0, 9.0]);
            assert!((1.0..=9.0).contains(&row[22].x));
        }
    }

    #[test]
    fn a_page_of_which_nothing_is_known_stays() {
        let mut page = vec![Vec3::ONE; (SIDE * SIDE) as usize];
        fill(&mut page, SIDE, |_| false);
        assert!(page.iter().all(|light| *light == Vec3::ONE));
    }
}
