//! Converts glTF meshes to triangle lists.
//!
//! Results are as [`Primitive`] promises: indices inside the vertices, finite positions, unit
//! normals. Primitives and triangles keep their numbers, since charts name them by these.

use std::collections::BTreeMap;

use glam::{Vec2, Vec3, Vec4};

use super::accessor::Accessors;
use super::uv_sets::UvSets;
use super::vertices::{Element, Notes, mend, select_vertices};
use super::{json, skin, tangents};
use crate::error::{At, Fault, invalid};
use crate::mesh::{Mesh, MorphTarget, Primitive};
use crate::{Material, MaterialId, origin};

/// Reads a mesh. `materials` are the file's, the default material last.
pub(super) fn read(
    accessors: Accessors<'_>,
    index: usize,
    materials: &[Material],
) -> Result<(Mesh, Notes), Fault> {
    let json = &accessors.root.meshes[index];
    let place = describe(index, &json.name);
    let mut notes = Notes::default();
    let mut primitives = Vec::new();
    let mut targets = None;
    for (p, primitive) in json.primitives.iter().enumerate() {
        let here = || format!("{place}, primitive {p}");
        if *targets.get_or_insert(primitive.targets.len()) != primitive.targets.len() {
            return Err(
                invalid("its primitives have different numbers of morph targets").at(&place)
            );
        }
        if primitive.mode < 4 {
            notes.warnings.push(format!("{}: points and lines are not drawn", here()));
            primitives.push(Primitive::default());
            continue;
        }
        let first = notes.warnings.len();
        let read = read_primitive(accessors, primitive, materials, &mut notes).at(here)?;
        notes.warnings[first..].iter_mut().for_each(|w| *w = format!("{}: {w}", here()));
        primitives.push(read);
    }
    let targets = targets.unwrap_or(0);
    let mut morph_weights = json.weights.clone();
    if morph_weights.iter().any(|w| !w.is_finite()) {
        return Err(invalid("a morph weight is not finite").at(&place));
    }
    morph_weights.resize(targets, 0.0);
    let origin = origin::centre(&mut primitives);
    Ok((Mesh { name: json.name.clone(), primitives, morph_weights, origin }, notes))
}

pub(super) fn describe(index: usize, name: &str) -> String {
    if name.is_empty() { format!("mesh {index}") } else { format!("mesh {index} {name:?}") }
}

fn read_primitive(
    accessors: Accessors<'_>,
    json: &json::Primitive,
    materials: &[Material],
    notes: &mut Notes,
) -> Result<Primitive, Fault> {
    let Some(&position) = json.attributes.get("POSITION") else {
        notes.warnings.push("without positions it is not drawn".into());
        return Ok(Primitive::default());
    };
    if accessors.count(position)? > u64::from(u32::MAX) {
        return Err(invalid("more vertices than 32-bit indices can name"));
    }
    let mut primitive = read_attributes(accessors, json, position, notes)?;
    primitive.morph_targets = read_morph_targets(accessors, json, &primitive, notes)?;
    primitive.material = material(json, materials)?;
    primitive.triangles = read_triangles(accessors, json, primitive.vertices.positions.len())?;
    check_positions(&mut primitive, notes)?;
    if primitive.triangles.is_empty() {
        return Ok(Primitive::default());
    }
    if primitive.vertices.normals.is_empty() {
        make_flat(&mut primitive, accessors)?;
    } else {
        repair_normals(&mut primitive);
    }
    let map = materials[primitive.material.0 as usize].normal_texture.as_ref();
    if primitive.vertices.tangents.is_empty()
        && let Some(map) = map
    {
        accessors.budget.geometry::<Vec4>(primitive.vertices.positions.len())?;
        tangents::generate(&mut primitive, map);
    }
    Ok(primitive)
}

fn material(json: &json::Primitive, materials: &[Material]) -> Result<MaterialId, Fault> {
    let default = materials.len() - 1;
    let index = json.material.unwrap_or(default);
    if index > default || json.material == Some(default) {
        return Err(invalid(format!("material {index} of {default} does not exist")));
    }
    Ok(MaterialId(index as u32))
}

fn read_attributes(
    accessors: Accessors<'_>,
    json: &json::Primitive,
    position: usize,
    notes: &mut Notes,
) -> Result<Primitive, Fault> {
    let positions: Vec<Vec3> = vec3s(accessors, position, "POSITION")?;
    let count = positions.len();
    let attribute = |name: &str| json.attributes.get(name).copied();
    let check = |name: &str, length: usize| match length == count {
        true => Ok(()),
        false => Err(invalid(format!("{name} has {length} elements, POSITION {count}"))),
    };
    let mut primitive = Primitive::default();
    primitive.vertices.positions = positions;
    if let Some(index) = attribute("NORMAL") {
        primitive.vertices.normals = vec3s(accessors, index, "NORMAL")?;
        // Normals of zero get the mean of their triangles later.
        mend("NORMAL", &mut primitive.vertices.normals, Vec3::ZERO, notes);
        check("NORMAL", primitive.vertices.normals.len())?;
        if let Some(index) = attribute("TANGENT") {
            let tangents = accessors.floats::<4>(index).at(|| "TANGENT".into())?;
            check("TANGENT", tangents.len())?;
            let mut tangents: Vec<_> = tangents.into_iter().map(Vec4::from).collect();
            mend("TANGENT", &mut tangents, Vec3::X.extend(1.0), notes);
            primitive.vertices.tangents = tangents.into_iter().map(unit_tangent).collect();
        }
    }
    let sets = UvSets::of(json.material.and_then(|index| accessors.root.materials.get(index)));
    for (uv, set) in primitive.uv.iter_mut().zip(sets.numbers()) {
        let name = format!("TEXCOORD_{set}");
        if let Some(index) = attribute(&name) {
            let read = accessors.floats::<2>(index).at(|| name.clone())?;
            check(&name, read.len())?;
            *uv = read.into_iter().map(Vec2::from).collect();
            mend(&name, uv, Vec2::ZERO, notes);
        }
    }
    if let Some(index) = attribute("COLOR_0") {
        primitive.colors = read_colors(accessors, index, notes).at(|| "COLOR_0".into())?;
        check("COLOR_0", primitive.colors.len())?;
    }
    (primitive.joints, primitive.weights) = skin::read(accessors, json, count, notes)?;
    Ok(primitive)
}

fn read_colors(
    accessors: Accessors<'_>,
    index: usize,
    notes: &mut Notes,
) -> Result<Vec<Vec4>, Fault> {
    let mut colors: Vec<Vec4> = if accessors.components(index)? == 3 {
        accessors.floats::<3>(index)?.into_iter().map(|c| Vec3::from(c).extend(1.0)).collect()
    } else {
        accessors.floats::<4>(index)?.into_iter().map(Vec4::from).collect()
    };
    mend("COLOR_0", &mut colors, Vec4::ONE, notes);
    Ok(colors.into_iter().map(|c| c.clamp(Vec4::ZERO, Vec4::ONE)).collect())
}

fn vec3s(accessors: Accessors<'_>, index: usize, name: &str) -> Result<Vec<Vec3>, Fault> {
    let values = accessors.floats::<3>(index).at(|| name.into())?;
    Ok(values.into_iter().map(Vec3::from).collect())
}

/// Refuses triangles with an invalid position. Invalid vertices of no triangle are moved to where
/// another vertex is.
fn check_positions(primitive: &mut Primitive, notes: &mut Notes) -> Result<(), Fault> {
    let positions = &mut primitive.vertices.positions;
    let is_nowhere = |i: &u32| !positions[*i as usize].is_sound();
    if primitive.triangles.iter().flatten().any(is_nowhere) {
        return Err(invalid("POSITION holds a number that is not finite or over 1e18"));
    }
    let somewhere = primitive.triangles.first().map_or(Vec3::ZERO, |t| positions[t[0] as usize]);
    mend("POSITION", positions, somewhere, notes);
    Ok(())
}

fn unit_tangent(tangent: Vec4) -> Vec4 {
    let direction = tangent.truncate().try_normalize().unwrap_or(Vec3::X);
    direction.extend(if tangent.w < 0.0 { -1.0 } else { 1.0 })
}

fn read_morph_targets(
    accessors: Accessors<'_>,
    json: &json::Primitive,
    primitive: &Primitive,
    notes: &mut Notes,
) -> Result<Vec<MorphTarget>, Fault> {
    let count = primitive.vertices.positions.len();
    let mut read = |target: &BTreeMap<String, usize>, name: &str| match target.get(name) {
        None => Ok(Vec::new()),
        Some(&index) => {
            let mut values = vec3s(accessors, index, name)?;
            if name != "POSITION" {
                mend(name, &mut values, Vec3::ZERO, notes);
            } else if !values.iter().all(Element::is_sound) {
                return Err(invalid(format!(
                    "{name} holds a number that is not finite or over 1e18"
                )));
            }
            if values.len() == count {
                return Ok(values);
            }
            Err(invalid(format!("{name} has {} elements, POSITION {count}", values.len())))
        }
    };
    let targets = json.targets.iter().enumerate();
    targets
        .map(|(t, target)| {
            let mut read = || {
                Ok(MorphTarget {
                    positions: read(target, "POSITION")?,
                    normals: read(target, "NORMAL")?,
                    tangents: read(target, "TANGENT")?,
                })
            };
            read().at(|| format!("morph target {t}"))
        })
        .collect()
}

/// The triangles of a list (mode 4), strip (5) or fan (6), counter-clockwise.
fn read_triangles(
    accessors: Accessors<'_>,
    json: &json::Primitive,
    vertices: usize,
) -> Result<Vec<[u32; 3]>, Fault> {
    let indices: Vec<u32> = match json.indices {
        Some(index) => {
            let indices = accessors.integers::<1>(index).at(|| "indices".into())?;
            indices.into_iter().map(|[i]| i).collect()
        }
        None => {
            accessors.budget.geometry::<u32>(vertices)?;
            (0..vertices as u32).collect()
        }
    };
    if let Some(index) = indices.iter().find(|i| **i as usize >= vertices) {
        return Err(invalid(format!("index {index} of {vertices} vertices does not exist")));
    }
    let count = if json.mode == 4 { indices.len() / 3 } else { indices.len().saturating_sub(2) };
    accessors.budget.triangles(count)?;
    accessors.budget.geometry::<[u32; 3]>(count)?;
    Ok(match json.mode {
        4 => indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
        // Every other triangle of a strip is wound the other way (glTF 2.0, section 3.7.2.1).
        5 => indices
            .windows(3)
            .enumerate()
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .collect(),
        6 => {
            let rim = indices.get(1..).unwrap_or_default();
            rim.windows(2).map(|w| [w[0], w[1], indices[0]]).collect()
        }
        mode => return Err(invalid(format!("unknown primitive mode {mode}"))),
    })
}

/// The unit normal of a triangle whose front is counter-clockwise; +Y where it has none.
pub(crate) fn face_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    let [a, b, c] = [a, b, c].map(|p| p.as_dvec3());
    (b - a).cross(c - a).try_normalize().map_or(Vec3::Y, |n| n.as_vec3())
}

/// Gives each triangle its own vertices with the triangle's normal (glTF 2.0, section 3.7.2.1).
fn make_flat(primitive: &mut Primitive, accessors: Accessors<'_>) -> Result<(), Fault> {
    let corners = primitive.triangles.len() * 3;
    let a_vertex = size_of::<[f32; 6]>()
        + primitive.uv.iter().filter(|uv| !uv.is_empty()).count() * size_of::<Vec2>()
        + if primitive.colors.is_empty() { 0 } else { size_of::<Vec4>() }
        + primitive.influence_sets() * size_of::<[f32; 6]>()
        + primitive.morph_targets.len() * size_of::<[Vec3; 3]>();
    accessors.budget.geometry::<u8>(corners.saturating_mul(a_vertex))?;
    let order: Vec<u32> = primitive.triangles.iter().flatten().copied().collect();
    select_vertices(primitive, &order);
    primitive.triangles =
        (0..order.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let positions = primitive.vertices.positions.as_chunks::<3>().0;
    primitive.vertices.normals = positions.iter().flat_map(|p| [face_normal(*p); 3]).collect();
    primitive.flat = true;
    Ok(())
}

/// Normalises normals; those without direction get the mean of their triangles.
fn repair_normals(primitive: &mut Primitive) {
    let mut broken = false;
    for normal in &mut primitive.vertices.normals {
        *normal = normal.as_dvec3().normalize_or_zero().as_vec3();
        broken |= *normal == Vec3::ZERO;
    }
    if !broken {
        return;
    }
    let positions = &primitive.vertices.positions;
    let mut sums = vec![glam::DVec3::ZERO; positions.len()];
    for triangle in &primitive.triangles {
        let [a, b, c] = triangle.map(|i| positions[i as usize].as_dvec3());
        let sum = (b - a).cross(c - a);
        triangle.iter().for_each(|i| sums[*i as usize] += sum);
    }
    for (normal, sum) in primitive.vertices.normals.iter_mut().zip(sums) {
        if *normal == Vec3::ZERO {
            *normal = sum.try_normalize().map_or(Vec3::Y, |n| n.as_vec3());
        }
    }
}
