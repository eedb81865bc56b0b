//! A frame of light to be sent.

/// A frame of light to be sent.
#[derive(Clone, Debug, PartialEq)]
pub struct EncodedRegion {
    /// Number of the region.
    pub region: u32,
    /// Temporal layer.
    pub layer: u8,
    /// Whether the frame begins a group on its track.
    pub new_group: bool,
    /// The frame.
    pub bytes: Vec<u8>,
    /// Of probes, the root-mean-square error over the region's values, each relative to the length of
    /// its probe's c0; 0 of lumels, whose halves are coded without loss.
    pub error: f32,
}
