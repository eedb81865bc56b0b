//! Where the probes of a scene go that does not say it, and whether those of a volume are of use.
//!
//! A scene's bounds hold more than the space that people look at: the inside of the ground, what lies
//! above a roof. So places all over the bounds are tried. One is of use where it sees the front of some
//! surface, and is not within something, as backs tell. The volume spans the cells of those that are.

use std::sync::Arc;

use glam::{Quat, UVec3, Vec3};
use lumencast_gather::{Gather, Job, Receiver, SumsAt};
use lumencast_light::{Grid, Order};
use lumencast_scene::{Aabb, Scene, Snapshot, VolumeSpec};

use crate::error::SolveError;
use crate::walls::BURIED_ABOVE;

/// Places that are tried, about.
const TRIALS: f32 = 4096.0;
/// Where fewer of the places within the bounds are of use, places beyond them are tried too.
const ENOUGH: f32 = 0.25;
/// How far beyond them, on each side, as a share of the bounds.
const MARGIN: f32 = 0.25;
/// Directions in which each looks.
const DIRECTIONS: u32 = 64;
/// Probes of a default volume of usual size, and of any at most.
const PROBES: f32 = 512.0;
const MOST_PROBES: u32 = 4096;
/// Cells of a default volume are no larger than that as long as probes allow, metres: about the size of
/// what people build.
const CELL: f32 = 2.0;
/// Layers of probes across the thinnest side, as long as probes allow.
const LAYERS: f32 = 2.0;
/// No side is thinner, metres.
const THINNEST: f32 = 1e-3;

/// What became of a volume's probes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Survey {
    /// Those that were looked at.
    pub probes: usize,
    /// Those within something: they see backs of surfaces.
    pub buried: usize,
    /// Those that see no surface at all.
    pub lost: usize,
}

impl Survey {
    /// Whether most of them are of no use.
    #[must_use]
    pub fn is_mostly_useless(&self) -> bool {
        2 * (self.buried + self.lost) > self.probes
    }
}

/// What a place is good for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    /// It sees fronts of surfaces.
    Open,
    Buried,
    /// It sees nothing.
    Lost,
}

/// The volumes that a scene asks for, or else the [default one](default_volume).
///
/// # Errors
/// A gatherer that gave up.
pub fn volumes(
    scene: &mut Scene,
    gatherer: &mut dyn Gather,
) -> Result<Vec<VolumeSpec>, SolveError> {
    let own = scene.volumes();
    if own.is_empty() {
        let (snapshot, bounds) = (scene.snapshot(), scene.bounds());
        return Ok(vec![default_volume(&snapshot, bounds, gatherer)?]);
    }
    Ok(own)
}

/// The volume of a scene that asks for none.
///
/// Its cells are near cubes: 512 of them, more in scenes so large that a cell would be more than two
/// metres wide or so thin that there would be one layer, at most 4,096.
///
/// # Errors
/// A gatherer that gave up.
pub fn default_volume(
    scene: &Arc<Snapshot>,
    bounds: Aabb,
    gatherer: &mut dyn Gather,
) -> Result<VolumeSpec, SolveError> {
    let within = useful(scene, bounds, gatherer)?;
    if within.share >= ENOUGH {
        return Ok(around(within.bounds));
    }
    // What people look at is about the scene, as of a single thing.
    let margin = MARGIN * (bounds.max - bounds.min);
    let beyond = Aabb { min: bounds.min - margin, max: bounds.max + margin };
    let about = useful(scene, beyond, gatherer)?;
    Ok(around(if about.share > within.share { about.bounds } else { within.bounds }))
}

/// The places of a box that are of use.
struct Useful {
    /// The box about their cells; that of all where there are none.
    bounds: Aabb,
    /// Of all places.
    share: f32,
}

fn useful(
    scene: &Arc<Snapshot>,
    bounds: Aabb,
    gatherer: &mut dyn Gather,
) -> Result<Useful, SolveError> {
    let tried = trials(bounds);
    let uses = uses(scene, tried.positions(), gatherer)?;
    let half = 0.5 * tried.spacing();
    let mut found = Aabb::EMPTY;
    let mut count = 0.0;
    for (position, _) in tried.positions().zip(&uses).filter(|(_, found)| **found == Use::Open) {
        found.grow(position - half);
        found.grow(position + half);
        count += 1.0;
    }
    if found.is_empty() {
        return Ok(Useful { bounds: grown(bounds, THINNEST), share: 0.0 });
    }
    // Trials of thin sides reach beyond the bounds, as the space about what is flat does.
    let is_flat = (bounds.max - bounds.min).cmplt(half);
    let bounds = Aabb {
        min: Vec3::select(is_flat, found.min, found.min.max(bounds.min)),
        max: Vec3::select(is_flat, found.max, found.max.min(bounds.max)),
    };
    Ok(Useful { bounds, share: count / uses.len() as f32 })
}

/// What becomes of a volume's probes in a scene; of some thousands of them where it has more.
///
/// # Errors
/// A gatherer that gave up.
pub fn survey(
    scene: &Arc<Snapshot>,
    volume: &VolumeSpec,
    gatherer: &mut dyn Gather,
) -> Result<Survey, SolveError> {
    // An odd step goes through all layers of a grid.
    let step = volume.grid.probe_count().div_ceil(TRIALS as usize) | 1;
    let uses = uses(scene, volume.grid.positions().step_by(step), gatherer)?;
    let count = |of: Use| uses.iter().filter(|found| **found == of).count();
    Ok(Survey { probes: uses.len(), buried: count(Use::Buried), lost: count(Use::Lost) })
}

/// The places that are tried: cells of the bounds, of which thin sides are widened to two, so that
/// places on both sides of what is flat are tried.
fn trials(bounds: Aabb) -> Grid {
    let extent = (bounds.max - bounds.min).max(Vec3::splat(THINNEST));
    let mut cell = (extent.element_product() / TRIALS).cbrt().max(THINNEST);
    // What is flat or long has larger cells than its volume tells.
    while (extent / cell).ceil().max(Vec3::splat(LAYERS)).element_product() > TRIALS {
        cell *= 1.1;
    }
    grid(grown(bounds, LAYERS * cell), cell)
}

/// The box with no side less than `least`, about its middle.
fn grown(bounds: Aabb, least: f32) -> Aabb {
    let middle = 0.5 * (bounds.min + bounds.max);
    let half = 0.5 * (bounds.max - bounds.min).max(Vec3::splat(least));
    Aabb { min: middle - half, max: middle + half }
}

/// A box as near cubes of about that size.
fn grid(bounds: Aabb, cell: f32) -> Grid {
    let size = bounds.max - bounds.min;
    Grid {
        center: 0.5 * (bounds.min + bounds.max),
        rotation: Quat::IDENTITY,
        size,
        resolution: (size / cell).round().as_uvec3().max(UVec3::ONE),
    }
}

/// The volume of a box.
fn around(bounds: Aabb) -> VolumeSpec {
    let size = bounds.max - bounds.min;
    let usual = (size.element_product() / PROBES).cbrt();
    let mut cell = usual.min(CELL).min(size.min_element() / LAYERS).max(THINNEST);
    let grid = loop {
        let grid = grid(bounds, cell);
        let cells = grid.resolution.to_array().map(u64::from).iter().product::<u64>();
        if cells <= u64::from(MOST_PROBES) {
            break grid;
        }
        cell *= 1.02;
    };
    VolumeSpec { grid, order: Order::default() }
}

fn uses(
    scene: &Arc<Snapshot>,
    places: impl Iterator<Item = Vec3>,
    gatherer: &mut dyn Gather,
) -> Result<Vec<Use>, SolveError> {
    let receivers: Vec<_> = places.map(Receiver::probe).collect();
    let job = Job { bounces: 0, surfaces: true, ..Job::new(scene.clone(), receivers, DIRECTIONS) };
    let ticket = gatherer.submit(job);
    let gathered = gatherer.wait(ticket).ok_or(SolveError::Gather)?;
    Ok(gathered.sums.iter().map(|sums| found(&sums)).collect())
}

fn found(sums: &SumsAt<'_>) -> Use {
    let met = || sums.surfaces.iter().flatten();
    if sums.culled_fraction > BURIED_ABOVE {
        Use::Buried
    } else if met().any(|surface| surface.front) {
        Use::Open
    } else {
        Use::Lost
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use lumencast_gather::path_trace::{CpuPathTracer, Options};
    use lumencast_testkit::rooms::{Placed, Rooms};
    use lumencast_testkit::scenes::{Stage, lambert};

    use super::*;

    /// A closed room, seen from within.
    fn room(size: Vec3) -> Stage {
        let mut stage = Stage::default();
        let grey = stage.material(lambert(Vec3::splat(0.5), Vec3::ZERO));
        stage.room(Vec3::ZERO, size, grey);
        stage
    }

    fn tracer() -> CpuPathTracer {
        CpuPathTracer::new(Options::default()).expect("threads")
    }

    /// The default volume of a stage with these bounds, and what becomes of its probes.
    fn placed(stage: Stage, size: Vec3) -> (Grid, Survey) {
        let (scene, mut tracer) = (stage.snapshot(), tracer());
        let bounds = Aabb { min: -0.5 * size, max: 0.5 * size };
        let volume = default_volume(&scene, bounds, &mut tracer).expect("a volume");
        volume.check().expect("a sound volume");
        let survey = survey(&scene, &volume, &mut tracer).expect("a survey");
        assert_eq!(survey.probes, volume.grid.probe_count());
        (volume.grid, survey)
    }

    /// Halls that are flat, long, tall, huge and tiny: every probe is inside, cells are near cubes.
    #[test]
    fn every_probe_is_in_the_room() {
        for (size, most, ratio) in [
            (Vec3::new(60.0, 2.8, 60.0), 4096, 1.3),
            (Vec3::new(3.0, 2.5, 200.0), 4096, 1.3),
            (Vec3::new(4.0, 90.0, 5.0), 4096, 1.3),
            (Vec3::new(800.0, 300.0, 500.0), 4096, 1.3),
            (Vec3::splat(0.004), 512, 1.01),
            (Vec3::splat(2.0), 512, 1.01),
            (Vec3::new(29.8, 12.4, 18.3), 1024, 1.3),
        ] {
            let (grid, survey) = placed(room(size), size);
            assert_eq!((survey.buried, survey.lost), (0, 0), "{size}");
            assert!(survey.probes >= 64 && survey.probes <= most, "{size}: {}", survey.probes);
            let cell = grid.spacing();
            assert!(cell.max_element() / cell.min_element() < ratio, "{size}: {cell}");
            assert!((grid.size - size).abs().max_element() < 1e-3 * size.max_element(), "{size}");
        }
    }

    /// Of a ground without thickness, the side that is seen.
    #[test]
    fn probes_stand_on_the_ground() {
        let mut stage = Stage::default();
        let grey = stage.material(lambert(Vec3::splat(0.5), Vec3::ZERO));
        stage.quad(Vec3::new(-50.0, 0.0, 50.0), Vec3::X * 100.0, Vec3::NEG_Z * 100.0, grey);
        let (grid, survey) = placed(stage, Vec3::new(100.0, 0.0, 100.0));
        assert_eq!(survey.buried, 0);
        assert!(grid.positions().all(|p| p.y > 0.0));
    }

    /// Volumes are placed in the world, wherever the scene is computed.
    #[test]
    fn far_rooms_have_the_volume_of_near_ones() {
        let at = DVec3::new(1e6 + 0.37, 120.3, -1e6);
        let far = Rooms { at, placed: Placed::Flat, emission: 0.0 };
        let [near_grid, far_grid] = [far.near(), far].map(|rooms| {
            let (mut scene, mut tracer) = (rooms.scene(), tracer());
            let volume = volumes(&mut scene, &mut tracer).expect("a volume").remove(0);
            let survey = survey(&scene.snapshot(), &volume, &mut tracer).expect("a survey");
            assert_eq!(survey.lost, 0, "{rooms:?}");
            assert!(8 * survey.buried < survey.probes, "{rooms:?}: {survey:?}");
            volume.grid
        });
        // A cell of those that are tried.
        let cell = 0.5;
        let moved = far.local(far_grid.center) - near_grid.center;
        assert!(moved.abs().max_element() < cell, "{far_grid:?} {near_grid:?}");
        let grown = far_grid.size - near_grid.size;
        assert!(grown.abs().max_element() < cell, "{far_grid:?} {near_grid:?}");
    }

    /// About a solid thing, whose bounds hold nothing but its inside.
    #[test]
    fn probes_stand_about_a_single_thing() {
        let mut stage = Stage::default();
        let grey = stage.material(lambert(Vec3::splat(0.5), Vec3::ZERO));
        let axes = [Vec3::X, Vec3::Y, Vec3::Z];
        for (axis, normal) in axes.into_iter().enumerate() {
            let [u, v] = [1, 2].map(|k| axes[(axis + k) % 3]);
            let corner = -0.5 * (u + v);
            stage.quad(corner + 0.5 * normal, u, v, grey);
            stage.quad(corner - 0.5 * normal, v, u, grey);
        }
        let (grid, survey) = placed(stage, Vec3::ONE);
        assert!(!survey.is_mostly_useless() && survey.lost == 0, "{survey:?}");
        assert!((grid.size - 1.5).abs().max_element() < 1e-3, "{}", grid.size);
    }

    #[test]
    fn a_volume_in_the_wrong_place_is_told() {
        let size = Vec3::new(6.0, 3.0, 6.0);
        let (scene, mut tracer) = (room(size).snapshot(), tracer());
        let inside = around(Aabb { min: -0.5 * size, max: 0.5 * size });
        let beside =
            |x: f32| VolumeSpec { grid: Grid { center: Vec3::X * x, ..inside.grid }, ..inside };
        let mut told =
            |volume| survey(&scene, &volume, &mut tracer).expect("a survey").is_mostly_useless();
        assert!(!told(inside) && !told(beside(1.0)));
        assert!(told(beside(5.0)) && told(beside(1000.0)));
    }

    #[test]
    fn a_scene_of_nothing_has_a_sound_volume() {
        let (grid, survey) = placed(Stage::default(), Vec3::ZERO);
        assert!(grid.size.min_element() > 0.0);
        assert_eq!(survey.lost, survey.probes);
    }
}
