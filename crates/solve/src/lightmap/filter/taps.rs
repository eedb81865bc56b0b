//! The neighbours of a lumel.

/// The B3 spline.
const KERNEL: [f32; 5] = [1.0 / 16.0, 1.0 / 4.0, 3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];

/// A neighbour by its place on the page, in steps. Its opposite is one too: both are done at a time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tap {
    x: i32,
    y: i32,
}

/// Those of the square of so many steps to each side, without the lumel itself; one of each two that
/// are opposite.
pub(super) fn taps(reach: i32) -> impl Iterator<Item = Tap> {
    let all = (0..=reach).flat_map(move |y| (-reach..=reach).map(move |x| Tap { x, y }));
    all.filter(|tap| tap.y > 0 || tap.x > 0)
}

impl Tap {
    /// The lumel itself.
    pub(super) const OWN: Self = Self { x: 0, y: 0 };

    /// How far on it is in columns.
    pub(super) fn shift(self, step: usize, side: usize) -> usize {
        (step * self.y as usize * side).wrapping_add_signed(step as isize * self.x as isize)
    }

    /// Squared distance, steps.
    pub(super) fn steps(self) -> f32 {
        (self.x.pow(2) + self.y.pow(2)) as f32
    }

    /// What it weighs where all else is equal.
    pub(super) fn kernel(self) -> f32 {
        KERNEL[(self.x + 2) as usize] * KERNEL[(self.y + 2) as usize]
    }
}
