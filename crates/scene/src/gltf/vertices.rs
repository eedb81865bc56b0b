//! Lists of vertex attributes: repair and reordering.

use glam::{Vec2, Vec3, Vec4};

use crate::mesh::Primitive;

/// Results of reading meshes besides the meshes.
#[derive(Debug, Default)]
pub(super) struct Notes {
    pub(super) warnings: Vec<String>,
}

/// An element of an attribute.
pub(super) trait Element: Copy {
    /// Whether its numbers are finite and at most 1e18.
    fn is_sound(&self) -> bool;
}

macro_rules! element {
    ($($vector:ty),*) => {$(
        impl Element for $vector {
            fn is_sound(&self) -> bool {
                self.abs().cmple(Self::splat(1e18)).all()
            }
        }
    )*};
}

element!(Vec2, Vec3, Vec4);

/// Replaces elements that are not finite or too large by a harmless one.
pub(super) fn mend<T: Element>(name: &str, values: &mut [T], harmless: T, notes: &mut Notes) {
    let mut count = 0;
    for value in values.iter_mut().filter(|value| !value.is_sound()) {
        *value = harmless;
        count += 1;
    }
    if count > 0 {
        notes.warnings.push(format!(
            "{name}: {count} of its elements are passed over, as they are not finite or over 1e18"
        ));
    }
}

/// Replaces the vertices by copies of those in `order`.
pub(super) fn select_vertices(primitive: &mut Primitive, order: &[u32]) {
    fn select<T: Copy>(values: &mut Vec<T>, order: &[u32]) {
        if !values.is_empty() {
            *values = order.iter().map(|i| values[*i as usize]).collect();
        }
    }
    let sets = primitive.influence_sets() as u32;
    primitive.sources = order.iter().map(|vertex| primitive.source(*vertex)).collect();
    select(&mut primitive.vertices.positions, order);
    select(&mut primitive.vertices.normals, order);
    select(&mut primitive.vertices.tangents, order);
    primitive.uv.iter_mut().for_each(|uv| select(uv, order));
    select(&mut primitive.colors, order);
    if sets > 0 {
        let order: Vec<u32> = order.iter().flat_map(|i| i * sets..(i + 1) * sets).collect();
        select(&mut primitive.joints, &order);
        select(&mut primitive.weights, &order);
    }
    for target in &mut primitive.morph_targets {
        select(&mut target.positions, order);
        select(&mut target.normals, order);
        select(&mut target.tangents, order);
    }
}
