//! A simulated link: what is sent comes out later, perhaps in another order, twice or never. The
//! caller owns the clock, so a minute of bad network passes in a millisecond, the same every time.

/// How bad a link is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// Seconds that every item takes.
    pub delay: f64,
    /// Seconds added at most, uniformly; more than the time between items reorders them.
    pub jitter: f64,
    /// Share of items that never arrive.
    pub loss: f64,
    /// Share of items that arrive twice.
    pub doubled: f64,
}

impl Conditions {
    /// No delay, no loss.
    pub const PERFECT: Self = Self { delay: 0.0, jitter: 0.0, loss: 0.0, doubled: 0.0 };
}

/// A link for items of type `T`.
#[derive(Clone, Debug)]
pub struct Link<T> {
    /// May be changed at any time; items on their way keep their arrival.
    pub conditions: Conditions,
    random: u64,
    /// (arrival, item), in the order of sending.
    on_the_way: Vec<(f64, T)>,
}

impl<T: Clone> Link<T> {
    /// A link whose luck is decided by `seed`.
    pub fn new(conditions: Conditions, seed: u64) -> Self {
        Self { conditions, random: seed, on_the_way: Vec::new() }
    }

    /// Sends an item at `now`.
    pub fn send(&mut self, now: f64, item: T) {
        if self.unit() < self.conditions.loss {
            return;
        }
        if self.unit() < self.conditions.doubled {
            let arrival = self.arrival(now);
            self.on_the_way.push((arrival, item.clone()));
        }
        let arrival = self.arrival(now);
        self.on_the_way.push((arrival, item));
    }

    /// The next item that has arrived by `now`, with its time of arrival, in order of arrival.
    pub fn receive(&mut self, now: f64) -> Option<(f64, T)> {
        let arrived =
            self.on_the_way.iter().enumerate().filter(|(_, (arrival, _))| *arrival <= now);
        let (first, _) = arrived.min_by(|(_, (a, _)), (_, (b, _))| a.total_cmp(b))?;
        Some(self.on_the_way.remove(first))
    }

    /// Cuts the link: what is on its way is lost.
    pub fn cut(&mut self) {
        self.on_the_way.clear();
    }

    fn arrival(&mut self, now: f64) -> f64 {
        now + self.conditions.delay + self.unit() * self.conditions.jitter
    }

    /// Uniform in [0, 1) (splitmix64).
    fn unit(&mut self) -> f64 {
        self.random = self.random.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.random ^ (self.random >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_are_late_lost_doubled_and_reordered_as_told() {
        let conditions = Conditions { delay: 0.1, jitter: 0.05, loss: 0.2, doubled: 0.1 };
        let mut link = Link::new(conditions, 1);
        for i in 0..10_000 {
            link.send(f64::from(i) * 0.01, i);
        }
        let mut seen = vec![0; 10_000];
        let (mut reordered, mut last) = (0, 0);
        let mut arrivals = Vec::new();
        while let Some((arrival, i)) = link.receive(1e9) {
            let late = arrival - f64::from(i) * 0.01;
            assert!((0.1 - 1e-9..0.15 + 1e-9).contains(&late));
            seen[i as usize] += 1;
            reordered += usize::from(i < last);
            last = i;
            arrivals.push(arrival);
        }
        assert!(arrivals.is_sorted());
        let lost = seen.iter().filter(|&&n| n == 0).count();
        let doubled = seen.iter().filter(|&&n| n == 2).count();
        assert!((1800..2200).contains(&lost), "{lost}");
        assert!((650..950).contains(&doubled), "{doubled}");
        assert!(reordered > 1000, "{reordered}");
    }

    #[test]
    fn a_perfect_link_keeps_order_and_loses_nothing() {
        let mut link = Link::new(Conditions::PERFECT, 1);
        for i in 0..10 {
            link.send(1.0, i);
        }
        assert_eq!(link.receive(0.5), None);
        let received: Vec<_> = std::iter::from_fn(|| link.receive(1.0)).collect();
        assert_eq!(received, (0..10).map(|i| (1.0, i)).collect::<Vec<_>>());
    }
}
