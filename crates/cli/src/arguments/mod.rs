//! Arguments that several commands share.

mod drawing;
mod effort;
mod fields;
mod gather;
mod lightmap;
mod materials;
mod reading;
mod scene;
mod tick;
mod volume;

pub(crate) use drawing::Exposure;
#[cfg(feature = "gpu")]
pub(crate) use drawing::occlusion;
pub(crate) use effort::{EffortArguments, MOST_SAMPLES};
pub(crate) use fields::{FieldsArguments, Wanted};
pub(crate) use gather::{GatherArguments, source};
pub(crate) use lightmap::LightmapArguments;
pub(crate) use materials::Materials;
pub(crate) use reading::{Reading, ReadingArguments};
pub(crate) use scene::{SceneArguments, SceneSource, scene_name};
pub(crate) use tick::TickArguments;
#[cfg(feature = "gpu")]
pub(crate) use volume::VolumeArgument;

/// The port of `serve` unless told otherwise.
pub(crate) const DEFAULT_PORT: u16 = 4443;
