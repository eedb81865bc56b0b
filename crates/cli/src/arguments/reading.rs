//! Where on surfaces light is read, and whether it is fitted to be read there.

use clap::Args;
use lumencast_light::Offset;
use lumencast_solve::blend::BlendSettings;
use lumencast_solve::{FitOptions, GatherOptions};

use crate::values::parse_offset;

/// Light that is computed once is fitted to so many points a probe, unless told otherwise.
const POINTS: u32 = 256;
/// Where fitted light is read unless told otherwise. Farther off, points on both sides of an edge read
/// the same place; at the surface itself, both sides of a wall do (`docs/results/walls.md`).
const NEAR: Offset = Offset::Cells(0.125);

/// Where on surfaces light is read, and whether it is fitted to be read there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading {
    pub(crate) fit: Option<FitOptions>,
    pub(crate) offset: Offset,
}

impl Reading {
    pub(crate) fn gathered(self, bounces: u32, clamp: f32, blend: BlendSettings) -> GatherOptions {
        let (fit, offset) = (self.fit, self.offset);
        GatherOptions { bounces, clamp, blend, fit, offset, ..GatherOptions::default() }
    }
}

/// How surfaces read light.
#[derive(Debug, Args)]
pub(crate) struct ReadingArguments {
    /// Fits probes to the surfaces about them, so that light leaks through no walls: so many points of
    /// surfaces a probe, 0 to leave probes with what arrives at them. Takes as many samples again.
    /// Unless given, 256 where light is computed once, and none where it is live.
    #[arg(long, value_name = "POINTS", value_parser = clap::value_parser!(u32).range(0..=4096))]
    fit: Option<u32>,
    /// Where in front of a surface light is read: none, half-cell, N-cells or metres. Unless given,
    /// where the light says; light that is computed says half a cell, which is three.js's rule, but
    /// 0.125 cells where it is fitted and drawn at once.
    #[arg(long, value_name = "none|half-cell|N-cells|METRES", value_parser = parse_offset)]
    pub(crate) offset: Option<Offset>,
}

impl ReadingArguments {
    /// How pages read live light.
    pub(crate) fn served(&self) -> Reading {
        Reading { fit: self.fit(0), offset: self.offset.unwrap_or_default() }
    }

    /// How whoever has the file reads its light.
    pub(crate) fn baked(&self) -> Reading {
        Reading { fit: self.fit(POINTS), offset: self.offset.unwrap_or_default() }
    }

    /// How our own renderer reads light that is computed for it.
    pub(crate) fn drawn(&self) -> Reading {
        let fit = self.fit(POINTS);
        let usual = if fit.is_some() { NEAR } else { Offset::default() };
        Reading { fit, offset: self.offset.unwrap_or(usual) }
    }

    /// The readings that are compared: light as it is gathered, and fitted where that is asked for.
    pub(crate) fn compared(&self) -> Vec<Reading> {
        let gathered = Reading { fit: None, offset: self.offset.unwrap_or_default() };
        let fitted = Some(self.drawn()).filter(|reading| reading.fit.is_some());
        [gathered].into_iter().chain(fitted).collect()
    }

    fn fit(&self, usual: u32) -> Option<FitOptions> {
        let points = self.fit.unwrap_or(usual);
        (points > 0).then_some(FitOptions { points })
    }
}
