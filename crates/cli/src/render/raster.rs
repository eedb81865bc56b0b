//! Pictures as a client draws them: by a graphics adapter, under a light field.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Result, ensure};
use clap::{Args, ValueEnum};
use glam::{Affine3A, UVec2, Vec3};
use lumencast_light::{LightField, ProbeVolume};
use lumencast_picture::{Picture, exposure};
use lumencast_scene::{Scene, View};
use lumencast_shade::{Drawn, Gpu, PassTimes, Renderer, Settings, Shading, Shadows, Transparency};
use serde_json::json;

use super::{Lighting, PartsArgument, Render};
use crate::arguments::{
    EffortArguments, MOST_SAMPLES, ReadingArguments, occlusion, parse_occlusion, parse_positive,
};
use crate::light_source::{self, Computed};
use crate::output::{self, say, tell};

/// Samples a pixel unless told otherwise.
const SAMPLES: u32 = 8;
/// Of the picture that tells the exposure, as a part of the size.
const GLANCE: u32 = 4;
/// Pre-exposure of that picture: halves then hold 0.1 to 60 million cd/m² with all their digits.
const GLANCE_PRE_EXPOSURE: f32 = 1.0 / 1024.0;

/// How an adapter draws.
#[derive(Debug, Args)]
#[command(next_help_heading = "Pictures drawn by an adapter")]
pub(crate) struct RasterArguments {
    /// The light field: a file of `lumencast bake`, or the address of a server's scene. Computed where
    /// it is not given.
    #[arg(long, value_name = "FILE|URL")]
    light: Option<String>,
    /// Samples a probe where the field is computed, at most.
    #[arg(long, value_name = "N", default_value_t = MOST_SAMPLES,
          value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    probe_samples: u32,
    #[command(flatten)]
    effort: EffortArguments,
    #[command(flatten)]
    reading: ReadingArguments,
    /// Takes ringing out of the field by a Hann window that ends at this band; 3 leaves order 2 a
    /// quarter of its band 2. None unless given.
    #[arg(long, value_name = "BAND", value_parser = parse_positive)]
    window: Option<f32>,
    /// How often surfaces are shaded: once a sample, or once a pixel, which is faster.
    #[arg(long, value_enum, default_value_t = ShadingArgument::Samples)]
    shading: ShadingArgument,
    /// Texels along the side of a shadow map; 0 draws no shadows.
    #[arg(long, value_name = "N", default_value_t = 4096,
          value_parser = clap::value_parser!(u32).range(0..=16_384))]
    shadow_resolution: u32,
    /// Samples of a shadow's edge.
    #[arg(long, value_name = "N", default_value_t = 16,
          value_parser = clap::value_parser!(u32).range(1..=256))]
    pcf: u32,
    /// Samples of the search for what casts a shadow, which makes shadows of lights with a size
    /// soft; 0 leaves them sharp.
    #[arg(long, value_name = "N", default_value_t = 16,
          value_parser = clap::value_parser!(u32).range(0..=256))]
    pcss: u32,
    /// Takes away indirect light that is hidden within so many metres (ambient occlusion in screen
    /// space), which probes are too sparse for; 0 takes none.
    #[arg(long, value_name = "METRES", default_value_t = 0.0, value_parser = parse_occlusion)]
    occlusion: f32,
    /// How blended surfaces are drawn: by the samples that they cover, or sorted and mixed.
    #[arg(long, value_enum, default_value_t = TransparencyArgument::Coverage)]
    transparency: TransparencyArgument,
    /// Several views in one picture: a stereo pair, or a grid of cameras, the first at the upper left.
    #[arg(long, value_name = "stereo|COLSxROWS", value_parser = parse_views)]
    views: Option<UVec2>,
    /// Metres from one of several views to the next.
    #[arg(long, value_name = "METRES", default_value_t = 0.064)]
    view_spacing: f32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ShadingArgument {
    Pixels,
    Samples,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum TransparencyArgument {
    Coverage,
    Sorted,
}

impl RasterArguments {
    /// What only an adapter's pictures have, where it is asked for.
    pub(super) fn asked_for(&self) -> Option<&'static str> {
        let light = self.light.is_some().then_some("--light");
        light.or_else(|| self.views.is_some().then_some("--views"))
    }

    /// The light's file, where that is what it comes from.
    pub(super) fn light_file(&self) -> Option<PathBuf> {
        self.light.as_deref().filter(|light| !light_source::is_address(light)).map(PathBuf::from)
    }
}

impl Render {
    pub(super) fn draw_picture(&self, scene: &mut Scene, view: View) -> Result<()> {
        ensure!(
            self.parts == PartsArgument::All,
            "--parts is for the reference; give --lighting direct or --lighting indirect"
        );
        let settings = self.raster_settings();
        let gpu = Gpu::new()?;
        let adapter = gpu.name();
        for what in gpu.abilities().missing(&settings) {
            tell!("warning: {what}");
        }
        let snapshot = scene.snapshot();
        let mut renderer = Renderer::new(gpu, &settings);
        renderer.set_scene(&snapshot);
        let mut probes = 0;
        if settings.lighting.indirect {
            let volumes = self.volumes(scene)?;
            probes = volumes.iter().map(|volume| volume.grid.probe_count()).sum();
            let (offset, window) = (self.raster.reading.offset, self.raster.window);
            renderer.set_light(&LightField::new(volumes).seen(offset, window))?;
        }
        let grid = self.raster.views.unwrap_or(UVec2::ONE);
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
        self.report_drawn(&adapter, &drawn, probes, seconds, exposure)
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

    /// The field given, or else one computed for this picture.
    fn volumes(&self, scene: &mut Scene) -> Result<Vec<ProbeVolume>> {
        if let Some(light) = &self.raster.light {
            let (catalog, volumes) = light_source::light(light)?;
            light_source::check_fits(light, &catalog, scene);
            return Ok(volumes);
        }
        let computed = Computed {
            effort: self.raster.effort.with(self.raster.probe_samples),
            bounces: self.picture.bounces.saturating_sub(1),
            clamp: self.clamp,
            reading: self.raster.reading.drawn(),
            tracing: self.picture.tracing(),
        };
        let mut tracer = computed.tracer()?;
        let specs = self.scene.volumes(scene, &mut tracer)?;
        Ok(computed.volumes(&scene.snapshot(), &specs, &mut tracer)?.volumes)
    }

    fn report_drawn(
        &self,
        adapter: &str,
        drawn: &Drawn,
        probes: usize,
        seconds: f64,
        exposure: f32,
    ) -> Result<()> {
        if drawn.lights_without_shadow > 0 {
            tell!(
                "warning: {} lights cast no shadow: there is no room for their maps",
                drawn.lights_without_shadow
            );
        }
        let UVec2 { x: width, y: height } = self.picture.size;
        let views = self.raster.views.unwrap_or(UVec2::ONE).element_product();
        if self.json {
            return output::json(&json!({
                "files": self.output,
                "adapter": adapter,
                "width": width,
                "height": height,
                "views": views,
                "frames": drawn.frames,
                "samples": drawn.frames * drawn.samples,
                "shadow_maps": drawn.shadow_maps,
                "shadow_resolution": drawn.shadow_resolution,
                "lights_without_shadow": drawn.lights_without_shadow,
                "probes": probes,
                "seconds": seconds,
                "device_seconds": drawn.time.map(|time| json!({
                    "deformation": time.deformation,
                    "shadows": time.shadows,
                    "occlusion": time.occlusion,
                    "pictures": time.pictures,
                })),
                "exposure": exposure,
            }));
        }
        let files: Vec<_> = self.output.iter().map(|path| path.display().to_string()).collect();
        say!("{}", files.join(", "));
        say!(
            "views: {views} of {width} × {height}, samples a pixel: {} in {} frames, {seconds:.2} s",
            drawn.frames * drawn.samples,
            drawn.frames,
        );
        say!(
            "probes: {probes}, shadow maps: {} of {}², exposure {exposure}",
            drawn.shadow_maps,
            drawn.shadow_resolution
        );
        match drawn.time {
            // Nothing is shown on a screen.
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
        Ok(())
    }
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

fn parse_views(text: &str) -> Result<UVec2, String> {
    const MOST: u32 = 256;
    if text == "stereo" {
        return Ok(UVec2::new(2, 1));
    }
    let wrong =
        || format!("{text:?}: give stereo, or columns and rows as 8x4, at most {MOST} views");
    let (columns, rows) = text.split_once('x').ok_or_else(wrong)?;
    let side = |text: &str| text.parse::<u32>().ok().filter(|n| (1..=MOST).contains(n));
    match (side(columns), side(rows)) {
        (Some(x), Some(y)) if x * y <= MOST => Ok(UVec2::new(x, y)),
        _ => Err(wrong()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_views() {
        assert_eq!(parse_views("stereo"), Ok(UVec2::new(2, 1)));
        assert_eq!(parse_views("8x4"), Ok(UVec2::new(8, 4)));
        for wrong in ["", "3", "0x2", "20x20", "-1x2"] {
            assert!(parse_views(wrong).is_err(), "{wrong}");
        }
        let middle = View::look_at(Vec3::ZERO, Vec3::NEG_Z, 1.0).expect("two points");
        let eye = |view: &View| Vec3::from(view.world_from_camera.translation);
        let pair = views(&middle, UVec2::new(2, 1), 0.1);
        assert_eq!((eye(&pair[0]), eye(&pair[1])), (Vec3::X * -0.05, Vec3::X * 0.05));
        let grid = views(&middle, UVec2::splat(2), 1.0);
        assert_eq!(eye(&grid[0]), Vec3::new(-0.5, 0.5, 0.0), "the upper left");
        assert_eq!(views(&middle, UVec2::ONE, 1.0)[0], middle);
    }
}
