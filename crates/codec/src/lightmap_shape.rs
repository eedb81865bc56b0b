//! The shape of a lightmap: its pages, and where surfaces lie on them.

use std::collections::HashMap;
use std::sync::Arc;

use lumencast_light::{FieldId, Layout, Lightmap};
use serde::{Deserialize, Serialize};

use crate::lumel::{Coding, Cut, Tile};
use crate::{
    DecodeError, LayoutResource, Resource, ResourceHash, layout_resources, limits, read_charts,
};

/// A lightmap, as a catalog describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LightmapShape {
    /// How lumels are coded.
    pub coding: Coding,
    /// Lumels a side of every page.
    pub page_size: u32,
    /// Number of pages.
    pub pages: u32,
    /// Whether there are slopes, too ([`Lightmap::slopes`]).
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub slopes: bool,
    /// The resource that tells where surfaces lie on the pages.
    pub layout: ResourceHash,
}

impl LightmapShape {
    /// The shape of a lightmap that is coded so. It costs as much as writing its layout.
    pub fn of(lightmap: &Lightmap, coding: Coding) -> Self {
        let Layout { page_size, pages, .. } = *lightmap.layout;
        let layout = layout_resources(&lightmap.layout).0.hash();
        Self { coding, page_size, pages, slopes: lightmap.slopes.is_some(), layout }
    }

    /// A lightmap of this shape without light, whose layout has no surfaces: nothing is read from it
    /// until the layout is known.
    pub fn dark(&self, id: FieldId) -> Lightmap {
        let layout = Layout::new(self.page_size, self.pages, Vec::new());
        Lightmap::dark(id, Arc::new(layout)).with_slopes(self.slopes)
    }

    /// Whether frames of the one are frames of the other too: only their layouts may differ.
    pub fn is_coded_alike(&self, other: &Self) -> bool {
        Self { layout: other.layout, ..self.clone() } == *other
    }

    /// Number of lumels of all pages; where there are slopes, of these too.
    pub fn lumel_count(&self) -> usize {
        let irradiance = self.pages as usize * (self.page_size as usize).pow(2);
        if self.slopes { 2 * irradiance } else { irradiance }
    }

    /// How it is cut into tiles: as video a page is one.
    fn cut(&self) -> Cut {
        let Self { page_size, pages, slopes, .. } = *self;
        let side = match self.coding {
            Coding::Halves => limits::TILE_LUMELS,
            Coding::H264 | Coding::H264Stacked => page_size,
        };
        Cut { page_size, pages, slopes, side }
    }

    /// Its tiles, in order of their numbers.
    pub fn tiles(&self) -> impl Iterator<Item = Tile> + use<> {
        self.cut().tiles()
    }

    /// The tile of a number.
    pub fn tile(&self, id: u32) -> Option<Tile> {
        self.cut().tile(id)
    }

    /// Its layout, of resources that hold all of it.
    ///
    /// # Errors
    /// [`DecodeError`] when the layout or charts are missing, cannot be read or are of other pages.
    pub(crate) fn layout_of<'a>(&self, resources: &'a [Resource]) -> Result<Layout, DecodeError> {
        let named = |resource: &'a Resource| (resource.hash(), resource.bytes());
        let known: HashMap<_, _> = resources.iter().map(named).collect();
        let bytes = |hash: ResourceHash| {
            known.get(&hash).copied().ok_or(DecodeError::Malformed("a resource is missing"))
        };
        let layout = LayoutResource::read(bytes(self.layout)?)?;
        if (layout.page_size, layout.pages) != (self.page_size, self.pages) {
            return Err(DecodeError::Malformed("a layout of other pages"));
        }
        let read = |hash| Ok((hash, Arc::new(read_charts(bytes(hash)?)?)));
        let charts: Result<HashMap<_, _>, _> = layout.charts().into_iter().map(read).collect();
        let charts = charts?;
        Ok(layout.layout(|hash| charts.get(&hash).cloned()))
    }

    /// The shape, if it can be one.
    ///
    /// # Errors
    /// A size out of its range, or a limit that is exceeded.
    pub(crate) fn validated(self) -> Result<Self, DecodeError> {
        if self.page_size == 0 || self.pages == 0 {
            return Err(DecodeError::Malformed("a lightmap without lumels"));
        }
        let (side, most) = (self.page_size as usize, limits::PAGE_LUMELS as usize);
        DecodeError::limit("lumels of a page along a side", side, most)?;
        let lumels = side.pow(2).saturating_mul(self.pages as usize);
        DecodeError::limit("lumels of a field", lumels, limits::FIELD_LUMELS)?;
        DecodeError::limit("lumels of a field", self.lumel_count(), limits::FIELD_LUMELS)?;
        DecodeError::limit("regions of a field", self.cut().count(), limits::REGIONS)?;
        Ok(self)
    }
}
