//! What a window shows: a scene and its light, wherever they come from.

use std::sync::Arc;

use glam::Vec3;
use lumencast_light::{Light, Lightmap, LumelAges};
use lumencast_scene::{Aabb, NamedView, Scene, Snapshot};

/// A scene and its light.
pub trait World {
    /// Its name.
    fn name(&self) -> &str;

    /// From where it may be looked at; at least one view.
    fn views(&self) -> &[NamedView];

    /// The box that everything lies in.
    fn bounds(&self) -> Aabb;

    /// Brings it to `now`, seconds of a clock that never goes back; `eye` is where it is looked from.
    fn update(&mut self, now: f64, eye: Vec3);

    /// The scene as it was brought to; the same pointer while nothing changes.
    fn snapshot(&mut self) -> Arc<Snapshot>;

    /// Hands the light to `take` where it has changed since it was handed on last, or `anew`.
    fn light(&mut self, anew: bool, take: &mut dyn FnMut(&Light));

    /// How long ago the light of lumels came.
    fn lumel_ages(&self) -> Vec<LumelAges>;

    /// What there is to tell of the light: names and values.
    fn facts(&self) -> Vec<(&'static str, String)>;

    /// What people should know: that the connection is lost, for instance.
    fn notice(&self) -> Option<String>;

    /// Whether light has come and has settled.
    fn is_settled(&self) -> bool;

    /// Whether animations can be stopped here, and whether they run.
    fn plays(&self) -> Option<bool>;

    /// Lets animations run or stand, where [`World::plays`].
    fn play(&mut self, plays: bool);
}

/// A scene with light that stays as it is: a saved field.
#[derive(Debug)]
pub struct Still {
    scene: Scene,
    views: Vec<NamedView>,
    light: Light,
    source: String,
    handed_on: bool,
    plays: bool,
    last: Option<f64>,
    /// Seconds since it was first shown.
    shown: f64,
}

impl Still {
    /// A scene under a field; `source` says where that comes from.
    pub fn new(scene: Scene, light: Light, source: String) -> Self {
        let views = scene.views();
        let (handed_on, plays, last, shown) = (false, true, None, 0.0);
        Self { scene, views, light, source, handed_on, plays, last, shown }
    }
}

impl World for Still {
    fn name(&self) -> &str {
        self.scene.name()
    }

    fn views(&self) -> &[NamedView] {
        &self.views
    }

    fn bounds(&self) -> Aabb {
        self.scene.bounds()
    }

    fn update(&mut self, now: f64, _eye: Vec3) {
        let passed = self.last.map_or(0.0, |last| (now - last).max(0.0));
        self.last = Some(now);
        self.shown += passed;
        if self.plays {
            self.scene.advance(passed);
        }
    }

    fn snapshot(&mut self) -> Arc<Snapshot> {
        self.scene.snapshot()
    }

    fn light(&mut self, anew: bool, take: &mut dyn FnMut(&Light)) {
        if anew || !self.handed_on {
            take(&self.light);
            self.handed_on = true;
        }
    }

    /// All of it came when it was first shown.
    fn lumel_ages(&self) -> Vec<LumelAges> {
        let even = |lightmap: &Lightmap| LumelAges::even(lightmap.id, &lightmap.layout, self.shown);
        self.light.lightmaps().map(even).collect()
    }

    fn facts(&self) -> Vec<(&'static str, String)> {
        let probes = self.light.probe_count().to_string();
        vec![("light", self.source.clone()), ("probes", probes)]
    }

    fn notice(&self) -> Option<String> {
        self.light.fields().is_empty().then(|| "There is no indirect light.".to_owned())
    }

    fn is_settled(&self) -> bool {
        true
    }

    fn plays(&self) -> Option<bool> {
        Some(self.plays)
    }

    fn play(&mut self, plays: bool) {
        self.plays = plays;
    }
}
