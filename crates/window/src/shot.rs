//! A picture of a world, without a window.

use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use egui::{Pos2, RawInput, Rect};
use glam::UVec2;
use lumencast_shade::{Gpu, wgpu};

use crate::Options;
use crate::error::WindowError;
use crate::stage::Stage;
use crate::world::World;

/// How long light may take to come and to settle.
const PATIENCE: Duration = Duration::from_secs(300);
/// Between two looks at whether light has settled.
const PAUSE: Duration = Duration::from_millis(20);
/// The format of what stands in for the window.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Saves a picture of a world as soon as its light has settled and its exposure is known, as a window of
/// these options would show it. Needs no display.
///
/// # Errors
/// Where there is no adapter, the picture is too large for it, no light comes in five minutes, or the file
/// cannot be written.
pub fn shoot(world: Box<dyn World>, options: &Options, file: &Path) -> Result<(), WindowError> {
    shoot_within(PATIENCE, world, options, file)
}

fn shoot_within(
    patience: Duration,
    world: Box<dyn World>,
    options: &Options,
    file: &Path,
) -> Result<(), WindowError> {
    let gpu = Gpu::new()?;
    gpu.check_size(options.size)?;
    let onto = stand_in(&gpu, options.size);
    let mut stage = Stage::new(gpu, FORMAT, world, options);
    let began = Instant::now();
    let size = options.size.as_vec2();
    let screen = Rect::from_min_size(Pos2::ZERO, egui::vec2(size.x, size.y));
    while !stage.is_settled() {
        let input = RawInput { screen_rect: Some(screen), ..RawInput::default() };
        // Only exposure needs frames; drawing sooner would take from whoever computes the light.
        let size = if stage.has_settled_light() { options.size } else { UVec2::ZERO };
        stage.frame(began.elapsed().as_secs_f64(), input, size, &onto)?;
        stage.gpu().finish("drawing")?;
        if began.elapsed() > patience && !stage.has_settled_light() {
            return Err(WindowError::NoLight { patience, notice: stage.notice() });
        }
        thread::sleep(PAUSE);
    }
    stage.screenshot(options.size, file)
}

fn stand_in(gpu: &Gpu, size: UVec2) -> wgpu::TextureView {
    let texture = gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some("in place of a window"),
        size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;
    use lumencast_light::{Light, LumelAges};
    use lumencast_scene::{Aabb, NamedView, Scene, Snapshot};

    use super::*;
    use crate::Controls;

    /// A world whose server has gone before it sent any light.
    struct Dark(Scene, Vec<NamedView>);

    impl World for Dark {
        fn name(&self) -> &str {
            "dark"
        }

        fn views(&self) -> &[NamedView] {
            &self.1
        }

        fn bounds(&self) -> Aabb {
            self.0.bounds()
        }

        fn update(&mut self, _now: f64, _eye: Vec3) {}

        fn snapshot(&mut self) -> Arc<Snapshot> {
            self.0.snapshot()
        }

        fn light(&mut self, _anew: bool, _take: &mut dyn FnMut(&Light)) {}

        fn lumel_ages(&self) -> Vec<LumelAges> {
            Vec::new()
        }

        fn facts(&self) -> Vec<(&'static str, String)> {
            Vec::new()
        }

        fn notice(&self) -> Option<String> {
            Some("The server has gone.".into())
        }

        fn is_settled(&self) -> bool {
            false
        }

        fn plays(&self) -> Option<bool> {
            None
        }

        fn play(&mut self, _plays: bool) {}
    }

    #[test]
    fn a_world_that_stays_dark_is_not_waited_for_without_end() {
        let scene = Scene::builtin("cornell").unwrap();
        let views = scene.views();
        let controls = Controls::usual(false);
        let screenshots = Path::new(env!("CARGO_MANIFEST_DIR")).join("never");
        let options = Options { size: UVec2::splat(8), view: None, controls, screenshots };
        let file = options.screenshots.join("never.png");
        let world = Box::new(Dark(scene, views));
        let error = shoot_within(Duration::ZERO, world, &options, &file).unwrap_err();
        assert!(error.to_string().contains("The server has gone."), "{error}");
    }
}
