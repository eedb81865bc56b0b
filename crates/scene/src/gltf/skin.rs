//! Skins, and the joints that move vertices.

use glam::{Affine3A, Mat4, Vec4};

use super::accessor::Accessors;
use super::json;
use super::vertices::{Notes, mend};
use crate::asset::Skin;
use crate::error::{At, Fault, invalid};

/// Reads a skin.
pub(super) fn read_skin(accessors: Accessors<'_>, index: usize) -> Result<Skin, Fault> {
    let json = &accessors.root.skins[index];
    let read = || {
        let matrices = match json.inverse_bind_matrices {
            None => vec![Affine3A::IDENTITY; json.joints.len()],
            Some(accessor) => accessors
                .floats::<16>(accessor)?
                .iter()
                .map(|m| Affine3A::from_mat4(Mat4::from_cols_array(m)))
                .collect(),
        };
        if matrices.len() < json.joints.len() {
            return Err(invalid("it has fewer inverse bind matrices than joints"));
        }
        if matrices.iter().any(|m| !m.is_finite()) {
            return Err(invalid("an inverse bind matrix is not finite"));
        }
        if let Some(joint) = json.joints.iter().find(|j| **j >= accessors.root.nodes.len()) {
            return Err(invalid(format!("joint node {joint} does not exist")));
        }
        Ok(Skin { joints: json.joints.iter().map(|j| *j as u32).zip(matrices).collect() })
    };
    read().at(|| format!("skin {index}"))
}

/// Joints and weights of a primitive's vertices, from all its sets; empty where it has none.
pub(super) fn read(
    accessors: Accessors<'_>,
    json: &json::Primitive,
    vertices: usize,
    notes: &mut Notes,
) -> Result<(Vec<[u16; 4]>, Vec<Vec4>), Fault> {
    let mut sets = Vec::new();
    for set in 0.. {
        let names = [format!("JOINTS_{set}"), format!("WEIGHTS_{set}")];
        let [Some(joints), Some(weights)] =
            names.each_ref().map(|name| json.attributes.get(name).copied())
        else {
            break;
        };
        let joints = accessors.integers::<4>(joints).at(|| names[0].clone())?;
        let weights = accessors.floats::<4>(weights).at(|| names[1].clone())?;
        let mut weights: Vec<_> = weights.into_iter().map(Vec4::from).collect();
        mend(&names[1], &mut weights, Vec4::ZERO, notes);
        for (name, length) in names.iter().zip([joints.len(), weights.len()]) {
            if length != vertices {
                return Err(invalid(format!("{name} has {length} elements, POSITION {vertices}")));
            }
        }
        // Exporters fill a second set even where only other meshes need it.
        let is_used = weights.iter().any(|four| four.cmpgt(Vec4::ZERO).any());
        if is_used || sets.is_empty() {
            sets.push((joints, weights));
        }
    }
    accessors.budget.geometry::<([u16; 4], Vec4)>(vertices.saturating_mul(sets.len()))?;
    let mut all = (Vec::new(), Vec::new());
    for vertex in 0..vertices {
        let weight = |weights: &[Vec4]| weights[vertex].max(Vec4::ZERO);
        let sum: f32 = sets.iter().map(|(_, weights)| weight(weights).element_sum()).sum();
        let has_weights = sum > 0.0 && sum.is_finite();
        for (set, (joints, weights)) in sets.iter().enumerate() {
            let weights = match (has_weights, set) {
                (true, _) => weight(weights) / sum,
                (false, 0) => Vec4::X,
                (false, _) => Vec4::ZERO,
            };
            all.0.push(narrow(joints[vertex], weights).at(|| format!("JOINTS_{set}"))?);
            all.1.push(weights);
        }
    }
    Ok(all)
}

/// Converts joint indices to 16 bits; the index of a joint without weight becomes 0.
fn narrow(joints: [u32; 4], weights: Vec4) -> Result<[u16; 4], Fault> {
    let mut narrow = [0; 4];
    for (i, joint) in joints.into_iter().enumerate() {
        if weights[i] > 0.0 {
            narrow[i] =
                u16::try_from(joint).map_err(|_| invalid(format!("it names joint {joint}")))?;
        }
    }
    Ok(narrow)
}
