// What measuring a picture binds.

const METER_BINS: u32 = 512u;
// Bin 1 begins at 2^LEAST; bin 0 holds what is darker.
const METER_LEAST: f32 = -24.0;
const METER_BINS_A_STOP: f32 = 12.0;

@group(0) @binding(0) var metered: texture_2d<f32>;
@group(0) @binding(1) var<storage, read_write> histogram: array<atomic<u32>, METER_BINS>;
