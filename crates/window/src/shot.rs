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

/// Between two looks at whether light has settled.
const PAUSE: Duration = Duration::from_millis(20);
/// Of what stands in for the window.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Saves a picture of a world as soon as its light has settled and its exposure is known, as a window of
/// these options would show it. Needs no display.
///
/// # Errors
/// Where there is no adapter, the picture is too large for it, or the file cannot be written.
pub fn shoot(world: Box<dyn World>, options: &Options, file: &Path) -> Result<(), WindowError> {
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
