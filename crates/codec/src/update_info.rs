//! Updates of a field, and their temporal layers.

/// What an update of a field was computed from, and when.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UpdateInfo {
    /// Number u of the update; grows by one an update of the field.
    pub update: u64,
    /// The tick that computed it.
    pub tick: u64,
    /// Scene time of that tick, seconds.
    pub time: f64,
    /// Version of the scene that it shows.
    pub scene_version: u64,
}

impl UpdateInfo {
    /// The temporal layer of an update, for fields with three of them: 0 for every fourth, 1 for the
    /// other even ones, 2 for the odd. Lightmaps have one layer, which holds all updates.
    pub fn layer(&self) -> u8 {
        layer(self.update)
    }
}

/// The temporal layer of update number `update`, for fields with three of them.
pub(crate) fn layer(update: u64) -> u8 {
    match update % 4 {
        0 => 0,
        2 => 1,
        _ => 2,
    }
}
