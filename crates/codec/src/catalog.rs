//! The catalog: what a server offers (docs/wire.md, "Catalog").

use std::collections::HashSet;
use std::fmt;
use std::str::FromStr;

use glam::{IVec3, Quat};
use lumencast_light::{FieldId, Grid, Offset, Order, ProbeVolume};
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;

use crate::{DecodeError, Region, VERSION, limits};

/// A run of a server: new at every start. In JSON 16 hexadecimal digits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Epoch(pub u64);

impl fmt::Display for Epoch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

impl FromStr for Epoch {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if text.len() != 16 || !text.bytes().all(|b| b.is_ascii_hexdigit()) {
            return Err("an epoch is 16 hexadecimal digits");
        }
        u64::from_str_radix(text, 16).map(Self).map_err(|_| "an epoch is 16 hexadecimal digits")
    }
}

impl TryFrom<String> for Epoch {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        text.parse()
    }
}

impl From<Epoch> for String {
    fn from(epoch: Epoch) -> Self {
        epoch.to_string()
    }
}

/// What a server offers: a scene and its fields of light.
#[derive(Clone, Debug, PartialEq)]
pub struct Catalog {
    /// The server's run.
    pub epoch: Epoch,
    /// The scene.
    pub scene: SceneInfo,
    /// Length of a tick, seconds.
    pub tick_seconds: f64,
    /// The fields. Kinds that this program does not know are left out when a catalog is decoded.
    pub fields: Vec<Field>,
}

/// Where clients find the scene.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneInfo {
    /// Its name, which is the broadcast's too.
    pub name: String,
    /// Its glTF file under `/scene/` of the server's HTTP address.
    pub root: String,
}

/// A light field: a volume of probes, the one kind there is so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Field {
    /// Its number within the scene.
    pub id: u32,
    /// Order of the spherical harmonics.
    pub order: Order,
    /// Which instances it is for.
    #[serde(rename = "use")]
    pub usage: Use,
    /// Where the probes are.
    pub grid: Grid,
    /// Where in front of a surface the light is meant to be read: less than half a cell for light that
    /// was fitted to be read there.
    #[serde(default, skip_serializing_if = "is_usual")]
    pub offset: Offset,
    /// Absolute integer coordinates of the grid's first cell; 0 unless the volume scrolls.
    #[serde(default)]
    pub cells_min: IVec3,
    /// Boxes of cells that together cover the grid, without overlap.
    pub regions: Vec<Region>,
    /// Temporal layers, 1 to 3.
    pub layers: u8,
    /// log2 of the field's scale ([`lumencast_light::ScaleRule`]); none before there was any light.
    /// It follows the light: a server sends the catalog again when it has changed.
    #[serde(default, deserialize_with = "scale", skip_serializing_if = "Option::is_none")]
    pub scale_log2: Option<i8>,
    /// What computes it, in words: `cpu path tracing`. At most [`limits::SOURCE_BYTES`] bytes, no
    /// control characters; empty where nobody says.
    #[serde(default, deserialize_with = "words", skip_serializing_if = "String::is_empty")]
    pub source: String,
    /// The run of the server that computes it, where that is not the catalog's; see
    /// [`Catalog::epoch_of`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub epoch: Option<Epoch>,
}

/// A scale, or none where there is something else.
fn scale<'de, D: Deserializer<'de>>(from: D) -> Result<Option<i8>, D::Error> {
    let value = Value::deserialize(from)?;
    Ok(value.as_f64().filter(|v| v.fract() == 0.0 && (-128.0..128.0).contains(v)).map(|v| v as i8))
}

/// A source, which is printed on terminals, or nothing where there is something else.
fn words<'de, D: Deserializer<'de>>(from: D) -> Result<String, D::Error> {
    let value = Value::deserialize(from)?;
    let is_sound =
        |text: &&str| text.len() <= limits::SOURCE_BYTES && !text.chars().any(char::is_control);
    Ok(value.as_str().filter(is_sound).unwrap_or_default().to_owned())
}

fn is_usual(offset: &Offset) -> bool {
    *offset == Offset::default()
}

/// Which instances a field is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Use {
    /// Those that never move.
    Static,
    /// Those that move.
    Moving,
    /// All.
    #[default]
    All,
}

/// A catalog with its fields not yet looked into.
#[derive(Serialize, Deserialize)]
struct Frame<F> {
    lumencast: Value,
    epoch: Epoch,
    scene: SceneInfo,
    tick_seconds: f64,
    fields: Vec<F>,
}

/// A field with what says how to read it.
#[derive(Serialize)]
struct KindOf<'a> {
    kind: &'static str,
    basis: &'static str,
    #[serde(flatten)]
    field: &'a Field,
}

impl Catalog {
    /// The catalog as a frame.
    pub fn encode(&self) -> Vec<u8> {
        let fields =
            self.fields.iter().map(|field| KindOf { kind: "volume", basis: "sh", field }).collect();
        let frame = Frame {
            lumencast: VERSION.into(),
            epoch: self.epoch,
            scene: self.scene.clone(),
            tick_seconds: self.tick_seconds,
            fields,
        };
        serde_json::to_vec(&frame).expect("numbers, text and lists have a JSON form")
    }

    /// Reads a frame of the `catalog` track. Fields of unknown kinds, and those that contradict
    /// themselves or exceed a limit, are left out; so are members of fields that may be absent and are none.
    ///
    /// # Errors
    /// [`DecodeError::Version`] when the server speaks another version; others when the bytes are
    /// no catalog, exceed a limit or contradict themselves.
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        DecodeError::limit("bytes of a frame", bytes.len(), limits::FRAME_BYTES)?;
        let value: Value = json(serde_json::from_slice(bytes))?;
        // The version comes first: of another version's catalog nothing else can be expected.
        match value.get("lumencast").and_then(Value::as_u64) {
            Some(VERSION) => {}
            Some(found) => return Err(DecodeError::Version { found, known: VERSION }),
            None => return Err(DecodeError::Malformed("no number under lumencast")),
        }
        let frame: Frame<Value> = json(serde_json::from_value(value))?;
        DecodeError::limit("fields of a catalog", frame.fields.len(), limits::FIELDS)?;
        if !(1e-4..=3600.0).contains(&frame.tick_seconds) {
            return Err(DecodeError::Malformed("tick_seconds"));
        }
        let fields: Vec<Field> = frame
            .fields
            .into_iter()
            .filter(|field| field["kind"] == "volume" && field["basis"] == "sh")
            .filter_map(|field| json(serde_json::from_value::<Field>(field)).ok()?.validated().ok())
            .collect();
        let ids: HashSet<u32> = fields.iter().map(|field| field.id).collect();
        if ids.len() < fields.len() {
            return Err(DecodeError::Malformed("two fields have the same id"));
        }
        let probes = fields.iter().map(|field| field.grid.probe_count()).sum();
        DecodeError::limit("probes of all fields", probes, limits::CATALOG_PROBES)?;
        Ok(Self {
            epoch: frame.epoch,
            scene: frame.scene,
            tick_seconds: frame.tick_seconds,
            fields,
        })
    }

    /// The field of a number.
    pub fn field(&self, id: u32) -> Option<&Field> {
        self.fields.iter().find(|field| field.id == id)
    }

    /// The run that numbers a field's updates and ticks: its own, or else the catalog's.
    pub fn epoch_of(&self, field: &Field) -> Epoch {
        field.epoch.unwrap_or(self.epoch)
    }
}

impl Field {
    /// A volume of its shape without light.
    pub fn dark(&self) -> ProbeVolume {
        ProbeVolume::dark(FieldId(self.id), self.grid, self.order).read_at(self.offset)
    }

    /// The region of a number.
    pub fn region(&self, id: u32) -> Option<Region> {
        self.regions.iter().copied().find(|region| region.id == id)
    }

    /// Whether light of the one fits the other: all but scale, source and epoch are equal.
    pub fn has_shape_of(&self, other: &Self) -> bool {
        let shape = |field: &Self| Self {
            scale_log2: None,
            source: String::new(),
            epoch: None,
            ..field.clone()
        };
        shape(self) == shape(other)
    }

    fn validated(mut self) -> Result<Self, DecodeError> {
        let Grid { center, rotation, size, resolution } = self.grid;
        let probes = u128::from(resolution.x) * u128::from(resolution.y) * u128::from(resolution.z);
        if probes == 0 {
            return Err(DecodeError::Malformed("a grid without cells"));
        }
        let probes = usize::try_from(probes).unwrap_or(usize::MAX);
        DecodeError::limit("probes of a field", probes, limits::FIELD_PROBES)?;
        if !(center.is_finite() && size.is_finite() && size.min_element() > 0.0) {
            return Err(DecodeError::Malformed("a grid's center or size"));
        }
        if (rotation.length() - 1.0).abs() >= 1e-3 || !rotation.is_finite() {
            return Err(DecodeError::Malformed("a grid's rotation is no unit quaternion"));
        }
        if rotation != Quat::IDENTITY {
            self.grid.rotation = rotation.normalize();
        }
        let (Offset::Cells(offset) | Offset::Metres(offset)) = self.offset;
        if !offset.is_finite() {
            return Err(DecodeError::Malformed("offset"));
        }
        if !(1..=3).contains(&self.layers) {
            return Err(DecodeError::Malformed("layers"));
        }
        self.check_regions()?;
        Ok(self)
    }

    /// Regions must cover the grid without overlap.
    fn check_regions(&self) -> Result<(), DecodeError> {
        DecodeError::limit("regions of a field", self.regions.len(), limits::REGIONS)?;
        let ids: HashSet<u32> = self.regions.iter().map(|region| region.id).collect();
        if ids.len() < self.regions.len() {
            return Err(DecodeError::Malformed("two regions have the same id"));
        }
        let resolution = self.grid.resolution;
        let mut covered = vec![false; self.grid.probe_count()];
        for region in &self.regions {
            let cells = region.size.max_element() as usize;
            DecodeError::limit(
                "cells of a region along an axis",
                cells,
                limits::REGION_CELLS as usize,
            )?;
            if region.size.min_element() == 0
                || region.min.cmpgt(resolution).any()
                || (resolution - region.min).cmplt(region.size).any()
            {
                return Err(DecodeError::Malformed("a region is empty or lies outside its grid"));
            }
            for probe in region.probes(resolution) {
                if std::mem::replace(&mut covered[probe], true) {
                    return Err(DecodeError::Malformed("two regions overlap"));
                }
            }
        }
        if covered.contains(&false) {
            return Err(DecodeError::Malformed("the regions do not cover the grid"));
        }
        Ok(())
    }
}

/// A JSON error as ours.
pub(crate) fn json<T>(result: serde_json::Result<T>) -> Result<T, DecodeError> {
    result.map_err(|error| DecodeError::Json(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{UVec3, Vec3};
    use serde_json::json;

    fn catalog() -> Catalog {
        let grid = Grid {
            center: Vec3::new(0.5, 0.1, -2.0),
            rotation: Quat::IDENTITY,
            size: Vec3::new(8.0, 6.0, 4.0),
            resolution: UVec3::new(12, 6, 7),
        };
        Catalog {
            epoch: Epoch(0x9F0C_0000_0000_0001),
            scene: SceneInfo { name: "sponza".into(), root: "Sponza.glb".into() },
            tick_seconds: 0.04,
            fields: vec![Field {
                id: 3,
                order: Order::L2,
                usage: Use::All,
                grid,
                offset: Offset::Cells(0.125),
                cells_min: IVec3::ZERO,
                regions: crate::regions(grid.resolution),
                layers: 3,
                scale_log2: Some(16),
                source: "cpu path tracing".into(),
                epoch: Some(Epoch(5)),
            }],
        }
    }

    #[test]
    fn catalogs_round_trip() {
        assert_eq!(Catalog::decode(&catalog().encode()), Ok(catalog()));
    }

    #[test]
    fn unknown_kinds_and_members_are_skipped() {
        let mut value: Value = serde_json::from_slice(&catalog().encode()).unwrap();
        value["weather"] = json!("fine");
        value["fields"][0]["colour"] = json!("red");
        value["fields"].as_array_mut().unwrap().push(json!({ "kind": "hologram", "id": [] }));
        assert_eq!(Catalog::decode(value.to_string().as_bytes()), Ok(catalog()));
    }

    #[test]
    fn offset_scale_source_and_epoch_may_be_absent() {
        let mut value: Value = serde_json::from_slice(&catalog().encode()).unwrap();
        let field = value["fields"][0].as_object_mut().unwrap();
        assert_eq!(field.remove("offset"), Some(json!({ "cells": 0.125 })));
        assert_eq!(field.remove("scale_log2"), Some(json!(16)));
        assert_eq!(field.remove("source"), Some(json!("cpu path tracing")));
        assert_eq!(field.remove("epoch"), Some(json!("0000000000000005")));
        let old = Catalog::decode(value.to_string().as_bytes()).unwrap();
        let field = &old.fields[0];
        assert_eq!((field.source.as_str(), old.epoch_of(field)), ("", old.epoch));
        assert_eq!((field.scale_log2, field.offset), (None, Offset::HALF_CELL));
        let written: Value = serde_json::from_slice(&old.encode()).unwrap();
        assert_eq!(written, value, "and are then not written");
        let new = catalog();
        assert_eq!(new.epoch_of(&new.fields[0]), Epoch(5));
        let moved = Field { offset: Offset::HALF_CELL, ..new.fields[0].clone() };
        assert!(field.has_shape_of(&moved) && !field.has_shape_of(&new.fields[0]));
        assert!(!field.has_shape_of(&Field { layers: 2, ..new.fields[0].clone() }));
    }

    #[test]
    fn contradictions_and_excesses_are_refused() {
        let cases = [
            ("/lumencast", json!(2), "version"),
            ("/lumencast", json!("1"), "malformed"),
            ("/epoch", json!(null), "json"),
            ("/epoch", json!("12"), "json"),
            ("/tick_seconds", json!(0), "malformed"),
        ];
        for (place, wrong, kind) in cases {
            let mut value: Value = serde_json::from_slice(&catalog().encode()).unwrap();
            *value.pointer_mut(place).unwrap() = wrong;
            let error = Catalog::decode(value.to_string().as_bytes());
            assert_eq!(error.map_err(|e| e.kind()), Err(kind), "{place}");
        }
        let mut twice = catalog();
        twice.fields.push(twice.fields[0].clone());
        assert!(Catalog::decode(&twice.encode()).is_err());
    }
}
