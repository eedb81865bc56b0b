//! The panel: what people set, and what they read.

use std::ops::RangeInclusive;

use egui::{ComboBox, Grid, Label, RichText, Slider, Ui};
use lumencast_light::Offset;
use lumencast_picture::ToneMap;
use lumencast_shade::{Lighting, Occlusion, Settings, Shading, Transparency};

use crate::camera::Steering;
use crate::exposure::Exposure;

/// What people set.
#[derive(Clone, Debug, PartialEq)]
pub struct Controls {
    /// How pictures are drawn; size and pre-exposure are the window's business.
    pub settings: Settings,
    /// Where in front of surfaces light is read, where that is elsewhere than the light says.
    pub offset: Option<Offset>,
    /// Band at which a Hann window against ringing ends, where there is one.
    pub window: Option<f32>,
    /// From linear light to the display.
    pub tone_map: ToneMap,
    /// How bright.
    pub exposure: Exposure,
    /// Whether the panel is shown.
    pub panel: bool,
}

/// What people read.
#[derive(Clone, Debug, Default)]
pub(crate) struct Facts {
    /// Names of the cameras.
    pub cameras: Vec<String>,
    /// Whether animations run, where they can be stopped.
    pub plays: Option<bool>,
    /// Names and values, by heading.
    pub groups: Vec<(&'static str, Vec<(&'static str, String)>)>,
    /// What draws.
    pub adapter: String,
    /// What they should know.
    pub notices: Vec<String>,
}

/// What people asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Asked {
    /// To look from a camera of the scene.
    pub camera: Option<usize>,
    /// To let animations run or stand.
    pub plays: Option<bool>,
    /// A picture of this moment, saved.
    pub screenshot: bool,
}

/// What pointer and keys do.
const HELP: &str = "Drag: turn. Right drag: pan. Wheel: nearer. W A S D, Q E: walk, with Shift faster. \
     1 2 3: direct light, indirect, both. O, F: orbit, fly. X: automatic exposure. P: screenshot. \
     H: this panel.";
/// Samples a pixel that can be chosen.
const SAMPLES: [u32; 4] = [1, 2, 4, 8];
/// Sides of shadow maps that can be chosen.
const SHADOWS: [u32; 5] = [0, 512, 1024, 2048, 4096];

/// How strong indirect light can be made.
const STRENGTH: RangeInclusive<f32> = 0.0..=4.0;
/// How far occlusion can be made to reach, metres.
const RADIUS: RangeInclusive<f32> = 0.01..=2.0;

/// Shows the panel.
pub(crate) fn show(
    ui: &mut Ui,
    controls: &mut Controls,
    steering: &mut Steering,
    facts: &Facts,
) -> Asked {
    let mut asked = Asked::default();
    ui.horizontal_wrapped(|ui| {
        let lighting = &mut controls.settings.lighting;
        ui.checkbox(&mut lighting.direct, "Direct");
        ui.checkbox(&mut lighting.indirect, "Indirect");
        ui.checkbox(&mut lighting.emission, "Emission");
    });
    let strengths = &mut controls.settings.strengths;
    ui.add(Slider::new(&mut strengths.still, STRENGTH).text("indirect, on what is still"));
    ui.add(Slider::new(&mut strengths.moving, STRENGTH).text("indirect, on what moves"));
    ui.separator();
    exposure(ui, &mut controls.exposure);
    choice(ui, "Tone map", &mut controls.tone_map, &ToneMap::ALL, |map| map.to_string());
    ui.separator();

    ui.horizontal_wrapped(|ui| {
        ui.label("Camera");
        for (index, name) in facts.cameras.iter().enumerate() {
            if ui.button(name).clicked() {
                asked.camera = Some(index);
            }
        }
    });
    ui.horizontal(|ui| {
        ui.radio_value(steering, Steering::Orbit, "Orbit");
        ui.radio_value(steering, Steering::Fly, "Fly");
    });
    ui.horizontal(|ui| {
        if let Some(plays) = facts.plays
            && ui.button(if plays { "Pause" } else { "Play" }).clicked()
        {
            asked.plays = Some(!plays);
        }
        asked.screenshot = ui.button("Screenshot").clicked();
    });
    ui.separator();
    ui.collapsing("Drawing", |ui| drawing(ui, controls));
    for (heading, facts) in &facts.groups {
        ui.separator();
        table(ui, heading, facts);
    }
    ui.separator();
    for text in [&facts.adapter, HELP] {
        ui.add(Label::new(RichText::new(text).weak()).wrap());
    }
    asked
}

fn exposure(ui: &mut Ui, exposure: &mut Exposure) {
    ui.horizontal(|ui| {
        ui.label("Exposure");
        ui.checkbox(&mut exposure.auto, "automatic");
    });
    let slider = match exposure.auto {
        true => Slider::new(&mut exposure.compensation, Exposure::COMPENSATION),
        false => Slider::new(&mut exposure.stops, Exposure::STOPS),
    };
    ui.add(slider.suffix(" stops").fixed_decimals(1));
}

fn drawing(ui: &mut Ui, controls: &mut Controls) {
    let settings = &mut controls.settings;
    choice(ui, "Samples a pixel", &mut settings.samples, &SAMPLES, u32::to_string);
    let shadings = [Shading::Pixels, Shading::Samples];
    choice(ui, "Shading", &mut settings.shading, &shadings, |shading| match shading {
        Shading::Pixels => "once a pixel".into(),
        Shading::Samples => "once a sample".into(),
    });
    let transparencies = [Transparency::Coverage, Transparency::Sorted];
    choice(ui, "Transparency", &mut settings.transparency, &transparencies, |how| match how {
        Transparency::Coverage => "coverage".into(),
        Transparency::Sorted => "sorted".into(),
    });
    ui.checkbox(&mut settings.checkers, "Lumels as a checkerboard");
    let shadows = &mut settings.shadows;
    choice(ui, "Shadow maps", &mut shadows.resolution, &SHADOWS, |side| match side {
        0 => "none".into(),
        side => format!("{side}²"),
    });
    ui.add(Slider::new(&mut shadows.filter_samples, 1..=64).text("PCF samples"));
    ui.add(Slider::new(&mut shadows.search_samples, 0..=64).text("PCSS samples"));
    occlusion(ui, &mut settings.occlusion);
    let offsets = [
        None,
        Some(Offset::NONE),
        Some(Offset::Cells(0.125)),
        Some(Offset::HALF_CELL),
        Some(Offset::Metres(0.1)),
    ];
    choice(ui, "Light is read", &mut controls.offset, &offsets, |offset| match offset {
        None => "where it says".into(),
        Some(Offset::NONE) => "at the surface".into(),
        Some(Offset::HALF_CELL) => "half a cell off it".into(),
        Some(Offset::Cells(cells)) => format!("{cells} cells off it"),
        Some(Offset::Metres(metres)) => format!("{metres} m off it"),
    });
    let windows = [None, Some(5.0), Some(4.0), Some(3.0)];
    choice(ui, "Window of harmonics", &mut controls.window, &windows, |window| match window {
        None => "none".into(),
        Some(width) => format!("Hann, to band {width}"),
    });
}

fn occlusion(ui: &mut Ui, occlusion: &mut Option<Occlusion>) {
    let mut is_drawn = occlusion.is_some();
    if ui.checkbox(&mut is_drawn, "Ambient occlusion").changed() {
        *occlusion = is_drawn.then(Occlusion::default);
    }
    if let Some(Occlusion { radius, directions, steps }) = occlusion {
        ui.add(Slider::new(radius, RADIUS).logarithmic(true).suffix(" m").text("reach"));
        ui.add(Slider::new(directions, 1..=8).text("directions"));
        ui.add(Slider::new(steps, 1..=16).text("steps"));
    }
}

/// One of several values.
fn choice<T: PartialEq + Clone>(
    ui: &mut Ui,
    label: &str,
    value: &mut T,
    all: &[T],
    name: impl Fn(&T) -> String,
) {
    ComboBox::from_label(label).selected_text(name(value)).show_ui(ui, |ui| {
        for each in all {
            ui.selectable_value(value, each.clone(), name(each));
        }
    });
}

fn table(ui: &mut Ui, heading: &str, facts: &[(&'static str, String)]) {
    Grid::new(heading).num_columns(2).show(ui, |ui| {
        for (name, value) in facts {
            ui.weak(*name);
            ui.monospace(value);
            ui.end_row();
        }
    });
}

/// Follows the keys that are pressed.
pub(crate) fn keys(
    context: &egui::Context,
    controls: &mut Controls,
    steering: &mut Steering,
) -> Asked {
    use egui::Key;
    let mut asked = Asked::default();
    if context.egui_wants_keyboard_input() {
        return asked;
    }
    let pressed = |key| context.input(|input| input.key_pressed(key));
    for (key, lighting) in [
        (Key::Num1, Lighting::DIRECT),
        (Key::Num2, Lighting::INDIRECT),
        (Key::Num3, Lighting::FIELD),
    ] {
        if pressed(key) {
            controls.settings.lighting = lighting;
        }
    }
    if pressed(Key::O) {
        *steering = Steering::Orbit;
    }
    if pressed(Key::F) {
        *steering = Steering::Fly;
    }
    if pressed(Key::X) {
        controls.exposure.auto = !controls.exposure.auto;
    }
    if pressed(Key::H) {
        controls.panel = !controls.panel;
    }
    asked.screenshot = pressed(Key::P);
    asked
}
