//! How fields are told apart.

use serde::{Deserialize, Serialize};

/// Number of a field within a scene.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct FieldId(pub u32);
