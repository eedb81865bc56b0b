//! Light on disk: `.light` files (docs/wire.md, "Files").

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use lumencast_light::Field;
use lumencast_scene::Edit;

use crate::bytes::{Reader, put_varint};
use crate::state::{read_edits, write_edits};
use crate::{
    Catalog, DecodeError, Epoch, FieldEncoder, FrameHead, LumelCoding, LumelDecoder, ProbeDecoder,
    ProbeHeader, Resource, SceneInfo, Shape, UpdateInfo, layout_resources, limits,
};

const MAGIC: &[u8; 8] = b"LUMENCST";
/// Version of the file; that of what is in its records is the wire's.
const VERSION: u8 = 2;

/// What a record holds; those of other kinds are passed over.
mod kind {
    pub(super) const CATALOG: u64 = 0;
    pub(super) const KEYFRAME: u64 = 1;
    pub(super) const EDITS: u64 = 2;
    pub(super) const FILE: u64 = 3;
    pub(super) const RESOURCE: u64 = 4;
}

/// Saved light: a catalog and keyframes, the same bytes as on the wire.
#[derive(Clone, Debug, PartialEq)]
pub struct LightFile {
    /// What is in the file.
    pub catalog: Catalog,
    /// Edits that turn the scene as it stands in its file into the scene that this light is of.
    pub edits: Vec<Edit>,
    /// Files that the edits name.
    pub files: Vec<SavedFile>,
    /// Layouts of lightmaps, and their charts.
    pub resources: Vec<Resource>,
    /// Keyframes of regions of the catalog's fields; those of regions that it lacks are to be passed
    /// over.
    pub frames: Vec<SavedFrame>,
}

/// A file of the scene's folder, kept with the light.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SavedFile {
    /// Its name relative to the scene's folder, with forward slashes; no URI.
    pub name: String,
    /// What is in it.
    pub bytes: Vec<u8>,
}

/// A keyframe of a region.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SavedFrame {
    /// Number of the field.
    pub field: u32,
    /// Number of the region within the field.
    pub region: u32,
    /// The frame.
    pub bytes: Vec<u8>,
}

impl LightFile {
    /// Encodes fields; `source` says what computed them ([`crate::FieldInfo::source`]), `info` when and from
    /// which scene (its `update` becomes 0).
    pub fn of_fields<'a>(
        scene: SceneInfo,
        source: &str,
        fields: impl IntoIterator<Item = &'a Field>,
        info: UpdateInfo,
    ) -> Self {
        let info = UpdateInfo { update: 0, ..info };
        let mut infos = Vec::new();
        let mut frames = Vec::new();
        let mut resources = BTreeMap::new();
        for field in fields {
            if let Field::Lightmap(lightmap) = field {
                let (layout, charts) = layout_resources(&lightmap.layout);
                let all = charts.into_iter().chain([layout]);
                resources.extend(all.map(|resource| (resource.hash(), resource)));
            }
            let mut encoder = FieldEncoder::new(field, LumelCoding::Halves);
            let encoded =
                encoder.encode(field, info, |_| true).expect("halves can always be coded");
            infos.push(encoder.describe(field, source));
            frames.extend(encoded.into_iter().map(|frame| SavedFrame {
                field: field.id().0,
                region: frame.region,
                bytes: frame.bytes,
            }));
        }
        // No server runs, and nothing ticks.
        let (epoch, tick_seconds) = (Epoch(0), 1.0);
        let catalog = Catalog { epoch, scene, tick_seconds, fields: infos, unknown: Vec::new() };
        let resources = resources.into_values().collect();
        Self { catalog, edits: Vec::new(), files: Vec::new(), resources, frames }
    }

    /// The file's bytes.
    pub fn write(&self) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        out.push(VERSION);
        put_record(&mut out, kind::CATALOG, &[&self.catalog.encode()]);
        if !self.edits.is_empty() {
            put_record(&mut out, kind::EDITS, &[&write_edits(&self.edits)]);
        }
        for SavedFile { name, bytes } in &self.files {
            let mut head = Vec::new();
            put_varint(&mut head, name.len() as u64);
            put_record(&mut out, kind::FILE, &[&head, name.as_bytes(), bytes]);
        }
        for resource in &self.resources {
            put_record(&mut out, kind::RESOURCE, &[resource.bytes()]);
        }
        for SavedFrame { field, region, bytes } in &self.frames {
            let mut head = Vec::new();
            put_varint(&mut head, (*field).into());
            put_varint(&mut head, (*region).into());
            put_record(&mut out, kind::KEYFRAME, &[&head, bytes]);
        }
        out
    }

    /// Reads a file. Payloads of its frames are not decoded yet. Records and edits that this program
    /// does not know are left out.
    ///
    /// # Errors
    /// [`DecodeError`] when the bytes are no light file of this version.
    pub fn read(bytes: &[u8]) -> Result<Self, DecodeError> {
        if bytes.len() as u64 > limits::FILE_BYTES {
            let value = bytes.len() as u64;
            return Err(DecodeError::Limit {
                what: "bytes of a file",
                value,
                limit: limits::FILE_BYTES,
            });
        }
        let mut reader = Reader(bytes);
        if reader.take(MAGIC.len())? != MAGIC {
            return Err(DecodeError::Malformed("not a light file"));
        }
        let version = reader.u8()?;
        if version != VERSION {
            return Err(DecodeError::Version { found: version.into(), known: VERSION.into() });
        }
        let (kind::CATALOG, catalog) = record(&mut reader)? else {
            return Err(DecodeError::Malformed("a light file without a catalog"));
        };
        let catalog = Catalog::decode(catalog.0)?;
        let mut read = Self {
            catalog,
            edits: Vec::new(),
            files: Vec::new(),
            resources: Vec::new(),
            frames: Vec::new(),
        };
        while !reader.0.is_empty() {
            let (kind, mut body) = record(&mut reader)?;
            match kind {
                kind::KEYFRAME => read.frames.extend(SavedFrame::read(body, &read.catalog)?),
                kind::EDITS => read.edits = read_edits(body.0)?,
                kind::FILE => {
                    let length = usize::try_from(body.varint()?);
                    let name = body.take(length.map_err(|_| DecodeError::Truncated)?)?;
                    let name = str::from_utf8(name).map_err(|_| DecodeError::Malformed("name"))?;
                    read.files.push(SavedFile { name: name.to_owned(), bytes: body.0.to_vec() });
                }
                kind::RESOURCE => {
                    let length = body.0.len();
                    DecodeError::limit("bytes of a resource", length, limits::RESOURCE_BYTES)?;
                    read.resources.push(Resource::new(body.0.to_vec()));
                }
                _ => {}
            }
        }
        Ok(read)
    }

    /// Decodes the fields; regions that the file lacks are dark.
    ///
    /// # Errors
    /// [`DecodeError`] when a frame cannot be decoded or does not fit the catalog, or when a lightmap's
    /// layout or charts are missing or cannot be read.
    pub fn fields(&self) -> Result<Vec<Field>, DecodeError> {
        let mut fields: HashMap<u32, Field> = HashMap::new();
        for frame in &self.frames {
            let Some(info) = self.catalog.field(frame.field) else { continue };
            let entry = fields.entry(info.id);
            match &info.shape {
                Shape::Volume(shape) => {
                    let Some(region) = shape.region(frame.region) else { continue };
                    let light = ProbeDecoder::new(region.size, shape.order).decode(&frame.bytes)?;
                    let field = entry.or_insert_with(|| info.dark());
                    let Some(volume) = field.as_volume_mut() else { continue };
                    let n = shape.order.coefficients();
                    let probes = region.probes(shape.grid.resolution);
                    for (probe, values) in probes.zip(light.coefficients.chunks(n)) {
                        volume.probe_mut(probe).copy_from_slice(values);
                    }
                }
                Shape::Lightmap(shape) => {
                    let Some(tile) = shape.tile(frame.region) else { continue };
                    let light = LumelDecoder::new(shape.coding, tile.size).decode(&frame.bytes)?;
                    let field = entry.or_insert_with(|| info.dark());
                    let Some(lightmap) = field.as_lightmap_mut() else { continue };
                    tile.put(light, lightmap);
                }
            }
        }
        for info in &self.catalog.fields {
            let lightmap = fields.get_mut(&info.id).and_then(Field::as_lightmap_mut);
            if let (Some(shape), Some(lightmap)) = (info.shape.as_lightmap(), lightmap) {
                lightmap.layout = Arc::new(shape.layout_of(&self.resources)?);
            }
        }
        Ok(self.catalog.fields.iter().filter_map(|field| fields.remove(&field.id)).collect())
    }
}

impl SavedFrame {
    /// Reads a record; nothing where its field is none of the catalog, or of an unknown kind.
    fn read(mut body: Reader<'_>, catalog: &Catalog) -> Result<Option<Self>, DecodeError> {
        let (field, region) = (body.number()?, body.number()?);
        let Some(info) = catalog.field(field) else { return Ok(None) };
        let base = match info.shape {
            Shape::Volume(_) => ProbeHeader::read(body.0)?.base,
            Shape::Lightmap(_) => FrameHead::read(body.0)?.base,
        };
        if base.is_some() {
            return Err(DecodeError::Malformed("a delta in a light file"));
        }
        Ok(Some(Self { field, region, bytes: body.0.to_vec() }))
    }
}

fn put_record(out: &mut Vec<u8>, kind: u64, parts: &[&[u8]]) {
    let mut head = Vec::new();
    put_varint(&mut head, kind);
    let length = head.len() + parts.iter().map(|part| part.len()).sum::<usize>();
    put_varint(out, length as u64);
    out.extend_from_slice(&head);
    for part in parts {
        out.extend_from_slice(part);
    }
}

/// The next record's kind and what is in it.
fn record<'a>(reader: &mut Reader<'a>) -> Result<(u64, Reader<'a>), DecodeError> {
    let length = usize::try_from(reader.varint()?).map_err(|_| DecodeError::Truncated)?;
    let mut body = Reader(reader.take(length)?);
    Ok((body.varint()?, body))
}

#[cfg(test)]
mod tests;
