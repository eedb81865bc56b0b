//! The device, and what its adapter can do.

use std::sync::{Arc, Mutex, PoisonError};

use glam::UVec2;

use crate::error::GpuError;
use crate::textures::{COLOR, DEPTH};

/// The most passes that are timed: a query set holds no more pairs.
pub(crate) const TIMED_PASSES: usize = wgpu::QUERY_SET_MAX_QUERIES as usize / 2;

/// What is used where an adapter has it, and done without where it has not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Abilities {
    /// The most samples that a pixel has at once, in [`COLOR`] and [`DEPTH`]: 1, 2, 4 or 8.
    pub samples: u32,
    /// Every sample of a pixel can be shaded.
    pub sample_shading: bool,
    /// The adapter tells how long passes take.
    pub clock: bool,
}

/// What every device has: shaders read storage buffers in every stage, and compute.
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
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    /// Holds the timestamps of passes, where the adapter has a clock.
    clock: Option<wgpu::QuerySet>,
    /// Sample counts that pictures can be multisampled with.
    sample_counts: Vec<u32>,
    sample_shading: bool,
    /// What went wrong since it was last asked for.
    fault: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    /// Opens the adapter that the platform thinks fastest; `VK_DRIVER_FILES` and the like choose
    /// otherwise.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] where there is none, [`GpuError::Device`] where it gives no device.
    pub fn new() -> Result<Self, GpuError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        Self::of_instance(&instance, None)
    }

    /// Opens the fastest adapter that can show pictures on a surface of that instance.
    ///
    /// # Errors
    /// As [`Gpu::new`].
    pub fn for_surface(
        instance: &wgpu::Instance,
        surface: &wgpu::Surface<'_>,
    ) -> Result<Self, GpuError> {
        Self::of_instance(instance, Some(surface))
    }

    fn of_instance(
        instance: &wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
    ) -> Result<Self, GpuError> {
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: surface,
            ..Default::default()
        };
        let open = async {
            let adapter = instance.request_adapter(&options).await.map_err(|error| {
                tracing::debug!(%error, "no adapter");
                GpuError::NoAdapter
            })?;
            Self::of_adapter(adapter).await
        };
        pollster::block_on(open)
    }

    async fn of_adapter(adapter: wgpu::Adapter) -> Result<Self, GpuError> {
        let info = adapter.get_info();
        let flags = adapter.get_downlevel_capabilities().flags;
        if let Some(reason) = refusal(flags) {
            return Err(GpuError::Device { adapter: info.name, reason });
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
            GpuError::Device { adapter: info.name.clone(), reason: error.to_string() }
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

    /// What the adapter has of all that can be done without.
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

    /// Makes everything that lies on the device.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// Takes what the device is to do.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// The adapter that the device was opened on.
    pub fn adapter(&self) -> &wgpu::Adapter {
        &self.adapter
    }

    /// The names of the adapter and of its driver, for people.
    pub fn name(&self) -> String {
        let driver = [self.info.driver.as_str(), self.info.driver_info.as_str()].join(" ");
        format!("{} ({}, {})", self.info.name, self.info.backend.to_str(), driver.trim())
    }

    /// Whether the device computes on the processor.
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
    /// [`GpuError::Size`] where it has no pixels, or more a side than the adapter draws.
    pub fn check_size(&self, size: UVec2) -> Result<(), GpuError> {
        let limit = self.device.limits().max_texture_dimension_2d;
        if size.min_element() == 0 || size.max_element() > limit {
            return Err(GpuError::Size { width: size.x, height: size.y, limit });
        }
        Ok(())
    }

    /// Holds the timestamps of passes, where the adapter has a clock.
    pub(crate) fn clock(&self) -> Option<&wgpu::QuerySet> {
        self.clock.as_ref()
    }

    /// Whether the device has complained since it was last asked. `during` names what was done, for
    /// people.
    ///
    /// # Errors
    /// [`GpuError::Failed`] where the device was lost, or has failed otherwise.
    pub fn check(&self, during: &'static str) -> Result<(), GpuError> {
        let fault = self.fault.lock().unwrap_or_else(PoisonError::into_inner).take();
        match fault {
            Some(reason) => Err(GpuError::failed(during, reason)),
            None => Ok(()),
        }
    }

    /// Waits until everything submitted is done.
    ///
    /// # Errors
    /// As [`Gpu::check`].
    pub fn finish(&self, during: &'static str) -> Result<(), GpuError> {
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|error| GpuError::failed(during, error))?;
        self.check(during)
    }

    /// Lets callbacks of what is done be called, without waiting.
    ///
    /// # Errors
    /// As [`Gpu::check`].
    pub fn poll(&self, during: &'static str) -> Result<(), GpuError> {
        self.device.poll(wgpu::PollType::Poll).map_err(|error| GpuError::failed(during, error))?;
        self.check(during)
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
}
