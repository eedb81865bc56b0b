//! The panel: what people set, and what they read.

use std::ops::RangeInclusive;

use egui::{ComboBox, Grid, Label, RichText, Slider, Ui};
use lumencast_light::Offset;
use lumencast_picture::ToneMap;
use lumencast_shade::{Lighting, LumelLook, Occlusion, Settings, Shading, Transparency};

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
    for (strength, name, hint) in [
        (&mut strengths.still, "Static", "Strength of indirect light, on what stands still"),
        (&mut strengths.moving, "Dynamic", "Strength of indirect light, on what moves"),
    ] {
        ui.add(Slider::new(strength, STRENGTH).text(name)).on_hover_text(hint);
    }
    lumels(ui, &mut controls.settings);
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

/// What one looks into lumels by, in the page's words.
fn lumels(ui: &mut Ui, settings: &mut Settings) {
    let looks = [LumelLook::Light, LumelLook::Lumels, LumelLook::Age];
    choice(ui, "Show", &mut settings.look, &looks, |look| match look {
        LumelLook::Light => "Light".into(),
        LumelLook::Lumels => "Lumels, one square each".into(),
        LumelLook::Age => "Age, green to red".into(),
    });
    ui.checkbox(&mut settings.pages, "Pages").on_hover_text("Show the pages that lumels lie on");
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

#[cfg(test)]
impl Controls {
    /// The usual settings, with the panel or without.
    pub(crate) fn usual(panel: bool) -> Self {
        Self {
            settings: Settings::default(),
            offset: None,
            window: None,
            tone_map: ToneMap::Srgb,
            exposure: Exposure::new(None),
            panel,
        }
    }
}

#[cfg(test)]
mod tests {
    use egui::{Event, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape, pos2};

    use super::*;

    /// A panel, and a clock.
    struct Panel {
        context: egui::Context,
        controls: Controls,
        now: f64,
    }

    impl Panel {
        fn new() -> Self {
            let controls = Controls::usual(true);
            Self { context: egui::Context::default(), controls, now: 0.0 }
        }

        /// A frame; the words that it shows, and where.
        fn frame(&mut self, events: Vec<Event>) -> Vec<(String, Rect)> {
            self.now += 0.5;
            let screen_rect = Some(Rect::from_min_max(pos2(0.0, 0.0), pos2(400.0, 1200.0)));
            let input =
                RawInput { screen_rect, events, time: Some(self.now), ..RawInput::default() };
            let (controls, facts) = (&mut self.controls, Facts::default());
            let mut output = self.context.clone().run_ui(input, |ui| {
                show(ui, controls, &mut Steering::Orbit, &facts);
            });
            // Nothing draws it.
            output.textures_delta.clear();
            let mut shapes: Vec<Shape> = output.shapes.into_iter().map(|s| s.shape).collect();
            let mut words = Vec::new();
            while let Some(shape) = shapes.pop() {
                match shape {
                    Shape::Vec(more) => shapes.extend(more),
                    Shape::Text(text) => {
                        words.push((text.galley.text().to_owned(), text.visual_bounding_rect()));
                    }
                    _ => {}
                }
            }
            words
        }

        /// The middle of a word.
        fn at(&mut self, word: &str) -> Pos2 {
            let words = self.frame(vec![]);
            let found = words.iter().find(|(shown, _)| shown == word);
            found.unwrap_or_else(|| panic!("no {word} among {words:?}")).1.center()
        }

        /// Clicks on a word.
        fn click(&mut self, word: &str) {
            let at = self.at(word);
            self.click_at(at);
        }

        fn click_at(&mut self, pos: Pos2) {
            let click = |pressed| Event::PointerButton {
                pos,
                button: PointerButton::Primary,
                pressed,
                modifiers: Modifiers::NONE,
            };
            self.frame(vec![Event::PointerMoved(pos)]);
            self.frame(vec![click(true)]);
            self.frame(vec![click(false)]);
        }
    }

    /// A slider begins at the left of the row that its word ends.
    #[test]
    fn strengths_have_a_slider_each() {
        let mut panel = Panel::new();
        let usual = panel.controls.settings.strengths;
        let row = panel.at("Static").y;
        panel.click_at(pos2(10.0, row));
        let strengths = panel.controls.settings.strengths;
        assert!(strengths.still < 0.5 * usual.still, "{strengths:?}");
        assert_eq!(strengths.moving, usual.moving);
        let row = panel.at("Dynamic").y;
        panel.click_at(pos2(10.0, row));
        assert_eq!(panel.controls.settings.strengths.still, strengths.still);
        assert!(panel.controls.settings.strengths.moving < 0.5 * usual.moving);
    }

    #[test]
    fn lumels_are_looked_into_by_the_words_of_the_page() {
        let mut panel = Panel::new();
        let mut shown = "Light";
        for (word, look) in [
            ("Lumels, one square each", LumelLook::Lumels),
            ("Age, green to red", LumelLook::Age),
            ("Light", LumelLook::Light),
        ] {
            panel.click(shown);
            panel.click(word);
            assert_eq!(panel.controls.settings.look, look);
            shown = word;
        }
        for pages in [true, false] {
            panel.click("Pages");
            assert_eq!(panel.controls.settings.pages, pages);
        }
    }
}
