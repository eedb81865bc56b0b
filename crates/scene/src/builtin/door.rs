//! Light through a narrow doorway from a lit front room into a dark one. A green sphere is in the
//! dark room, and the camera looks from there to the door. About 11,000 triangles.

use glam::{Quat, Vec3};
use serde_json::{Value, json};

use super::shapes::Shape;
use super::writer::Writer;

/// Half the thickness of the wall between the rooms, metres.
const WALL: f32 = 0.1;
const HEIGHT: f32 = 2.8;
const HALF_WIDTH: f32 = 2.5;
const DEPTH: f32 = 5.0;
/// The doorway: its left and right edge and its height, metres.
const DOOR: (f32, f32, f32) = (0.7, 1.4, 2.1);

pub(super) fn glb() -> Vec<u8> {
    let mut w = Writer::default();
    let plaster = w.diffuse("plaster", [0.75, 0.72, 0.68]);
    let floor = w.surface("floor", [0.45, 0.32, 0.22], 0.6);
    let wood = w.surface("wood", [0.5, 0.3, 0.15], 0.7);
    let green = w.diffuse("green", [0.12, 0.55, 0.15]);
    let glaze = w.two_sided("glaze", [0.2, 0.35, 0.65], 0.3);

    let rooms = w.mesh("rooms", &[(&walls(), plaster), (&floors(), floor)]);
    w.node(json!({ "name": "rooms", "mesh": rooms }));
    let leaf = Shape::cuboid(Vec3::ZERO, Vec3::new(DOOR.1 - DOOR.0, DOOR.2 - 0.02, 0.04), 4);
    let leaf = w.mesh("door", &[(&leaf, wood)]);
    let turned = Quat::from_rotation_y(-1.9);
    w.node(placed("door", leaf, Vec3::new(DOOR.0, 0.0, WALL), turned));

    let sphere = w.mesh("sphere", &[(&Shape::sphere(0.45, 64, 32), green)]);
    w.node(placed("green sphere", sphere, Vec3::new(0.6, 0.45, -2.4), Quat::IDENTITY));
    furnish(&mut w, wood, glaze);

    w.light(
        json!({ "name": "lamp", "type": "point", "color": [1.0, 0.86, 0.7], "intensity": 60.0 }),
        json!({ "name": "lamp", "translation": [0.4, 2.3, 2.6] }),
    );
    let look = Quat::from_rotation_y(-2.55);
    let camera = json!({
        "name": "camera", "translation": [-1.7, 1.5, -4.4], "rotation": (look * Quat::from_rotation_x(-0.12)).to_array(),
    });
    w.camera("camera", 0.95, camera);
    // The volumes meet within the wall, so that the doorway is in one or the other.
    let volume = |z: f32| {
        json!({
            "center": [0.0, HEIGHT / 2.0, z],
            "size": [2.0 * HALF_WIDTH, HEIGHT, DEPTH],
            "resolution": [8, 5, 8], "order": 2,
        })
    };
    let volumes = [volume(-DEPTH / 2.0), volume(DEPTH / 2.0)];
    w.finish(json!({ "lumencast": { "volumes": volumes, "lightmap": { "size": 512 } } }))
}

fn placed(name: &str, mesh: usize, at: Vec3, turned: Quat) -> Value {
    json!({
        "name": name, "mesh": mesh,
        "translation": at.to_array(), "rotation": turned.to_array(),
    })
}

fn walls() -> Shape {
    let (x, y, z) = (Vec3::X * 2.0 * HALF_WIDTH, Vec3::Y * HEIGHT, Vec3::Z * 2.0 * DEPTH);
    let corner = Vec3::new(-HALF_WIDTH, 0.0, -DEPTH);
    let block = |x0: f32, x1: f32, y0: f32, y1: f32| {
        Shape::cuboid(Vec3::new(x0, y0, -WALL), Vec3::new(x1, y1, WALL), 6)
    };
    Shape::joined([
        Shape::rectangle(corner + y, x, z, 12),
        Shape::rectangle(corner, x, y, 12),
        Shape::rectangle(corner + x + z, -x, y, 12),
        Shape::rectangle(corner + z, -z, y, 12),
        Shape::rectangle(corner + x, z, y, 12),
        block(-HALF_WIDTH, DOOR.0, 0.0, HEIGHT),
        block(DOOR.1, HALF_WIDTH, 0.0, HEIGHT),
        block(DOOR.0, DOOR.1, DOOR.2, HEIGHT),
    ])
}

fn floors() -> Shape {
    let corner = Vec3::new(-HALF_WIDTH, 0.0, DEPTH);
    Shape::rectangle(corner, Vec3::X * 2.0 * HALF_WIDTH, Vec3::NEG_Z * 2.0 * DEPTH, 12)
}

/// A table with vases, chairs and a shelf in the dark room.
fn furnish(w: &mut Writer, wood: usize, glaze: usize) {
    let leg = |x: f32, z: f32, height: f32| {
        let half = Vec3::new(0.03, 0.0, 0.03);
        let at = Vec3::new(x, 0.0, z);
        Shape::cuboid(at - half, at + half + Vec3::Y * height, 2)
    };
    let legs = |dx: f32, dz: f32, height: f32| {
        Shape::joined([(-dx, -dz), (dx, -dz), (-dx, dz), (dx, dz)].map(|(x, z)| leg(x, z, height)))
    };
    let top = Shape::cuboid(Vec3::new(-0.8, 0.72, -0.45), Vec3::new(0.8, 0.76, 0.45), 4);
    let table = w.mesh("table", &[(&Shape::joined([top, legs(0.72, 0.37, 0.72)]), wood)]);
    let table_at = Vec3::new(-1.2, 0.0, -1.6);
    w.node(placed("table", table, table_at, Quat::from_rotation_y(0.25)));

    let seat = Shape::cuboid(Vec3::new(-0.22, 0.43, -0.22), Vec3::new(0.22, 0.46, 0.22), 2);
    let back = Shape::cuboid(Vec3::new(-0.22, 0.46, -0.22), Vec3::new(0.22, 0.95, -0.19), 2);
    let chair = w.mesh("chair", &[(&Shape::joined([seat, back, legs(0.19, 0.19, 0.43)]), wood)]);
    for (index, (x, z, turn)) in [(-1.6, -2.4, 0.1), (-0.7, -2.5, -0.3)].into_iter().enumerate() {
        let name = format!("chair {}", index + 1);
        w.node(placed(&name, chair, Vec3::new(x, 0.0, z), Quat::from_rotation_y(turn)));
    }

    let boards = (0..4).map(|k| {
        let y = 0.3 + 0.5 * k as f32;
        Shape::cuboid(Vec3::new(-0.5, y, -0.15), Vec3::new(0.5, y + 0.03, 0.15), 2)
    });
    let sides = [-0.5, 0.5].map(|x: f32| {
        Shape::cuboid(Vec3::new(x - 0.015, 0.0, -0.15), Vec3::new(x + 0.015, 2.0, 0.15), 2)
    });
    let shelf = w.mesh("shelf", &[(&Shape::joined(boards.chain(sides)), wood)]);
    w.node(placed("shelf", shelf, Vec3::new(1.9, 0.0, -4.8), Quat::IDENTITY));

    let vase = Shape::lathe(32, 20, |t| {
        let belly = 0.05 + 0.06 * (std::f32::consts::PI * t).sin() + 0.02 * t * t;
        (if t == 0.0 { 0.0 } else { belly }, 0.35 * t)
    });
    let vase = w.mesh("vase", &[(&vase, glaze)]);
    for (index, at) in
        [Vec3::new(-1.45, 0.76, -1.55), Vec3::new(1.75, 1.33, -4.8)].into_iter().enumerate()
    {
        w.node(placed(&format!("vase {}", index + 1), vase, at, Quat::IDENTITY));
    }
}
