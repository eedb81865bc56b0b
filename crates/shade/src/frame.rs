//! One frame of a picture.

use lumencast_scene::Snapshot;
use lumencast_shaders::layout;

use crate::settings::{Lighting, LumelLook, Settings};
use crate::shadows::ShadowPlan;

/// How far patterns turn from one frame of a picture to the next: the golden section fills the circle
/// evenly for any number.
const GOLDEN: f32 = 0.618_034;

/// What a frame is drawn from.
#[derive(Clone, Copy)]
pub(crate) struct Frame<'a> {
    pub(crate) snapshot: &'a Snapshot,
    pub(crate) plan: &'a ShadowPlan,
    pub(crate) settings: &'a Settings,
    /// Samples of a pixel.
    pub(crate) samples: u32,
    /// Its number among the frames of a picture.
    pub(crate) number: u32,
}

impl Frame<'_> {
    /// How far its patterns are turned, parts of a turn.
    pub(crate) fn turn(&self) -> f32 {
        GOLDEN * self.number as f32
    }

    /// What shaders are told of it.
    pub(crate) fn layout(&self) -> layout::Frame {
        let settings = self.settings;
        let part = |is: bool, bit: u32| if is { bit } else { 0 };
        let Lighting { emission, direct, indirect } = settings.lighting;
        layout::Frame {
            light_count: self.snapshot.lights.len() as u32,
            parts: part(emission, layout::parts::EMISSION)
                | part(direct, layout::parts::DIRECT)
                | part(indirect, layout::parts::INDIRECT),
            filter_samples: settings.shadows.filter_samples.max(1),
            search_samples: settings.shadows.search_samples,
            pre_exposure: settings.pre_exposure,
            sample_count: self.samples,
            filter_radius: settings.shadows.filter_radius,
            frame: self.number,
            still: settings.strengths.still,
            moving: settings.strengths.moving,
            look: match settings.look {
                LumelLook::Light => layout::look::LIGHT,
                LumelLook::Lumels => layout::look::LUMELS,
                LumelLook::Age => layout::look::AGE,
            },
            occlusion_radius: settings.drawn_occlusion().map_or(0.0, |occlusion| occlusion.radius),
        }
    }
}
