//! A room whose light is simulated well enough to be coded: an empty box of five white walls, a red
//! and a green one, a ball, a point light; probes see it by Monte Carlo with two bounces, blended
//! over time, as the gatherer's do.

use glam::{UVec3, Vec3};
use lumencast_light::{FieldId, Grid, Order, ProbeVolume, sh};

/// A small generator (PCG-XSH-RR), so that runs repeat.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xD1B5_4A32_D192_ED03)
    }

    fn unit(&mut self) -> f32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let x = (((self.0 >> 18) ^ self.0) >> 27) as u32;
        (x.rotate_right((self.0 >> 59) as u32) >> 8) as f32 / (1 << 24) as f32
    }

    /// Uniform on the sphere.
    fn direction(&mut self) -> Vec3 {
        let z = 1.0 - 2.0 * self.unit();
        let phi = std::f32::consts::TAU * self.unit();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    }
}

/// Half extents of the room, metres.
const HALF: Vec3 = Vec3::new(3.0, 2.0, 3.0);

/// What changes.
#[derive(Clone, Copy)]
pub(crate) struct Room {
    pub(crate) lamp: Vec3,
    /// Candela.
    pub(crate) intensity: f32,
    pub(crate) ball: Vec3,
}

struct Hit {
    position: Vec3,
    normal: Vec3,
    albedo: Vec3,
}

impl Room {
    fn ball_distance(&self, origin: Vec3, direction: Vec3) -> Option<f32> {
        let to = self.ball - origin;
        let along = to.dot(direction);
        let gap = to.length_squared() - along * along;
        (along > 0.0 && gap < 0.64).then(|| along - (0.64 - gap).sqrt()).filter(|&t| t > 1e-3)
    }

    fn trace(&self, origin: Vec3, direction: Vec3) -> Hit {
        let walls = (HALF * direction.signum() - origin) / direction;
        let wall = walls.min_element();
        if let Some(t) = self.ball_distance(origin, direction).filter(|&t| t < wall) {
            let position = origin + direction * t;
            return Hit {
                position,
                normal: (position - self.ball) / 0.8,
                albedo: Vec3::splat(0.7),
            };
        }
        let axis = walls.min_position();
        let mut normal = Vec3::ZERO;
        normal[axis] = -direction[axis].signum();
        let albedo = match (axis, direction.x > 0.0) {
            (0, false) => Vec3::new(0.63, 0.06, 0.05),
            (0, true) => Vec3::new(0.14, 0.45, 0.09),
            _ => Vec3::splat(0.73),
        };
        Hit { position: origin + direction * wall * 0.999, normal, albedo }
    }

    /// Light that leaves a point on its way back: direct, then `bounces` more.
    fn radiance(&self, origin: Vec3, direction: Vec3, bounces: u32, random: &mut Random) -> Vec3 {
        let hit = self.trace(origin, direction);
        let to = self.lamp - hit.position;
        let (distance, unit) = (to.length(), to.normalize());
        let lit = self.ball_distance(hit.position, unit).is_none_or(|t| t > distance);
        let cosine = hit.normal.dot(unit).max(0.0) * f32::from(lit);
        let direct = hit.albedo
            * (self.intensity * cosine / (distance * distance).max(0.01) / std::f32::consts::PI);
        if bounces == 0 {
            return direct;
        }
        let next = (hit.normal + 0.999 * random.direction()).normalize();
        direct + hit.albedo * self.radiance(hit.position, next, bounces - 1, random)
    }

    /// One tick's estimate of every probe.
    pub(crate) fn gather(&self, volume: &mut ProbeVolume, samples: u32, random: &mut Random) {
        let weight = 4.0 * std::f32::consts::PI / samples as f32;
        for i in 0..volume.grid.probe_count() {
            let position = volume.grid.position(volume.grid.cell(i));
            let order = volume.order;
            let probe = volume.probe_mut(i);
            probe.fill(Vec3::ZERO);
            for _ in 0..samples {
                let direction = random.direction();
                let radiance = self.radiance(position, direction, 2, random) * weight;
                for (c, b) in probe.iter_mut().zip(sh::basis(order, direction)) {
                    *c += radiance * b;
                }
            }
        }
    }
}

/// A volume over the room.
pub(crate) fn volume(cells: u32, order: Order) -> ProbeVolume {
    let grid = Grid {
        center: Vec3::ZERO,
        rotation: glam::Quat::IDENTITY,
        size: 2.0 * HALF,
        resolution: UVec3::splat(cells),
    };
    ProbeVolume::dark(FieldId(0), grid, order)
}
