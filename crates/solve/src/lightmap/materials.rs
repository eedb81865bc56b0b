//! Which surfaces show lumels, by their materials as these are now.

use std::collections::{BTreeSet, HashMap};

use lumencast_charts::takes_lumels;
use lumencast_light::{Layout, Surface, SurfaceId};
use lumencast_scene::{Instance, Snapshot};

use super::{InstanceId, instance_of};

/// How many primitives of an instance show lumels.
pub(super) fn showing(instance: &Instance, scene: &Snapshot) -> usize {
    (0..instance.mesh.primitives.len()).filter(|number| shows(instance, *number, scene)).count()
}

/// Surfaces of these instances that show none: edits have made them glass, or black.
pub(super) fn blank(
    layout: &Layout,
    instances: &HashMap<InstanceId, &Instance>,
    scene: &Snapshot,
) -> BTreeSet<SurfaceId> {
    let surfaces = layout.surfaces().iter();
    let is_blank = |surface: &&Surface| {
        let instance = instances.get(&instance_of(surface));
        instance.is_some_and(|instance| !shows(instance, surface.id.primitive as usize, scene))
    };
    surfaces.filter(is_blank).map(|surface| surface.id).collect()
}

fn shows(instance: &Instance, primitive: usize, scene: &Snapshot) -> bool {
    let primitive = instance.mesh.primitives.get(primitive);
    primitive.is_some_and(|primitive| takes_lumels(primitive, &scene.materials))
}
