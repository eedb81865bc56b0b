//! How much light of a lit room leaks into the dark one beside it, by the thickness of the wall between
//! them: what probes in cells of a metre can tell apart, and lumels of a decimetre.
//!
//! ```sh
//! cargo run --release -p lumencast-solve --example walls
//! ```
#![expect(clippy::print_stdout, reason = "a program for the terminal")]

use std::sync::Arc;

use glam::{Quat, UVec3, Vec3};
use lumencast_charts::{laid_out, sheets};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_light::{Grid, Light, Offset, Order};
use lumencast_scene::{LightmapSpec, Snapshot, VolumeSpec};
use lumencast_solve::blend::BlendSettings;
use lumencast_solve::{Bake, Effort, FitOptions, GatherOptions, bake, spread};
use lumencast_testkit::walls::{ROOM, parted_room, two_rooms};

/// Thicknesses of the wall, metres.
const WALLS: [f32; 5] = [0.0, 0.02, 0.05, 0.1, 0.2];

/// A side of a lumel, metres.
const TEXEL: f32 = 0.1;

/// The light of the dark side's lumels, a share of that of the lit side's: the mean over all surfaces,
/// and over those farther than two lumels from the wall.
fn leaked_at_lumels(scene: &Arc<Snapshot>, wall: f32, tracer: &mut CpuPathTracer) -> [f32; 2] {
    let fronts = sheets(scene, None, &|_| true).expect("charts").sheets;
    let laid_out = laid_out(&fronts, LightmapSpec::Texel(TEXEL)).expect("a layout");
    let (effort, options) = (Effort::of_samples(256), GatherOptions::default());
    let lightmap = Some(&laid_out);
    let wanted = Bake { scene, volumes: &[], lightmap, effort, options };
    let light = Light::new(bake(wanted, tracer, |_| ()).expect("light").fields);
    let places = spread(scene, &laid_out.layout, 20_000);
    let mean = |side: f32, from: f32| {
        let of_side = places.iter().filter(|p| side * p.position.x >= 0.5 * wall + from);
        let read: Vec<f32> = of_side.map(|place| light.irradiance_at(place).y).collect();
        read.iter().sum::<f32>() / read.len() as f32
    };
    [0.0, 2.0 * TEXEL].map(|from| 100.0 * mean(1.0, from) / mean(-1.0, from))
}

/// The mean irradiance that a field shows on the metre of a room's floor beside the wall.
fn floor(light: &Light, wall: f32, side: f32) -> f32 {
    let at = |i: u16| {
        let [x, z] = [i % 20, i / 20].map(|k| (f32::from(k) + 0.5) / 20.0);
        Vec3::new(side * (0.5 * wall + x), -0.5 * ROOM.y, (z - 0.5) * ROOM.z)
    };
    (0..400).map(|i| light.irradiance(at(i), Vec3::Y).y.max(0.0)).sum::<f32>() / 400.0
}

fn main() {
    let mut tracer = CpuPathTracer::new(Options::default()).expect("threads");
    println!(
        "| wall, cm | as gathered | fitted | lumels | lumels, one floor | but for two beside it |"
    );
    println!("| --- | --- | --- | --- | --- | --- |");
    for wall in WALLS {
        let scene = two_rooms(wall);
        let size = ROOM.with_x(2.0 * ROOM.x + wall);
        let resolution = size.round().as_uvec3();
        let grid = Grid { center: Vec3::ZERO, rotation: Quat::IDENTITY, size, resolution };
        debug_assert_eq!(resolution, UVec3::new(10, 3, 5), "cells of a metre");
        let volume = VolumeSpec { grid, order: Order::L2 };
        let leaked = |fit: Option<FitOptions>, offset: Offset, tracer: &mut CpuPathTracer| {
            let blend = BlendSettings::default();
            let options = GatherOptions { blend, fit, offset, ..GatherOptions::default() };
            let effort = Effort::of_samples(16_384);
            let volumes = &[volume];
            let wanted = Bake { scene: &scene, volumes, lightmap: None, effort, options };
            let baked = bake(wanted, tracer, |_| ()).expect("light");
            let light = Light::new(baked.fields);
            100.0 * floor(&light, wall, 1.0) / floor(&light, wall, -1.0)
        };
        let gathered = leaked(None, Offset::HALF_CELL, &mut tracer);
        let fitted = leaked(Some(FitOptions { points: 256 }), Offset::Cells(0.125), &mut tracer);
        let [lumels, _] = leaked_at_lumels(&scene, wall, &mut tracer);
        let one_floor = match wall > 0.0 {
            true => leaked_at_lumels(&parted_room(wall), wall, &mut tracer)
                .map(|share| format!("{share:.2} %")),
            false => ["–"; 2].map(str::to_owned),
        };
        let [one_floor, but_two] = one_floor;
        println!(
            "| {:.0} | {gathered:.1} % | {fitted:.2} % | {lumels:.2} % | {one_floor} | {but_two} |",
            100.0 * wall
        );
    }
}
