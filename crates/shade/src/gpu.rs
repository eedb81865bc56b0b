//! The graphics device.

use std::sync::{Arc, Mutex, PoisonError};

use glam::UVec2;

use crate::ShadeError;
use crate::bindings::entry;
use crate::settings::{Settings, Shading};

/// What colours are drawn in before they are shown: linear, pre-exposed.
pub(crate) const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Depth, of pictures and shadow maps alike.
pub(crate) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The most passes of a frame that are timed: a query set holds no more pairs.
pub(crate) const TIMED_PASSES: usize = wgpu::QUERY_SET_MAX_QUERIES as usize / 2;

/// What is used where an adapter has it, and done without where it has not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Abilities {
    /// The most samples that a pixel has at once: 1, 2, 4 or 8. Pictures of more are averaged over
    /// frames.
    pub samples: u32,
    /// Every sample of a pixel can be shaded. Without it, pictures are averaged over frames of one
    /// sample instead, and windows are shaded once a pixel.
    pub sample_shading: bool,
    /// It tells how long passes take.
    pub clock: bool,
}

impl Abilities {
    /// What pictures by these settings have to do without, for people.
    pub fn missing(&self, settings: &Settings) -> Vec<&'static str> {
        let mut missing = Vec::new();
        let shades_samples = settings.shading == Shading::Samples && settings.samples > 1;
        if shades_samples && !self.sample_shading {
            missing.push(
                "the adapter cannot shade single samples of a pixel: pictures are averaged over \
                 frames of one sample, windows are shaded once a pixel",
            );
        }
        if !self.clock {
            missing.push("the adapter has no clock: passes are not timed");
        }
        missing
    }
}

/// What there is no drawing without: shaders read instances and lights from storage buffers, and skins
/// are computed.
const NEEDED: wgpu::DownlevelFlags = wgpu::DownlevelFlags::COMPUTE_SHADERS
    .union(wgpu::DownlevelFlags::VERTEX_STORAGE)
    .union(wgpu::DownlevelFlags::FRAGMENT_STORAGE);

/// Why an adapter with these abilities cannot be used.
fn refusal(flags: wgpu::DownlevelFlags) -> Option<String> {
    let lacking = NEEDED.difference(flags);
    let names: Vec<_> = lacking.iter_names().map(|(name, _)| name).collect();
    let names = names.join(", ");
    (!lacking.is_empty()).then(|| {
        format!("it lacks {names}; another one, or one in software (mesa-vulkan-drivers), may do")
    })
}

/// A device, and what is known of its adapter.
#[derive(Debug)]
pub struct Gpu {
    adapter: wgpu::Adapter,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    /// For the timestamps of a frame's passes, if it has a clock.
    pub(crate) clock: Option<wgpu::QuerySet>,
    /// Sample counts that pictures can be multisampled with.
    sample_counts: Vec<u32>,
    sample_shading: bool,
    /// What went wrong since it was last asked for.
    fault: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    /// Of the adapter that the platform thinks fastest; `VK_DRIVER_FILES` and the like choose
    /// otherwise.
    ///
    /// # Errors
    /// Where there is none, or it gives no device.
    pub fn new() -> Result<Self, ShadeError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        Self::of_instance(&instance, None)
    }

    /// Of the fastest adapter that can show pictures on a surface of that instance.
    ///
    /// # Errors
    /// As [`Gpu::new`].
    pub fn for_surface(
        instance: &wgpu::Instance,
        surface: &wgpu::Surface<'_>,
    ) -> Result<Self, ShadeError> {
        Self::of_instance(instance, Some(surface))
    }

    fn of_instance(
        instance: &wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
    ) -> Result<Self, ShadeError> {
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: surface,
            ..Default::default()
        };
        let open = async {
            let adapter = instance.request_adapter(&options).await.map_err(|error| {
                tracing::debug!(%error, "no adapter");
                ShadeError::NoAdapter
            })?;
            Self::of_adapter(adapter).await
        };
        pollster::block_on(open)
    }

    async fn of_adapter(adapter: wgpu::Adapter) -> Result<Self, ShadeError> {
        let info = adapter.get_info();
        let flags = adapter.get_downlevel_capabilities().flags;
        if let Some(reason) = refusal(flags) {
            return Err(ShadeError::Device { adapter: info.name, reason });
        }
        // With this feature, sample counts are those of the adapter instead of WebGPU's 1 and 4.
        let specific = wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES;
        let wanted = specific | wgpu::Features::TIMESTAMP_QUERY;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("lumencast"),
            required_features: adapter.features() & wanted,
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = adapter.request_device(&descriptor).await.map_err(|error| {
            ShadeError::Device { adapter: info.name.clone(), reason: error.to_string() }
        })?;
        let supported = |format: wgpu::TextureFormat, count| {
            let flags = adapter.get_texture_format_features(format).flags;
            flags.sample_count_supported(count)
        };
        let is_specific = device.features().contains(specific);
        let sample_counts = [1, 2, 4, 8]
            .into_iter()
            .filter(|&count| match is_specific {
                true => supported(COLOR, count) && supported(DEPTH, count),
                false => count == 1 || count == 4,
            })
            .collect();
        let fault = Arc::new(Mutex::new(None));
        let keep = |reason: String, fault: &Mutex<Option<String>>| {
            tracing::error!(reason, "the graphics device failed");
            let mut fault = fault.lock().unwrap_or_else(PoisonError::into_inner);
            fault.get_or_insert(reason);
        };
        let (of_errors, of_loss) = (fault.clone(), fault.clone());
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            keep(error.to_string(), &of_errors);
        }));
        device.set_device_lost_callback(move |reason, message| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                keep(format!("device lost: {message}"), &of_loss);
            }
        });
        let clock = clock(&device);
        let sample_shading = flags.contains(wgpu::DownlevelFlags::MULTISAMPLED_SHADING);
        Ok(Self { adapter, device, queue, info, clock, sample_counts, sample_shading, fault })
    }

    /// What it has of all that can be done without.
    pub fn abilities(&self) -> Abilities {
        Abilities {
            samples: self.samples_at_once(u32::MAX),
            sample_shading: self.sample_shading,
            clock: self.clock.is_some(),
        }
    }

    /// The same device, used as if it had no more than these: what a lesser adapter would draw.
    #[must_use]
    pub fn limited_to(mut self, most: Abilities) -> Self {
        self.sample_counts.retain(|&count| count <= most.samples);
        self.sample_shading &= most.sample_shading;
        self.clock = self.clock.filter(|_| most.clock);
        self
    }

    /// For those who draw more onto what is shown.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The device's.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// What the device is of.
    pub fn adapter(&self) -> &wgpu::Adapter {
        &self.adapter
    }

    /// Name of the adapter, and of its driver.
    pub fn name(&self) -> String {
        let driver = [self.info.driver.as_str(), self.info.driver_info.as_str()].join(" ");
        format!("{} ({}, {})", self.info.name, self.info.backend.to_str(), driver.trim())
    }

    /// Whether it computes on the processor.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// The most samples of at most `wanted` that a pixel can have at once.
    pub fn samples_at_once(&self, wanted: u32) -> u32 {
        let fitting = self.sample_counts.iter().copied().filter(|&count| count <= wanted);
        fitting.max().unwrap_or(1)
    }

    /// Whether a picture of this size can be drawn.
    ///
    /// # Errors
    /// [`ShadeError::Size`].
    pub fn check_size(&self, size: UVec2) -> Result<(), ShadeError> {
        let limit = self.device.limits().max_texture_dimension_2d;
        if size.min_element() == 0 || size.max_element() > limit {
            return Err(ShadeError::Size { width: size.x, height: size.y, limit });
        }
        Ok(())
    }

    /// What the device has complained about since it was last asked.
    pub(crate) fn check(&self, during: &'static str) -> Result<(), ShadeError> {
        let fault = self.fault.lock().unwrap_or_else(PoisonError::into_inner).take();
        match fault {
            Some(reason) => Err(ShadeError::Failed { during, reason }),
            None => Ok(()),
        }
    }

    /// Waits until everything submitted is done.
    ///
    /// # Errors
    /// Where the device was lost, or has failed otherwise.
    pub fn finish(&self, during: &'static str) -> Result<(), ShadeError> {
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|error| ShadeError::Failed { during, reason: error.to_string() })?;
        self.check(during)
    }

    /// What the device has complained about since it was last asked, without waiting for it.
    ///
    /// # Errors
    /// Where it was lost, or has failed otherwise.
    pub fn health(&self) -> Result<(), ShadeError> {
        self.poll("drawing")
    }

    /// Lets callbacks of what is done be called, without waiting.
    pub(crate) fn poll(&self, during: &'static str) -> Result<(), ShadeError> {
        self.device
            .poll(wgpu::PollType::Poll)
            .map_err(|error| ShadeError::Failed { during, reason: error.to_string() })?;
        self.check(during)
    }

    pub(crate) fn shader(&self, label: &str, source: String) -> wgpu::ShaderModule {
        self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        })
    }

    /// A pipeline that computes, and the layout of its one group, whose bindings are of these types.
    pub(crate) fn compute(
        &self,
        label: &str,
        source: String,
        entry_point: &str,
        types: &[wgpu::BindingType],
    ) -> (wgpu::BindGroupLayout, wgpu::ComputePipeline) {
        let module = self.shader(label, source);
        let label = Some(label);
        let visibility = wgpu::ShaderStages::COMPUTE;
        let entries: Vec<_> = (0..)
            .zip(types)
            .map(|(binding, &ty)| wgpu::BindGroupLayoutEntry { visibility, ..entry(binding, ty) })
            .collect();
        let layout = self.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label,
            entries: &entries,
        });
        let pipeline_layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label,
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label,
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some(entry_point),
            compilation_options: Default::default(),
            cache: None,
        });
        (layout, pipeline)
    }

    /// A buffer with contents; of at least `least` bytes, since bindings may not be empty.
    pub(crate) fn buffer(
        &self,
        label: &str,
        usage: wgpu::BufferUsages,
        contents: &[u8],
        least: u64,
    ) -> wgpu::Buffer {
        let size = (contents.len() as u64).max(least).next_multiple_of(4);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        if !contents.is_empty() {
            self.queue.write_buffer(&buffer, 0, contents);
        }
        buffer
    }
}

/// Two timestamps for each pass of a frame; nothing where the adapter has no clock.
fn clock(device: &wgpu::Device) -> Option<wgpu::QuerySet> {
    let has_clock = device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
    has_clock.then(|| {
        device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("passes"),
            ty: wgpu::QueryType::Timestamp,
            count: 2 * TIMED_PASSES as u32,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adapters_that_cannot_draw_are_refused_with_what_they_lack() {
        let all = wgpu::DownlevelFlags::all();
        assert_eq!(refusal(all), None);
        assert_eq!(refusal(NEEDED), None, "all else can be done without");
        let said = refusal(all - wgpu::DownlevelFlags::VERTEX_STORAGE).expect("a reason");
        assert!(said.contains("VERTEX_STORAGE") && !said.contains("COMPUTE"), "{said}");
    }

    #[test]
    fn what_is_missing_is_said_where_it_is_asked_for() {
        let all = Abilities { samples: 4, sample_shading: true, clock: true };
        let samples = Settings { samples: 8, shading: Shading::Samples, ..Settings::default() };
        assert!(all.missing(&samples).is_empty());
        let none = Abilities { samples: 1, sample_shading: false, clock: false };
        assert_eq!(none.missing(&samples).len(), 2);
        let pixels = Settings { shading: Shading::Pixels, ..samples };
        assert!(none.missing(&pixels)[0].contains("clock"));
    }
}
