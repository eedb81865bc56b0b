//! How much a picture changes from frame to frame while surfaces pass from lumels to probes.

use std::f32::consts::PI;
use std::sync::Arc;

use anyhow::{Result, ensure};
use glam::Vec3;
use lumencast_gather::path_trace::CpuPathTracer;
use lumencast_light::{Field, FieldId, Layout, Light, Lightmap};
use lumencast_picture::Picture;
use lumencast_scene::Scene;
use lumencast_shade::{Gpu, Lighting, Renderer, Settings};
use lumencast_solve::{Bake, Effort, GatherOptions, bake, volumes};
use serde_json::{Value, json};

use super::display::code;
use crate::bench::drawing::draw;
use crate::bench::traced::SIZE;
use crate::camera;
use crate::output::say;

/// Frames of a passage: half a second of 60 a second.
const FRAMES: usize = 30;
/// Codes by which a pixel may change in a frame beside its share of the whole change.
const ALLOWED: f32 = 2.0;
/// Samples of a probe.
const SAMPLES: u32 = 4096;

/// What was seen while all surfaces passed at once.
pub(super) struct Handover {
    /// The largest change of a pixel in a frame beyond its share of the whole change, codes.
    beyond: f32,
    /// The largest whole change of a pixel, codes.
    whole: f32,
    /// The share of pixels that change by more than is allowed.
    too_much: f64,
}

impl Handover {
    /// Draws a scene whose surfaces all pass from lumels to probes. `white` lux are white.
    pub(super) fn measure(
        mut scene: Scene,
        lightmap: &Lightmap,
        tracer: &mut CpuPathTracer,
        white: f32,
    ) -> Result<Self> {
        let snapshot = scene.snapshot();
        let volumes = volumes(&mut scene, tracer)?;
        ensure!(!volumes.is_empty(), "the scene has no volume that surfaces could pass to");
        let wanted = Bake {
            scene: &snapshot,
            volumes: &volumes,
            lightmap: None,
            effort: Effort::of_samples(SAMPLES),
            options: GatherOptions::default(),
        };
        let probes = bake(wanted, tracer, |_| ())?.fields;
        let id = FieldId(probes.iter().map(|field| field.id().0 + 1).max().unwrap_or(0));
        let settings = Settings { size: SIZE, pre_exposure: PI / white, ..Settings::default() };
        let view = camera::view(&scene, None)?;
        let mut renderer = Renderer::new(Gpu::new()?, &settings);
        renderer.set_scene(&snapshot);
        let frame = |number: usize| -> Result<Vec<Vec3>> {
            let layout = passing(&lightmap.layout, 1.0 - number as f32 / FRAMES as f32);
            let shown = Lightmap { id, layout, ..lightmap.clone() };
            renderer.set_light(&Light::new(probes.iter().cloned().chain([Field::from(shown)])))?;
            let picture = draw(&mut renderer, view, &settings, Lighting::FIELD)?;
            Ok(codes(&picture, white / PI))
        };
        let frames: Vec<Vec<Vec3>> = (0..=FRAMES).map(frame).collect::<Result<_>>()?;
        Ok(Self::of(&frames))
    }

    /// What is seen in frames, pixel by pixel.
    fn of(frames: &[Vec<Vec3>]) -> Self {
        let mut seen = Self { beyond: 0.0, whole: 0.0, too_much: 0.0 };
        let pixels = frames[0].len();
        for pixel in 0..pixels {
            let change = |a: usize, b: usize| (frames[a][pixel] - frames[b][pixel]).abs();
            let whole = change(0, frames.len() - 1);
            let beyond = |at: usize| change(at, at - 1) - whole / (frames.len() - 1) as f32;
            let most = (1..frames.len()).map(|at| beyond(at).max_element()).fold(0.0, f32::max);
            seen.whole = seen.whole.max(whole.max_element());
            seen.beyond = seen.beyond.max(most);
            seen.too_much += f64::from(u8::from(most > ALLOWED)) / pixels as f64;
        }
        seen
    }

    pub(super) fn json(&self) -> Value {
        json!({
            "codes_beyond": self.beyond,
            "allowed": ALLOWED,
            "whole_codes": self.whole,
            "too_much": self.too_much,
        })
    }

    pub(super) fn say(&self) {
        say!(
            "hand-over: pixels change by up to {:.1} codes in all, and in a frame by up to {:.1} codes \
             beyond a {FRAMES}th of that; {ALLOWED:.0} are allowed, {:.2} % of pixels have more",
            self.whole,
            self.beyond,
            100.0 * self.too_much
        );
    }
}

/// A layout all of whose surfaces have come so far from probes to lumels.
fn passing(layout: &Layout, share: f32) -> Arc<Layout> {
    let shares = layout.surfaces().iter().map(|surface| (surface.id, share)).collect();
    Arc::new(layout.clone().with_shares(shares))
}

/// Codes of a display that shows so much radiance as white, not rounded.
fn codes(picture: &Picture, white: f32) -> Vec<Vec3> {
    picture.pixels().iter().map(|pixel| pixel.map(|channel| code(channel, white))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An even passage has nothing beyond a share of the whole; a jump has all but that.
    #[test]
    fn jumps_are_told_from_even_passages() {
        let frames = |shares: [f32; 4]| shares.map(|share| vec![Vec3::splat(90.0 * share)]);
        let even = Handover::of(&frames([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0]));
        assert!(even.beyond.abs() < 1e-3 && (even.whole - 90.0).abs() < 1e-3);
        let jump = Handover::of(&frames([0.0, 0.0, 1.0, 1.0]));
        assert!((jump.beyond - 60.0).abs() < 1e-3, "{}", jump.beyond);
        assert_eq!([even.too_much, jump.too_much], [0.0, 1.0]);
    }
}
