//! Surfaces that pass from probes to lumels, or back, when a lightmap's layout changes.

use std::collections::BTreeMap;
use std::sync::Arc;

use lumencast_light::{Layout, Surface, SurfaceId};

/// Seconds that a surface takes.
const SECONDS: f64 = 0.5;

/// The passage from one layout to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct Handover {
    /// The newest layout.
    newest: Option<Arc<Layout>>,
    passing: BTreeMap<SurfaceId, Passing>,
    /// When they were looked at last.
    seen: f64,
}

/// A surface on its way.
#[derive(Clone, Debug)]
struct Passing {
    surface: Surface,
    /// How far it has come from probes to lumels.
    way: f64,
    /// Whether it gets lumels, or loses them.
    comes: bool,
}

impl Handover {
    /// The layout to be shown at `now`, where `newest` is the one to be reached. The first one is shown
    /// at once.
    pub(crate) fn show(&mut self, newest: &Arc<Layout>, now: f64) -> Arc<Layout> {
        let step = (now - self.seen).max(0.0) / SECONDS;
        self.seen = now;
        for passing in self.passing.values_mut() {
            passing.way += if passing.comes { step } else { -step };
        }
        self.passing.retain(|_, passing| (0.0..1.0).contains(&passing.way));
        if !self.newest.as_ref().is_some_and(|known| Arc::ptr_eq(known, newest)) {
            self.turn_to(newest);
        }
        if self.passing.is_empty() {
            return newest.clone();
        }
        let leaving = self.passing.values().filter(|passing| !passing.comes);
        let leaving = leaving.map(|passing| passing.surface.clone());
        let surfaces = newest.surfaces().iter().cloned().chain(leaving).collect();
        let shares = self.passing.iter().map(|(id, passing)| (*id, passing.way as f32));
        let layout = Layout::new(newest.page_size, newest.pages, surfaces);
        Arc::new(layout.with_shares(shares.collect()))
    }

    fn turn_to(&mut self, newest: &Arc<Layout>) {
        let Some(before) = self.newest.replace(newest.clone()) else { return };
        if before.page_size != newest.page_size {
            self.passing.clear();
            return;
        }
        for surface in before.surfaces().iter().filter(|s| newest.surface(s.id).is_none()) {
            self.turn(surface, false);
        }
        for surface in newest.surfaces() {
            match before.surface(surface.id) {
                None => self.turn(surface, true),
                // It lies elsewhere at once.
                Some(known) if known != surface => drop(self.passing.remove(&surface.id)),
                Some(_) => {}
            }
        }
        self.passing.retain(|_, passing| passing.surface.is_on_first(newest.pages));
    }

    /// Lets a surface come or leave, from where it is on its way.
    fn turn(&mut self, surface: &Surface, comes: bool) {
        let way = self.passing.get(&surface.id).map_or(if comes { 0.0 } else { 1.0 }, |p| p.way);
        // 1 is no longer on its way.
        let way = way.min(1.0 - 1e-6);
        self.passing.insert(surface.id, Passing { surface: surface.clone(), way, comes });
    }
}

#[cfg(test)]
mod tests {
    use glam::UVec2;
    use lumencast_light::{Charts, Rectangle};

    use super::*;

    fn layout(nodes: &[u32]) -> Arc<Layout> {
        let surface = |node: &u32| Surface {
            id: id(*node),
            charts: Arc::new(Charts::default()),
            rectangles: vec![Rectangle { page: 0, corner: UVec2::splat(*node) }],
        };
        Arc::new(Layout::new(64, 1, nodes.iter().map(surface).collect()))
    }

    fn id(node: u32) -> SurfaceId {
        SurfaceId { node, ..SurfaceId::default() }
    }

    /// Shares of surfaces 1 and 2, where they are there.
    fn shares(layout: &Layout) -> [Option<f32>; 2] {
        [1, 2].map(|node| layout.surface(id(node)).map(|surface| layout.share(surface.id)))
    }

    #[test]
    fn surfaces_come_and_leave_within_half_a_second() {
        let (both, one) = (layout(&[1, 2]), layout(&[1]));
        let mut handover = Handover::default();
        let shown = handover.show(&both, 7.0);
        assert!(Arc::ptr_eq(&shown, &both), "the first is shown at once");
        // It leaves, comes back half-way, and leaves again.
        assert_eq!(shares(&handover.show(&one, 8.0))[0], Some(1.0));
        let mut last = 1.0;
        for frame in 1..=15u8 {
            let shown = handover.show(&one, 8.0 + f64::from(frame) / 60.0);
            let [Some(1.0), Some(share)] = shares(&shown) else { panic!("{:?}", shares(&shown)) };
            let right = 1.0 - f32::from(frame) / 30.0;
            assert!((share - right).abs() < 1e-4 && share < last, "{share} for {right}");
            last = share;
        }
        assert!((last - 0.5).abs() < 1e-4, "half-way");
        let back = handover.show(&both, 8.25);
        assert!((back.share(id(2)) - last).abs() < 1e-4, "it turns where it is");
        assert!((handover.show(&both, 8.35).share(id(2)) - 0.7).abs() < 1e-3);
        assert!(Arc::ptr_eq(&handover.show(&both, 8.6), &both));
        handover.show(&one, 9.0);
        assert_eq!(shares(&handover.show(&one, 9.51)), [Some(1.0), None]);
    }

    #[test]
    fn pages_of_another_size_and_other_places_are_shown_at_once() {
        let mut handover = Handover::default();
        handover.show(&layout(&[1, 2]), 0.0);
        let other = Arc::new(Layout::new(32, 1, layout(&[1]).surfaces().to_vec()));
        assert!(Arc::ptr_eq(&handover.show(&other, 1.0), &other));
        let moved = {
            let mut surface = other.surfaces()[0].clone();
            surface.rectangles[0].corner = UVec2::splat(9);
            Arc::new(Layout::new(32, 1, vec![surface]))
        };
        assert!(Arc::ptr_eq(&handover.show(&moved, 2.0), &moved));
    }
}
