//! A lit room beside a dark one, with a wall of any thickness between them.

use std::sync::Arc;

use glam::Vec3;
use lumencast_scene::{LightKind, Material, PunctualLight, Snapshot};

use crate::scenes::{Stage, lambert};

/// Sides of each of the two rooms, metres.
pub const ROOM: Vec3 = Vec3::new(5.0, 3.0, 5.0);

const LAMP: PunctualLight = PunctualLight {
    kind: LightKind::Point { radius: 0.0 },
    color: Vec3::ONE,
    intensity: 100.0,
    range: None,
};

/// Two rooms of [`ROOM`] side by side along x, the wall about x = 0, a lamp in the left one. The wall is so
/// many metres thick; without thickness it is a sheet in one room.
#[must_use]
pub fn two_rooms(wall: f32) -> Arc<Snapshot> {
    let mut stage = Stage::default();
    let grey = lambert(Vec3::splat(0.6), Vec3::ZERO);
    let sheet = stage.material(Material { double_sided: true, ..grey.clone() });
    let grey = stage.material(grey);
    let middle = 0.5 * (ROOM.x + wall);
    if wall == 0.0 {
        stage.room(Vec3::ZERO, ROOM.with_x(2.0 * ROOM.x), grey);
        let corner = Vec3::new(0.0, -0.5 * ROOM.y, -0.5 * ROOM.z);
        stage.quad(corner, Vec3::Y * ROOM.y, Vec3::Z * ROOM.z, sheet);
    } else {
        stage.room(Vec3::NEG_X * middle, ROOM, grey);
        stage.room(Vec3::X * middle, ROOM, grey);
    }
    stage.light(LAMP, Vec3::new(-middle, 0.8, 0.3), Vec3::NEG_Y);
    stage.snapshot()
}

/// One room, parted by such a wall that stands on its floor; the lamp is in the left half.
#[must_use]
pub fn parted_room(wall: f32) -> Arc<Snapshot> {
    let mut stage = Stage::default();
    let grey = stage.material(lambert(Vec3::splat(0.6), Vec3::ZERO));
    stage.room(Vec3::ZERO, ROOM.with_x(2.0 * ROOM.x + wall), grey);
    stage.room(Vec3::ZERO, -ROOM.with_x(wall), grey);
    stage.light(LAMP, Vec3::new(-0.5 * (ROOM.x + wall), 0.8, 0.3), Vec3::NEG_Y);
    stage.snapshot()
}
