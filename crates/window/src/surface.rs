//! Where a window's pictures go.

use std::sync::Arc;

use glam::UVec2;
use lumencast_shade::{Gpu, GpuError, wgpu};
use winit::window::Window;

use crate::error::WindowError;

/// A window's surface, and how it is set up.
pub(crate) struct Surface {
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
}

impl Surface {
    /// A window's surface, with the device that draws on it. `display` is the event loop's.
    pub(crate) fn new(
        window: &Arc<Window>,
        display: winit::event_loop::OwnedDisplayHandle,
    ) -> Result<(Self, Gpu), WindowError> {
        let descriptor = wgpu::InstanceDescriptor::new_with_display_handle(Box::new(display));
        let instance = wgpu::Instance::new(descriptor);
        let surface = instance
            .create_surface(window.clone())
            .map_err(|error| WindowError::Display(error.to_string()))?;
        let gpu = Gpu::for_surface(&instance, &surface)?;
        let refused =
            |reason: &str| WindowError::Surface { adapter: gpu.name(), reason: reason.to_owned() };
        let size = size_of(window);
        let mut config = surface
            .get_default_config(gpu.adapter(), size.x.max(1), size.y.max(1))
            .ok_or_else(|| refused("it offers no format"))?;
        let capabilities = surface.get_capabilities(gpu.adapter());
        // The tone map gives display codes, and the panel is mixed in them.
        config.format = capabilities
            .formats
            .iter()
            .copied()
            .find(|format| {
                matches!(format, wgpu::TextureFormat::Bgra8Unorm | wgpu::TextureFormat::Rgba8Unorm)
            })
            .ok_or_else(|| {
                refused("it offers no format of eight bits without a curve of its own")
            })?;
        config.present_mode = wgpu::PresentMode::AutoVsync;
        // What is seen is as new as can be.
        config.desired_maximum_frame_latency = 1;
        let surface = Self { surface, config };
        surface.configure(&gpu);
        Ok((surface, gpu))
    }

    pub(crate) fn format(&self) -> wgpu::TextureFormat {
        self.config.format
    }

    /// Takes the window's size, unless that is nothing.
    pub(crate) fn resize(&mut self, gpu: &Gpu, size: UVec2) {
        if size.min_element() > 0 && size != self.size() {
            let limit = gpu.device().limits().max_texture_dimension_2d;
            (self.config.width, self.config.height) = (size.x.min(limit), size.y.min(limit));
            self.configure(gpu);
        }
    }

    pub(crate) fn size(&self) -> UVec2 {
        UVec2::new(self.config.width, self.config.height)
    }

    fn configure(&self, gpu: &Gpu) {
        self.surface.configure(gpu.device(), &self.config);
    }

    /// The texture of the next frame; nothing where there is none now, and another time there may.
    pub(crate) fn next(&self, gpu: &Gpu) -> Result<Option<wgpu::SurfaceTexture>, WindowError> {
        use wgpu::CurrentSurfaceTexture as Current;
        for _ in 0..2 {
            match self.surface.get_current_texture() {
                Current::Success(texture) => return Ok(Some(texture)),
                Current::Timeout | Current::Occluded | Current::Validation => return Ok(None),
                // The old texture has to be gone before the surface is set up anew.
                Current::Suboptimal(texture) => drop(texture),
                Current::Outdated => {}
                Current::Lost => {
                    let reason = "the window's surface was lost".to_owned();
                    let during = "showing a picture";
                    return Err(GpuError::Failed { during, reason }.into());
                }
            }
            self.configure(gpu);
        }
        Ok(None)
    }
}

/// Pixels of a window.
pub(crate) fn size_of(window: &Window) -> UVec2 {
    let size = window.inner_size();
    UVec2::new(size.width, size.height)
}
