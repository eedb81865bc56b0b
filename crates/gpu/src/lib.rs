//! A graphics device, by whatever adapter wgpu finds: bindings, commands that are timed, textures, and
//! what comes back from it.
//!
//! The crate knows no scene, no shader and no light. It is what everything shares that draws or computes
//! on a device. [`Gpu`] opens a device and tells what its adapter can do; [`Commands`] are what it is
//! given to do; a [`Readback`] is what they leave.
//!
//! ```
//! use lumencast_gpu::{Commands, Gpu, GpuError, Readback, bindings, wgpu};
//!
//! const SHADER: &str = "
//!     @group(0) @binding(0) var<storage, read_write> numbers: array<f32>;
//!
//!     @compute @workgroup_size(1)
//!     fn double(@builtin(global_invocation_id) id: vec3u) {
//!         numbers[id.x] *= 2.0;
//!     }";
//!
//! let gpu = match Gpu::new() {
//!     Err(GpuError::NoAdapter) => return Ok(()),
//!     gpu => gpu?,
//! };
//! let layout = gpu.group_layout("double", wgpu::ShaderStages::COMPUTE, &[bindings::WRITTEN]);
//! let pipeline = gpu.compute("double", SHADER, "double", &[&layout]);
//! let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
//! let numbers = gpu.buffer("numbers", usage, bytemuck::bytes_of(&[1.0f32, 2.0]), 0);
//! let group = gpu.group("double", &layout, &[numbers.as_entire_binding()]);
//!
//! let mut commands = Commands::new(&gpu);
//! let (encoder, timestamp_writes) = commands.compute_pass("doubling");
//! let descriptor = wgpu::ComputePassDescriptor { label: None, timestamp_writes };
//! let mut pass = encoder.begin_compute_pass(&descriptor);
//! pass.set_pipeline(&pipeline);
//! pass.set_bind_group(0, &group, &[]);
//! pass.dispatch_workgroups(2, 1, 1);
//! drop(pass);
//! let copy = Readback::buffer(&gpu, "numbers", numbers.size());
//! commands.encoder.copy_buffer_to_buffer(&numbers, 0, &copy, 0, numbers.size());
//! let timed = commands.submit(&gpu);
//!
//! let bytes = Readback::begin(copy).wait(&gpu, "doubling")?;
//! assert_eq!(bytes[..], *bytemuck::bytes_of(&[2.0f32, 4.0]));
//! // Seconds of each pass, where the adapter has a clock.
//! if let Some(timed) = timed {
//!     let passes = timed.wait(&gpu)?;
//!     assert_eq!(passes[0].0, "doubling");
//! }
//! # Ok::<(), GpuError>(())
//! ```

#![forbid(unsafe_code)]

pub mod bindings;
mod device;
mod error;
mod make;
mod readback;
pub mod textures;
mod timing;

pub use device::{Abilities, Gpu};
pub use error::GpuError;
pub use readback::{Readback, TextureCopy};
pub use timing::{Commands, Timed};
pub use wgpu;
