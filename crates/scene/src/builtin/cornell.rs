//! The Cornell box, two metres a side, open to the front, with the published colours. It holds a
//! tall box and a moving sphere. About 4,000 triangles.

use std::f32::consts::TAU;

use glam::{Affine3A, Quat, Vec3};
use serde_json::json;

use super::shapes::Shape;
use super::writer::Writer;

const WHITE: [f32; 3] = [0.73, 0.73, 0.73];
const RED: [f32; 3] = [0.65, 0.05, 0.05];
const GREEN: [f32; 3] = [0.12, 0.45, 0.15];

pub(super) fn glb() -> Vec<u8> {
    let mut w = Writer::default();
    let (white, red, green) =
        (w.diffuse("white", WHITE), w.diffuse("red", RED), w.diffuse("green", GREEN));
    let panel = w.emitter("ceiling light", [9.0, 7.2, 5.0]);

    let (x, y, z) = (Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0);
    let corner = Vec3::new(-1.0, 0.0, -1.0);
    let shell = Shape::joined([
        Shape::rectangle(corner + z, x, -z, 10),
        Shape::rectangle(corner + y, x, z, 10),
        Shape::rectangle(corner, x, y, 10),
    ]);
    let left = Shape::rectangle(corner + z, -z, y, 10);
    let right = Shape::rectangle(corner + x, z, y, 10);
    let room = w.mesh("room", &[(&shell, white), (&left, red), (&right, green)]);
    w.node(json!({ "name": "room", "mesh": room }));

    let light = Shape::rectangle(Vec3::new(-0.3, 1.99, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6, 1);
    let light = w.mesh("ceiling light", &[(&light, panel)]);
    w.node(json!({ "name": "ceiling light", "mesh": light }));

    let tall = Shape::cuboid(Vec3::new(-0.3, 0.0, -0.3), Vec3::new(0.3, 1.2, 0.3), 8)
        .placed(Affine3A::from_quat(Quat::from_rotation_y(0.3)));
    let tall = w.mesh("tall box", &[(&tall, white)]);
    w.node(json!({ "name": "tall box", "mesh": tall, "translation": [-0.4, 0.0, -0.4] }));

    let sphere = w.mesh("sphere", &[(&Shape::sphere(0.3, 48, 24), white)]);
    let [path_x, path_y, path_z] = path(0.0).to_array();
    let sphere = w
        .node(json!({ "name": "sphere", "mesh": sphere, "translation": [path_x, path_y, path_z] }));
    let times: Vec<f32> = (0..=32).map(|k| k as f32 * 0.25).collect();
    let places: Vec<f32> = (0..=32).flat_map(|k| path(k as f32 / 32.0).to_array()).collect();
    let moved = (sphere, "translation");
    w.animation("sphere goes round", moved, "LINEAR", &times, ("VEC3", &places));

    // It is a spot light, so that it does not overexpose the ceiling that it hangs from.
    let down = Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2).to_array();
    w.light(
        json!({
            "name": "lamp", "type": "spot", "color": [1.0, 0.85, 0.65], "intensity": 4.0,
            "spot": { "innerConeAngle": 0.6, "outerConeAngle": 1.2 },
        }),
        json!({ "name": "lamp", "translation": [0.0, 1.95, 0.0], "rotation": down }),
    );
    w.camera("camera", 0.66, json!({ "name": "camera", "translation": [0.0, 1.0, 4.0] }));
    let volume = json!({
        "center": [0.0, 1.0, 0.0], "size": [2.0, 2.0, 2.0], "resolution": [8, 8, 8], "order": 2,
    });
    w.finish(json!({ "lumencast": { "volumes": [volume], "lightmap": { "size": 256 } } }))
}

/// Position of the sphere on its path, for `round` from 0 to 1.
fn path(round: f32) -> Vec3 {
    let (sin, cos) = (TAU * round).sin_cos();
    Vec3::new(0.45 + 0.2 * cos, 0.32 + 0.25 * (1.0 - (2.0 * TAU * round).cos()), 0.35 + 0.3 * sin)
}
