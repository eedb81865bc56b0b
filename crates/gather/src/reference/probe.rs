//! Light at points with its standard error.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use lumencast_light::Order;
use lumencast_scene::Snapshot;

use crate::path_trace::{CpuPathTracer, Levels, MaterialModel, Options};
use crate::{Gather, Job, Receiver, SumsAt};

/// Settings of an estimate at points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeSettings {
    /// Order of the expansion.
    pub order: Order,
    /// Number of directions in one lattice.
    pub samples: u32,
    /// Number of independently rotated lattices, at least 2. The standard error has a relative
    /// error of 1/√(2(n − 1)), so 16 or more are advised.
    pub lattices: u32,
    /// Largest number of surface scattering events on a path, as in [`Job::bounces`].
    pub bounces: u32,
    /// As in [`Job::clamp`].
    pub clamp: f32,
    /// The material model.
    pub materials: MaterialModel,
    /// Seed of the noise; different seeds give independent estimates.
    pub seed: u64,
}

impl Default for ProbeSettings {
    fn default() -> Self {
        Self {
            order: Order::L2,
            samples: 4096,
            lattices: 16,
            bounces: 3,
            clamp: f32::INFINITY,
            materials: MaterialModel::Full,
            seed: 1,
        }
    }
}

/// Light arriving at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeEstimate {
    /// Coefficients of arriving radiance, cd/m².
    pub sh: Vec<Vec3>,
    /// Standard errors of the coefficients, from the differences between lattices.
    pub standard_error: Vec<Vec3>,
    /// As in [`SumsAt::dark_back_fraction`].
    pub dark_back_fraction: f32,
}

/// Estimates the light at points, in order.
///
/// # Errors
/// Where the system gives no thread to compute with.
pub fn probe_sh(
    scene: &Arc<Snapshot>,
    points: &[Vec3],
    settings: &ProbeSettings,
) -> std::io::Result<Vec<ProbeEstimate>> {
    let options = Options { materials: settings.materials, threads: None, levels: Levels::One };
    let mut tracer = CpuPathTracer::new(options)?;
    let samples = settings.samples.max(1);
    let receivers: Arc<[_]> = points.iter().copied().map(Receiver::probe).collect();
    let mut lattices = Vec::new();
    for lattice in 0..settings.lattices.max(2) {
        let ticket = tracer.submit(Job {
            order: settings.order,
            bounces: settings.bounces,
            clamp: settings.clamp,
            seed: crate::sampling::mix2(settings.seed, u64::from(lattice)),
            ..Job::new(scene.clone(), receivers.clone(), samples)
        });
        let gathered =
            tracer.wait(ticket).ok_or_else(|| std::io::Error::other("gathering ended early"))?;
        lattices.push(gathered.sums);
    }
    let of_point = |p: usize| lattices.iter().map(|sums| sums.at(p)).collect::<Vec<_>>();
    Ok((0..points.len()).map(|p| combine(&of_point(p))).collect())
}

/// Mean and standard error of the mean over lattices.
fn combine(lattices: &[SumsAt<'_>]) -> ProbeEstimate {
    let n = lattices.len() as f64;
    let statistics = (0..lattices[0].sum.len()).map(|k| {
        let values: Vec<DVec3> =
            lattices.iter().map(|s| s.sum[k].as_dvec3() / f64::from(s.count)).collect();
        let mean = values.iter().sum::<DVec3>() / n;
        let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<DVec3>() / (n - 1.0);
        let error = (variance / n).map(f64::sqrt);
        (mean.as_vec3(), error.as_vec3())
    });
    let (sh, standard_error) = statistics.unzip();
    ProbeEstimate {
        sh,
        standard_error,
        dark_back_fraction: (lattices.iter().map(|s| f64::from(s.dark_back_fraction)).sum::<f64>()
            / n) as f32,
    }
}
