//! How the passes of a frame are drawn: depth alone, and pictures.

use crate::materials::Surface;
use crate::pages::FlatPages;
use crate::part::Part;
use crate::passes::Pass;
use crate::pipelines::{Layouts, Pipelines};
use crate::scene::{Call, GpuScene};
use crate::settings::Transparency;
use crate::target::{Target, depth_attachment};
use crate::timing::{Commands, Stage};

/// Draws the depth of surfaces.
#[derive(Clone, Copy)]
pub(crate) struct Depths<'a> {
    pub(crate) scene: &'a GpuScene,
    pub(crate) layouts: &'a Layouts,
}

impl Depths<'_> {
    /// Draws what a light sees onto a layer of its shadow maps.
    pub(crate) fn shadow_map(
        self,
        commands: &mut Commands,
        pass: Pass<'_>,
        layer: &wgpu::TextureView,
    ) {
        let (encoder, timestamp_writes) = commands.pass(Stage::Shadows);
        let mut encoded = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow map"),
            depth_stencil_attachment: Some(depth_attachment(layer, wgpu::StoreOp::Store)),
            timestamp_writes,
            ..Default::default()
        });
        self.draw(&mut encoded, pass, pass.calls);
    }

    /// Draws the depth that ambient occlusion is found by. Blended surfaces have no part in it: half of
    /// one hides half of what lies behind it, which no single depth tells.
    pub(crate) fn of_pixels(
        self,
        commands: &mut Commands,
        pass: Pass<'_>,
        onto: &wgpu::TextureView,
    ) {
        let (encoder, timestamp_writes) = commands.pass(Stage::Occlusion);
        let mut encoded = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("depth of pixels"),
            depth_stencil_attachment: Some(depth_attachment(onto, wgpu::StoreOp::Store)),
            timestamp_writes,
            ..Default::default()
        });
        let hides = |call: &&Call| self.scene.draw(call).0.surface != Surface::Blended;
        self.draw(&mut encoded, pass, pass.calls.iter().filter(hides));
    }

    fn draw<'c>(
        self,
        encoded: &mut wgpu::RenderPass<'_>,
        pass: Pass<'_>,
        calls: impl IntoIterator<Item = &'c Call>,
    ) {
        let mut last = None;
        for call in calls {
            let (draw, material) = self.scene.draw(call);
            if last != Some(draw.surface) {
                encoded.set_pipeline(self.layouts.depth(draw.surface));
                pass.bind(encoded);
                last = Some(draw.surface);
            }
            if draw.surface != Surface::Solid {
                encoded.set_bind_group(3, &material.group, &[]);
            }
            draw_call(encoded, &draw.part, call);
        }
    }
}

/// Draws surfaces, what lies behind them, and what stands before them.
#[derive(Clone, Copy)]
pub(crate) struct Picture<'a> {
    pub(crate) scene: &'a GpuScene,
    pub(crate) pipelines: &'a Pipelines,
    /// Group 1: what shines.
    pub(crate) light: &'a wgpu::BindGroup,
    /// Group 2: the light of the fields.
    pub(crate) field: &'a wgpu::BindGroup,
    /// Whether the environment is shown.
    pub(crate) background: bool,
    /// The pages that are shown before all, if any.
    pub(crate) pages: Option<&'a FlatPages>,
}

impl Picture<'_> {
    /// Draws what a camera sees.
    pub(crate) fn draw(self, commands: &mut Commands, pass: Pass<'_>, target: &Target) {
        let mut encoded = target.pass(commands);
        pass.bind(&mut encoded);
        encoded.set_bind_group(1, self.light, &[]);
        // What is mixed with the background comes after it.
        let is_mixed = |call: &Call| {
            self.pipelines.variant.transparency == Transparency::Sorted
                && self.scene.draw(call).0.surface == Surface::Blended
        };
        let calls = pass.calls;
        let (drawn, mixed) = calls.split_at(calls.partition_point(|call| !is_mixed(call)));
        // Depth first, so that no solid surface is shaded where another one hides it.
        let is_solid = |call: &&Call| self.scene.draw(call).0.surface == Surface::Solid;
        encoded.set_pipeline(&self.pipelines.first);
        for call in drawn.iter().filter(is_solid) {
            draw_call(&mut encoded, &self.scene.draw(call).0.part, call);
        }
        self.draw_surfaces(&mut encoded, drawn);
        if self.background {
            encoded.set_pipeline(&self.pipelines.background);
            encoded.draw(0..3, 0..1);
        }
        self.draw_surfaces(&mut encoded, mixed);
        if let Some(pages) = self.pages {
            encoded.set_pipeline(&self.pipelines.pages);
            encoded.set_bind_group(2, self.field, &[]);
            pages.draw(&mut encoded);
        }
    }

    fn draw_surfaces(self, encoded: &mut wgpu::RenderPass<'_>, calls: &[Call]) {
        let mut last = None;
        for call in calls {
            let (draw, material) = self.scene.draw(call);
            if last != Some((draw.surface, draw.material)) {
                encoded.set_pipeline(self.pipelines.forward(draw.surface));
                encoded.set_bind_group(2, self.field, &[]);
                encoded.set_bind_group(3, &material.group, &[]);
                last = Some((draw.surface, draw.material));
            }
            draw_call(encoded, &draw.part, call);
        }
    }
}

fn draw_call(encoded: &mut wgpu::RenderPass<'_>, part: &Part, call: &Call) {
    encoded.set_vertex_buffer(0, part.shape.slice(..));
    encoded.set_vertex_buffer(1, part.attributes.slice(..));
    encoded.set_index_buffer(part.indices.slice(..), wgpu::IndexFormat::Uint32);
    encoded.draw_indexed(0..part.index_count, 0, call.instances.clone());
}
