//! Origins: the points that positions are relative to.
//!
//! 32-bit floats have 24 binary digits. A million metres from the origin, as in map coordinates,
//! neighbouring floats are 6 cm apart. So positions are computed in 64 bits and stored relative to
//! a point among them. Positions of a scene's meshes and lights are relative to
//! [`Snapshot::origin`](crate::Snapshot), those of a mesh's vertices to
//! [`Mesh::origin`](crate::Mesh). Where a scene lies near the world's origin, that is its origin.

use glam::{DAffine3, DVec3, Vec3};

use crate::Aabb;
use crate::mesh::Primitive;

/// Scenes and meshes whose middle is within this distance in metres keep the world's own origin.
/// There floats are at most a millimetre apart.
pub(crate) const NEAR: f64 = 8192.0;
/// Origins are multiples of it, metres, so that 32-bit floats hold them and differences from them
/// exactly.
const GRID: f64 = 1024.0;
/// Thickness of walls that light may pass, as a share of the scene's reach: the tolerance of
/// tracing.
const LOST: f64 = 5e-6;

/// The origin for geometry with this middle.
pub(crate) fn about(middle: DVec3) -> Vec3 {
    if middle.is_finite() && middle.abs().max_element() >= NEAR {
        ((middle / GRID).round() * GRID).as_vec3()
    } else {
        Vec3::ZERO
    }
}

/// Moves a mesh's vertices to an origin in their middle, and returns that origin. Vertices of a
/// skinned mesh stay, since its joints place them.
pub(crate) fn centre(primitives: &mut [Primitive]) -> Vec3 {
    if primitives.iter().any(|p| !p.joints.is_empty()) {
        return Vec3::ZERO;
    }
    let mut bounds = Aabb::EMPTY;
    let positions = primitives.iter().flat_map(|p| &p.vertices.positions);
    positions.for_each(|position| bounds.grow(*position));
    let origin = about(0.5 * (bounds.min.as_dvec3() + bounds.max.as_dvec3()));
    if origin != Vec3::ZERO {
        let positions = primitives.iter_mut().flat_map(|p| &mut p.vertices.positions);
        positions.for_each(|position| *position -= origin);
    }
    origin
}

/// A part of a scene: its box in the world, and its number of triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lump {
    pub(crate) min: DVec3,
    pub(crate) max: DVec3,
    pub(crate) triangles: usize,
}

impl Lump {
    /// The box around points, with zero triangles.
    pub(crate) fn around(points: impl Iterator<Item = DVec3>) -> Self {
        let nothing = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (min, max) = points.fold(nothing, |(min, max), p| (min.min(p), max.max(p)));
        Self { min, max, triangles: 0 }
    }

    /// The box around a transformed box, with zero triangles.
    pub(crate) fn placed([min, max]: &[DVec3; 2], place: &DAffine3) -> Self {
        let corner = |i: usize| {
            let far = [i & 1 != 0, i & 2 != 0, i & 4 != 0];
            place.transform_point3(DVec3::select(far.into(), *max, *min))
        };
        Self::around((0..8).map(corner))
    }
}

/// The origin of a scene, near the median of its triangles. Distant strays do not move it away from
/// most of the scene.
pub(crate) fn of_scene(lumps: &[Lump]) -> Vec3 {
    let half: usize = lumps.iter().map(|lump| lump.triangles).sum::<usize>() / 2;
    let median = |axis: usize| {
        let middle = |lump: &Lump| 0.5 * (lump.min[axis] + lump.max[axis]);
        let mut middles: Vec<_> = lumps.iter().map(|l| (middle(l), l.triangles)).collect();
        middles.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut before = 0;
        let found = middles.iter().find(|(_, triangles)| {
            before += triangles;
            before > half
        });
        found.map_or(0.0, |(middle, _)| *middle)
    };
    about(DVec3::new(median(0), median(1), median(2)))
}

/// Warnings of the precision that is lost in spite of the origin, for display.
pub(crate) fn warnings(lumps: &[Lump], origin: Vec3) -> Vec<String> {
    let origin = origin.as_dvec3();
    let farthest = |from: DVec3| {
        let corner = |lump: &Lump| (lump.min - from).abs().max((lump.max - from).abs());
        lumps.iter().map(|lump| corner(lump).max_element()).fold(0.0, f64::max)
    };
    let mut warnings = Vec::new();
    if origin != DVec3::ZERO {
        let distance = farthest(DVec3::ZERO);
        let digits = distance * 0.5f64.powi(24);
        warnings.push(format!(
            "the scene lies {} from the origin: probes, cameras and edits are placed there to {} \
             only; move it nearer",
            length(distance),
            length(digits),
        ));
    }
    let reach = farthest(origin);
    if reach > 2.0 * NEAR {
        warnings.push(format!(
            "the scene reaches {} from its middle: there light may pass walls thinner than {}; \
             scale or split it",
            length(reach),
            length(LOST * reach),
        ));
    }
    warnings
}

/// A length in metres, for display.
fn length(metres: f64) -> String {
    match metres {
        m if m >= 1e4 => format!("{:.0} km", m / 1e3),
        m if m >= 1.0 => format!("{m:.0} m"),
        m if m >= 0.01 => format!("{:.0} cm", 1e2 * m),
        m => format!("{:.1} mm", 1e3 * m),
    }
}
