// What a light binds: all its volumes, in one 3D texture, and all pages of lumels, in layers of another.

#import field/volume

struct Fields {
    // Volumes.
    count: u32,
    // Irradiance is what the pages hold times this.
    lumel_scale: f32,
    // Lumels along a side of the squares that share an age, and how many of these lie along a page's.
    age_side: u32,
    age_columns: u32,
}

@group(2) @binding(0) var<uniform> fields: Fields;
@group(2) @binding(1) var<storage, read> volumes: array<Volume>;
@group(2) @binding(2) var atlas: texture_3d<f32>;
@group(2) @binding(3) var atlas_sampler: sampler;
@group(2) @binding(4) var pages: texture_2d_array<f32>;
// Seconds since the light of lumels came, layer after layer of the pages and row after row of squares;
// less than 0 where none has come yet.
@group(2) @binding(5) var<storage, read> ages: array<f32>;
