// What a light binds: all its volumes, in one 3D texture.

#import field/volume

struct Fields {
    count: u32,
}

@group(2) @binding(0) var<uniform> fields: Fields;
@group(2) @binding(1) var<storage, read> volumes: array<Volume>;
@group(2) @binding(2) var atlas: texture_3d<f32>;
@group(2) @binding(3) var atlas_sampler: sampler;
