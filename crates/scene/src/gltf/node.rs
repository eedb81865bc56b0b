//! Nodes, lights and cameras of a glTF.

use glam::{DMat4, DVec3, Quat, Vec3};

use super::json;
use crate::asset::{AssetNode, Camera, Projection, Skin};
use crate::error::{At, Fault, invalid};
use crate::light::{LightKind, PunctualLight};
use crate::limits;
use crate::mesh::Mesh;
use crate::trs::Trs;

/// Reads the nodes and checks that they form trees.
pub(super) fn read(
    root: &json::Root,
    lights: &[PunctualLight],
    warnings: &mut Vec<String>,
) -> Result<Vec<AssetNode>, Fault> {
    if root.nodes.len() > limits::NODES {
        return Err(Fault::TooLarge { what: "nodes".into(), limit: limits::NODES as u64 });
    }
    let mut nodes = Vec::with_capacity(root.nodes.len());
    for (index, json) in root.nodes.iter().enumerate() {
        let place = || describe(index, &json.name);
        let (trs, same) = transform(json).at(place)?;
        if !same {
            warnings.push(format!("{}: the shear of its matrix is left out", place()));
        }
        let node = references(root, json, lights).at(place)?;
        nodes.push(AssetNode { parent_from_node: trs, ..node });
    }
    link_parents(&mut nodes)?;
    Ok(nodes)
}

pub(super) fn describe(index: usize, name: &str) -> String {
    if name.is_empty() { format!("node {index}") } else { format!("node {index} {name:?}") }
}

fn transform(json: &json::Node) -> Result<(Trs, bool), Fault> {
    if let Some(matrix) = json.matrix {
        let matrix = DMat4::from_cols_array(&matrix);
        let extent = f64::from(limits::EXTENT);
        if !matrix.is_finite() || matrix.to_cols_array().iter().any(|v| v.abs() > extent) {
            return Err(invalid("its matrix is not finite"));
        }
        return Ok(Trs::from_matrix(matrix));
    }
    let rotation = match json.rotation {
        None => Quat::IDENTITY,
        Some(q) => {
            let length = Quat::from_array(q).length();
            if !(length > 1e-3 && length < 1e3) {
                return Err(invalid("its rotation is not a unit quaternion"));
            }
            Quat::from_array(q).normalize()
        }
    };
    let trs = Trs {
        translation: json.translation.map_or(DVec3::ZERO, DVec3::from),
        rotation,
        scale: json.scale.map_or(Vec3::ONE, Vec3::from),
    };
    match trs.is_within_limits() {
        true => Ok((trs, true)),
        false => Err(invalid(format!("its transform is not finite or over {:e}", limits::EXTENT))),
    }
}

fn references(
    root: &json::Root,
    json: &json::Node,
    lights: &[PunctualLight],
) -> Result<AssetNode, Fault> {
    let check = |what: &str, index: Option<usize>, count: usize| match index {
        Some(i) if i >= count => Err(invalid(format!("{what} {i} of {count} does not exist"))),
        index => Ok(index.map(|i| i as u32)),
    };
    let light = json.extensions.light.as_ref().map(|l| l.light);
    let light = check("light", light, lights.len())?;
    for child in &json.children {
        check("child node", Some(*child), root.nodes.len())?;
    }
    if json.weights.iter().any(|w| !w.is_finite()) {
        return Err(invalid("a morph weight is not finite"));
    }
    Ok(AssetNode {
        name: json.name.clone(),
        children: json.children.iter().map(|c| *c as u32).collect(),
        mesh: check("mesh", json.mesh, root.meshes.len())?,
        skin: check("skin", json.skin, root.skins.len())?,
        camera: check("camera", json.camera, root.cameras.len())?,
        light: light.map(|l| lights[l as usize]),
        hidden: json.extensions.visibility.as_ref().is_some_and(|v| !v.visible),
        weights: json.weights.clone(),
        ..AssetNode::default()
    })
}

/// Sets parents; refuses nodes with two parents, and cycles.
fn link_parents(nodes: &mut [AssetNode]) -> Result<(), Fault> {
    for parent in 0..nodes.len() {
        for child in nodes[parent].children.clone() {
            if let Some(other) = nodes[child as usize].parent.replace(parent as u32) {
                return Err(invalid(format!(
                    "node {child} is a child of node {other} and of node {parent}"
                )));
            }
        }
    }
    let mut reached: Vec<u32> =
        (0..nodes.len() as u32).filter(|i| nodes[*i as usize].parent.is_none()).collect();
    let mut at = 0;
    while let Some(&node) = reached.get(at) {
        reached.extend_from_slice(&nodes[node as usize].children);
        at += 1;
    }
    if reached.len() == nodes.len() {
        return Ok(());
    }
    let mut outside = vec![true; nodes.len()];
    reached.into_iter().for_each(|node| outside[node as usize] = false);
    let first = outside.iter().position(|o| *o).unwrap_or_default();
    Err(invalid(format!("nodes form a circle; node {first} is below itself or in no tree")))
}

/// The root nodes of the scene to draw.
pub(super) fn roots(root: &json::Root, nodes: &[AssetNode]) -> Result<Vec<u32>, Fault> {
    let index = root.scene.unwrap_or(0);
    let Some(scene) = root.scenes.get(index) else {
        if root.scene.is_some() {
            return Err(invalid(format!("scene {index} does not exist")));
        }
        let parentless = |i: &u32| nodes[*i as usize].parent.is_none();
        return Ok((0..nodes.len() as u32).filter(parentless).collect());
    };
    let mut listed = vec![false; nodes.len()];
    for &node in &scene.nodes {
        match nodes.get(node) {
            None => return Err(invalid(format!("scene {index}: node {node} does not exist"))),
            Some(n) if n.parent.is_some() || listed[node] => {
                return Err(invalid(format!(
                    "scene {index} lists node {node}, which is listed twice or below another node"
                )));
            }
            Some(_) => listed[node] = true,
        }
    }
    Ok(scene.nodes.iter().map(|n| *n as u32).collect())
}

/// Reads KHR_lights_punctual.
pub(super) fn lights(
    root: &json::Root,
    warnings: &mut Vec<String>,
) -> Result<Vec<PunctualLight>, Fault> {
    let Some(lights) = &root.extensions.lights else { return Ok(Vec::new()) };
    let read = |(index, json): (usize, &json::Light)| {
        read_light(index, json, warnings).at(|| format!("light {index}"))
    };
    lights.lights.iter().enumerate().map(read).collect()
}

fn read_light(
    index: usize,
    json: &json::Light,
    warnings: &mut Vec<String>,
) -> Result<PunctualLight, Fault> {
    let mut kind = match json.kind.as_str() {
        "point" => LightKind::Point { radius: 0.0 },
        "directional" => LightKind::Directional { angle: 0.0 },
        "spot" => {
            let default = json::Spot::default();
            let spot = json.spot.as_ref().unwrap_or(&default);
            let mut inner = spot.inner_cone_angle;
            let outer = spot.outer_cone_angle;
            if inner >= outer && outer > 0.0 {
                warnings.push(format!("light {index}: its inner cone is made less than its outer"));
                inner = outer.next_down();
            }
            LightKind::Spot { inner, outer, radius: 0.0 }
        }
        other => return Err(invalid(format!("unknown type {other:?}"))),
    };
    if let Some(extras) = json.extras.get("lumencast") {
        let json::LightSize { radius, angle } = serde_json::from_value(extras.clone())
            .map_err(|e| invalid(format!("extras.lumencast: {e}")))?;
        kind.resize(radius, angle).map_err(invalid)?;
    }
    let (color, intensity) = (Vec3::from(json.color), json.intensity);
    if json.range == Some(0.0) {
        warnings.push(format!("light {index}: its range of 0 is taken for none"));
    }
    let range = json.range.filter(|range| *range != 0.0);
    let light = PunctualLight { kind, color, intensity, range };
    light.check().map_err(invalid)?;
    Ok(light)
}

/// Reads the cameras.
pub(super) fn cameras(root: &json::Root, warnings: &mut Vec<String>) -> Result<Vec<Camera>, Fault> {
    let read = |(index, json): (usize, &json::Camera)| {
        let place = || format!("camera {index} {:?}", json.name);
        let (camera, has_no_near) = read_camera(json).at(place)?;
        if has_no_near {
            warnings.push(format!("{}: its near plane at 0 is put before what it sees", place()));
        }
        Ok(camera)
    };
    root.cameras.iter().enumerate().map(read).collect()
}

/// Distance of the near plane for a perspective camera whose file has 0: in metres, and at most as
/// a share of the far plane's distance.
const NEAR: f32 = 0.01;

/// A camera, and whether its near plane had to be invented.
fn read_camera(json: &json::Camera) -> Result<(Camera, bool), Fault> {
    let has_no_near = json.perspective.as_ref().is_some_and(|p| p.znear == 0.0);
    let positive = |v: f32| v > 0.0 && v.is_finite();
    let (projection, is_valid) = match (&json.perspective, &json.orthographic) {
        (Some(p), _) => {
            let (yfov, aspect_ratio, far) = (p.yfov, p.aspect_ratio, p.zfar);
            let near = match has_no_near {
                true => far.map_or(NEAR, |far| NEAR.min(NEAR * far)),
                false => p.znear,
            };
            let is_valid = positive(yfov)
                && yfov < std::f32::consts::PI
                && aspect_ratio.is_none_or(positive)
                && positive(near)
                && far.is_none_or(|far| positive(far) && far > near);
            (Projection::Perspective { yfov, aspect_ratio, near, far }, is_valid)
        }
        (None, Some(o)) => {
            let (half_width, half_height, near, far) =
                (o.xmag.abs(), o.ymag.abs(), o.znear, o.zfar);
            let is_valid =
                positive(half_width) && positive(half_height) && near >= 0.0 && far > near;
            let is_valid = is_valid && far.is_finite();
            (Projection::Orthographic { half_width, half_height, near, far }, is_valid)
        }
        (None, None) => return Err(invalid("it is neither perspective nor orthographic")),
    };
    match is_valid {
        true => Ok((Camera { name: json.name.clone(), projection }, has_no_near)),
        false => Err(invalid("its projection is out of range")),
    }
}

/// Checks that all joints of skinned meshes are the skin's, and checks the nodes' morph weights.
pub(super) fn check_meshes(
    nodes: &[AssetNode],
    meshes: &[std::sync::Arc<Mesh>],
    skins: &[std::sync::Arc<Skin>],
) -> Result<(), Fault> {
    let mut checked = std::collections::HashSet::new();
    for (index, node) in nodes.iter().enumerate() {
        let Some(mesh) = node.mesh else { continue };
        let mesh_here = &meshes[mesh as usize];
        let targets = mesh_here.morph_weights.len();
        if !node.weights.is_empty() && node.weights.len() != targets {
            let n = node.weights.len();
            return Err(invalid(format!("node {index}: {n} weights for {targets} morph targets")));
        }
        let Some(skin) = node.skin else { continue };
        let joints = skins[skin as usize].joints.len();
        let too_large =
            |p: &crate::Primitive| p.joints.iter().flatten().any(|j| usize::from(*j) >= joints);
        if checked.insert((mesh, skin)) && mesh_here.primitives.iter().any(too_large) {
            return Err(invalid(format!(
                "node {index}: mesh {mesh} names joints that its skin {skin} of {joints} lacks"
            )));
        }
    }
    Ok(())
}
