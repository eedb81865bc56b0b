//! How much of a lit room's light lumels show in the dark room beside it.

use std::sync::Arc;

use lumencast_charts::{laid_out, sheets};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_light::Light;
use lumencast_scene::{LightmapSpec, Snapshot};
use lumencast_solve::{Bake, Effort, GatherOptions, bake, spread};
use lumencast_testkit::walls::{parted_room, two_rooms};

/// A side of a lumel, metres.
const TEXEL: f32 = 0.1;
/// At most so much of the lit room's light may be seen in the dark one.
const MOST: f32 = 1e-3;

/// The mean light of all surfaces on the dark side farther than `from` metres from a wall about x = 0, by
/// that on the lit side.
fn leaked(scene: &Arc<Snapshot>, wall: f32, from: f32) -> f32 {
    let mut tracer = CpuPathTracer::new(Options::default()).expect("threads");
    let fronts = sheets(scene, None, &|_| true).expect("charts").sheets;
    let laid_out = laid_out(&fronts, LightmapSpec::Texel(TEXEL)).expect("a layout");
    let (effort, options) = (Effort::of_samples(16), GatherOptions::default());
    let lightmap = Some(&laid_out);
    let wanted = Bake { scene, volumes: &[], lightmap, effort, options };
    let light = Light::new(bake(wanted, &mut tracer, |_| ()).expect("light").fields);
    let places = spread(scene, &laid_out.layout, 20_000);
    let mean = |side: f32| {
        let of_side = places.iter().filter(|p| side * p.position.x >= 0.5 * wall + from);
        let read: Vec<f32> = of_side.map(|place| light.irradiance_at(place).y).collect();
        assert!(read.len() > 5000, "{} places", read.len());
        read.iter().sum::<f32>() / read.len() as f32
    };
    mean(1.0) / mean(-1.0)
}

#[test]
fn walls_keep_light_in_its_room() {
    for wall in [0.02, 0.05, 0.1, 0.2] {
        let rooms = leaked(&two_rooms(wall), wall, 0.0);
        assert!(rooms <= MOST, "{wall} m: {rooms}");
        // Beside the wall, a lumel of the common floor may reach below it.
        let floor = leaked(&parted_room(wall), wall, 2.0 * TEXEL);
        assert!(floor <= MOST, "{wall} m, one floor: {floor}");
    }
}
