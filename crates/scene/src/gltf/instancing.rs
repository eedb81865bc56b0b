//! EXT_mesh_gpu_instancing: transforms at which a node's mesh is shown, relative to the node.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Quat, Vec3};

use super::accessor::Accessors;
use super::node::describe;
use crate::asset::AssetNode;
use crate::error::{At, Fault, invalid};
use crate::limits;
use crate::trs::Trs;

/// Gives nodes their instances. Instances of a node without a mesh are ignored. So are those of a
/// skinned mesh, since its joints place it.
pub(super) fn read(
    accessors: Accessors<'_>,
    nodes: &mut [AssetNode],
    warnings: &mut Vec<String>,
) -> Result<(), Fault> {
    let mut total = nodes.len() as u64;
    for (index, (node, json)) in nodes.iter_mut().zip(&accessors.root.nodes).enumerate() {
        let Some(instancing) = json.extensions.instancing.as_ref().filter(|_| node.mesh.is_some())
        else {
            continue;
        };
        let place = || describe(index, &json.name);
        if node.skin.is_some() {
            warnings.push(format!("{}: instances of a skinned mesh are left out", place()));
            continue;
        }
        let here = || format!("{}: EXT_mesh_gpu_instancing", place());
        let Some(count) = count(accessors, &instancing.attributes).at(here)? else { continue };
        total = total.saturating_add(count);
        if total > limits::NODES as u64 {
            let what = "nodes and their instances".into();
            return Err(Fault::TooLarge { what, limit: limits::NODES as u64 });
        }
        node.instances = Some(transforms(accessors, &instancing.attributes, count).at(here)?);
    }
    Ok(())
}

const ATTRIBUTES: [&str; 3] = ["TRANSLATION", "ROTATION", "SCALE"];

/// Number of instances; `None` where no attribute places any.
fn count(
    accessors: Accessors<'_>,
    attributes: &BTreeMap<String, usize>,
) -> Result<Option<u64>, Fault> {
    let mut first: Option<(&str, u64)> = None;
    for name in ATTRIBUTES {
        let Some(&accessor) = attributes.get(name) else { continue };
        let count = accessors.count(accessor).at(|| name.into())?;
        match first {
            None => first = Some((name, count)),
            Some((_, other)) if other == count => {}
            Some((other_name, other)) => {
                return Err(invalid(format!(
                    "{name} has {count} elements, {other_name} {other}; each instance has one of each"
                )));
            }
        }
    }
    Ok(first.map(|(_, count)| count))
}

fn transforms(
    accessors: Accessors<'_>,
    attributes: &BTreeMap<String, usize>,
    count: u64,
) -> Result<Arc<[DAffine3]>, Fault> {
    let index = |name: &str| attributes.get(name).copied();
    let translations = match index("TRANSLATION") {
        Some(index) => accessors.floats::<3>(index).at(|| "TRANSLATION".into())?,
        None => Vec::new(),
    };
    let rotations = match index("ROTATION") {
        Some(index) => accessors.floats::<4>(index).at(|| "ROTATION".into())?,
        None => Vec::new(),
    };
    let scales = match index("SCALE") {
        Some(index) => accessors.floats::<3>(index).at(|| "SCALE".into())?,
        None => Vec::new(),
    };
    accessors.budget.geometry::<DAffine3>(count as usize)?;
    let transform = |i: usize| {
        let rotation = match rotations.get(i) {
            None => Quat::IDENTITY,
            Some(q) => unit(Quat::from_array(*q)).ok_or_else(|| {
                invalid(format!("the ROTATION of instance {i} is not a quaternion"))
            })?,
        };
        let trs = Trs {
            translation: translations.get(i).map_or(DVec3::ZERO, |t| Vec3::from(*t).as_dvec3()),
            rotation,
            scale: scales.get(i).map_or(Vec3::ONE, |s| Vec3::from(*s)),
        };
        match trs.is_within_limits() {
            true => Ok(trs.precise()),
            false => Err(invalid(format!(
                "the transform of instance {i} is not finite or over {:e}",
                limits::EXTENT
            ))),
        }
    };
    (0..count as usize).map(transform).collect()
}

/// Normalises a rotation. Bytes and shorts represent unit quaternions only approximately.
fn unit(q: Quat) -> Option<Quat> {
    let length = q.length();
    (length > 1e-3 && length.is_finite()).then(|| q / length)
}
