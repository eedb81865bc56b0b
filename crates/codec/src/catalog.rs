//! The catalog: what a server offers (docs/wire.md, "Catalog").

use std::collections::HashSet;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::epoch::Epoch;
use crate::error::json;
use crate::field_info::{FieldInfo, UnknownField};
use crate::{DecodeError, VERSION, limits};

/// What a server offers: a scene and its fields of light.
#[derive(Clone, Debug, PartialEq)]
pub struct Catalog {
    /// The server's run.
    pub epoch: Epoch,
    /// The scene.
    pub scene: SceneInfo,
    /// Length of a tick, seconds.
    pub tick_seconds: f64,
    /// The fields, of the kinds that this program knows.
    pub fields: Vec<FieldInfo>,
    /// Fields of other kinds, for people: they are read, and never written.
    pub unknown: Vec<UnknownField>,
}

/// Where clients find the scene.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneInfo {
    /// Its name, which is the broadcast's too.
    pub name: String,
    /// Its glTF file under `/scene/` of the server's HTTP address.
    pub root: String,
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

impl Catalog {
    /// The catalog as a frame.
    pub fn encode(&self) -> Vec<u8> {
        let frame = Frame {
            lumencast: VERSION.into(),
            epoch: self.epoch,
            scene: self.scene.clone(),
            tick_seconds: self.tick_seconds,
            fields: self.fields.iter().collect(),
        };
        serde_json::to_vec(&frame).expect("numbers, text and lists have a JSON form")
    }

    /// Reads a frame of the `catalog` track. Fields of unknown kinds are kept apart. Fields that
    /// contradict themselves or exceed a limit are left out; so are members of fields that may be absent
    /// and are none.
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
        let (mut fields, mut unknown) = (Vec::new(), Vec::new());
        for entry in frame.fields {
            match FieldInfo::read(entry) {
                Ok(Ok(field)) => fields.push(field),
                Ok(Err(field)) => unknown.push(field),
                Err(_) => {}
            }
        }
        let ids: HashSet<u32> = fields.iter().map(|field| field.id).collect();
        if ids.len() < fields.len() {
            return Err(DecodeError::Malformed("two fields have the same id"));
        }
        let probes = fields.iter().map(|field| field.shape.probe_count()).sum();
        DecodeError::limit("probes of all fields", probes, limits::CATALOG_PROBES)?;
        let lumels = fields.iter().map(|field| field.shape.lumel_count()).sum();
        DecodeError::limit("lumels of all fields", lumels, limits::CATALOG_LUMELS)?;
        let Frame { epoch, scene, tick_seconds, .. } = frame;
        Ok(Self { epoch, scene, tick_seconds, fields, unknown })
    }

    /// The field of a number.
    pub fn field(&self, id: u32) -> Option<&FieldInfo> {
        self.fields.iter().find(|field| field.id == id)
    }

    /// The run that numbers a field's updates and ticks: its own, or else the catalog's.
    pub fn epoch_of(&self, field: &FieldInfo) -> Epoch {
        field.epoch.unwrap_or(self.epoch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Shape;
    use glam::{Quat, UVec3, Vec3};
    use lumencast_light::{FieldId, Grid, Layout, Lightmap, Offset, Order, ProbeVolume};
    use serde_json::json;
    use std::sync::Arc;

    fn catalog() -> Catalog {
        let grid = Grid {
            center: Vec3::new(0.5, 0.1, -2.0),
            rotation: Quat::IDENTITY,
            size: Vec3::new(8.0, 6.0, 4.0),
            resolution: UVec3::new(12, 6, 7),
        };
        let volume = ProbeVolume::dark(FieldId(3), grid, Order::L2).read_at(Offset::Cells(0.125));
        let field = FieldInfo::of_volume(&volume, Some(16), "cpu path tracing");
        Catalog {
            epoch: Epoch(0x9F0C_0000_0000_0001),
            scene: SceneInfo { name: "sponza".into(), root: "Sponza.glb".into() },
            tick_seconds: 0.04,
            fields: vec![FieldInfo { epoch: Some(Epoch(5)), ..field }],
            unknown: vec![],
        }
    }

    #[test]
    fn catalogs_round_trip() {
        assert_eq!(Catalog::decode(&catalog().encode()), Ok(catalog()));
    }

    #[test]
    fn unknown_kinds_are_kept_apart_and_unknown_members_skipped() {
        let mut value: Value = serde_json::from_slice(&catalog().encode()).unwrap();
        value["weather"] = json!("fine");
        value["fields"][0]["colour"] = json!("red");
        value["fields"][0]["shape"]["colour"] = json!("red");
        let mut wavelets = value["fields"][0].clone();
        wavelets["shape"]["basis"] = json!("wavelets");
        let hologram = json!({ "kind": "hologram", "id": [] });
        value["fields"].as_array_mut().unwrap().extend([wavelets, hologram, json!(7)]);
        let unknown = [(Some(3), "volume"), (None, "hologram")];
        let unknown = unknown.map(|(id, kind)| UnknownField { id, kind: kind.into() }).to_vec();
        let expected = Catalog { unknown, ..catalog() };
        assert_eq!(Catalog::decode(value.to_string().as_bytes()), Ok(expected));
    }

    fn with_lightmap() -> Catalog {
        let mut catalog = catalog();
        let layout = Arc::new(Layout::new(600, 2, Vec::new()));
        let lightmap = Lightmap::dark(FieldId(4), layout);
        let shape = crate::LightmapShape::of(&lightmap, crate::Coding::Halves);
        catalog.fields.push(FieldInfo::of_lightmap(lightmap.id, shape, Some(10), "bake"));
        catalog
    }

    #[test]
    fn lightmaps_stand_beside_volumes() {
        let catalog = with_lightmap();
        assert_eq!(Catalog::decode(&catalog.encode()), Ok(catalog.clone()));
        let value: Value = serde_json::from_slice(&catalog.encode()).unwrap();
        let field = &catalog.fields[1];
        let layout = field.shape.as_lightmap().unwrap().layout.to_string();
        let written = json!({
            "id": 4, "use": "static", "scale_log2": 10, "source": "bake", "kind": "lightmap",
            "shape": { "coding": "halves", "page_size": 600, "pages": 2, "layout": layout },
        });
        assert_eq!(value["fields"][1], written);
        let shape = &field.shape;
        assert!(shape.regions().eq(0..18));
        assert_eq!((shape.layers(), shape.kind(), shape.lumel_count()), (1, "lightmap", 720_000));
        assert_eq!(shape.distance(17, Vec3::ONE), 0.0);
        assert_eq!(shape.distance(18, Vec3::ONE), f32::INFINITY);
        assert!(field.dark().as_lightmap().unwrap().layout.surfaces().is_empty());
    }

    #[test]
    fn lightmaps_in_other_codings_are_unknown_and_those_told_wrongly_left_out() {
        let kept = |member: &str, value: Value| {
            let mut catalog: Value = serde_json::from_slice(&with_lightmap().encode()).unwrap();
            catalog["fields"][1]["shape"][member] = value;
            let read = Catalog::decode(catalog.to_string().as_bytes()).unwrap();
            (read.fields.len() - 1, read.unknown.len())
        };
        assert_eq!(kept("page_size", json!(600)), (1, 0));
        assert_eq!(kept("slopes", json!(true)), (1, 0));
        for coding in [json!("av1"), json!(null), json!(7)] {
            assert_eq!(kept("coding", coding), (0, 1));
        }
        for (member, wrong) in [
            ("page_size", json!(0)),
            ("page_size", json!(4097)),
            ("page_size", json!(1.5)),
            ("pages", json!(0)),
            ("pages", json!(24)),
            ("slopes", json!(1)),
            ("layout", json!("12")),
            ("layout", json!(null)),
        ] {
            assert_eq!(kept(member, wrong.clone()), (0, 0), "{member} {wrong}");
        }
        // Small pages have fewer lumels than a field may have, and more tiles.
        let mut many = with_lightmap();
        let Shape::Lightmap(shape) = &mut many.fields[1].shape else { panic!("a volume") };
        (shape.page_size, shape.pages) = (1, 4097);
        assert_eq!(Catalog::decode(&many.encode()).map(|read| read.fields.len()), Ok(1));
    }

    #[test]
    fn lumels_of_all_fields_are_bounded() {
        let mut catalog = with_lightmap();
        let Shape::Lightmap(shape) = &mut catalog.fields[1].shape else { panic!("a volume") };
        (shape.page_size, shape.pages) = (4096, 1);
        assert_eq!(Catalog::decode(&catalog.encode()).map(|read| read.fields.len()), Ok(1));
        let Shape::Lightmap(shape) = &mut catalog.fields[1].shape else { panic!("a volume") };
        (shape.page_size, shape.pages) = (1024, 8);
        assert_eq!(Catalog::decode(&catalog.encode()), Ok(catalog.clone()));
        catalog.fields.push(FieldInfo { id: 5, ..catalog.fields[1].clone() });
        let error = Catalog::decode(&catalog.encode()).map_err(|error| error.kind());
        assert_eq!(error, Err("limit"));
    }

    #[test]
    fn offset_scale_source_and_epoch_may_be_absent() {
        let mut value: Value = serde_json::from_slice(&catalog().encode()).unwrap();
        let field = value["fields"][0].as_object_mut().unwrap();
        assert_eq!(field.remove("scale_log2"), Some(json!(16)));
        assert_eq!(field.remove("source"), Some(json!("cpu path tracing")));
        assert_eq!(field.remove("epoch"), Some(json!("0000000000000005")));
        let shape = field["shape"].as_object_mut().unwrap();
        assert_eq!(shape.remove("offset"), Some(json!({ "cells": 0.125 })));
        let old = Catalog::decode(value.to_string().as_bytes()).unwrap();
        let field = &old.fields[0];
        assert_eq!((field.source.as_str(), old.epoch_of(field)), ("", old.epoch));
        let offset = field.shape.as_volume().map(|shape| shape.offset);
        assert_eq!((field.scale_log2, offset), (None, Some(Offset::HALF_CELL)));
        let written: Value = serde_json::from_slice(&old.encode()).unwrap();
        assert_eq!(written, value, "and are then not written");
        let new = catalog();
        assert_eq!(new.epoch_of(&new.fields[0]), Epoch(5));
        assert_ne!(new.fields[0].shape, field.shape, "light that is read elsewhere");
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
