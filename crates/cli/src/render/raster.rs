//! Pictures as a client draws them: by a graphics adapter, under light that was computed.

use std::time::Instant;

use anyhow::{Result, ensure};
use glam::{Affine3A, UVec2, Vec3};
use lumencast_light::{Field, Light};
use lumencast_picture::{Picture, exposure};
use lumencast_scene::{Scene, View};
use lumencast_shade::{Drawn, Gpu, PassTimes, Renderer, Settings, Shading, Shadows, Transparency};
use serde_json::{Value, json};

use super::raster_arguments::{RasterArguments, ShadingArgument, TransparencyArgument};
use super::{Lighting, PartsArgument, Render};
use crate::arguments::occlusion;
use crate::light_source::{Computed, Found};
use crate::output::{self, say, tell};

/// Samples a pixel unless told otherwise.
const SAMPLES: u32 = 8;
/// The picture that tells the exposure has this part of the size along each side.
const GLANCE: u32 = 4;
/// The pre-exposure of that picture: halves then hold 0.1 to 60 million cd/m² with all their digits.
const GLANCE_PRE_EXPOSURE: f32 = 1.0 / 1024.0;

impl Render {
    pub(super) fn draw_picture(
        &self,
        scene: &mut Scene,
        view: View,
        light: Option<Found>,
    ) -> Result<()> {
        ensure!(
            self.parts == PartsArgument::All,
            "--parts is for the reference; give --lighting direct or --lighting indirect"
        );
        let settings = self.raster_settings();
        let gpu = Gpu::new()?;
        let adapter = gpu.name();
        for what in settings.missing(gpu.abilities()) {
            tell!("warning: {what}");
        }
        let snapshot = scene.snapshot();
        let mut renderer = Renderer::new(gpu, &settings);
        renderer.set_scene(&snapshot);
        let (mut probes, mut pages) = (0, 0);
        if settings.lighting.indirect {
            let light = Light::new(self.fields(scene, light)?);
            probes = light.probe_count();
            pages = light.lightmaps().map(|lightmap| lightmap.layout.pages).sum();
            let (offset, window) = (self.raster.reading.offset, self.raster.window);
            renderer.set_light(&light.seen(offset, window))?;
        }
        let grid = self.grid();
        let views = views(&view, grid, self.raster.view_spacing);
        let (exposure, before) = match self.exposure.0 {
            Some(exposure) => (exposure, None),
            None => glance(&mut renderer, &views, &settings)?,
        };
        let settings = Settings { pre_exposure: exposure, ..settings };

        let start = Instant::now();
        let (pictures, mut drawn) = renderer.pictures_with(&views, &settings)?;
        let seconds = start.elapsed().as_secs_f64();
        if let (Some(time), Some(before)) = (&mut drawn.time, before) {
            keep(time, &before);
        }
        let picture = side_by_side(&pictures, settings.size, grid)?;
        self.write(&picture, exposure)?;
        if drawn.lights_without_shadow > 0 {
            tell!(
                "warning: {} lights cast no shadow: there is no room for their maps",
                drawn.lights_without_shadow
            );
        }
        let done = Done { adapter, drawn, probes, pages, seconds, exposure };
        if self.json {
            return output::json(&self.report_drawn(&done));
        }
        self.print_drawn(&done);
        Ok(())
    }

    fn raster_settings(&self) -> Settings {
        let RasterArguments { shading, shadow_resolution, pcf, pcss, .. } = self.raster;
        Settings {
            size: self.picture.size,
            samples: self.spp.unwrap_or(SAMPLES),
            shading: match shading {
                ShadingArgument::Pixels => Shading::Pixels,
                ShadingArgument::Samples => Shading::Samples,
            },
            lighting: match self.lighting() {
                Lighting::Reference | Lighting::Field => lumencast_shade::Lighting::FIELD,
                Lighting::Direct => lumencast_shade::Lighting::DIRECT,
                Lighting::Indirect => lumencast_shade::Lighting::INDIRECT,
                Lighting::None => lumencast_shade::Lighting::NONE,
            },
            materials: self.picture.materials.drawn(),
            shadows: Shadows {
                resolution: shadow_resolution,
                filter_samples: pcf,
                search_samples: pcss,
                ..Shadows::default()
            },
            occlusion: occlusion(self.raster.occlusion),
            transparency: match self.raster.transparency {
                TransparencyArgument::Coverage => Transparency::Coverage,
                TransparencyArgument::Sorted => Transparency::Sorted,
            },
            ..Settings::default()
        }
    }

    /// The fields given, or else those computed for this picture.
    fn fields(&self, scene: &mut Scene, light: Option<Found>) -> Result<Vec<Field>> {
        if let Some(light) = light {
            light.check_fits(scene);
            return Ok(light.fields);
        }
        let computed = Computed {
            effort: self.raster.fields.effort(&self.raster.effort, self.raster.probe_samples),
            bounces: self.picture.bounces.saturating_sub(1),
            clamp: self.clamp,
            reading: self.raster.reading.drawn(),
            tracing: self.picture.tracing(),
        };
        let mut gatherer = computed.gatherer()?;
        let wanted = self.raster.fields.wanted(scene, &self.scene, &mut *gatherer)?;
        Ok(computed.light(&scene.snapshot(), &wanted, &mut *gatherer)?.fields)
    }

    /// Columns and rows of views.
    fn grid(&self) -> UVec2 {
        self.raster.views.unwrap_or(UVec2::ONE)
    }

    fn print_drawn(&self, done: &Done) {
        let Done { adapter, drawn, probes, pages, seconds, exposure } = done;
        let UVec2 { x: width, y: height } = self.picture.size;
        let files: Vec<_> = self.output.iter().map(|path| path.display().to_string()).collect();
        say!("{}", files.join(", "));
        say!(
            "views: {} of {width} × {height}, samples a pixel: {} in {} frames, {seconds:.2} s",
            self.grid().element_product(),
            drawn.frames * drawn.samples,
            drawn.frames,
        );
        say!(
            "probes: {probes}, pages of lumels: {pages}, shadow maps: {} of {}², exposure {exposure}",
            drawn.shadow_maps,
            drawn.shadow_resolution
        );
        match drawn.time {
            // A picture in a file takes no time on a screen.
            Some(PassTimes { deformation, shadows, occlusion, pictures, screen: _ }) => say!(
                "{adapter}: {:.1} ms skins and morph targets, {:.1} ms shadow maps, \
                 {:.1} ms occlusion, {:.1} ms pictures",
                1e3 * deformation,
                1e3 * shadows,
                1e3 * occlusion,
                1e3 * pictures
            ),
            None => say!("{adapter}"),
        }
    }

    fn report_drawn(&self, done: &Done) -> Value {
        let drawn = &done.drawn;
        json!({
            "files": self.output,
            "adapter": done.adapter,
            "width": self.picture.size.x,
            "height": self.picture.size.y,
            "views": self.grid().element_product(),
            "frames": drawn.frames,
            "samples": drawn.frames * drawn.samples,
            "shadow_maps": drawn.shadow_maps,
            "shadow_resolution": drawn.shadow_resolution,
            "lights_without_shadow": drawn.lights_without_shadow,
            "probes": done.probes,
            "pages": done.pages,
            "seconds": done.seconds,
            "device_seconds": drawn.time.map(|time| json!({
                "deformation": time.deformation,
                "shadows": time.shadows,
                "occlusion": time.occlusion,
                "pictures": time.pictures,
            })),
            "exposure": done.exposure,
        })
    }
}

/// A picture that was drawn, and what it took.
struct Done {
    adapter: String,
    drawn: Drawn,
    /// The number of the light's probes.
    probes: usize,
    /// The number of its pages of lumels.
    pages: u32,
    seconds: f64,
    exposure: f32,
}

/// The exposure of a first, small picture, and what that took.
fn glance(
    renderer: &mut Renderer,
    views: &[View],
    settings: &Settings,
) -> Result<(f32, Option<PassTimes>)> {
    let small = Settings {
        size: (settings.size / GLANCE).max(UVec2::ONE),
        samples: 1,
        pre_exposure: GLANCE_PRE_EXPOSURE,
        ..*settings
    };
    let (pictures, drawn) = renderer.pictures_with(&views[..1], &small)?;
    Ok((exposure(&side_by_side(&pictures, small.size, UVec2::ONE)?), drawn.time))
}

/// Adds what a picture found on the device already, from the glance before it.
fn keep(time: &mut PassTimes, before: &PassTimes) {
    for (now, before) in
        [(&mut time.deformation, before.deformation), (&mut time.shadows, before.shadows)]
    {
        if *now == 0.0 {
            *now = before;
        }
    }
}

/// A grid of cameras about one, all looking in parallel; row by row from the upper left.
fn views(middle: &View, grid: UVec2, spacing: f32) -> Vec<View> {
    let place = |i: u32| {
        let at = UVec2::new(i % grid.x, i / grid.x).as_vec2() - 0.5 * (grid.as_vec2() - 1.0);
        let linear = middle.world_from_camera.matrix3;
        let right = Vec3::from(linear.x_axis).normalize_or_zero();
        let up = Vec3::from(linear.y_axis).normalize_or_zero();
        let moved = Affine3A::from_translation(spacing * (at.x * right - at.y * up));
        View { world_from_camera: moved * middle.world_from_camera, ..*middle }
    };
    (0..grid.element_product()).map(place).collect()
}

/// One picture of a grid of pictures.
fn side_by_side(pictures: &[Vec<Vec3>], size: UVec2, grid: UVec2) -> Result<Picture> {
    let pixel = |x: u32, y: u32| {
        let tile = (y / size.y) * grid.x + x / size.x;
        pictures[tile as usize][((y % size.y) * size.x + x % size.x) as usize]
    };
    Ok(Picture::from_fn(size.x * grid.x, size.y * grid.y, pixel))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_views() {
        let middle = View::look_at(Vec3::ZERO, Vec3::NEG_Z, 1.0).expect("two points");
        let eye = |view: &View| Vec3::from(view.world_from_camera.translation);
        let pair = views(&middle, UVec2::new(2, 1), 0.1);
        assert_eq!((eye(&pair[0]), eye(&pair[1])), (Vec3::X * -0.05, Vec3::X * 0.05));
        let grid = views(&middle, UVec2::splat(2), 1.0);
        assert_eq!(eye(&grid[0]), Vec3::new(-0.5, 0.5, 0.0), "the upper left");
        assert_eq!(views(&middle, UVec2::ONE, 1.0)[0], middle);
    }
}
