//! How large lumels are: all alike, but on surfaces that would not fit a page otherwise.

use std::collections::BTreeMap;
use std::sync::Arc;

use lumencast_charts::{LaidOut, lumels_on_pages};
use lumencast_light::{Layout, SurfaceId};

/// Sides of lumels, metres.
#[derive(Clone, Debug)]
pub(crate) struct Texels {
    usual: f32,
    /// Of surfaces whose lumels are larger.
    larger: BTreeMap<SurfaceId, f32>,
    /// Of each receiver, where there are such.
    each: Option<Arc<[f32]>>,
}

impl Texels {
    /// Of so many receivers; `receiver_of` has those of covered lumels.
    pub(crate) fn new(laid_out: &LaidOut, receiver_of: &[u32], receivers: usize) -> Self {
        let LaidOut { layout, texel, larger, .. } = laid_out;
        if larger.is_empty() {
            return Self { usual: *texel, larger: BTreeMap::new(), each: None };
        }
        let mut each = vec![*texel; receivers];
        for surface in layout.surfaces() {
            if let Some(texel) = larger.get(&surface.id) {
                for (lumel, _) in lumels_on_pages(layout, surface) {
                    if let Some(own) = each.get_mut(receiver_of[lumel] as usize) {
                        *own = *texel;
                    }
                }
            }
        }
        Self { usual: *texel, larger: larger.clone(), each: Some(each.into()) }
    }

    /// The side of a receiver's lumel, metres.
    pub(crate) fn at(&self, receiver: u32) -> f32 {
        self.each.as_ref().map_or(self.usual, |each| each[receiver as usize])
    }

    /// Each side that some of these receivers' lumels have, metres, once.
    pub(crate) fn among(&self, receivers: impl Iterator<Item = u32>) -> Vec<f32> {
        let Some(each) = &self.each else { return vec![self.usual] };
        let mut sides: Vec<f32> = receivers.map(|receiver| each[receiver as usize]).collect();
        sides.sort_by(f32::total_cmp);
        sides.dedup();
        sides
    }

    /// Lumels of these sizes, laid out so.
    pub(crate) fn laid_out(&self, layout: &Layout) -> LaidOut {
        let Self { usual: texel, ref larger, .. } = *self;
        LaidOut { layout: layout.clone(), texel, larger: larger.clone(), coarser: false }
    }

    /// Bytes of memory that grow with the number of lumels.
    pub(crate) fn bytes(&self) -> usize {
        self.each.as_ref().map_or(0, |each| size_of_val(&**each))
    }
}
