//! glTF animations.

use super::accessor::Accessors;
use super::json;
use crate::animation::{Curve, Interpolation, Property};
use crate::asset::{Animation, AssetNode, Channel};
use crate::error::{At, Fault, invalid};
use crate::mesh::Mesh;

/// Reads an animation.
pub(super) fn read(
    accessors: Accessors<'_>,
    index: usize,
    nodes: &[AssetNode],
    meshes: &[std::sync::Arc<Mesh>],
    warnings: &mut Vec<String>,
) -> Result<Animation, Fault> {
    let json = &accessors.root.animations[index];
    let place = match json.name.as_str() {
        "" => format!("animation {index}"),
        name => format!("animation {index} {name:?}"),
    };
    let mut channels = Vec::new();
    for (c, channel) in json.channels.iter().enumerate() {
        let Some(node) = channel.target.node else { continue };
        let property = match channel.target.path.as_str() {
            "translation" => Property::Translation,
            "rotation" => Property::Rotation,
            "scale" => Property::Scale,
            "weights" => Property::Weights,
            other => {
                warnings.push(format!("{place}: the path {other:?} is not animated"));
                continue;
            }
        };
        let width = || width(property, node, nodes, meshes);
        let curve = || read_curve(accessors, json, channel.sampler, property, width()?);
        let here = || format!("{place}, channel {c}");
        let curve = curve().at(here)?;
        if curve.times.windows(2).any(|w| w[0] == w[1]) {
            warnings.push(format!("{}: keys of one time are a jump", here()));
        }
        channels.push(Channel { node: node as u32, curve });
    }
    let last = channels.iter().filter_map(|c| c.curve.times.last()).copied().fold(0.0, f32::max);
    Ok(Animation { name: json.name.clone(), duration: f64::from(last), channels })
}

/// Numbers in a value of a node's property.
fn width(
    property: Property,
    node: usize,
    nodes: &[AssetNode],
    meshes: &[std::sync::Arc<Mesh>],
) -> Result<usize, Fault> {
    let node_here =
        nodes.get(node).ok_or_else(|| invalid(format!("node {node} does not exist")))?;
    match property {
        Property::Translation | Property::Scale => Ok(3),
        Property::Rotation => Ok(4),
        Property::Weights => {
            let targets = node_here.mesh.map_or(0, |m| meshes[m as usize].morph_weights.len());
            match targets {
                0 => Err(invalid(format!("node {node} has no morph targets to animate"))),
                targets => Ok(targets),
            }
        }
    }
}

fn read_curve(
    accessors: Accessors<'_>,
    animation: &json::Animation,
    sampler: usize,
    property: Property,
    width: usize,
) -> Result<Curve, Fault> {
    let json = animation
        .samplers
        .get(sampler)
        .ok_or_else(|| invalid(format!("sampler {sampler} does not exist")))?;
    let interpolation = match json.interpolation {
        json::Interpolation::Step => Interpolation::Step,
        json::Interpolation::Linear => Interpolation::Linear,
        json::Interpolation::CubicSpline => Interpolation::CubicSpline,
    };
    let times = accessors.floats::<1>(json.input).at(|| "times of the keys".into())?;
    let times: Vec<f32> = times.into_iter().map(|[t]| t).collect();
    let finite = times.iter().all(|t| t.is_finite() && *t >= 0.0);
    if times.is_empty() || !finite || times.windows(2).any(|w| w[0] > w[1]) {
        return Err(invalid("the times of its keys are not finite, or fall"));
    }
    let values: Vec<f32> = match property {
        Property::Translation | Property::Scale => {
            accessors.floats::<3>(json.output)?.into_iter().flatten().collect()
        }
        Property::Rotation => accessors.floats::<4>(json.output)?.into_iter().flatten().collect(),
        Property::Weights => accessors.floats::<1>(json.output)?.into_iter().flatten().collect(),
    };
    let needed = Curve::values_needed(interpolation, width, times.len());
    if values.len() < needed {
        return Err(invalid(format!("{} values; its keys need {needed}", values.len())));
    }
    if values.iter().any(|v| !v.is_finite() || v.abs() > 1e9) {
        return Err(invalid("a value is not finite or over 1e9"));
    }
    Ok(Curve { property, interpolation, width, times, values })
}
