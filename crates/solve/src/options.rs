//! How light is gathered, blended and fitted.

use lumencast_light::Offset;

use crate::blend::BlendSettings;

/// How light is gathered and blended.
#[derive(Clone, Copy, Debug)]
pub struct GatherOptions {
    /// Surface scattering events on a path seen from a probe.
    pub bounces: u32,
    /// Upper limit of one path vertex's contribution, cd/m².
    pub clamp: f32,
    /// How updates are blended over time.
    pub blend: BlendSettings,
    /// Whether, and how, probes are fitted to the surfaces about them; otherwise they hold the light
    /// that arrives at them.
    pub fit: Option<FitOptions>,
    /// Where in front of surfaces clients are to read the light. Fitted light is right there alone.
    pub offset: Offset,
    /// Whether lumels also tell how light depends on the normal, for surfaces with normal maps.
    pub directional: bool,
}

impl Default for GatherOptions {
    fn default() -> Self {
        Self {
            bounces: 3,
            clamp: f32::INFINITY,
            blend: BlendSettings::default(),
            fit: None,
            offset: Offset::default(),
            directional: false,
        }
    }
}

/// How probes are fitted to surfaces ([`crate::fit`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOptions {
    /// Directions a probe in which points of surfaces are looked for, at least 1; fewer where a volume
    /// has so many probes that there would be more than a million points. Gathering at them takes as
    /// many samples as gathering at the probes, in all, and up to as many more as there are places about
    /// the volume from which something is seen.
    pub points: u32,
}
