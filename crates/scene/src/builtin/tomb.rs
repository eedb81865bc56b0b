//! A tomb: a stone room with columns, turning sculptures of many triangles, a red curtain in the
//! draught, and a flashlight. About 518,000 triangles.

use std::f32::consts::{PI, TAU};

use glam::{Quat, Vec3};
use serde_json::{Value, json};

use super::shapes::Shape;
use super::writer::Writer;

/// Size of the room, metres: x and z from −HALF to HALF, y from 0 to HEIGHT.
const HALF: Vec3 = Vec3::new(5.0, 0.0, 6.0);
const HEIGHT: f32 = 4.5;

pub(super) fn glb() -> Vec<u8> {
    let mut w = Writer::default();
    let stone = w.diffuse("stone", [0.55, 0.48, 0.38]);
    let marble = w.surface("marble", [0.8, 0.78, 0.74], 0.35);
    let bronze = w.surface("bronze", [0.55, 0.36, 0.14], 0.4);
    let jade = w.surface("jade", [0.12, 0.45, 0.28], 0.3);
    let gold = w.surface("gold", [0.83, 0.62, 0.2], 0.35);

    let room = w.mesh("room", &[(&room(), stone)]);
    w.node(json!({ "name": "room", "mesh": room }));
    let column = w.mesh("column", &[(&column(), stone)]);
    for (index, (x, z)) in
        [-3.2, 3.2].iter().flat_map(|x| [-4.0, -1.3, 1.4, 4.1].map(|z| (*x, z))).enumerate()
    {
        let name = format!("column {}", index + 1);
        w.node(json!({ "name": name, "mesh": column, "translation": [x, 0.0, z] }));
    }

    let sculptures: [(&str, Shape, usize, [f32; 3], f32); 4] = [
        ("knot", knot(2.0, 3.0), bronze, [-1.5, 1.5, -2.2], 14.0),
        ("star", knot(3.0, 5.0), gold, [1.5, 1.5, -3.2], -18.0),
        ("idol", idol(), jade, [0.1, 0.9, -4.6], 22.0),
        ("shell", shell(), marble, [1.9, 1.3, 0.2], 12.0),
    ];
    let pedestal = Shape::cuboid(Vec3::new(-0.4, 0.0, -0.4), Vec3::new(0.4, 0.8, 0.4), 12);
    let pedestal = w.mesh("pedestal", &[(&pedestal, stone)]);
    for (name, shape, material, at, seconds) in sculptures {
        w.node(json!({ "name": format!("pedestal of the {name}"), "mesh": pedestal, "translation": [at[0], 0.0, at[2]] }));
        let mesh = w.mesh(name, &[(&shape, material)]);
        let node = w.node(json!({ "name": name, "mesh": mesh, "translation": at }));
        turn(&mut w, name, node, seconds);
    }
    curtain(&mut w);

    let hand = Vec3::new(-0.9, 1.5, 4.8);
    w.light(
        json!({
            "name": "flashlight", "type": "spot", "color": [1.0, 0.93, 0.8], "intensity": 120.0,
            "spot": { "innerConeAngle": 0.28, "outerConeAngle": 0.42 },
        }),
        json!({
            "name": "flashlight", "translation": hand.to_array(),
            "rotation": aimed(hand, Vec3::new(-0.6, 1.5, -5.5)),
        }),
    );
    let eye = Vec3::new(-0.4, 1.9, 5.5);
    let camera = json!({
        "name": "camera", "translation": eye.to_array(),
        "rotation": aimed(eye, Vec3::new(0.1, 1.3, -3.0)),
    });
    w.camera("camera", 1.0, camera);
    let volume = json!({
        "center": [0.0, HEIGHT / 2.0, 0.0],
        "size": [2.0 * HALF.x, HEIGHT, 2.0 * HALF.z],
        "resolution": [10, 5, 12], "order": 2,
    });
    w.finish(json!({ "lumencast": { "volumes": [volume], "lightmap": { "size": 1024 } } }))
}

/// The rotation that turns −Z at one point towards another.
fn aimed(from: Vec3, to: Vec3) -> Value {
    let (x, y, z) = (to - from).normalize_or(Vec3::NEG_Z).into();
    let yaw = f32::atan2(-x, -z);
    let rotation = Quat::from_rotation_y(yaw) * Quat::from_rotation_x(y.asin());
    json!(rotation.to_array())
}

/// Adds an animation that turns a node once about +Y in `seconds`; negative turns it backwards.
fn turn(w: &mut Writer, name: &str, node: usize, seconds: f32) {
    const KEYS: u32 = 8;
    let times: Vec<f32> = (0..=KEYS).map(|k| seconds.abs() * k as f32 / KEYS as f32).collect();
    let angle = |k: u32| TAU * seconds.signum() * k as f32 / KEYS as f32;
    let values: Vec<f32> =
        (0..=KEYS).flat_map(|k| Quat::from_rotation_y(angle(k)).to_array()).collect();
    let name = format!("{name} turns");
    w.animation(&name, (node, "rotation"), "LINEAR", &times, ("VEC4", &values));
}

/// Bumps of stone, −1 to 1: a few sines with a long common period.
fn bumps(p: Vec3) -> f32 {
    let a = (p.x * 3.1 + 0.7).sin() * (p.y * 2.7 + 1.9).sin() * (p.z * 3.7 + 0.2).sin();
    let b = (p.x * 7.3 + 2.1).sin() * (p.y * 8.1 + 0.4).sin() * (p.z * 6.7 + 1.3).sin();
    0.7 * a + 0.3 * b
}

/// Floor, ceiling and walls of rough stone, seen from inside.
fn room() -> Shape {
    let (x, y, z) = (Vec3::X * 2.0 * HALF.x, Vec3::Y * HEIGHT, Vec3::Z * 2.0 * HALF.z);
    let corner = -HALF;
    let wall = |corner: Vec3, along: Vec3, up: Vec3| {
        let normal = along.cross(up).normalize_or(Vec3::Y);
        Shape::surface(72, 72, move |s, t| {
            // The walls are flat at the edges, so that they meet.
            let edge = (s.min(1.0 - s).min(t.min(1.0 - t)) * 20.0).clamp(0.0, 1.0);
            let p = corner + s * along + t * up;
            p + normal * (edge * 0.04 * bumps(p))
        })
    };
    Shape::joined([
        wall(corner + z, x, -z),
        wall(corner + y, x, z),
        wall(corner, x, y),
        wall(corner + x + z, -x, y),
        wall(corner + z, -z, y),
        wall(corner + x, z, y),
    ])
}

/// A fluted column.
fn column() -> Shape {
    Shape::surface(72, 30, |s, t| {
        let t = t.clamp(0.0, 1.0);
        let ends = (1.0 - (2.0 * t - 1.0).abs()) * 12.0;
        let radius = 0.3 - 0.04 * t + 0.1 * (1.0 - ends.clamp(0.0, 1.0));
        let fluted = radius * (1.0 + 0.035 * ends.clamp(0.0, 1.0) * (16.0 * TAU * s).cos());
        let (sin, cos) = (-TAU * s).sin_cos();
        Vec3::new(fluted * cos, HEIGHT * t, fluted * sin)
    })
}

/// A (p, q) torus knot with a ribbed tube.
fn knot(p: f32, q: f32) -> Shape {
    let curve = move |s: f32| {
        let (around, through) = (TAU * p * s, TAU * q * s);
        let radius = 0.42 + 0.16 * through.cos();
        Vec3::new(radius * around.cos(), 0.22 * through.sin(), radius * around.sin())
    };
    let radius = |s: f32, t: f32| 0.09 * (1.0 + 0.12 * (40.0 * TAU * s + TAU * t).sin());
    Shape::tube(800, 64, curve, radius)
}

/// A figure of stacked rings, each rotated a little.
fn idol() -> Shape {
    Shape::surface(256, 200, |s, t| {
        let t = t.clamp(0.0, 1.0);
        let body = (PI * t).sin().max(0.0).sqrt() * (0.22 + 0.1 * (4.0 * PI * t).cos());
        let radius = body * (1.0 + 0.12 * (7.0 * TAU * s + 9.0 * t).cos());
        let (sin, cos) = (-TAU * s).sin_cos();
        Vec3::new(radius * cos, 1.5 * t, radius * sin)
    })
}

/// A sphere with spiralling ribs.
fn shell() -> Shape {
    Shape::surface(256, 171, |s, t| {
        let t = t.clamp(0.0, 1.0);
        let (ring, height) = (PI * (1.0 - t)).sin_cos();
        let ribs = (10.0 * TAU * s + 12.0 * t).cos() * ring;
        let radius = 0.45 * (1.0 + 0.07 * ribs + 0.015 * bumps(Vec3::new(9.0 * t, 20.0 * s, 1.0)));
        let (sin, cos) = (-TAU * s).sin_cos();
        radius * Vec3::new(ring * cos, height, ring * sin)
    })
}

/// A curtain in front of the back wall. The weights of two morph targets a quarter of a wave apart
/// circulate, which makes waves run along it.
fn curtain(w: &mut Writer) {
    let fold = |s: f32| 0.07 * (14.0 * TAU * s).sin();
    let at = |s: f32, t: f32| Vec3::new(3.4 * (s - 0.5), 3.2 * t, fold(s));
    let wave = |phase: f32| {
        move |s: f32, t: f32| {
            let swing = 0.18 * (1.0 - t) * (2.0 * TAU * s + 3.0 * t + phase).sin();
            Vec3::new(0.0, 0.0, swing)
        }
    };
    let rest = Shape::surface(160, 64, at);
    let targets = [0.0, PI / 2.0].map(|phase| {
        let wave = wave(phase);
        let moved = Shape::surface(160, 64, |s, t| at(s, t) + wave(s, t));
        let differ = |a: &[Vec3], b: &[Vec3]| -> Vec<Vec3> {
            a.iter().zip(b).map(|(a, b)| *a - *b).collect()
        };
        let positions = w.vectors(&differ(&moved.positions, &rest.positions));
        let normals = w.vectors(&differ(&moved.normals, &rest.normals));
        json!({ "POSITION": positions, "NORMAL": normals })
    });
    let red = w.two_sided("red velvet", [0.6, 0.03, 0.04], 0.95);
    let attributes =
        json!({ "POSITION": w.vectors(&rest.positions), "NORMAL": w.vectors(&rest.normals) });
    let indices = w.indices(&rest.triangles);
    let primitive = json!({
        "attributes": attributes, "indices": indices, "material": red, "targets": targets,
    });
    let mesh = json!({ "name": "curtain", "primitives": [primitive], "weights": [1.0, 0.0] });
    let mesh = w.add("meshes", mesh);
    let node =
        w.node(json!({ "name": "curtain", "mesh": mesh, "translation": [-1.9, 0.05, -5.5] }));
    let times: Vec<f32> = (0..=24).map(|k| k as f32 * 0.25).collect();
    let weights: Vec<f32> = (0..=24)
        .flat_map(|k| {
            let (sin, cos) = (TAU * k as f32 / 24.0).sin_cos();
            [cos, sin]
        })
        .collect();
    let moved = (node, "weights");
    w.animation("curtain in the draught", moved, "LINEAR", &times, ("SCALAR", &weights));
}
