//! Light fields on disk: `.light` files (docs/wire.md, "Files").

use std::collections::HashMap;

use lumencast_light::ProbeVolume;

use crate::bytes::{Reader, put_varint};
use crate::{
    Catalog, DecodeError, Epoch, Field, ProbeDecoder, ProbeEncoder, ProbeHeader, SceneInfo,
    UpdateInfo, Use, VERSION, limits,
};

const MAGIC: &[u8; 8] = b"LUMENCST";

/// A saved light field: a catalog and keyframes, the same bytes as on the wire.
#[derive(Clone, Debug, PartialEq)]
pub struct LightFile {
    /// What is in the file.
    pub catalog: Catalog,
    /// Keyframes of regions; those of fields or regions that the catalog lacks are to be passed over.
    pub frames: Vec<SavedFrame>,
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
    /// Encodes volumes; `source` says what computed them ([`Field::source`]), `info` when and from
    /// which scene (its `update` becomes 0).
    pub fn of_volumes<'a>(
        epoch: Epoch,
        scene: SceneInfo,
        tick_seconds: f64,
        source: &str,
        volumes: impl IntoIterator<Item = &'a ProbeVolume>,
        info: UpdateInfo,
    ) -> Self {
        let mut fields = Vec::new();
        let mut frames = Vec::new();
        for volume in volumes {
            let mut encoder = ProbeEncoder::new(volume.grid.resolution, volume.order);
            let encoded = encoder.encode(volume, UpdateInfo { update: 0, ..info }, |_| true);
            fields.push(Field {
                id: volume.id.0,
                order: volume.order,
                usage: Use::All,
                grid: volume.grid,
                offset: volume.offset,
                cells_min: glam::IVec3::ZERO,
                regions: encoder.regions().collect(),
                layers: 3,
                scale_log2: encoder.scale_log2(),
                source: source.to_owned(),
                epoch: None,
            });
            frames.extend(encoded.into_iter().map(|frame| SavedFrame {
                field: volume.id.0,
                region: frame.region,
                bytes: frame.bytes,
            }));
        }
        Self { catalog: Catalog { epoch, scene, tick_seconds, fields }, frames }
    }

    /// The file's bytes.
    pub fn write(&self) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        out.push(VERSION as u8);
        put_record(&mut out, &self.catalog.encode());
        let mut record = Vec::new();
        for frame in &self.frames {
            record.clear();
            put_varint(&mut record, frame.field.into());
            put_varint(&mut record, frame.region.into());
            record.extend_from_slice(&frame.bytes);
            put_record(&mut out, &record);
        }
        out
    }

    /// Reads a file. Payloads of its frames are not decoded yet.
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
        let version = u64::from(reader.u8()?);
        if version != VERSION {
            return Err(DecodeError::Version(version));
        }
        let catalog = Catalog::decode(record(&mut reader)?)?;
        let mut frames = Vec::new();
        while !reader.0.is_empty() {
            let mut entry = Reader(record(&mut reader)?);
            let (field, region) = (number(&mut entry)?, number(&mut entry)?);
            if ProbeHeader::read(entry.0)?.base.is_some() {
                return Err(DecodeError::Malformed("a delta in a light file"));
            }
            frames.push(SavedFrame { field, region, bytes: entry.0.to_vec() });
        }
        Ok(Self { catalog, frames })
    }

    /// Decodes the volumes; probes of regions that the file lacks are dark.
    ///
    /// # Errors
    /// [`DecodeError`] when a frame cannot be decoded or does not fit the catalog.
    pub fn volumes(&self) -> Result<Vec<ProbeVolume>, DecodeError> {
        let mut volumes: HashMap<u32, ProbeVolume> = HashMap::new();
        for frame in &self.frames {
            let Some(field) = self.catalog.field(frame.field) else { continue };
            let Some(region) = field.region(frame.region) else { continue };
            let light = ProbeDecoder::new(region.size, field.order).decode(&frame.bytes)?;
            let volume = volumes.entry(field.id).or_insert_with(|| field.dark());
            let n = field.order.coefficients();
            for (probe, values) in
                region.probes(field.grid.resolution).zip(light.coefficients.chunks(n))
            {
                volume.probe_mut(probe).copy_from_slice(values);
            }
        }
        Ok(self.catalog.fields.iter().filter_map(|field| volumes.remove(&field.id)).collect())
    }
}

fn put_record(out: &mut Vec<u8>, record: &[u8]) {
    put_varint(out, record.len() as u64);
    out.extend_from_slice(record);
}

fn record<'a>(reader: &mut Reader<'a>) -> Result<&'a [u8], DecodeError> {
    let length = usize::try_from(reader.varint()?).map_err(|_| DecodeError::Truncated)?;
    reader.take(length)
}

fn number(reader: &mut Reader<'_>) -> Result<u32, DecodeError> {
    u32::try_from(reader.varint()?).map_err(|_| DecodeError::Malformed("a number of 2^32 or more"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, UVec3, Vec3};
    use lumencast_light::{Grid, Offset, Order, VolumeId};

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
                let mut volume = ProbeVolume::dark(VolumeId(id), grid, Order::L2);
                volume.offset = Offset::Cells(0.125 * id as f32);
                for (i, c) in volume.coefficients.iter_mut().enumerate() {
                    *c = Vec3::new(1.0, 2.0, 3.0) / (1 + i % 9) as f32;
                }
                volume
            })
            .collect();
        let scene = SceneInfo { name: "a".into(), root: "a.glb".into() };
        let file =
            LightFile::of_volumes(Epoch(1), scene, 0.04, "a test", &volumes, UpdateInfo::default());
        (volumes, file)
    }

    #[test]
    fn files_round_trip() {
        let (volumes, file) = file();
        let read = LightFile::read(&file.write()).unwrap();
        assert_eq!(read, file);
        let decoded = read.volumes().unwrap();
        assert_eq!(decoded.len(), 2);
        for (volume, decoded) in volumes.iter().zip(&decoded) {
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
    fn every_truncation_is_refused_or_lacks_frames() {
        let (_, file) = file();
        let bytes = file.write();
        for length in 0..bytes.len() {
            if let Ok(part) = LightFile::read(&bytes[..length]) {
                assert!(part.frames.len() < file.frames.len());
            }
        }
        assert_eq!(LightFile::read(b"LUMENCST\x02").map_err(|e| e.kind()), Err("version"));
        assert_eq!(LightFile::read(b"GIF89a..\x01").map_err(|e| e.kind()), Err("malformed"));
        // A record that claims to be huge allocates nothing.
        let mut claim = b"LUMENCST\x01".to_vec();
        put_varint(&mut claim, (1 << 53) - 1);
        assert_eq!(LightFile::read(&claim).map_err(|e| e.kind()), Err("truncated"));
    }
}
