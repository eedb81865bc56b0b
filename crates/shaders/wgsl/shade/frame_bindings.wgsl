// What a frame binds: what is drawn of its light, and all that shines.

#import common/environment
#import common/punctual
#import shade/frame

@group(1) @binding(0) var<uniform> frame: Frame;
@group(1) @binding(1) var<uniform> environment: Environment;
@group(1) @binding(2) var environment_picture: texture_2d<f32>;
@group(1) @binding(3) var<storage, read> lights: array<PunctualLight>;
@group(1) @binding(4) var<storage, read> shadow_views: array<ShadowView>;
@group(1) @binding(5) var shadow_maps: texture_depth_2d_array;
@group(1) @binding(6) var shadow_sampler: sampler;
// The table by cosine and roughness. Its left half has what F0 and F90 are multiplied by, and the lobe's
// mean direction; its right half has the lobe's bands.
@group(1) @binding(7) var environment_brdf: texture_2d<f32>;
@group(1) @binding(8) var table_sampler: sampler;
// Ambient occlusion: the share of indirect light that arrives, and the depths that it is of.
@group(1) @binding(9) var occlusion_visibility: texture_2d<f32>;
@group(1) @binding(10) var occlusion_depths: texture_depth_2d;
