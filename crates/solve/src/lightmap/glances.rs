//! What glances have found.

use std::collections::HashMap;

use glam::Vec3;
use lumencast_light::luminance;

/// Light is changing where it is brighter or darker by this share of it, and by so many standard errors of
/// what glances have found.
const CHANGING: f32 = 0.02;
const CERTAIN: f32 = 2.0;

/// Whether changes of luminance stand out that glances have found at lumels which lie together: of the noise
/// that these have, and of the variance of what is shown. What does not is sooner known by more samples than
/// by more glances.
pub(crate) fn stand_out(since: &[f32], level: f32, variance: f32) -> bool {
    let count = since.len() as f32;
    let mean = since.iter().sum::<f32>() / count;
    let squares = since.iter().map(|by| (by - mean).powi(2)).sum::<f32>() / count;
    let error = variance + CERTAIN * CERTAIN * squares / count;
    mean.abs() > CHANGING * level && mean * mean > error
}

/// What the glances at a lumel have found.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Found {
    /// Irradiance of the last one, lux.
    last: Vec3,
    /// Luminance that glances would have found, on average, when what is known of the lumel was
    /// gathered.
    then: f32,
}

/// What has been found at the receivers of glances.
#[derive(Clone, Debug, Default)]
pub(crate) struct Glances(HashMap<u32, Found>);

impl Glances {
    /// Bytes of memory, but for what a map keeps free.
    pub(crate) fn bytes(&self) -> usize {
        self.0.len() * size_of::<(u32, Found)>()
    }

    /// Takes in the irradiance that a glance has found. Tells how much it has changed since the last one;
    /// nothing where it was the first.
    pub(crate) fn look(&mut self, receiver: u32, last: Vec3) -> Option<Vec3> {
        if let Some(found) = self.0.get_mut(&receiver) {
            return Some(last - std::mem::replace(&mut found.last, last));
        }
        self.0.insert(receiver, Found { last, then: luminance(last) });
        None
    }

    /// Irradiance that the last glance at a receiver has found, lux; zero before there was any.
    pub(crate) fn last(&self, receiver: u32) -> Vec3 {
        self.0.get(&receiver).map_or(Vec3::ZERO, |found| found.last)
    }

    /// Samples were added to what is known of a receiver, and are this share of it.
    pub(crate) fn add(&mut self, receiver: u32, share: f32) {
        if let Some(found) = self.0.get_mut(&receiver) {
            found.then += share * (luminance(found.last) - found.then);
        }
    }

    /// By how much luminance has changed since what is known of a receiver was gathered.
    pub(crate) fn since(&self, receiver: u32) -> f32 {
        self.0.get(&receiver).map_or(0.0, |found| luminance(found.last) - found.then)
    }

    /// A receiver is elsewhere now.
    pub(crate) fn forget(&mut self, receiver: u32) {
        self.0.remove(&receiver);
    }

    /// Takes over what others have found at a receiver.
    pub(crate) fn keep(&mut self, receiver: u32, others: &Self, before: u32) {
        if let Some(found) = others.0.get(&before) {
            self.0.insert(receiver, *found);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_stand_out_of_noise() {
        let since: Vec<f32> = (0..16).map(|k| if k % 2 == 0 { 1.0 } else { -0.6 }).collect();
        assert!(!stand_out(&since, 2.0, 0.0), "they disagree");
        let since: Vec<f32> = since.iter().map(|by| by + 0.5).collect();
        assert!(stand_out(&since, 2.0, 0.0));
        assert!(!stand_out(&since, 2.0, 0.6), "what is shown is as noisy");
        assert!(!stand_out(&since, 100.0, 0.0), "too little to be seen");
        assert!(stand_out(&[-0.5; 16], 2.0, 0.0));
        assert!(!stand_out(&[0.0; 16], 0.0, 0.0) && !stand_out(&[], 0.0, 0.0));
    }

    /// Light that jumps is told by the next glance; since what is known is of then, until samples of now
    /// make up for it.
    #[test]
    fn jumps_are_told_once_and_remembered_while_they_matter() {
        let mut glances = Glances::default();
        assert_eq!(glances.look(3, Vec3::ONE), None);
        glances.add(3, 1.0);
        assert_eq!(
            (glances.since(3), glances.last(3), glances.last(4)),
            (0.0, Vec3::ONE, Vec3::ZERO)
        );
        assert_eq!(glances.look(3, Vec3::splat(5.0)), Some(Vec3::splat(4.0)));
        assert_eq!(glances.look(3, Vec3::splat(5.0)), Some(Vec3::ZERO));
        assert!((glances.since(3) - 4.0).abs() < 1e-5);
        glances.add(3, 0.5);
        assert!((glances.since(3) - 2.0).abs() < 1e-5);
        let mut kept = Glances::default();
        kept.keep(7, &glances, 3);
        assert_eq!(kept.look(7, Vec3::ONE), Some(Vec3::splat(-4.0)));
        kept.forget(7);
        assert_eq!((kept.look(7, Vec3::ONE), kept.since(8)), (None, 0.0));
    }
}
