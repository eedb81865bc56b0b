//! The cache itself: what comes in, and what is to be seen at a time.

use std::collections::{BTreeMap, VecDeque};
use std::ops::Deref;

use lumencast_codec::{
    Catalog, ClientEdit, Epoch, FieldInfo, LightFile, LightTrack, Resource, ResourceHash,
    StateFrame,
};
use lumencast_light::{Field, FieldId, Light, LumelAges};
use lumencast_scene::Edit;

use crate::CacheError;
use crate::clock::ServerClock;
use crate::edits::{Edits, SceneEvent};
use crate::field::FieldCache;
use crate::handover::Handover;
use crate::newest::Newest;
use crate::received::Received;
use crate::resources::Resources;

/// Seconds that the scene's time may run on past the newest state frame.
const LONGEST_RUN: f64 = 1.0;

/// What a client knows of a server: its fields and their light, its clock, its scene.
///
/// It owns no socket, no thread and no clock: the caller passes bytes in, and with every call the
/// time `now` in seconds on a clock of its own that never goes back. Frames may be late, lost,
/// doubled and out of order; the catalog comes first, again after each new connection. Wrong bytes
/// give an error and change nothing.
///
/// Memory: five copies of the light of those regions that frames have come for, at most
/// [`lumencast_codec::limits::CATALOG_PROBES`] probes and [`lumencast_codec::limits::CATALOG_LUMELS`]
/// lumels; three where nothing changes.
#[derive(Debug, Default)]
pub struct Cache {
    catalog: Option<Catalog>,
    /// Whether the catalog is that of a file.
    saved: bool,
    fields: BTreeMap<u32, FieldCache>,
    light: Light,
    /// Of each lightmap, how its surfaces pass from one layout to the next.
    handovers: BTreeMap<u32, Handover>,
    resources: Resources,
    clock: ServerClock,
    state: Option<StateFrame>,
    edits: Edits,
}

/// Light at a moment.
#[derive(Clone, Copy, Debug)]
pub struct CurrentLight<'a> {
    /// The fields, blended to that moment. Regions for which nothing has come yet hold the light of
    /// before, or none.
    pub light: &'a Light,
    /// Seconds since the newest light was computed; `None` when none came from a server.
    pub age: Option<f64>,
    /// Seconds since the oldest region's light was computed.
    pub oldest_age: Option<f64>,
    /// Tick of the newest light of the catalog's own server.
    pub tick: Option<u64>,
    /// Version of the scene that that light was computed from.
    pub scene_version: Option<u64>,
}

impl Deref for CurrentLight<'_> {
    type Target = Light;

    fn deref(&self) -> &Light {
        self.light
    }
}

impl Cache {
    /// For a client that sends no edits.
    pub fn new() -> Self {
        Self::default()
    }

    /// For a client that sends edits under the name `client`, by which they come back.
    pub fn of_client(client: impl Into<String>) -> Self {
        Self { edits: Edits::of_client(client.into()), ..Self::default() }
    }

    /// The name under which this client's edits come back.
    pub fn client(&self) -> &str {
        self.edits.client()
    }

    /// Takes in a frame of the `catalog` track. A new epoch makes the cache forget acknowledgements
    /// and clock of the old one, a field's new epoch makes it forget that field's updates; the light
    /// stays until new light is there. Fields and regions that are no longer listed are forgotten.
    ///
    /// # Errors
    /// [`CacheError::Decode`].
    pub fn add_catalog(&mut self, bytes: &[u8], now: f64) -> Result<(), CacheError> {
        let catalog = Catalog::decode(bytes)?;
        // What it leaves of the light is what is to be seen now.
        self.show(now);
        self.set_catalog(catalog, false);
        Ok(())
    }

    /// Starts from saved light, before a server has been heard of.
    ///
    /// # Errors
    /// [`CacheError::Decode`]; [`CacheError::Connected`] once a server's catalog has come.
    pub fn load(&mut self, file: &[u8], now: f64) -> Result<(), CacheError> {
        if self.catalog.is_some() && !self.saved {
            return Err(CacheError::Connected);
        }
        let file = LightFile::read(file)?;
        let mut loaded = Self::default();
        loaded.set_catalog(file.catalog, true);
        // Twice, since layouts tell which charts are wanted.
        for resource in file.resources.iter().chain(&file.resources).map(Resource::bytes) {
            match loaded.add_resource(resource) {
                Ok(()) | Err(CacheError::UnknownResource(_)) => {}
                Err(error) => return Err(error),
            }
        }
        for frame in &file.frames {
            let track = LightTrack { field: frame.field, region: frame.region, layer: 0 };
            match loaded.add_light(track, &frame.bytes, now) {
                Ok(_) | Err(CacheError::UnknownField(_) | CacheError::UnknownRegion { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        *self = Self { edits: std::mem::take(&mut self.edits), ..loaded };
        Ok(())
    }

    fn set_catalog(&mut self, catalog: Catalog, saved: bool) {
        let before = self.catalog.take();
        let restarted = before.as_ref().is_some_and(|old| old.epoch != catalog.epoch);
        if restarted || self.saved {
            self.clock = ServerClock::default();
            self.state = None;
            if !self.saved {
                self.edits.restart();
            }
        }
        let mut caches = BTreeMap::new();
        let mut shown = Vec::with_capacity(catalog.fields.len());
        for info in &catalog.fields {
            let same = before.as_ref().and_then(|before| {
                let old =
                    before.field(info.id).filter(|old| old.shape.is_coded_alike(&info.shape))?;
                Some(before.epoch_of(old))
            });
            let known = self.light.field(FieldId(info.id));
            shown.push(match known {
                Some(field) if same.is_some() => field.clone(),
                _ => FieldCache::lit_by(&self.light, info),
            });
            let goes_on = same == Some(catalog.epoch_of(info)) && !self.saved;
            let kept = self.fields.remove(&info.id).filter(|_| same.is_some());
            let mut cache = kept.unwrap_or_else(|| FieldCache::new(info));
            if !goes_on {
                cache.forget_updates();
            }
            caches.insert(info.id, cache);
        }
        self.fields = caches;
        self.light = Light::new(shown);
        self.handovers.retain(|id, _| catalog.field(*id).is_some());
        self.resources.follow(&catalog);
        self.catalog = Some(catalog);
        self.saved = saved;
    }

    /// Takes in a frame of the `state` track; whether it was newer than all before. What it tells
    /// of the scene waits in [`Cache::scene_events`].
    ///
    /// # Errors
    /// [`CacheError::Decode`], [`CacheError::NoCatalog`].
    pub fn add_state(&mut self, bytes: &[u8], now: f64) -> Result<bool, CacheError> {
        if self.catalog.is_none() || self.saved {
            return Err(CacheError::NoCatalog);
        }
        let frame = StateFrame::decode(bytes)?;
        let news = self.edits.take_in(&frame);
        if news {
            self.clock.sample(frame.tick, frame.clock, now);
            let (edits, refused, snapshot) = (Vec::new(), Vec::new(), None);
            self.state = Some(StateFrame { edits, refused, snapshot, ..frame });
        }
        Ok(news)
    }

    /// Takes in a frame of a track of light.
    ///
    /// # Errors
    /// Any [`CacheError`] but [`CacheError::Connected`]. A missing base
    /// ([`lumencast_codec::DecodeError::MissingBase`]) is no reason to worry: a later frame helps.
    pub fn add_light(
        &mut self,
        track: LightTrack,
        bytes: &[u8],
        now: f64,
    ) -> Result<Received, CacheError> {
        let catalog = self.catalog.as_ref().ok_or(CacheError::NoCatalog)?;
        let unknown = CacheError::UnknownField(track.field);
        let cache = self.fields.get_mut(&track.field).ok_or(unknown.clone())?;
        let shown = self.light.fields_mut().iter_mut().find(|field| field.id().0 == track.field);
        cache.add(track, bytes, now, catalog.tick_seconds, shown.ok_or(unknown)?)
    }

    /// Names of resources that are to be asked for: the layouts that the catalog names, and the charts
    /// that known layouts name. Those that have come are forgotten when nothing names them any more.
    pub fn wanted_resources(&self) -> Vec<ResourceHash> {
        self.resources.wanted()
    }

    /// Takes in a resource's bytes. Lightmaps show its surfaces from the next call of
    /// [`Cache::light`] on; those whose charts have not come yet are left out.
    ///
    /// # Errors
    /// [`CacheError::UnknownResource`] when the bytes are none of [`Cache::wanted_resources`]; it
    /// changes nothing. [`CacheError::Decode`] when they are, and cannot be read or are too much; they
    /// are then wanted no longer.
    pub fn add_resource(&mut self, bytes: &[u8]) -> Result<(), CacheError> {
        self.resources.add(bytes)
    }

    /// The light to be seen at `now`: every region on the way from its last update to its newest,
    /// which it reaches one measured interval after that one came. An update that is overdue leaves
    /// the newest standing.
    pub fn light(&mut self, now: f64) -> CurrentLight<'_> {
        self.show(now);
        let ages = || self.newest().filter_map(|(field, newest)| self.age(field, newest, now));
        // Ticks of another server count something else.
        let newest = self
            .newest()
            .filter(|(field, _)| self.is_own(field))
            .map(|(_, newest)| newest.info)
            .max_by_key(|info| info.tick);
        CurrentLight {
            light: &self.light,
            age: ages().min_by(f64::total_cmp),
            oldest_age: ages().max_by(f64::total_cmp),
            tick: newest.map(|info| info.tick),
            scene_version: newest.map(|info| info.scene_version),
        }
    }

    /// How long ago, at `now`, the light of each lightmap's tiles came; of saved light, how long ago it was
    /// loaded.
    pub fn lumel_ages(&self, now: f64) -> Vec<LumelAges> {
        let ages = |(id, cache): (&u32, &FieldCache)| cache.lumel_ages(FieldId(*id), now);
        self.fields.iter().filter_map(ages).collect()
    }

    /// Brings the light to what is to be seen at `now`.
    fn show(&mut self, now: f64) {
        self.lay_out(now);
        for field in self.light.fields_mut() {
            if let Some(cache) = self.fields.get_mut(&field.id().0) {
                cache.show(now, field);
            }
        }
    }

    /// Gives lightmaps their layouts at `now`, as far as these are known.
    fn lay_out(&mut self, now: f64) {
        self.resources.lay_out();
        for lightmap in self.light.fields_mut().iter_mut().filter_map(Field::as_lightmap_mut) {
            let info = self.catalog.as_ref().and_then(|catalog| catalog.field(lightmap.id.0));
            let shape = info.and_then(|info| info.shape.as_lightmap());
            if let Some(layout) = shape.and_then(|shape| self.resources.layout(shape)) {
                let handover = self.handovers.entry(lightmap.id.0).or_default();
                lightmap.layout = handover.show(layout, now);
            }
        }
    }

    /// The newest light of every region that has any.
    fn newest(&self) -> impl Iterator<Item = (&FieldInfo, &Newest)> {
        let fields = self.catalog.iter().flat_map(|catalog| &catalog.fields);
        fields.flat_map(|field| {
            let cache = self.fields.get(&field.id).into_iter();
            cache.flat_map(FieldCache::newest).map(move |newest| (field, newest))
        })
    }

    /// Whether a field comes from the server whose clock and ticks the state track tells.
    fn is_own(&self, field: &FieldInfo) -> bool {
        self.catalog.as_ref().is_some_and(|catalog| catalog.epoch_of(field) == catalog.epoch)
    }

    /// Seconds since light was computed; since it came, where its server's clock is not known.
    fn age(&self, field: &FieldInfo, light: &Newest, now: f64) -> Option<f64> {
        if self.saved {
            return None;
        }
        let tick_seconds = self.catalog.as_ref()?.tick_seconds;
        let computed = self.clock.of_tick(light.info.tick, tick_seconds);
        let age = match (self.clock.at(now), computed) {
            (Some(time), Some(computed)) if self.is_own(field) => time - computed,
            _ => now - light.arrived,
        };
        Some(age.max(0.0))
    }

    /// Whether all that is known is of `tick` or later: the state, with no tick missing before it, and the
    /// light of every region. Ticks of another server's fields count something else: of those any light will
    /// do.
    pub fn has_reached(&self, tick: u64) -> bool {
        let Some(catalog) = self.catalog.as_ref().filter(|_| !self.saved) else { return false };
        let newest = |field: &FieldInfo, region: u32| {
            Some(self.fields.get(&field.id)?.newest_of(region)?.info.tick)
        };
        let is_lit = |field: &FieldInfo| {
            let least = if self.is_own(field) { tick } else { 0 };
            field.shape.regions().all(|region| newest(field, region) >= Some(least))
        };
        let state = self.state.as_ref().is_some_and(|state| state.tick >= tick);
        state && self.server_edits().is_some() && catalog.fields.iter().all(is_lit)
    }

    /// What happened to the scene since the last call, in order.
    pub fn scene_events(&mut self) -> Vec<SceneEvent> {
        self.edits.take_events()
    }

    /// Edits that turn the scene as it stands in its file into the server's; `None` while a tick is
    /// missing, until the next snapshot.
    pub fn server_edits(&self) -> Option<&[Edit]> {
        self.edits.server()
    }

    /// Puts an edit on the list of those that wait for the server; the bytes are to be sent. The
    /// caller shows the edit at once and hears of its fate by [`Cache::scene_events`].
    ///
    /// # Errors
    /// [`CacheError::TooManyPending`].
    pub fn edit(&mut self, edit: Edit) -> Result<Vec<u8>, CacheError> {
        self.edits.add(edit)
    }

    /// Edits that the server has not dealt with yet, oldest first; to be sent again on a new
    /// connection.
    pub fn pending(&self) -> &VecDeque<ClientEdit> {
        self.edits.pending()
    }

    /// The server's run; `None` before its catalog.
    pub fn epoch(&self) -> Option<Epoch> {
        self.catalog.as_ref().filter(|_| !self.saved).map(|catalog| catalog.epoch)
    }

    /// What the server, or the loaded file, offers.
    pub fn current_catalog(&self) -> Option<&Catalog> {
        self.catalog.as_ref()
    }

    /// The newest state frame, without its edits.
    pub fn newest_state(&self) -> Option<&StateFrame> {
        self.state.as_ref()
    }

    /// The server's clock at `now`, seconds, late by the least delay of the way.
    pub fn server_time(&self, now: f64) -> Option<f64> {
        self.clock.at(now)
    }

    /// Scene time at `now`, seconds; it stands still when the server has been silent for a second.
    pub fn scene_time(&self, now: f64) -> Option<f64> {
        let state = self.state.as_ref()?;
        let passed = self.clock.at(now)? - state.clock;
        Some(state.time + passed.clamp(0.0, LONGEST_RUN))
    }
}
