//! What the comparisons of drawn pictures share.

use anyhow::Result;
use lumencast_picture::Picture;
use lumencast_scene::{View, VolumeSpec};
use lumencast_shade::{Lighting, Renderer, Settings};

/// The light of two parts of a picture together.
pub(super) fn sum(a: &Picture, b: &Picture) -> Picture {
    let mut sum = a.clone();
    sum.pixels_mut().iter_mut().zip(b.pixels()).for_each(|(a, b)| *a += *b);
    sum
}

/// What an adapter draws of a part of the light.
pub(super) fn draw(
    renderer: &mut Renderer,
    view: View,
    settings: &Settings,
    lighting: Lighting,
) -> Result<Picture> {
    let settings = Settings { lighting, ..*settings };
    let pixels = renderer.pictures(&[view], &settings)?.remove(0);
    Ok(Picture::new(settings.size.x, settings.size.y, pixels)?)
}

/// A volume's cells as they are given on the command line.
pub(super) fn cells(spec: &VolumeSpec) -> String {
    let [x, y, z] = spec.grid.resolution.to_array();
    format!("{x}x{y}x{z}")
}
