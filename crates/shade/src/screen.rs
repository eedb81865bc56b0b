//! Pictures shown on a screen, without a detour by the processor: exposed and tone mapped on the
//! device, and measured there, so that the next one can be exposed as it needs.

use std::collections::VecDeque;

use lumencast_gpu::{Gpu, Readback, bindings};
use lumencast_picture::ToneMap;
use lumencast_shaders::layout;
use lumencast_shaders::layout::tone;
use lumencast_shaders::screen;

use crate::ShadeError;
use crate::meter::{Meter, exposure};
use crate::timing::{Commands, PassTimes, Stage, Timed};

/// Frames that may be under way; more are not measured.
const UNDER_WAY: usize = 3;
/// The step between two codes of eight bits.
const STEP: f32 = 1.0 / 255.0;

/// Shows pictures on textures of one format, which take display codes as they are (`Unorm`, not
/// `UnormSrgb`).
#[derive(Debug)]
pub struct Screen {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
    meter: Meter,
    under_way: VecDeque<UnderWay>,
}

/// A frame that was submitted and is not yet known to be done.
#[derive(Debug)]
struct UnderWay {
    histogram: Readback,
    timed: Option<Timed>,
    pre_exposure: f32,
}

/// What a frame turned out to be, some time after it was submitted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured {
    /// The factor on radiance that would have suited it, as in the page: the middle of its luminances
    /// becomes middle grey (0.2), unless that would burn out more than a few per cent of it. Nothing
    /// where it is (nearly) black.
    pub exposure: Option<f32>,
    /// What it took; nothing where the device has no clock.
    pub time: Option<PassTimes>,
}

/// How a picture is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Show {
    /// Factor on radiance; of 1 over the luminance that is to be white. Best also the pre-exposure
    /// of the picture's settings, so that halves are finest where it matters.
    pub exposure: f32,
    /// From linear colour to codes.
    pub tone_map: ToneMap,
}

impl Screen {
    /// Shows pictures on textures of a format.
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Self {
        let types = [bindings::UNIFORM, bindings::PICTURE];
        let layout = gpu.group_layout("screen", wgpu::ShaderStages::FRAGMENT, &types);
        let pipeline_layout = gpu.pipeline_layout("screen", &[Some(&layout)]);
        let module = gpu.shader("screen", screen());
        let pipeline = gpu.device().create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("screen"),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("screen_vertex"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("screen_fragment"),
                compilation_options: Default::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { layout, pipeline, meter: Meter::new(gpu), under_way: VecDeque::new() }
    }

    /// Draws a picture onto a texture of its size. Exposure is relative to what the picture has already.
    pub(crate) fn draw(
        &self,
        gpu: &Gpu,
        commands: &mut Commands,
        picture: &wgpu::TextureView,
        show: Show,
        onto: &wgpu::TextureView,
    ) {
        let screen = layout::Screen {
            factor: show.exposure,
            tone_map: number(show.tone_map),
            step: STEP,
            _pad: 0,
        };
        let uniform = wgpu::BufferUsages::UNIFORM;
        let screen = gpu.buffer("screen", uniform, bytemuck::bytes_of(&screen), 0);
        let picture = wgpu::BindingResource::TextureView(picture);
        let group = gpu.group("screen", &self.layout, &[screen.as_entire_binding(), picture]);
        let color = wgpu::RenderPassColorAttachment {
            view: onto,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                store: wgpu::StoreOp::Store,
            },
        };
        let (encoder, timestamp_writes) = commands.pass(Stage::Screen);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("screen"),
            color_attachments: &[Some(color)],
            timestamp_writes,
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }

    /// Measures a picture, unless too many are on their way.
    pub(crate) fn measure(
        &self,
        gpu: &Gpu,
        commands: &mut Commands,
        picture: &wgpu::TextureView,
    ) -> Option<wgpu::Buffer> {
        let is_free = self.under_way.len() < UNDER_WAY;
        is_free.then(|| self.meter.measure(gpu, commands, picture))
    }

    /// Waits for a frame that has been submitted.
    pub(crate) fn submitted(
        &mut self,
        timed: Option<Timed>,
        histogram: wgpu::Buffer,
        pre_exposure: f32,
    ) {
        // Its timestamps are asked for before it, so that they are there when it is.
        let histogram = Readback::begin(histogram);
        self.under_way.push_back(UnderWay { histogram, timed, pre_exposure });
    }

    /// What the oldest frame that is done turned out to be, once for each; nothing while the device
    /// is busy with them all.
    ///
    /// # Errors
    /// Where the device has failed.
    pub fn measured(&mut self, gpu: &Gpu) -> Result<Option<Measured>, ShadeError> {
        const DURING: &str = "measuring a picture";
        gpu.poll(DURING)?;
        let Some(first) = self.under_way.front() else { return Ok(None) };
        let Some(histogram) = first.histogram.take(DURING)? else { return Ok(None) };
        let exposure = exposure(bytemuck::cast_slice(&histogram)).map(|e| e * first.pre_exposure);
        drop(histogram);
        let time = first.timed.as_ref().map_or(Ok(None), |timed| timed.take(gpu))?;
        self.under_way.pop_front();
        Ok(Some(Measured { exposure, time }))
    }
}

fn number(tone_map: ToneMap) -> u32 {
    match tone_map {
        ToneMap::Gamma => tone::GAMMA,
        ToneMap::Srgb => tone::SRGB,
        ToneMap::Reinhard => tone::REINHARD,
        ToneMap::Filmic => tone::FILMIC,
        ToneMap::Neutral => tone::NEUTRAL,
    }
}
