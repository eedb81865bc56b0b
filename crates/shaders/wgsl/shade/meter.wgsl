// How bright a picture is: a histogram of its luminance, in steps of a part of a stop.

#import common/tone
#import shade/meter_bindings

var<workgroup> counts: array<atomic<u32>, METER_BINS>;

// A workgroup counts a square of pixels for itself first: atomics on one place wait for each other.
@compute @workgroup_size(16, 16)
fn meter(
    @builtin(global_invocation_id) pixel: vec3u,
    @builtin(local_invocation_index) own: u32,
) {
    let size = textureDimensions(metered);
    if all(pixel.xy < size) {
        let y = luminance(textureLoad(metered, pixel.xy, 0).rgb);
        // Neither infinite nor no number.
        if y <= 65504.0 {
            let bin = floor(METER_BINS_A_STOP * (log2(max(y, 1e-12)) - METER_LEAST)) + 1.0;
            atomicAdd(&counts[u32(clamp(bin, 0.0, f32(METER_BINS - 1u)))], 1u);
        }
    }
    workgroupBarrier();
    for (var bin = own; bin < METER_BINS; bin += 256u) {
        let count = atomicLoad(&counts[bin]);
        if count > 0u {
            atomicAdd(&histogram[bin], count);
        }
    }
}
