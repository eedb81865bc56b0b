//! Noise is taken from lumels by those about them on the surface.
//!
//! An à-trous filter (Dammertz et al. 2010): in passes of growing steps, each lumel becomes a mean of the
//! 5 × 5 about it. Position and normal decide who is a neighbour; samples, how much it tells. Whose light
//! is the same, noise decides: what differs by more than noise explains is detail, and stays. One lumel is
//! too noisy to tell, so the 5 × 5 about both are compared (non-local means: Buades et al. 2005; Rousselle
//! et al. 2012, equation 3). Lumels that are known well are left alone.

mod brightest;
mod columns;
mod means;
mod numbers;
mod pairs;
mod patches;
mod taps;

use lumencast_gather::by_vectors;

use brightest::Brightest;
use columns::Columns;
pub(crate) use columns::Noisy;
use means::Means;
use numbers::{add, after, squared};
use pairs::Pairs;
use patches::PATCH;
use taps::taps;

/// Passes; steps are 1, 2, 4.
const PASSES: u32 = 3;
/// Lumels so far off count for a lumel: two steps and a patch in each pass, and one where its variance is
/// doubted.
pub(crate) const REACH: u32 = 2 * ((1 << PASSES) - 1) + PASSES * PATCH as u32 + 1;
/// A lumel stands out that is so many times as bright as all but one about it, where there are so many at
/// least.
const STANDS_OUT: f32 = 1.25;
const ABOUT: f32 = 2.0;
/// One of so many samples does so by chance as likely as not.
const FEW: f32 = 4.0;
/// A neighbour on the surface is at most so many times as far in the world as on the page.
pub(crate) const STRETCH: f32 = 1.5;

/// Filters a window of a page, `side` a side, a lumel every `texel` metres. Lumels that are not there
/// take no part. Those within `margin` of its border are not wanted, and filtered in part.
pub(crate) fn filter(window: &mut [Option<Noisy>], side: u32, texel: f32, margin: u32) {
    by_vectors(
        #[inline(always)]
        || filter_all(window, side, texel, margin),
    );
}

#[inline(always)]
fn filter_all(window: &mut [Option<Noisy>], side: u32, texel: f32, margin: u32) {
    let mut columns = Columns::new(window, side as usize);
    let mut pairs = Pairs::new(window.len());
    doubt_low_variances(&mut columns, STRETCH * texel, &mut pairs);
    for pass in 0..PASSES {
        // What later passes read beyond what is wanted.
        let later: u32 = (pass + 1..PASSES).map(|pass| (2 << pass) + PATCH as u32).sum();
        let margin = margin.saturating_sub(later) as usize;
        let near = STRETCH * (1 << pass) as f32 * texel;
        filter_once(&mut columns, 1 << pass, near, margin, &mut pairs);
    }
    for (number, lumel) in window.iter_mut().enumerate() {
        if let Some(lumel) = lumel {
            columns.put(number, lumel);
        }
    }
}

/// Gives lumels the variance that few samples hide, by those about them that lie at most `near` metres
/// off. Rare bright samples may all be missing: a variance is at least the mean of those about it. Or a
/// lumel has met several: it may be too bright by what it has more than all but one about it.
#[inline(always)]
fn doubt_low_variances(columns: &mut Columns, near: f32, pairs: &mut Pairs) {
    let (mut sums, mut counts) = (columns.variance.clone(), columns.known.clone());
    let mut brightest = Brightest::new(counts.len());
    for tap in taps(1) {
        let shift = tap.shift(1, columns.side);
        let here = pairs.find(columns, 0..columns.known.len(), shift, near * near * tap.steps());
        let there = after(&here, shift);
        let beside = &pairs.beside[here.clone()];
        for (sums, values) in [(&mut sums, &columns.variance), (&mut counts, &columns.known)] {
            add(&mut sums[here.clone()], &values[there.clone()], beside);
            add(&mut sums[there.clone()], &values[here.clone()], beside);
        }
        brightest.take(&here, &columns.luminance[there.clone()], beside);
        brightest.take(&there, &columns.luminance[here], beside);
    }
    for (i, variance) in columns.variance.iter_mut().enumerate() {
        let known = columns.known[i];
        let mean = sums[i] / counts[i].max(f32::MIN_POSITIVE);
        let (own, second) = (columns.luminance[i], brightest.second[i]);
        let stands_out = counts[i] - known >= ABOUT && own > STANDS_OUT * second;
        let excess = if stands_out { own - second } else { 0.0 };
        let chance = FEW * FEW / (FEW * FEW + squared(columns.samples[i]));
        *variance = variance.max(known * mean).max(chance * squared(excess));
    }
}

/// One pass over all but a margin: neighbours are so many lumels apart on the page, and at most `near`
/// metres for each step.
#[inline(always)]
fn filter_once(columns: &mut Columns, step: usize, near: f32, margin: usize, pairs: &mut Pairs) {
    let wanted = margin * columns.side..(columns.side - margin) * columns.side;
    let mut means = Means::new(columns, wanted.clone());
    for tap in taps(2) {
        let shift = tap.shift(step, columns.side);
        pairs.compare(columns, &wanted, shift, near * near * tap.steps());
        means.add(columns, pairs, shift, tap.kernel());
    }
    means.put(columns);
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::random::{mix, unit};

    const SIDE: u32 = 32;

    /// A page on a plane; what is right, its noise, and the page.
    fn page(right: impl Fn(u32) -> f32, noise: f32) -> Vec<Option<Noisy>> {
        let lumel = |number: u32| {
            let (x, y) = ((number % SIDE) as f32, (number / SIDE) as f32);
            // Uniform, of this standard deviation.
            let off = noise * 12.0f32.sqrt() * (unit((mix(u64::from(number)) >> 32) as u32) - 0.5);
            Some(Noisy {
                position: 0.1 * Vec3::new(x, 0.0, y),
                normal: Vec3::Y,
                irradiance: Vec3::splat(right(number) + off),
                slope: Vec3::ZERO,
                variance: noise * noise,
                samples: 8.0,
            })
        };
        (0..SIDE * SIDE).map(lumel).collect()
    }

    fn error(page: &[Option<Noisy>], right: impl Fn(u32) -> f32) -> f32 {
        let squares = page
            .iter()
            .zip(0..)
            .map(|(lumel, number)| (lumel.unwrap().irradiance.x - right(number)).powi(2));
        (squares.sum::<f32>() / page.len() as f32).sqrt()
    }

    #[test]
    fn noise_goes_and_what_it_does_not_explain_stays() {
        let flat = |_| 10.0;
        let mut even = page(flat, 1.0);
        filter(&mut even, SIDE, 0.1, 0);
        assert!(error(&even, flat) < 0.25, "{}", error(&even, flat));
        // A shadow's edge, twenty standard deviations high.
        let edge = |number: u32| if number % SIDE < SIDE / 2 { 10.0 } else { 30.0 };
        let mut shadow = page(edge, 1.0);
        filter(&mut shadow, SIDE, 0.1, 0);
        assert!(error(&shadow, edge) < 0.3, "{}", error(&shadow, edge));
        // Without noise nothing changes.
        let slope = |number: u32| number as f32;
        let mut clean = page(slope, 0.0);
        filter(&mut clean, SIDE, 0.1, 0);
        assert!(error(&clean, slope) < 1e-3, "{}", error(&clean, slope));
    }

    /// Two bright samples of two are thought chance, even beside another such lumel; of many, they are not.
    #[test]
    fn few_samples_are_doubted_where_they_stand_out() {
        let middle = SIDE * SIDE / 2 + SIDE / 2;
        for (samples, count) in [(2.0, 1), (2.0, 2), (256.0, 1), (256.0, 2)] {
            let mut sparks = page(|_| 10.0, 1.0);
            sparks.iter_mut().flatten().for_each(|lumel| lumel.samples = samples);
            for lumel in sparks[middle as usize..][..count].iter_mut().flatten() {
                (lumel.irradiance, lumel.variance) = (Vec3::splat(100.0), 0.0);
            }
            filter(&mut sparks, SIDE, 0.1, 0);
            let shown = sparks[middle as usize].expect("a lumel").irradiance.x;
            let is_chance = samples < 4.0;
            assert_eq!(shown < 20.0, is_chance, "{count} of {samples} samples: {shown}");
            assert_eq!(shown > 90.0, !is_chance, "{count} of {samples} samples: {shown}");
        }
    }

    /// Of every sixteenth lumel something is known: the others lie between.
    #[test]
    fn what_is_not_known_is_interpolated() {
        let slope = |number: u32| 10.0 + (number % SIDE) as f32 / 8.0;
        let mut sparse = page(slope, 0.1);
        for (lumel, number) in sparse.iter_mut().flatten().zip(0..) {
            if [number, number / SIDE].iter().any(|at| !at.is_multiple_of(4)) {
                (lumel.irradiance, lumel.samples) = (Vec3::splat(1e4), 0.0);
            }
        }
        filter(&mut sparse, SIDE, 0.1, 0);
        assert!(sparse.iter().flatten().all(Noisy::is_known));
        assert!(error(&sparse, slope) < 0.5, "{}", error(&sparse, slope));
        let mut unknown = page(slope, 0.1);
        unknown.iter_mut().flatten().for_each(|lumel| lumel.samples = 0.0);
        filter(&mut unknown, SIDE, 0.1, 0);
        assert!(!unknown.iter().flatten().any(Noisy::is_known));
    }

    /// Lumels that lie beside each other on the page alone, and those of a wall beside a floor, do not
    /// count.
    #[test]
    fn neighbours_are_those_on_the_surface() {
        let edge = |number: u32| if number % SIDE < SIDE / 2 { 1.0 } else { 2.0 };
        for fault in ["apart", "another wall", "none"] {
            let mut two = page(edge, 0.0);
            for (lumel, number) in two.iter_mut().flatten().zip(0..) {
                lumel.variance = 100.0;
                if number % SIDE >= SIDE / 2 {
                    match fault {
                        "apart" => lumel.position += Vec3::Y,
                        "another wall" => lumel.normal = Vec3::X,
                        _ => {}
                    }
                }
            }
            filter(&mut two, SIDE, 0.1, 0);
            let is_mixed = error(&two, edge) > 0.05;
            assert_eq!(is_mixed, fault == "none", "{fault}: {}", error(&two, edge));
        }
    }
}
