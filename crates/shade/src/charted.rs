//! Primitives with lumels: their vertices are parted where charts are.

use std::collections::HashMap;
use std::sync::Arc;

use lumencast_gpu::Gpu;
use lumencast_light::{Charts, FieldId, Layout, Light, Surface, SurfaceId};
use lumencast_scene::{Instance, Mesh, Primitive};
use lumencast_shaders::layout;

use crate::part::{Corner, LumelPlace, Part, upload_corners};

/// A lightmap's surfaces on its pages, and its pages on layers of the pages' texture.
#[derive(Clone, Debug)]
pub(crate) struct PlacedLayout {
    /// The lightmap's number.
    pub(crate) field: FieldId,
    pub(crate) layout: Arc<Layout>,
    /// The layers of the first pages: of light, and of slopes.
    pub(crate) first_layers: [u32; 2],
}

/// Where surfaces lie on the layers of the pages' texture: lightmap after lightmap.
#[derive(Clone, Debug, Default)]
pub(crate) struct SurfaceLayouts(Vec<PlacedLayout>);

impl SurfaceLayouts {
    pub(crate) fn of(light: &Light) -> Self {
        let mut next = 0;
        let layouts = light.lightmaps().map(|lightmap| {
            let pages = lightmap.layout.pages;
            let first = next;
            let slopes = if lightmap.slopes.is_some() { first + pages } else { first };
            next = slopes + pages;
            let layout = lightmap.layout.clone();
            PlacedLayout { field: lightmap.id, layout, first_layers: [first, slopes] }
        });
        Self(layouts.collect())
    }

    /// Those of all lightmaps.
    pub(crate) fn all(&self) -> &[PlacedLayout] {
        &self.0
    }

    /// Whether they are the very same.
    pub(crate) fn is(&self, other: &Self) -> bool {
        let addresses = |of: &Self| -> Vec<(*const Layout, [u32; 2])> {
            of.0.iter().map(|placed| (Arc::as_ptr(&placed.layout), placed.first_layers)).collect()
        };
        addresses(self) == addresses(other)
    }

    /// The sides of a primitive that have lumels, front and back.
    fn sides(&self, instance: &Instance, primitive: usize) -> [Option<Side<'_>>; 2] {
        let (node, copy, primitive) = (instance.node.0, instance.copy, primitive as u32);
        [false, true].map(|back| {
            let id = SurfaceId { node, copy, primitive, back };
            self.0.iter().find_map(|PlacedLayout { layout, first_layers, .. }| {
                let surface = layout.surface(id)?;
                Some(Side { surface, first_layers: *first_layers, share: layout.share(id) })
            })
        })
    }
}

/// A side of a primitive that has lumels.
#[derive(Clone, Copy)]
struct Side<'a> {
    surface: &'a Surface,
    /// The layers of the first pages: of light, and of slopes.
    first_layers: [u32; 2],
    /// How far it has come from probes to lumels.
    share: f32,
}

/// The charts of the sides of each primitive of an instance.
type Sides = Vec<[Option<Arc<Charts>>; 2]>;

/// Meshes with their charts, each uploaded once.
#[derive(Debug, Default)]
pub(crate) struct Charted {
    kept: HashMap<Vec<usize>, Kept>,
}

#[derive(Debug)]
struct Kept {
    /// Kept, so that no other takes its place.
    _mesh: Arc<Mesh>,
    _sides: Sides,
    parts: Vec<Part>,
}

/// The primitives of an instance that has lumels.
pub(crate) struct WithLumels<'a> {
    pub(crate) parts: &'a [Part],
    /// Equal for instances that share their parts.
    pub(crate) number: usize,
}

impl Charted {
    /// Begins a listing: what is not asked for until the next one is forgotten then.
    pub(crate) fn begin(&mut self) -> Self {
        std::mem::take(self)
    }

    /// The primitives of an instance, where some of them have lumels. Its rectangles are put behind
    /// those that there are. `before`: what the last listing had.
    pub(crate) fn parts(
        &mut self,
        gpu: &Gpu,
        before: &mut Self,
        instance: &Instance,
        layouts: &SurfaceLayouts,
        rectangles: &mut Vec<layout::Rectangle>,
    ) -> Option<WithLumels<'_>> {
        if layouts.0.is_empty() || !instance.still {
            return None;
        }
        let primitives = &instance.mesh.primitives;
        let mut sides: Sides = Vec::with_capacity(primitives.len());
        let first = rectangles.len();
        for (number, primitive) in primitives.iter().enumerate() {
            let of = layouts.sides(instance, number);
            let of = of.map(|side| side.filter(|side| fits(&side.surface.charts, primitive)));
            for Side { surface, first_layers: [first_layer, slopes], share } in
                of.into_iter().flatten()
            {
                rectangles.extend(surface.rectangles.iter().map(|rectangle| layout::Rectangle {
                    corner: rectangle.corner.as_vec2(),
                    layer: first_layer + rectangle.page,
                    share,
                    slopes: slopes + rectangle.page,
                    _pad0: 0,
                }));
            }
            sides.push(of.map(|side| side.map(|side| side.surface.charts.clone())));
        }
        if rectangles.len() == first {
            return None;
        }
        let address =
            |charts: &Option<Arc<Charts>>| charts.as_ref().map_or(0, |c| Arc::as_ptr(c).addr());
        let key: Vec<usize> = std::iter::once(Arc::as_ptr(&instance.mesh).addr())
            .chain(sides.iter().flatten().map(address))
            .collect();
        let kept = match before.kept.remove(&key) {
            Some(kept) => self.kept.entry(key).or_insert(kept),
            None => self.kept.entry(key).or_insert_with(|| Kept {
                parts: upload(gpu, &instance.mesh, &sides),
                _mesh: instance.mesh.clone(),
                _sides: sides,
            }),
        };
        let number = kept.parts.as_ptr().addr();
        Some(WithLumels { parts: &kept.parts, number })
    }
}

/// Whether charts are those of a primitive: of as many triangles, with its vertices.
fn fits(charts: &Charts, primitive: &Primitive) -> bool {
    let is_own = |(triangle, own): (&[u32; 3], &[u32; 3])| {
        let source = |vertex: &u32| charts.vertices.get(*vertex as usize).map(|v| v.source);
        *triangle == Charts::NOWHERE
            || triangle.iter().map(source).eq(own.iter().map(|v| Some(primitive.source(*v))))
    };
    charts.triangles.len() == primitive.triangles.len()
        && charts.triangles.iter().zip(&primitive.triangles).all(is_own)
}

fn upload(gpu: &Gpu, mesh: &Mesh, sides: &Sides) -> Vec<Part> {
    let mut first = 0;
    let part = |(primitive, sides): (&Primitive, &[Option<Arc<Charts>>; 2])| {
        let firsts = sides.each_ref().map(|charts| {
            let own = first;
            first += charts.as_ref().map_or(0, |charts| charts.sizes.len() as u32);
            own
        });
        let mut known = HashMap::new();
        let mut corners = Vec::new();
        let mut triangles = Vec::with_capacity(primitive.triangles.len());
        for (number, triangle) in primitive.triangles.iter().enumerate() {
            triangles.push([0, 1, 2].map(|k| {
                // The vertices of the charts that it is, and where they lie.
                let of = |side: usize| {
                    let charts = sides[side].as_ref()?;
                    let vertex = charts.triangles[number];
                    (vertex != Charts::NOWHERE)
                        .then(|| (vertex[k], charts.vertices[vertex[k] as usize]))
                };
                let of = [of(0), of(1)];
                let key = (triangle[k], of.map(|side| side.map(|(vertex, _)| vertex)));
                *known.entry(key).or_insert_with(|| {
                    let place = |side: usize| match of[side] {
                        Some((_, v)) => {
                            LumelPlace { at: v.at, rectangle: firsts[side] + v.rectangle }
                        }
                        None => LumelPlace::NOWHERE,
                    };
                    corners.push(Corner { source: triangle[k], lumels: [place(0), place(1)] });
                    corners.len() as u32 - 1
                })
            }));
        }
        upload_corners(gpu, primitive, &corners, &triangles)
    };
    mesh.primitives.iter().zip(sides).map(part).collect()
}
