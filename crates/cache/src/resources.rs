//! Layouts and charts that have come, and those to be asked for.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use lumencast_codec::{
    Catalog, DecodeError, LayoutResource, LightmapShape, ResourceHash, limits, read_charts,
};
use lumencast_light::{Charts, Layout};

use crate::CacheError;

/// All resources that the catalog and known layouts name.
#[derive(Clone, Debug, Default)]
pub(crate) struct Resources {
    layouts: BTreeMap<ResourceHash, State<KnownLayout>>,
    charts: BTreeMap<ResourceHash, State<Arc<Charts>>>,
    /// Bytes of all that have come.
    bytes: usize,
    /// Whether something has come that layouts do not show yet.
    stale: bool,
}

/// A layout, with as many of its surfaces as have charts.
#[derive(Clone, Debug)]
struct KnownLayout {
    resource: LayoutResource,
    layout: Arc<Layout>,
}

/// What is known of a resource that something names.
#[derive(Clone, Debug)]
enum State<T> {
    Wanted,
    Here {
        value: T,
        bytes: usize,
    },
    /// It has come and makes no sense, or was too much: it is not asked for again.
    Unreadable,
}

impl<T> State<T> {
    fn is_wanted(&self) -> bool {
        matches!(self, Self::Wanted)
    }

    fn value(&self) -> Option<&T> {
        match self {
            Self::Here { value, .. } => Some(value),
            Self::Wanted | Self::Unreadable => None,
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Here { bytes, .. } => *bytes,
            Self::Wanted | Self::Unreadable => 0,
        }
    }

    /// Becomes what was read.
    fn settle(&mut self, read: Result<T, DecodeError>, bytes: usize) -> Result<(), CacheError> {
        let (state, result) = match read {
            Ok(value) => (Self::Here { value, bytes }, Ok(())),
            Err(error) => (Self::Unreadable, Err(error.into())),
        };
        *self = state;
        result
    }
}

impl Resources {
    /// Names those that have not come yet: layouts, then charts.
    pub(crate) fn wanted(&self) -> Vec<ResourceHash> {
        let layouts = self.layouts.iter().filter(|(_, state)| state.is_wanted());
        let charts = self.charts.iter().filter(|(_, state)| state.is_wanted());
        layouts.map(|(hash, _)| *hash).chain(charts.map(|(hash, _)| *hash)).collect()
    }

    /// Wants what a catalog names, and forgets all that it does not.
    pub(crate) fn follow(&mut self, catalog: &Catalog) {
        let shapes = catalog.fields.iter().filter_map(|field| field.shape.as_lightmap());
        let named: BTreeSet<ResourceHash> = shapes.map(|shape| shape.layout).collect();
        self.layouts.retain(|hash, _| named.contains(hash));
        for hash in named {
            self.layouts.entry(hash).or_insert(State::Wanted);
        }
        self.forget();
    }

    /// Forgets charts that no layout names, once all layouts are known.
    fn forget(&mut self) {
        if self.layouts.values().any(State::is_wanted) {
            return;
        }
        let known = self.layouts.values().filter_map(State::value);
        let needed: BTreeSet<_> = known.flat_map(|known| known.resource.charts()).collect();
        self.charts.retain(|hash, _| needed.contains(hash));
        let layouts: usize = self.layouts.values().map(State::bytes).sum();
        self.bytes = layouts + self.charts.values().map(State::bytes).sum::<usize>();
    }

    /// Takes a resource in.
    pub(crate) fn add(&mut self, bytes: &[u8]) -> Result<(), CacheError> {
        let (hash, length) = (ResourceHash::of(bytes), bytes.len());
        let room = self.room_for(length);
        if let Some(state) = self.layouts.get_mut(&hash).filter(|state| state.is_wanted()) {
            let read = room.and_then(|()| LayoutResource::read(bytes));
            let layout = Arc::default();
            state.settle(read.map(|resource| KnownLayout { resource, layout }), length)?;
            let charts = state.value().map(|known| known.resource.charts());
            for charts in charts.into_iter().flatten() {
                self.charts.entry(charts).or_insert(State::Wanted);
            }
        } else if let Some(state) = self.charts.get_mut(&hash).filter(|state| state.is_wanted()) {
            let read = room.and_then(|()| read_charts(bytes));
            state.settle(read.map(Arc::new), length)?;
        } else {
            return Err(CacheError::UnknownResource(hash));
        }
        self.bytes += length;
        self.stale = true;
        self.forget();
        Ok(())
    }

    /// Whether so many bytes more may be kept.
    fn room_for(&self, bytes: usize) -> Result<(), DecodeError> {
        let (value, limit) = (self.bytes + bytes, limits::CATALOG_RESOURCE_BYTES);
        if value <= limit {
            return Ok(());
        }
        let what = "bytes of all resources";
        Err(DecodeError::Limit { what, value: value as u64, limit: limit as u64 })
    }

    /// Puts the surfaces into layouts whose charts have come since the last call.
    pub(crate) fn lay_out(&mut self) {
        if !std::mem::take(&mut self.stale) {
            return;
        }
        for state in self.layouts.values_mut() {
            if let State::Here { value: known, .. } = state {
                let charts = |hash| self.charts.get(&hash).and_then(State::value).cloned();
                known.layout = Arc::new(known.resource.layout(charts));
            }
        }
    }

    /// The layout of a lightmap, where it is known and of its pages.
    pub(crate) fn layout(&self, shape: &LightmapShape) -> Option<&Arc<Layout>> {
        let layout = &self.layouts.get(&shape.layout)?.value()?.layout;
        let pages = (layout.page_size, layout.pages);
        (pages == (shape.page_size, shape.pages)).then_some(layout)
    }
}
