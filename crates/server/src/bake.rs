//! Converged light, without a clock: the same fields as a running server's, averaged to the end.

use std::sync::Arc;

use lumencast_gather::Gather;
use lumencast_gather::blend::BlendSettings;
use lumencast_light::ProbeVolume;
use lumencast_scene::{Snapshot, VolumeSpec};

use crate::error::ServerError;
use crate::field::Field;
use crate::tick::{GatherOptions, look};

/// Samples of a probe in one job: enough to keep every core busy, few enough to show progress.
const SAMPLES_A_PASS: u32 = 64;
/// Rounds and steps of a fit to surfaces: more change nothing that can be seen.
const FIT_EFFORT: (u32, u32) = (4, 64);

/// Gathers `samples` samples for every probe of `volumes` and averages them, and as many for the
/// surfaces about it where probes are fitted; `options.blend` plays no part. `progress` is told the
/// share done, 0 to 1, after every pass.
///
/// The light's error falls with the root of `samples`: four times the samples, half the noise.
///
/// # Errors
/// A volume that makes no sense, or more than the wire format carries; nothing is gathered then.
pub fn bake(
    scene: &Arc<Snapshot>,
    volumes: &[VolumeSpec],
    gatherer: &mut dyn Gather,
    samples: u32,
    options: GatherOptions,
    mut progress: impl FnMut(f32),
) -> Result<Vec<ProbeVolume>, ServerError> {
    let mean = BlendSettings { ratio: f32::MIN_POSITIVE, significance: f32::INFINITY };
    let mut fields = Field::all(volumes, &GatherOptions { blend: mean, ..options })?;
    look(&mut fields, gatherer, scene);
    let passes = samples.div_ceil(SAMPLES_A_PASS).max(1);
    for pass in 0..passes {
        let first = u64::from(samples) * u64::from(pass) / u64::from(passes);
        let last = u64::from(samples) * u64::from(pass + 1) / u64::from(passes);
        let samples = (last - first).max(1) as u32;
        for field in &mut fields {
            let seed = u64::from(pass) << 8 | u64::from(field.id().0);
            let ticket = gatherer.submit(field.job(scene.clone(), None, samples, options, seed));
            if let Some(gathered) = gatherer.wait(ticket) {
                field.blend(&gathered);
            }
        }
        progress((pass + 1) as f32 / passes as f32);
    }
    fields.iter_mut().for_each(|field| field.publish(FIT_EFFORT));
    Ok(fields.into_iter().map(Field::into_volume).collect())
}
