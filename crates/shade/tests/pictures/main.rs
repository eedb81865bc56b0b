//! Pictures that an adapter draws: on a machine without a GPU in software, which is part of what is
//! tested.

mod abilities;
mod bad_input;
mod blending;
mod committed;
mod common;
mod direct_light;
mod environments;
mod far;
mod indirect_light;
mod looks;
mod lumels;
mod lumels_directional;
mod materials;
mod occlusion;
mod screen;
mod shadows;
mod texture_transforms;
