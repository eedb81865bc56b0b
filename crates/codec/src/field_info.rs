//! What a catalog tells of a field.

use glam::Vec3;
use lumencast_light::{Field, FieldId, ProbeVolume};
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;

use crate::epoch::Epoch;
use crate::error::json;
use crate::lightmap_shape::LightmapShape;
use crate::volume_shape::VolumeShape;
use crate::{DecodeError, limits};

/// A field, as a catalog describes it: what all kinds have in common, and the shape that its kind has.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FieldInfo {
    /// Its number within the scene.
    pub id: u32,
    /// Which instances it is for.
    #[serde(rename = "use")]
    pub usage: Use,
    /// log2 of the field's scale ([`lumencast_light::ScaleRule`]); none before there was any light.
    /// It follows the light: a server sends the catalog again when it has changed.
    #[serde(default, deserialize_with = "scale", skip_serializing_if = "Option::is_none")]
    pub scale_log2: Option<i8>,
    /// What computes it, in words: `cpu path tracing`. At most [`limits::SOURCE_BYTES`] bytes, no
    /// control characters; empty where nobody says.
    #[serde(default, deserialize_with = "words", skip_serializing_if = "String::is_empty")]
    pub source: String,
    /// The run of the server that computes it, where that is not the catalog's; see
    /// [`crate::Catalog::epoch_of`].
    #[serde(default, deserialize_with = "epoch", skip_serializing_if = "Option::is_none")]
    pub epoch: Option<Epoch>,
    /// Its kind, and what there is to know of that. Light of one field fits another exactly when their
    /// shapes are equal.
    #[serde(flatten)]
    pub shape: Shape,
}

/// The shape of a field, by its kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", content = "shape", rename_all = "snake_case")]
pub enum Shape {
    /// Probes in the cells of a box.
    Volume(VolumeShape),
    /// Lumels on surfaces.
    Lightmap(LightmapShape),
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

/// A field of a kind that this program does not know.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct UnknownField {
    /// Its number within the scene, where that is one.
    pub id: Option<u32>,
    /// Its kind, in words; empty where that is no text that can be shown.
    pub kind: String,
}

impl FieldInfo {
    /// A volume for all instances, computed by the catalog's own server; `source` as in
    /// [`FieldInfo::source`].
    pub fn of_volume(volume: &ProbeVolume, scale_log2: Option<i8>, source: &str) -> Self {
        Self {
            id: volume.id.0,
            usage: Use::All,
            scale_log2,
            source: source.to_owned(),
            epoch: None,
            shape: Shape::Volume(VolumeShape::of(volume)),
        }
    }

    /// A lightmap, computed by the catalog's own server; `source` as in [`FieldInfo::source`].
    pub fn of_lightmap(
        id: FieldId,
        shape: LightmapShape,
        scale_log2: Option<i8>,
        source: &str,
    ) -> Self {
        Self {
            id: id.0,
            usage: Use::Static,
            scale_log2,
            source: source.to_owned(),
            epoch: None,
            shape: Shape::Lightmap(shape),
        }
    }

    /// The field without light.
    pub fn dark(&self) -> Field {
        match &self.shape {
            Shape::Volume(shape) => shape.dark(FieldId(self.id)).into(),
            Shape::Lightmap(shape) => shape.dark(FieldId(self.id)).into(),
        }
    }

    /// Reads an entry of a catalog: a field, a field of unknown kind, or an error where a known kind is
    /// told wrongly.
    pub(crate) fn read(entry: Value) -> Result<Result<Self, UnknownField>, DecodeError> {
        if !entry.is_object() {
            return Err(DecodeError::Malformed("an entry of fields"));
        }
        if !Shape::is_known(&entry) {
            let id = entry["id"].as_u64().and_then(|id| u32::try_from(id).ok());
            return Ok(Err(UnknownField { id, kind: printable(&entry["kind"]) }));
        }
        let info: Self = json(serde_json::from_value(entry))?;
        let shape = info.shape.validated()?;
        Ok(Ok(Self { shape, ..info }))
    }
}

impl Shape {
    /// Whether an entry of a catalog is of a kind, and in a basis or coding, that this program knows.
    fn is_known(entry: &Value) -> bool {
        let shape = &entry["shape"];
        let is_one_of = |what: &str, known: &[&str]| {
            !shape.is_object() || shape[what].as_str().is_some_and(|word| known.contains(&word))
        };
        match entry["kind"].as_str() {
            Some("volume") => is_one_of("basis", &["sh"]),
            Some("lightmap") => is_one_of("coding", &["halves", "h264", "h264_stacked"]),
            _ => false,
        }
    }

    fn validated(self) -> Result<Self, DecodeError> {
        match self {
            Self::Volume(shape) => shape.validated().map(Self::Volume),
            Self::Lightmap(shape) => shape.validated().map(Self::Lightmap),
        }
    }

    /// Whether frames of the one are frames of the other too. Lightmaps may differ in their layout.
    pub fn is_coded_alike(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Lightmap(one), Self::Lightmap(other)) => one.is_coded_alike(other),
            _ => self == other,
        }
    }

    /// The volume, where it is one.
    pub fn as_volume(&self) -> Option<&VolumeShape> {
        match self {
            Self::Volume(shape) => Some(shape),
            Self::Lightmap(_) => None,
        }
    }

    /// The lightmap, where it is one.
    pub fn as_lightmap(&self) -> Option<&LightmapShape> {
        match self {
            Self::Volume(_) => None,
            Self::Lightmap(shape) => Some(shape),
        }
    }

    /// The word for its kind.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Volume(_) => "volume",
            Self::Lightmap(_) => "lightmap",
        }
    }

    /// Numbers of its regions: what is coded and sent as one frame.
    pub fn regions(&self) -> impl Iterator<Item = u32> + '_ {
        let numbers: Box<dyn Iterator<Item = u32> + '_> = match self {
            Self::Volume(shape) => Box::new(shape.regions.iter().map(|region| region.id)),
            Self::Lightmap(shape) => Box::new(shape.tiles().map(|tile| tile.id)),
        };
        numbers
    }

    /// Temporal layers of each region.
    pub fn layers(&self) -> u8 {
        match self {
            Self::Volume(shape) => shape.layers,
            Self::Lightmap(_) => 1,
        }
    }

    /// Distance of a world position from a region, metres; infinite where it has none of this number.
    /// Where the surfaces of a lightmap's region lie is not known from its shape: it is everywhere.
    pub fn distance(&self, region: u32, position: Vec3) -> f32 {
        match self {
            Self::Volume(shape) => shape
                .region(region)
                .map_or(f32::INFINITY, |region| shape.distance(region, position)),
            Self::Lightmap(shape) => shape.tile(region).map_or(f32::INFINITY, |_| 0.0),
        }
    }

    /// Distance of a world position from what it lights, metres; 0 inside, and for a lightmap, whose
    /// shape does not tell where its surfaces lie.
    pub fn distance_from_all(&self, position: Vec3) -> f32 {
        match self {
            Self::Volume(shape) => shape.grid.distance(position),
            Self::Lightmap(_) => 0.0,
        }
    }

    /// Number of its probes.
    pub fn probe_count(&self) -> usize {
        match self {
            Self::Volume(shape) => shape.grid.probe_count(),
            Self::Lightmap(_) => 0,
        }
    }

    /// Number of its lumels.
    pub fn lumel_count(&self) -> usize {
        match self {
            Self::Volume(_) => 0,
            Self::Lightmap(shape) => shape.lumel_count(),
        }
    }
}

/// A scale, or none where there is something else.
fn scale<'de, D: Deserializer<'de>>(from: D) -> Result<Option<i8>, D::Error> {
    let value = Value::deserialize(from)?;
    Ok(value.as_f64().filter(|v| v.fract() == 0.0 && (-128.0..128.0).contains(v)).map(|v| v as i8))
}

/// An epoch, which null is none of.
fn epoch<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Epoch>, D::Error> {
    Epoch::deserialize(from).map(Some)
}

/// A source, or nothing where there is something else.
fn words<'de, D: Deserializer<'de>>(from: D) -> Result<String, D::Error> {
    Ok(printable(&Value::deserialize(from)?))
}

/// Text that may be printed on terminals, or nothing where there is something else.
fn printable(value: &Value) -> String {
    let is_sound =
        |text: &&str| text.len() <= limits::SOURCE_BYTES && !text.chars().any(char::is_control);
    value.as_str().filter(is_sound).unwrap_or_default().to_owned()
}
