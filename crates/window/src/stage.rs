//! A frame of the window, without the window: input in, picture and panel out, on any texture.

use std::path::{Path, PathBuf};

use egui::{Color32, Panel, PlatformOutput, RawInput, Rect, Sense, Ui};
use egui_wgpu::ScreenDescriptor;
use glam::UVec2;
use lumencast_light::Offset;
use lumencast_picture::Picture;
use lumencast_scene::{Aabb, View};
use lumencast_shade::{Drawn, Gpu, LumelLook, PassTimes, Renderer, Screen, Settings, Show, wgpu};

use crate::Options;
use crate::camera::Camera;
use crate::error::WindowError;
use crate::panel::{self, Asked, Controls, Facts};
use crate::statistics::Frames;
use crate::world::World;

/// Width of the panel, points.
const PANEL: f32 = 300.0;
/// Samples a pixel of screenshots.
const SCREENSHOT_SAMPLES: u32 = 16;
/// Seconds for which it is told that a picture was saved.
const TOLD: f64 = 4.0;

/// All that makes up a window's picture but the window.
pub struct Stage {
    world: Box<dyn World>,
    camera: Camera,
    controls: Controls,
    context: egui::Context,
    device: Device,
    /// How the light that the device has is read.
    lit: Option<(Option<Offset>, Option<f32>)>,
    frames: Frames,
    drawn: Drawn,
    time: Option<PassTimes>,
    /// When exposure was measured last.
    metered: f64,
    screenshots: PathBuf,
    /// What was saved last, and when.
    saved: Option<(String, f64)>,
}

/// What is lost with a device.
struct Device {
    renderer: Renderer,
    screen: Screen,
    interface: egui_wgpu::Renderer,
}

impl Device {
    fn new(gpu: Gpu, format: wgpu::TextureFormat, settings: &Settings) -> Self {
        let screen = Screen::new(&gpu, format);
        let options = egui_wgpu::RendererOptions::default();
        let interface = egui_wgpu::Renderer::new(gpu.device(), format, options);
        Self { renderer: Renderer::new(gpu, settings), screen, interface }
    }
}

impl Stage {
    /// Draws a world onto textures of a format that takes display codes as they are.
    pub fn new(
        gpu: Gpu,
        format: wgpu::TextureFormat,
        world: Box<dyn World>,
        options: &Options,
    ) -> Self {
        let (center, extent) = middle(&world.bounds());
        let view = options.view.or_else(|| Some(world.views().first()?.view));
        let view = view.unwrap_or_else(|| View::overview(&world.bounds()));
        Self {
            camera: Camera::new(&view, center, extent),
            world,
            device: Device::new(gpu, format, &options.controls.settings),
            controls: options.controls.clone(),
            context: egui::Context::default(),
            lit: None,
            frames: Frames::default(),
            drawn: Drawn::default(),
            time: None,
            metered: 0.0,
            screenshots: options.screenshots.clone(),
            saved: None,
        }
    }

    /// Goes on with another device, after the one before was lost.
    pub fn restore(&mut self, gpu: Gpu, format: wgpu::TextureFormat) {
        self.device = Device::new(gpu, format, &self.controls.settings);
        self.lit = None;
        // It hands on what has changed, and the new device has nothing.
        self.context = egui::Context::default();
    }

    /// What the panel is made with.
    pub fn context(&self) -> &egui::Context {
        &self.context
    }

    /// What it draws with.
    pub fn gpu(&self) -> &Gpu {
        self.device.renderer.gpu()
    }

    /// The name of what is shown.
    pub fn name(&self) -> &str {
        self.world.name()
    }

    /// What people have set.
    pub fn controls(&self) -> &Controls {
        &self.controls
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// One frame at `now` seconds, onto a texture of `size` pixels.
    ///
    /// Where there is nothing to draw onto, as in a window of no size, time goes on and that is all.
    ///
    /// # Errors
    /// Where the device has failed, or a screenshot cannot be saved.
    pub fn frame(
        &mut self,
        now: f64,
        input: RawInput,
        size: UVec2,
        onto: &wgpu::TextureView,
    ) -> Result<PlatformOutput, WindowError> {
        let seconds = self.frames.begin(now);
        self.meter(now)?;
        self.world.update(now, self.camera.eye());
        if size.min_element() == 0 {
            return Ok(PlatformOutput::default());
        }
        let facts = self.facts(size);
        let context = self.context.clone();
        let mut asked = Asked::default();
        let mut output = context.run_ui(input, |ui| asked = self.interface(ui, &facts, seconds));
        let unused = self.take_textures(&mut output.textures_delta);

        if let Some(plays) = asked.plays {
            self.world.play(plays);
        }
        if let Some(named) = asked.camera.and_then(|number| self.world.views().get(number)) {
            self.camera.jump(&named.view, middle(&self.world.bounds()).0);
        }
        self.draw(size, onto)?;
        self.draw_interface(&context, output.shapes, size, onto);
        unused.iter().for_each(|id| self.device.interface.free_texture(id));
        if asked.screenshot {
            self.screenshot_beside(now, size)?;
        }
        Ok(output.platform_output)
    }

    /// Takes in what frames before turned out to be.
    fn meter(&mut self, now: f64) -> Result<(), WindowError> {
        let Device { renderer, screen, .. } = &mut self.device;
        while let Some(measured) = screen.measured(renderer.gpu())? {
            let Controls { exposure, settings, .. } = &mut self.controls;
            // What lumels are looked into by is as bright at any exposure: none would suit it.
            let is_light = settings.look == LumelLook::Light && !settings.pages;
            if is_light || !exposure.is_known() {
                exposure.measured(measured.exposure, (now - self.metered) as f32);
            }
            self.metered = now;
            self.time = measured.time;
        }
        if self.saved.as_ref().is_some_and(|(_, at)| now - at > TOLD) {
            self.saved = None;
        }
        Ok(())
    }

    /// The panel, and what is done on the picture beside it.
    fn interface(&mut self, ui: &mut Ui, facts: &Facts, seconds: f64) -> Asked {
        let Self { controls, camera, .. } = self;
        let mut asked = panel::keys(ui.ctx(), controls, &mut camera.steering);
        if controls.panel {
            let frame = egui::Frame::side_top_panel(ui.style())
                .fill(Color32::from_black_alpha(200))
                .inner_margin(12.0);
            Panel::right("panel").exact_size(PANEL).frame(frame).show(ui, |ui| {
                egui::ScrollArea::vertical().show(ui, |ui| {
                    let clicked = panel::show(ui, controls, &mut camera.steering, facts);
                    asked = Asked { screenshot: asked.screenshot || clicked.screenshot, ..clicked };
                });
            });
        }
        let picture = ui.available_rect_before_wrap();
        let response = ui.interact(picture, ui.scope_id().with("picture"), Sense::click_and_drag());
        camera.steer(&response, seconds as f32);
        show_notices(ui, picture, &facts.notices);
        asked
    }

    fn facts(&self, size: UVec2) -> Facts {
        let milliseconds = |seconds: f64| format!("{:.1} ms", 1e3 * seconds);
        let mut frame = Vec::new();
        if let Some(rate) = self.frames.rate() {
            let longest = self.frames.longest().map(milliseconds).unwrap_or_default();
            frame.push(("frames", format!("{rate:.1} a second")));
            frame.push(("longest", longest));
        }
        if let Some(time) = self.time {
            if time.deformation > 0.0 {
                frame.push(("skins, morphs", milliseconds(time.deformation)));
            }
            frame.push(("shadow maps", milliseconds(time.shadows)));
            if self.controls.settings.occlusion.is_some() {
                frame.push(("occlusion", milliseconds(time.occlusion)));
            }
            frame.push(("picture", milliseconds(time.pictures)));
            frame.push(("screen", milliseconds(time.screen)));
        }
        frame.push(("size", format!("{} × {}", size.x, size.y)));
        frame.push(("samples", self.drawn.samples.to_string()));
        frame.push((
            "shadows",
            format!("{} of {}²", self.drawn.shadow_maps, self.drawn.shadow_resolution),
        ));
        let mut notices: Vec<String> = self.world.notice().into_iter().collect();
        let missing = self.settings(size).missing(self.gpu().abilities());
        notices.extend(missing.into_iter().map(|what| format!("{what}.")));
        if self.drawn.lights_without_shadow > 0 {
            let count = self.drawn.lights_without_shadow;
            notices
                .push(format!("{count} lights cast no shadow: there is no room for their maps."));
        }
        notices.extend(self.saved.as_ref().map(|(name, _)| format!("Saved {name}")));
        Facts {
            cameras: self.world.views().iter().map(|named| named.name.clone()).collect(),
            plays: self.world.plays(),
            groups: vec![("Light", self.world.facts()), ("Frames", frame)],
            adapter: self.gpu().name(),
            notices,
        }
    }

    /// The picture's settings at a size.
    fn settings(&self, size: UVec2) -> Settings {
        let pre_exposure = self.controls.exposure.factor();
        Settings { size, pre_exposure, ..self.controls.settings }
    }

    fn draw(&mut self, size: UVec2, onto: &wgpu::TextureView) -> Result<(), WindowError> {
        let settings = self.settings(size);
        let show = Show { exposure: settings.pre_exposure, tone_map: self.controls.tone_map };
        let Device { renderer, screen, .. } = &mut self.device;
        renderer.set_scene(&self.world.snapshot());
        let wanted = (self.controls.offset, self.controls.window);
        let mut taken = Ok(());
        self.world.light(self.lit != Some(wanted), &mut |light| {
            taken = match wanted {
                (None, None) => renderer.set_light(light),
                (offset, window) => renderer.set_light(&light.clone().seen(offset, window)),
            };
        });
        taken?;
        self.lit = Some(wanted);
        if settings.look == LumelLook::Age {
            renderer.set_lumel_ages(self.world.lumel_ages());
        }
        self.drawn = renderer.show(&self.camera.view(), &settings, screen, show, onto)?;
        // Those who draw the panel do not expect a device that is gone.
        renderer.gpu().poll("drawing")?;
        Ok(())
    }

    fn draw_interface(
        &mut self,
        context: &egui::Context,
        shapes: Vec<egui::epaint::ClippedShape>,
        size: UVec2,
        onto: &wgpu::TextureView,
    ) {
        let pixels_per_point = context.pixels_per_point();
        let jobs = context.tessellate(shapes, pixels_per_point);
        let screen = ScreenDescriptor { size_in_pixels: size.to_array(), pixels_per_point };
        let Device { renderer, interface, .. } = &mut self.device;
        let (device, queue) = (renderer.gpu().device(), renderer.gpu().queue());
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut commands = interface.update_buffers(device, queue, &mut encoder, &jobs, &screen);
        let color = wgpu::RenderPassColorAttachment {
            view: onto,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
        };
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("panel"),
            color_attachments: &[Some(color)],
            ..Default::default()
        });
        interface.render(&mut pass.forget_lifetime(), &jobs, &screen);
        commands.push(encoder.finish());
        queue.submit(commands);
    }

    /// Uploads the panel's textures that have changed; returns those that this frame uses last.
    fn take_textures(&mut self, changes: &mut egui::TexturesDelta) -> Vec<egui::TextureId> {
        let Device { renderer, interface, .. } = &mut self.device;
        let (device, queue) = (renderer.gpu().device(), renderer.gpu().queue());
        for (id, deltas) in changes.set.drain() {
            deltas.iter().for_each(|delta| interface.update_texture(device, queue, id, delta));
        }
        changes.free.drain().collect()
    }

    /// What people should know of the world.
    pub(crate) fn notice(&self) -> String {
        self.world.notice().unwrap_or_default()
    }

    /// Whether light has come and has settled.
    pub(crate) fn has_settled_light(&self) -> bool {
        self.world.is_settled()
    }

    /// Whether what is seen is what is meant: light has settled and exposure is known.
    pub fn is_settled(&self) -> bool {
        self.has_settled_light() && self.controls.exposure.is_known()
    }

    /// Saves the picture without the panel, smoother than it is shown.
    ///
    /// # Errors
    /// Where the device has failed, or the file cannot be written.
    pub fn screenshot(&mut self, size: UVec2, file: &Path) -> Result<(), WindowError> {
        let settings = Settings { samples: SCREENSHOT_SAMPLES, ..self.settings(size) };
        let pictures = self.device.renderer.pictures(&[self.camera.view()], &settings)?;
        let Some(pixels) = pictures.into_iter().next() else { return Ok(()) };
        let picture = Picture::new(size.x, size.y, pixels)?;
        picture.write_png(file, self.controls.tone_map, settings.pre_exposure)?;
        Ok(())
    }

    /// Under a name that is not taken yet.
    fn screenshot_beside(&mut self, now: f64, size: UVec2) -> Result<(), WindowError> {
        let name = |i: u32| self.screenshots.join(format!("{}-{i}.png", self.world.name()));
        let Some(file) = (1..).map(name).find(|file| !file.exists()) else { return Ok(()) };
        let told = match self.screenshot(size, &file) {
            Ok(()) => format!("{}", file.display()),
            // Nothing to end the window for.
            Err(WindowError::Picture(error)) => format!("nothing: {error}"),
            Err(error) => return Err(error),
        };
        self.saved = Some((told, now));
        Ok(())
    }
}

/// Writes notices over the upper left of the picture.
fn show_notices(ui: &Ui, picture: Rect, notices: &[String]) {
    const MARGIN: f32 = 12.0;
    const PADDING: f32 = 6.0;
    let mut at = picture.left_top() + egui::Vec2::splat(MARGIN);
    let width = (picture.width() - 2.0 * MARGIN).max(0.0);
    for notice in notices {
        let font = egui::FontId::proportional(15.0);
        let text = ui.painter().layout(notice.clone(), font, Color32::WHITE, width);
        let around = Rect::from_min_size(at, text.size()).expand(PADDING);
        ui.painter().rect_filled(around, 4.0, Color32::from_black_alpha(180));
        ui.painter().galley(at, text, Color32::WHITE);
        at.y = around.bottom() + MARGIN;
    }
}

/// The middle of a box, and the length of its diagonal.
fn middle(bounds: &Aabb) -> (glam::Vec3, f32) {
    if bounds.is_empty() {
        return (glam::Vec3::ZERO, 1.0);
    }
    (0.5 * (bounds.min + bounds.max), bounds.min.distance(bounds.max).max(1e-3))
}
