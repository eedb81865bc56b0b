//! The window's life: events in, frames out.

use std::sync::Arc;
use std::time::{Duration, Instant};

use lumencast_shade::{GpuError, ShadeError};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::window::{Window, WindowId};

use crate::Options;
use crate::error::WindowError;
use crate::stage::Stage;
use crate::surface::{Surface, size_of};
use crate::world::World;

/// Devices that may be lost one after the other, each before it has shown a picture.
const ATTEMPTS: u32 = 3;
/// Before a frame is tried again where none could be shown.
const PAUSE: Duration = Duration::from_millis(50);

/// Shows a world in a window until that is closed. To be called from the program's main thread.
///
/// # Errors
/// Where there is no display or no adapter, or where the device is lost again and again.
pub fn open(world: Box<dyn World>, options: Options) -> Result<(), WindowError> {
    let display = |error: winit::error::EventLoopError| WindowError::Display(reason(&error));
    let events = EventLoop::new().map_err(display)?;
    let mut app = App {
        world: Some(world),
        options,
        began: Instant::now(),
        shown: None,
        showing: false,
        lost: 0,
        failure: None,
    };
    events.run_app(&mut app).map_err(display)?;
    app.failure.map_or(Ok(()), Err)
}

/// What the platform says, without the place in winit's source that its errors begin with: that is a path
/// of the machine where this was built.
fn reason(error: &dyn std::error::Error) -> String {
    let said = error.to_string();
    let place = said.strip_prefix("os error at ").and_then(|rest| rest.split_once(": "));
    place.map_or(said.clone(), |(_, reason)| reason.to_owned())
}

struct App {
    /// Until there is a window.
    world: Option<Box<dyn World>>,
    options: Options,
    began: Instant,
    shown: Option<Shown>,
    /// Whether it has shown a picture.
    showing: bool,
    /// Devices lost since a picture was shown.
    lost: u32,
    failure: Option<WindowError>,
}

/// A window and what is in it.
struct Shown {
    window: Arc<Window>,
    surface: Surface,
    stage: Stage,
    input: egui_winit::State,
}

impl Shown {
    fn new(
        events: &ActiveEventLoop,
        world: Box<dyn World>,
        options: &Options,
    ) -> Result<Self, WindowError> {
        let size = PhysicalSize::new(options.size.x, options.size.y);
        let attributes = Window::default_attributes()
            .with_title(format!("{} – Lumencast", world.name()))
            .with_inner_size(size);
        let window = events
            .create_window(attributes)
            .map_err(|error| WindowError::Display(reason(&error)))?;
        let window = Arc::new(window);
        let (surface, gpu) = Surface::new(&window, events.owned_display_handle())?;
        let stage = Stage::new(gpu, surface.format(), world, options);
        let input = input(&stage, &window);
        Ok(Self { window, surface, stage, input })
    }

    /// Goes on with another device.
    fn restore(&mut self, events: &ActiveEventLoop) -> Result<(), WindowError> {
        let (surface, gpu) = Surface::new(&self.window, events.owned_display_handle())?;
        self.stage.restore(gpu, surface.format());
        self.surface = surface;
        self.input = input(&self.stage, &self.window);
        Ok(())
    }

    /// Draws a frame; whether there was anything to draw it on.
    fn frame(&mut self, now: f64) -> Result<bool, WindowError> {
        if size_of(&self.window).min_element() == 0 {
            return Ok(false);
        }
        self.surface.resize(self.stage.gpu(), size_of(&self.window));
        let Some(texture) = self.surface.next(self.stage.gpu())? else { return Ok(false) };
        let view = texture.texture.create_view(&Default::default());
        let input = self.input.take_egui_input(&self.window);
        let output = self.stage.frame(now, input, self.surface.size(), &view)?;
        self.input.handle_platform_output(&self.window, output);
        self.window.pre_present_notify();
        self.stage.gpu().queue().present(texture);
        Ok(true)
    }
}

fn input(stage: &Stage, window: &Window) -> egui_winit::State {
    let id = egui::ViewportId::ROOT;
    let largest = stage.gpu().device().limits().max_texture_dimension_2d as usize;
    egui_winit::State::new(stage.context().clone(), id, window, None, None, Some(largest))
}

impl App {
    /// Ends with a failure.
    fn fail(&mut self, events: &ActiveEventLoop, error: WindowError) {
        self.failure = Some(error);
        events.exit();
    }

    fn redraw(&mut self, events: &ActiveEventLoop) {
        let now = self.began.elapsed().as_secs_f64();
        let Some(shown) = &mut self.shown else { return };
        match shown.frame(now) {
            Ok(true) => {
                if !std::mem::replace(&mut self.showing, true) {
                    tracing::debug!("the window shows a picture");
                }
                self.lost = 0;
                events.set_control_flow(ControlFlow::Poll);
                shown.window.request_redraw();
            }
            Ok(false) => events.set_control_flow(ControlFlow::wait_duration(PAUSE)),
            Err(WindowError::Shade(ShadeError::Gpu(GpuError::Failed { during, reason })))
                if self.lost < ATTEMPTS =>
            {
                tracing::warn!(during, reason, "the graphics device is made anew");
                self.lost += 1;
                match shown.restore(events) {
                    Ok(()) => shown.window.request_redraw(),
                    Err(error) => self.fail(events, error),
                }
            }
            Err(error) => self.fail(events, error),
        }
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let Some(world) = self.world.take() else { return };
        match Shown::new(events, world, &self.options) {
            Ok(shown) => {
                shown.window.request_redraw();
                self.shown = Some(shown);
            }
            Err(error) => self.fail(events, error),
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(shown) = &mut self.shown else { return };
        if event == WindowEvent::RedrawRequested {
            self.redraw(events);
            return;
        }
        // What it asks for comes with the next frame, which is never far.
        let _ = shown.input.on_window_event(&shown.window, &event);
        if matches!(event, WindowEvent::CloseRequested | WindowEvent::Destroyed) {
            events.exit();
        }
    }

    fn about_to_wait(&mut self, _: &ActiveEventLoop) {
        if let Some(shown) = &self.shown {
            shown.window.request_redraw();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_tell_no_place_in_the_source() {
        let said = [
            ("os error at /home/builder/winit/src/linux/mod.rs:765: no display", "no display"),
            ("os error at C:\\winit\\src\\mod.rs:7: a: b", "a: b"),
            ("it is not supported", "it is not supported"),
        ];
        for (error, told) in said {
            assert_eq!(reason(&std::io::Error::other(error)), told);
        }
    }
}
