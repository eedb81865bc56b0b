//! Layouts as bytes (docs/wire.md, "Layouts").

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use glam::UVec2;
use lumencast_light::{Charts, Layout, Rectangle, Surface, SurfaceId};

use super::charts::write_charts;
use super::{Resource, ResourceHash};
use crate::bytes::{Reader, put_varint};
use crate::{DecodeError, limits};

const VERSION: u64 = 1;
/// Bytes of a surface without rectangles, at least.
const LEAST_SURFACE: usize = 37;

/// Where surfaces lie on pages. Their charts are resources of their own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayoutResource {
    /// Lumels a side of every page.
    pub page_size: u32,
    /// Number of pages.
    pub pages: u32,
    /// In order of their numbers.
    pub surfaces: Vec<PlacedSurface>,
}

/// A surface of which the charts are told by name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlacedSurface {
    /// Which it is.
    pub id: SurfaceId,
    /// The resource that holds its charts.
    pub charts: ResourceHash,
    /// Where each of the charts' rectangles lies.
    pub rectangles: Vec<Rectangle>,
}

/// A layout and the charts of its surfaces as resources. Charts that several surfaces share are one.
pub fn layout_resources(layout: &Layout) -> (Resource, Vec<Resource>) {
    let mut names = HashMap::new();
    let mut charts = HashMap::new();
    let mut placed = Vec::with_capacity(layout.surfaces().len());
    for surface in layout.surfaces() {
        let name = *names.entry(Arc::as_ptr(&surface.charts)).or_insert_with(|| {
            let resource = Resource::new(write_charts(&surface.charts));
            let name = resource.hash();
            charts.insert(name, resource);
            name
        });
        let rectangles = surface.rectangles.clone();
        placed.push(PlacedSurface { id: surface.id, charts: name, rectangles });
    }
    let Layout { page_size, pages, .. } = *layout;
    let layout = LayoutResource { page_size, pages, surfaces: placed };
    let mut charts: Vec<Resource> = charts.into_values().collect();
    charts.sort_by_key(Resource::hash);
    (Resource::new(layout.write()), charts)
}

impl LayoutResource {
    fn write(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(16 + 48 * self.surfaces.len());
        put_varint(&mut out, VERSION);
        put_varint(&mut out, self.page_size.into());
        put_varint(&mut out, self.pages.into());
        put_varint(&mut out, self.surfaces.len() as u64);
        for PlacedSurface { id, charts, rectangles } in &self.surfaces {
            put_varint(&mut out, id.node.into());
            put_varint(&mut out, id.copy.into());
            put_varint(&mut out, id.primitive.into());
            out.push(id.back.into());
            out.extend(charts.0);
            put_varint(&mut out, rectangles.len() as u64);
            for Rectangle { page, corner } in rectangles {
                put_varint(&mut out, (*page).into());
                put_varint(&mut out, corner.x.into());
                put_varint(&mut out, corner.y.into());
            }
        }
        out
    }

    /// Reads a layout.
    ///
    /// # Errors
    /// [`DecodeError`] when the bytes are no layout of this version, exceed a limit or contradict
    /// themselves.
    pub fn read(bytes: &[u8]) -> Result<Self, DecodeError> {
        let mut reader = super::reader(bytes, VERSION)?;
        let (page_size, pages) = (reader.number()?, reader.number()?);
        let most = limits::PAGE_LUMELS as usize;
        DecodeError::limit("lumels of a page along a side", page_size as usize, most)?;
        let mut read = Self { page_size, pages, surfaces: Vec::new() };
        let surfaces = reader.count(LEAST_SURFACE)?;
        read.surfaces.reserve_exact(surfaces);
        for _ in 0..surfaces {
            let surface = read.surface(&mut reader)?;
            if read.surfaces.last().is_some_and(|last| last.id >= surface.id) {
                return Err(DecodeError::Malformed("surfaces out of order"));
            }
            read.surfaces.push(surface);
        }
        super::at_end(&reader)?;
        Ok(read)
    }

    fn surface(&self, reader: &mut Reader<'_>) -> Result<PlacedSurface, DecodeError> {
        let (node, copy, primitive) = (reader.number()?, reader.number()?, reader.number()?);
        let back = match reader.u8()? {
            side @ (0 | 1) => side == 1,
            _ => return Err(DecodeError::Malformed("a side of a surface")),
        };
        let mut charts = ResourceHash::default();
        charts.0.copy_from_slice(reader.take(32)?);
        let rectangles = reader.count(3)?;
        let rectangles =
            (0..rectangles).map(|_| self.rectangle(reader)).collect::<Result<_, _>>()?;
        Ok(PlacedSurface { id: SurfaceId { node, copy, primitive, back }, charts, rectangles })
    }

    fn rectangle(&self, reader: &mut Reader<'_>) -> Result<Rectangle, DecodeError> {
        let page = reader.number()?;
        let corner = UVec2::new(reader.number()?, reader.number()?);
        if page >= self.pages || corner.cmpge(UVec2::splat(self.page_size)).any() {
            return Err(DecodeError::Malformed("a rectangle outside the pages"));
        }
        Ok(Rectangle { page, corner })
    }

    /// The charts that it needs.
    pub fn charts(&self) -> BTreeSet<ResourceHash> {
        self.surfaces.iter().map(|surface| surface.charts).collect()
    }

    /// The layout of the surfaces whose charts are known. A surface whose rectangles are not those of
    /// its charts, or do not fit their pages, is left out.
    pub fn layout(&self, known: impl Fn(ResourceHash) -> Option<Arc<Charts>>) -> Layout {
        let surface = |placed: &PlacedSurface| {
            let charts = known(placed.charts)?;
            let rectangles = placed.rectangles.clone();
            let fits = self.fits(&rectangles, &charts.sizes);
            fits.then_some(Surface { id: placed.id, charts, rectangles })
        };
        let surfaces = self.surfaces.iter().filter_map(surface).collect();
        Layout::new(self.page_size, self.pages, surfaces)
    }

    fn fits(&self, rectangles: &[Rectangle], sizes: &[UVec2]) -> bool {
        let page = UVec2::splat(self.page_size);
        let fits = |(rectangle, size): (&Rectangle, &UVec2)| {
            rectangle.corner.saturating_add(*size).cmple(page).all()
        };
        rectangles.len() == sizes.len() && rectangles.iter().zip(sizes).all(fits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read_charts;
    use glam::Vec2;
    use lumencast_light::ChartVertex;

    fn charts(width: u32) -> Arc<Charts> {
        let at = |x: f32, y: f32| ChartVertex { source: 0, rectangle: 0, at: Vec2::new(x, y) };
        Arc::new(Charts {
            sizes: vec![UVec2::new(width, 4)],
            vertices: vec![at(0.5, 0.5), at(3.5, 0.5), at(0.5, 3.5)],
            triangles: vec![[0, 1, 2]],
        })
    }

    fn surface(node: u32, charts: &Arc<Charts>, page: u32, x: u32) -> Surface {
        Surface {
            id: SurfaceId { node, copy: 1, primitive: 2, back: node % 2 == 1 },
            charts: charts.clone(),
            rectangles: vec![Rectangle { page, corner: UVec2::new(x, 12) }],
        }
    }

    fn layout() -> Layout {
        let [narrow, wide] = [charts(4), charts(8)];
        let surfaces =
            vec![surface(3, &narrow, 0, 0), surface(1, &narrow, 1, 4), surface(2, &wide, 1, 8)];
        Layout::new(16, 2, surfaces)
    }

    fn known(charts: &[Resource]) -> impl Fn(ResourceHash) -> Option<Arc<Charts>> + '_ {
        move |hash| {
            let resource = charts.iter().find(|resource| resource.hash() == hash)?;
            read_charts(resource.bytes()).ok().map(Arc::new)
        }
    }

    #[test]
    fn layouts_round_trip_with_charts_once_each() {
        let (resource, charts) = layout_resources(&layout());
        let read = LayoutResource::read(resource.bytes()).unwrap();
        assert_eq!((charts.len(), read.charts().len()), (2, 2));
        assert_eq!(read.layout(known(&charts)), layout());
        assert_eq!(Resource::new(read.write()), resource);
    }

    #[test]
    fn surfaces_without_charts_or_that_contradict_them_are_left_out() {
        let (resource, charts) = layout_resources(&layout());
        let read = LayoutResource::read(resource.bytes()).unwrap();
        let nodes = |read: &LayoutResource, charts: &[Resource]| -> Vec<u32> {
            let layout = read.layout(known(charts));
            layout.surfaces().iter().map(|surface| surface.id.node).collect()
        };
        let wide = read.surfaces[1].charts;
        let only: Vec<Resource> = charts.iter().filter(|c| c.hash() == wide).cloned().collect();
        assert_eq!(nodes(&read, &only), [2]);
        let mut twice = read.clone();
        twice.surfaces[0].rectangles.push(Rectangle::default());
        assert_eq!(nodes(&twice, &charts), [2, 3], "a rectangle too many");
        let mut beyond = read.clone();
        beyond.surfaces[1].rectangles[0].corner.x = 9;
        assert_eq!(nodes(&beyond, &charts), [1, 3], "over the page's border");
    }

    #[test]
    fn contradictions_are_refused() {
        let (resource, _) = layout_resources(&layout());
        let good = LayoutResource::read(resource.bytes()).unwrap();
        let turned = |turn: &dyn Fn(&mut LayoutResource)| {
            let mut turned = good.clone();
            turn(&mut turned);
            LayoutResource::read(&turned.write()).map(drop).map_err(|error| error.kind())
        };
        assert_eq!(turned(&|_| ()), Ok(()));
        assert_eq!(turned(&|l| l.surfaces.swap(0, 1)), Err("malformed"));
        assert_eq!(turned(&|l| l.surfaces[1].id = l.surfaces[0].id), Err("malformed"));
        assert_eq!(turned(&|l| l.pages = 1), Err("malformed"));
        assert_eq!(turned(&|l| l.surfaces[0].rectangles[0].corner.y = 16), Err("malformed"));
        assert_eq!(turned(&|l| l.page_size = 4097), Err("limit"));
        let bytes = resource.bytes();
        for length in 0..bytes.len() {
            let error = LayoutResource::read(&bytes[..length]).map_err(|error| error.kind());
            assert_eq!(error, Err("truncated"), "{length}");
        }
        let read = |bytes: &[u8]| LayoutResource::read(bytes).map(drop).map_err(|e| e.kind());
        assert_eq!(read(&[bytes, &[0]].concat()), Err("malformed"));
        assert_eq!(read(&[&[2], &bytes[1..]].concat()), Err("version"));
        // The side of the first surface.
        let mut sideways = bytes.to_vec();
        assert_eq!(std::mem::replace(&mut sideways[7], 2), 1);
        assert_eq!(read(&sideways), Err("malformed"));
    }
}
