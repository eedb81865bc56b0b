//! What drawing took.

use crate::shadows::ShadowPlan;
use crate::timing::PassTimes;

/// What drawing took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drawn {
    /// Frames that were averaged.
    pub frames: u32,
    /// Samples a pixel of each.
    pub samples: u32,
    /// Shadow maps.
    pub shadow_maps: usize,
    /// Texels along the side of a shadow map.
    pub shadow_resolution: u32,
    /// Lights that cast no shadow, because there is no room for their maps.
    pub lights_without_shadow: usize,
    /// Seconds that the device says it took, of all frames; nothing where it has no clock.
    pub time: Option<PassTimes>,
}

impl Drawn {
    /// Takes in what is drawn of shadows.
    pub(crate) fn shadows(&mut self, plan: &ShadowPlan) {
        self.shadow_maps = plan.views.len();
        self.shadow_resolution = plan.resolution;
        self.lights_without_shadow = plan.left_out;
    }
}
