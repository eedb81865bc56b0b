//! Light on disk: `.light` files (docs/wire.md, "Files").

use std::collections::HashMap;

use lumencast_light::Field;
use lumencast_scene::Edit;

use crate::bytes::{Reader, put_varint};
use crate::state::{read_edits, write_edits};
use crate::{
    Catalog, DecodeError, Epoch, FieldEncoder, ProbeDecoder, ProbeHeader, SceneInfo, Shape,
    UpdateInfo, limits,
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
    /// The probe frame.
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
        for field in fields {
            let mut encoder = FieldEncoder::new(field);
            let encoded = encoder.encode(field, info, |_| true);
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
        Self { catalog, edits: Vec::new(), files: Vec::new(), frames }
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
        let mut read = Self { catalog, edits: Vec::new(), files: Vec::new(), frames: Vec::new() };
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
                _ => {}
            }
        }
        Ok(read)
    }

    /// Decodes the fields; regions that the file lacks are dark.
    ///
    /// # Errors
    /// [`DecodeError`] when a frame cannot be decoded or does not fit the catalog.
    pub fn fields(&self) -> Result<Vec<Field>, DecodeError> {
        let mut fields: HashMap<u32, Field> = HashMap::new();
        for frame in &self.frames {
            let Some(info) = self.catalog.field(frame.field) else { continue };
            let dark = || info.dark();
            match (&info.shape, fields.entry(info.id)) {
                (Shape::Volume(shape), entry) => {
                    let Some(region) = shape.region(frame.region) else { continue };
                    let light = ProbeDecoder::new(region.size, shape.order).decode(&frame.bytes)?;
                    let Field::Volume(volume) = entry.or_insert_with(dark);
                    let n = shape.order.coefficients();
                    let probes = region.probes(shape.grid.resolution);
                    for (probe, values) in probes.zip(light.coefficients.chunks(n)) {
                        volume.probe_mut(probe).copy_from_slice(values);
                    }
                }
            }
        }
        Ok(self.catalog.fields.iter().filter_map(|field| fields.remove(&field.id)).collect())
    }
}

impl SavedFrame {
    /// Reads a record; nothing where its field is none of the catalog, or of an unknown kind.
    fn read(mut body: Reader<'_>, catalog: &Catalog) -> Result<Option<Self>, DecodeError> {
        let (field, region) = (number(&mut body)?, number(&mut body)?);
        let Some(info) = catalog.field(field) else { return Ok(None) };
        match info.shape {
            Shape::Volume(_) if ProbeHeader::read(body.0)?.base.is_some() => {
                Err(DecodeError::Malformed("a delta in a light file"))
            }
            Shape::Volume(_) => Ok(Some(Self { field, region, bytes: body.0.to_vec() })),
        }
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

fn number(reader: &mut Reader<'_>) -> Result<u32, DecodeError> {
    u32::try_from(reader.varint()?).map_err(|_| DecodeError::Malformed("a number of 2^32 or more"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, UVec3, Vec3};
    use lumencast_light::{FieldId, Grid, Light, Offset, Order, ProbeVolume};

    fn file() -> (Vec<ProbeVolume>, LightFile) {
        let volumes: Vec<ProbeVolume> = [(7, UVec3::new(12, 2, 3)), (2, UVec3::ONE)]
            .into_iter()
            .map(|(id, resolution)| {
                let grid = Grid {
                    center: Vec3::ONE,
                    rotation: Quat::from_rotation_y(1.0),
                    size: Vec3::splat(3.0),
                    resolution,
                };
                let mut volume = ProbeVolume::dark(FieldId(id), grid, Order::L2);
                volume.offset = Offset::Cells(0.125 * id as f32);
                for (i, c) in volume.coefficients.iter_mut().enumerate() {
                    *c = Vec3::new(1.0, 2.0, 3.0) / (1 + i % 9) as f32;
                }
                volume
            })
            .collect();
        let scene = SceneInfo { name: "a".into(), root: "a.glb".into() };
        let fields: Vec<Field> = volumes.iter().cloned().map(Field::from).collect();
        let file = LightFile::of_fields(scene, "a test", &fields, UpdateInfo::default());
        (volumes, file)
    }

    #[test]
    fn files_round_trip() {
        let (volumes, file) = file();
        let read = LightFile::read(&file.write()).unwrap();
        assert_eq!(read, file);
        let decoded = Light::new(read.fields().unwrap());
        assert_eq!(decoded.fields().len(), 2);
        for (volume, decoded) in volumes.iter().zip(decoded.volumes()) {
            assert_eq!(
                (volume.id, volume.order, volume.grid.resolution, volume.offset),
                (decoded.id, decoded.order, decoded.grid.resolution, decoded.offset)
            );
            let worst = volume
                .coefficients
                .iter()
                .zip(&decoded.coefficients)
                .fold(0.0_f32, |w, (a, b)| w.max(a.distance(*b)));
            assert!(worst > 0.0 && worst < 0.03 * volume.coefficients[0].length(), "{worst}");
        }
    }

    #[test]
    fn edits_and_their_files_are_kept_and_unknown_records_passed_over() {
        let (_, mut file) = file();
        let environment = lumencast_scene::Environment::clear_sky(1000.0);
        file.edits = vec![Edit::SetEnvironment { environment }];
        file.files = vec![SavedFile { name: "sky/a b.hdr".into(), bytes: vec![7; 300] }];
        let mut bytes = file.write();
        put_record(&mut bytes, 99, &[b"of a later version"]);
        put_record(&mut bytes, kind::KEYFRAME, &[&[99, 0], b"of a field of a later kind"]);
        assert_eq!(LightFile::read(&bytes), Ok(file.clone()));

        let mut edits = Vec::new();
        put_record(&mut edits, kind::EDITS, &[br#"{"edits":[{"edit":"turn_to_gold"}, 7]}"#]);
        let read = LightFile::read(&[&bytes[..], &edits].concat()).expect("a file");
        assert_eq!(read.edits, []);

        let mut nameless = bytes.clone();
        put_record(&mut nameless, kind::FILE, &[&[2], b"\xff\xff", b"contents"]);
        assert_eq!(LightFile::read(&nameless).map_err(|e| e.kind()), Err("malformed"));
        let mut headless = MAGIC.to_vec();
        headless.push(VERSION);
        put_record(&mut headless, kind::FILE, &[&[1], b"a", b""]);
        assert_eq!(LightFile::read(&headless).map_err(|e| e.kind()), Err("malformed"));
    }

    #[test]
    fn every_truncation_is_refused_or_lacks_frames() {
        let (_, file) = file();
        let bytes = file.write();
        for length in 0..bytes.len() {
            if let Ok(part) = LightFile::read(&bytes[..length]) {
                assert!(part.frames.len() < file.frames.len());
            }
        }
        assert_eq!(LightFile::read(b"LUMENCST\x01").map_err(|e| e.kind()), Err("version"));
        assert_eq!(LightFile::read(b"GIF89a..\x01").map_err(|e| e.kind()), Err("malformed"));
        // A record that claims to be huge allocates nothing.
        let mut claim = b"LUMENCST\x02".to_vec();
        put_varint(&mut claim, (1 << 53) - 1);
        assert_eq!(LightFile::read(&claim).map_err(|e| e.kind()), Err("truncated"));
    }
}
