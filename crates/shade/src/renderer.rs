//! The renderer: scene and light in, pictures out.

use std::mem;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use lumencast_gpu::Gpu;
use lumencast_light::Light;
use lumencast_scene::{Snapshot, View};
use lumencast_shaders::layout;

use crate::ShadeError;
use crate::camera::{Camera, Frustum, jitter};
use crate::field::GpuField;
use crate::lights::GpuLights;
use crate::materials::Surface;
use crate::occlusion::{Groups, Occluder};
use crate::pipelines::{Layouts, Pipelines, Variant};
use crate::scene::{Call, GpuScene};
use crate::screen::{Screen, Show};
use crate::settings::{Lighting, Materials, Settings, Shading, Transparency};
use crate::shadows::ShadowPlan;
use crate::target::{Target, depth_attachment};
use crate::timing::{Commands, PassTimes, Stage, Timed};

/// How far patterns turn from one frame of a picture to the next: the golden section fills the circle
/// evenly for any number.
const GOLDEN: f32 = 0.618_034;

/// Draws pictures of a scene under the light of a field.
///
/// ```no_run
/// use lumencast_light::Light;
/// use lumencast_scene::Scene;
/// use lumencast_shade::{Gpu, Renderer, Settings};
///
/// let mut scene = Scene::open("cornell")?;
/// let settings = Settings::default();
/// let mut renderer = Renderer::new(Gpu::new()?, &settings);
/// renderer.set_scene(&scene.snapshot());
/// renderer.set_light(&Light::default())?;
/// let view = scene.cameras()[0].view();
/// let pictures = renderer.pictures(&[view], &settings)?;
/// assert_eq!(pictures[0].len(), 1280 * 720);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Renderer {
    gpu: Gpu,
    layouts: Layouts,
    pipelines: Option<Pipelines>,
    target: Option<Target>,
    scene: GpuScene,
    /// What is on the device, and with which materials.
    shown: Option<(Arc<Snapshot>, Materials)>,
    wanted: Option<Arc<Snapshot>>,
    lights: GpuLights,
    field: GpuField,
    occluder: Occluder,
    /// The shadow maps that are on the device.
    drawn: Option<ShadowPlan>,
}

/// What drawing took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drawn {
    /// Frames that were averaged.
    pub frames: u32,
    /// Samples a pixel of each.
    pub samples: u32,
    /// Shadow maps.
    pub shadow_maps: usize,
    /// Texels along the side of a shadow map.
    pub shadow_resolution: u32,
    /// Lights that cast no shadow, because there is no room for their maps.
    pub lights_without_shadow: usize,
    /// What the device says that it took, of all frames; nothing where it has no clock.
    pub time: Option<PassTimes>,
}

impl Drawn {
    fn of_plan(&mut self, plan: &ShadowPlan) {
        self.shadow_maps = plan.views.len();
        self.shadow_resolution = plan.resolution;
        self.lights_without_shadow = plan.left_out;
    }
}

/// What a frame is of.
#[derive(Clone, Copy)]
struct FrameSettings<'a> {
    snapshot: &'a Snapshot,
    plan: &'a ShadowPlan,
    settings: &'a Settings,
    /// Among the frames of a picture.
    number: u32,
}

/// What the passes of a frame share: group 0, with bytes from one pass's view to the next's.
struct Passes {
    group: wgpu::BindGroup,
    stride: u32,
}

impl Passes {
    /// Binds what pass `number` looks from.
    fn bind(&self, pass: &mut wgpu::RenderPass<'_>, number: u32) {
        pass.set_bind_group(0, &self.group, &[number * self.stride]);
    }
}

impl Renderer {
    /// With an empty scene and no light; of the settings only what holds for textures counts.
    pub fn new(gpu: Gpu, settings: &Settings) -> Self {
        let (lights, field) = (GpuLights::new(&gpu), GpuField::new(&gpu));
        Self {
            layouts: Layouts::new(&gpu, &lights.layout, &field.layout),
            scene: GpuScene::new(&gpu, settings.anisotropy),
            lights,
            field,
            occluder: Occluder::new(&gpu),
            gpu,
            pipelines: None,
            target: None,
            shown: None,
            wanted: None,
            drawn: None,
        }
    }

    /// What it draws with.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Draws this moment of a scene from now on. What it shares with the one before stays on the
    /// device.
    pub fn set_scene(&mut self, snapshot: &Arc<Snapshot>) {
        self.wanted = Some(snapshot.clone());
    }

    /// Takes indirect light from this field from now on, read where its volumes say.
    ///
    /// # Errors
    /// Where it does not fit the device's textures.
    pub fn set_light(&mut self, light: &Light) -> Result<(), ShadeError> {
        self.field.update(&self.gpu, light)
    }

    /// One picture a view, all under the same light: radiance (cd/m²), row by row from the top left.
    /// What does not depend on the view, shadow maps and the field, is drawn once for all.
    ///
    /// # Errors
    /// Where the device fails or the size is none that it draws.
    pub fn pictures(
        &mut self,
        views: &[View],
        settings: &Settings,
    ) -> Result<Vec<Vec<Vec3>>, ShadeError> {
        self.pictures_with(views, settings).map(|(pictures, _)| pictures)
    }

    /// As [`Renderer::pictures`], with what it took.
    ///
    /// # Errors
    /// As there.
    pub fn pictures_with(
        &mut self,
        views: &[View],
        settings: &Settings,
    ) -> Result<(Vec<Vec<Vec3>>, Drawn), ShadeError> {
        self.gpu.check_size(settings.size)?;
        let one_by_one =
            settings.shading == Shading::Samples && !self.gpu.abilities().sample_shading;
        let wanted = if one_by_one { 1 } else { settings.samples.max(1) };
        let samples = self.gpu.samples_at_once(wanted);
        let frames = settings.samples.max(1).div_ceil(samples);
        let mut commands = Commands::new(&self.gpu);
        self.prepare(settings, samples, &mut commands);
        let pixels = settings.size.as_usizevec2().element_product();
        let mut pictures = vec![vec![Vec3::ZERO; pixels]; views.len()];
        let weight = 1.0 / (settings.pre_exposure * frames as f32);
        let mut drawn = Drawn { frames, samples, ..Drawn::default() };
        let Some(snapshot) = self.snapshot() else { return Ok((pictures, drawn)) };
        let camera = |view: &View, moved| {
            Camera::new(&view.relative_to(snapshot.origin), settings.size, moved)
        };
        // The same for all frames, so that its maps are drawn once.
        let still: Vec<Camera> = views.iter().map(|view| camera(view, Vec2::ZERO)).collect();
        let plan = self.shadow_plan(&snapshot, &still, settings);
        for number in 0..frames {
            // Samples of a pixel are spread over strata along both axes; frames move them within.
            let moved = jitter(number, frames) / samples as f32;
            let cameras: Vec<Camera> = views.iter().map(|view| camera(view, moved)).collect();
            let mut copies = Vec::with_capacity(views.len());
            let frame = FrameSettings { snapshot: &snapshot, plan: &plan, settings, number };
            self.frame(&mut commands, frame, &cameras, |gpu, commands, target| {
                copies.push(target.copy(gpu, commands));
            });
            let submitted = mem::replace(&mut commands, Commands::new(&self.gpu));
            let timed = Timed::submit(submitted, &self.gpu);
            for (picture, copy) in pictures.iter_mut().zip(copies) {
                copy.add_to(&self.gpu, picture, weight)?;
            }
            if let Some(timed) = timed {
                *drawn.time.get_or_insert_default() += timed.wait(&self.gpu)?;
            }
        }
        drawn.of_plan(&plan);
        Ok((pictures, drawn))
    }

    /// Draws a view and shows it on a texture of the settings' size, without waiting for it. Of the
    /// samples, no more are drawn than the adapter multisamples at once. What the picture turned out
    /// to be, and what it took, [`Screen::measured`] tells later.
    ///
    /// # Errors
    /// Where the device has failed or the size is none that it draws.
    pub fn show(
        &mut self,
        view: &View,
        settings: &Settings,
        screen: &mut Screen,
        show: Show,
        onto: &wgpu::TextureView,
    ) -> Result<Drawn, ShadeError> {
        self.gpu.check_size(settings.size)?;
        self.gpu.check("showing a picture")?;
        let samples = self.gpu.samples_at_once(settings.samples.max(1));
        let mut commands = Commands::new(&self.gpu);
        self.prepare(settings, samples, &mut commands);
        let mut drawn = Drawn { frames: 1, samples, ..Drawn::default() };
        let Some(snapshot) = self.snapshot() else { return Ok(drawn) };
        let view = view.relative_to(snapshot.origin);
        let cameras = [Camera::new(&view, settings.size, Vec2::ZERO)];
        let plan = self.shadow_plan(&snapshot, &cameras, settings);
        drawn.of_plan(&plan);

        let frame = FrameSettings { snapshot: &snapshot, plan: &plan, settings, number: 0 };
        let mut histogram = None;
        self.frame(&mut commands, frame, &cameras, |gpu, commands, target| {
            let picture = target.picture();
            screen.draw(gpu, commands, picture, settings.pre_exposure, show, onto);
            histogram = screen.measure(gpu, commands, picture);
        });
        let timed = Timed::submit(commands, &self.gpu);
        if let Some(histogram) = histogram {
            screen.submitted(timed, histogram, settings.pre_exposure);
        }
        Ok(drawn)
    }

    fn snapshot(&self) -> Option<Arc<Snapshot>> {
        self.shown.as_ref().map(|(snapshot, _)| snapshot.clone())
    }

    /// Makes ready what the settings ask for; `commands` bring the scene to its moment.
    fn prepare(&mut self, settings: &Settings, samples: u32, commands: &mut Commands) {
        let variant = Variant {
            samples,
            // A pixel of one sample is shaded once either way.
            shading: match samples > 1 && self.gpu.abilities().sample_shading {
                true => settings.shading,
                false => Shading::Pixels,
            },
            transparency: settings.transparency,
            occluded: settings.drawn_occlusion().is_some(),
        };
        if self.pipelines.as_ref().is_none_or(|p| p.variant != variant) {
            self.pipelines = Some(Pipelines::new(&self.gpu, &self.layouts, variant));
        }
        if self.target.as_ref().is_none_or(|target| !target.fits(settings.size, samples)) {
            self.target = Some(Target::new(&self.gpu, settings.size, samples));
        }
        if variant.occluded {
            self.occluder.prepare(&self.gpu, &self.layouts.pass, settings.size);
        }
        let Some(wanted) = &self.wanted else { return };
        self.field.place_about(&self.gpu, wanted.origin);
        let is_shown = |(shown, model): &(Arc<Snapshot>, Materials)| {
            Arc::ptr_eq(shown, wanted) && *model == settings.materials
        };
        if !self.shown.as_ref().is_some_and(is_shown) {
            let layout = &self.layouts.material;
            self.scene.update(&self.gpu, commands, layout, wanted, settings.materials);
            self.shown = Some((wanted.clone(), settings.materials));
            self.drawn = None;
        }
    }

    /// Draws one frame of each camera: shadow maps, then occlusion, surfaces, and what lies behind them.
    /// `taken` is called after each camera's commands, before the next one's overwrite the picture.
    fn frame(
        &mut self,
        commands: &mut Commands,
        FrameSettings { snapshot, plan, settings, number }: FrameSettings<'_>,
        cameras: &[Camera],
        mut taken: impl FnMut(&Gpu, &mut Commands, &Target),
    ) {
        let redraws = self.drawn.as_ref() != Some(plan);

        let mut visible = Vec::new();
        let shadow_calls: Vec<Vec<Call>> = match redraws {
            true => plan.views.iter().map(|view| self.casters(view, &mut visible)).collect(),
            false => Vec::new(),
        };
        let camera_calls: Vec<Vec<Call>> =
            cameras.iter().map(|c| self.seen(c, settings.transparency, &mut visible)).collect();
        let turn = GOLDEN * number as f32;
        let shadows = if redraws { plan.views.as_slice() } else { &[] };
        let views: Vec<layout::View> = shadows
            .iter()
            .map(|view| layout::View {
                clip_from_world: view.clip_from_world,
                ..Default::default()
            })
            .chain(cameras.iter().map(|camera| camera.layout(turn)))
            .collect();
        let occlusion = settings.drawn_occlusion();
        let occlusion = occlusion.and_then(|settings| self.occluder.groups(&self.gpu, settings));
        let passes = self.passes(&views, &visible);

        if redraws {
            let layers = self.lights.shadow_maps(&self.gpu, plan);
            for ((layer, calls), pass) in layers.iter().zip(&shadow_calls).zip(0..) {
                self.draw_shadow_map(commands, &passes, pass, layer, calls);
            }
            self.drawn = Some(plan.clone());
        }
        let frame = frame_layout(settings, self.pipelines.as_ref(), number);
        let light = self.lights.group(&self.gpu, snapshot, plan, frame, &self.occluder);
        for (calls, pass) in camera_calls.iter().zip(shadows.len() as u32..) {
            if let Some(groups) = &occlusion {
                self.draw_occlusion(commands, &passes, pass, calls, groups);
            }
            self.draw_picture(commands, &passes, pass, calls, &light, settings.lighting);
            if let Some(target) = &self.target {
                taken(&self.gpu, commands, target);
            }
        }
    }

    fn shadow_plan(
        &self,
        snapshot: &Snapshot,
        cameras: &[Camera],
        settings: &Settings,
    ) -> ShadowPlan {
        let limits = self.gpu.device().limits();
        let mut shadows = settings.shadows;
        shadows.resolution = shadows.resolution.min(limits.max_texture_dimension_2d);
        if !settings.lighting.direct {
            shadows.resolution = 0;
        }
        let layers = limits.max_texture_array_layers;
        ShadowPlan::new(&snapshot.lights, cameras, &self.scene.bounds, &shadows, layers)
    }

    /// What a shadow map shows.
    fn casters(&self, view: &layout::ShadowView, visible: &mut Vec<u32>) -> Vec<Call> {
        let frustum = Frustum::new(&view.clip_from_world);
        self.scene.calls(&frustum, visible, |_| true)
    }

    /// What a camera shows, in the order in which it is drawn.
    fn seen(
        &self,
        camera: &Camera,
        transparency: Transparency,
        visible: &mut Vec<u32>,
    ) -> Vec<Call> {
        let frustum = Frustum::new(&camera.clip_from_world);
        match transparency {
            Transparency::Coverage => self.scene.calls(&frustum, visible, |_| true),
            Transparency::Sorted => {
                let solid = |surface| surface != Surface::Blended;
                let mut calls = self.scene.calls(&frustum, visible, solid);
                calls.extend(self.scene.sorted_calls(&frustum, camera.eye, visible));
                calls
            }
        }
    }

    /// What passes with these views have in common; `visible`: the instances that they draw.
    fn passes(&self, views: &[layout::View], visible: &[u32]) -> Passes {
        let alignment = self.gpu.device().limits().min_uniform_buffer_offset_alignment;
        let size = size_of::<layout::View>();
        let stride = (size as u32).next_multiple_of(alignment);
        let mut bytes = vec![0; stride as usize * views.len().max(1)];
        for (slot, view) in bytes.chunks_exact_mut(stride as usize).zip(views) {
            slot[..size].copy_from_slice(bytemuck::bytes_of(view));
        }
        let uniform = wgpu::BufferUsages::UNIFORM;
        let storage = wgpu::BufferUsages::STORAGE;
        let views = self.gpu.buffer("views", uniform, &bytes, 0);
        let visible = self.gpu.buffer("visible", storage, bytemuck::cast_slice(visible), 4);
        let view = wgpu::BufferBinding {
            buffer: &views,
            offset: 0,
            size: std::num::NonZeroU64::new(size as u64),
        };
        let resources = [
            wgpu::BindingResource::Buffer(view),
            self.scene.instances.as_entire_binding(),
            visible.as_entire_binding(),
        ];
        let group = self.gpu.group("pass", &self.layouts.pass, &resources);
        Passes { group, stride }
    }

    fn draw_shadow_map(
        &self,
        commands: &mut Commands,
        passes: &Passes,
        number: u32,
        layer: &wgpu::TextureView,
        calls: &[Call],
    ) {
        let (encoder, timestamp_writes) = commands.pass(Stage::Shadows);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow map"),
            depth_stencil_attachment: Some(depth_attachment(layer, wgpu::StoreOp::Store)),
            timestamp_writes,
            ..Default::default()
        });
        self.draw_depth(&mut pass, passes, number, calls);
    }

    /// Draws what a camera's picture is going to read of ambient occlusion. Blended surfaces have no
    /// part in it: half of one hides half of what lies behind it, which no single depth tells.
    fn draw_occlusion(
        &self,
        commands: &mut Commands,
        passes: &Passes,
        number: u32,
        calls: &[Call],
        groups: &Groups,
    ) {
        let (encoder, timestamp_writes) = commands.pass(Stage::Occlusion);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("depth of pixels"),
            depth_stencil_attachment: Some(depth_attachment(
                self.occluder.depth(),
                wgpu::StoreOp::Store,
            )),
            timestamp_writes,
            ..Default::default()
        });
        let solid = |call: &&Call| self.scene.draw(call).0.surface != Surface::Blended;
        self.draw_depth(&mut pass, passes, number, calls.iter().filter(solid));
        drop(pass);
        self.occluder.draw(commands, groups, |pass| passes.bind(pass, number));
    }

    fn draw_depth<'a>(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        passes: &Passes,
        number: u32,
        calls: impl IntoIterator<Item = &'a Call>,
    ) {
        let mut last = None;
        for call in calls {
            let (draw, material) = self.scene.draw(call);
            if last != Some(draw.surface) {
                pass.set_pipeline(self.layouts.depth(draw.surface));
                passes.bind(pass, number);
                last = Some(draw.surface);
            }
            if draw.surface != Surface::Solid {
                pass.set_bind_group(3, &material.group, &[]);
            }
            draw_call(pass, &draw.part, call);
        }
    }

    fn draw_picture(
        &self,
        commands: &mut Commands,
        passes: &Passes,
        number: u32,
        calls: &[Call],
        light: &wgpu::BindGroup,
        lighting: Lighting,
    ) {
        let (Some(target), Some(pipelines)) = (&self.target, &self.pipelines) else { return };
        let mut pass = target.pass(commands);
        passes.bind(&mut pass, number);
        pass.set_bind_group(1, light, &[]);
        // What is mixed with the background comes after it.
        let is_mixed = |call: &Call| {
            pipelines.variant.transparency == Transparency::Sorted
                && self.scene.draw(call).0.surface == Surface::Blended
        };
        let (drawn, mixed) = calls.split_at(calls.partition_point(|call| !is_mixed(call)));
        // Depth first, so that no solid surface is shaded where another one hides it.
        let is_solid = |call: &&Call| self.scene.draw(call).0.surface == Surface::Solid;
        pass.set_pipeline(&pipelines.first);
        for call in drawn.iter().filter(is_solid) {
            draw_call(&mut pass, &self.scene.draw(call).0.part, call);
        }
        self.draw_surfaces(&mut pass, pipelines, drawn);
        if lighting.emission {
            pass.set_pipeline(&pipelines.background);
            pass.draw(0..3, 0..1);
        }
        self.draw_surfaces(&mut pass, pipelines, mixed);
    }

    fn draw_surfaces(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipelines: &Pipelines,
        calls: &[Call],
    ) {
        let mut last = None;
        for call in calls {
            let (draw, material) = self.scene.draw(call);
            if last != Some((draw.surface, draw.material)) {
                pass.set_pipeline(pipelines.forward(draw.surface));
                pass.set_bind_group(2, &self.field.group, &[]);
                pass.set_bind_group(3, &material.group, &[]);
                last = Some((draw.surface, draw.material));
            }
            draw_call(pass, &draw.part, call);
        }
    }
}

fn draw_call(pass: &mut wgpu::RenderPass<'_>, part: &crate::part::Part, call: &Call) {
    pass.set_vertex_buffer(0, part.shape.slice(..));
    pass.set_vertex_buffer(1, part.attributes.slice(..));
    pass.set_index_buffer(part.indices.slice(..), wgpu::IndexFormat::Uint32);
    pass.draw_indexed(0..part.index_count, 0, call.instances.clone());
}

fn frame_layout(settings: &Settings, pipelines: Option<&Pipelines>, number: u32) -> layout::Frame {
    let part = |is: bool, bit: u32| if is { bit } else { 0 };
    let Lighting { emission, direct, indirect } = settings.lighting;
    layout::Frame {
        // Counted where the lights are.
        light_count: 0,
        parts: part(emission, layout::parts::EMISSION)
            | part(direct, layout::parts::DIRECT)
            | part(indirect, layout::parts::INDIRECT),
        filter_samples: settings.shadows.filter_samples.max(1),
        search_samples: settings.shadows.search_samples,
        pre_exposure: settings.pre_exposure,
        sample_count: pipelines.map_or(1, |p| p.variant.samples),
        filter_radius: settings.shadows.filter_radius,
        frame: number,
        occlusion_radius: settings.drawn_occlusion().map_or(0.0, |occlusion| occlusion.radius),
        ..layout::Frame::default()
    }
}
