//! Converged light, without a clock: the same fields as a running server's, averaged until their noise
//! does not show.

use std::sync::Arc;

use lumencast_charts::LaidOut;
use lumencast_gather::Gather;
use lumencast_light::{Field, FieldId};
use lumencast_scene::{Snapshot, VolumeSpec};

use crate::blend::BlendSettings;
use crate::error::SolveError;
use crate::lightmap::BLOCKS_AT_ONCE;
use crate::noise;
use crate::options::GatherOptions;
use crate::request::{Request, Turn};
use crate::solver::{FitEffort, Solver};

/// Samples of a probe in one job: enough to spread directions well, few enough to show progress.
const PROBE_PASS: u32 = 256;
/// The same of a lumel. There are many of them, and no directions to spread well are lost to order.
const LUMEL_PASS: u32 = 16;
/// Rounds and steps of a fit to surfaces: more change nothing that can be seen.
const FIT_EFFORT: FitEffort = FitEffort { rounds: 4, steps: 64 };
/// The same of what tells the noise.
const NOISE_EFFORT: FitEffort = FitEffort { rounds: 2, steps: 32 };
/// Passes after which the noise is checked first.
const FIRST_CHECK: u32 = 4;
/// From one look at the noise to the next, samples become at most so many times as many, since noise
/// that is large tells little about how many are needed.
const MOST_GROWTH: f32 = 4.0;
/// And at least so many times, since a look takes as long as a fit.
const LEAST_GROWTH: f32 = 1.25;

/// How long light is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Samples of a probe, at most.
    pub samples: u32,
    /// Samples of a lumel, at most.
    pub lumel_samples: u32,
    /// The noise at which it ends sooner: root of the mean square of what noise adds to surfaces as they
    /// are displayed, in codes of 0 to 255 where the brightest are white. All samples are taken unless
    /// it is given.
    pub noise: Option<f32>,
}

impl Effort {
    /// So many samples of a probe or a lumel, however noisy they are.
    #[must_use]
    pub fn of_samples(samples: u32) -> Self {
        Self { samples, lumel_samples: samples, noise: None }
    }
}

/// How far a computation is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Done {
    /// What is computed.
    pub of: Receivers,
    /// Share of the samples that will be taken, as far as that is known: 0 to 1.
    pub share: f32,
    /// As in [`Effort::noise`]; nothing before it was looked at first.
    pub noise: Option<f32>,
}

/// What light is computed at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Receivers {
    /// The probes of volumes.
    Probes,
    /// The lumels of surfaces.
    Lumels,
}

/// Light that was computed once.
#[derive(Clone, Debug, PartialEq)]
pub struct Baked {
    /// The volumes in the order in which they were asked for, pieces of one following one another; then
    /// the lightmap.
    pub fields: Vec<Field>,
    /// What was spent on probes.
    pub probes: Spent,
    /// What was spent on lumels, where there are some.
    pub lumels: Option<Spent>,
}

/// How long light was computed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spent {
    /// Samples of a receiver.
    pub samples: u32,
    /// As in [`Effort::noise`], where that was asked for.
    pub noise: Option<f32>,
}

/// Light to compute once.
#[derive(Clone, Copy, Debug)]
pub struct Bake<'a> {
    /// The scene.
    pub scene: &'a Arc<Snapshot>,
    /// Where probes are to be.
    pub volumes: &'a [VolumeSpec],
    /// Where lumels are to be.
    pub lightmap: Option<&'a LaidOut>,
    /// How long it is computed.
    pub effort: Effort,
    /// How light is gathered; `blend` plays no part.
    pub options: GatherOptions,
}

/// Gathers light for every probe, and as many samples for the surfaces about it where probes are
/// fitted, and averages it; then the same for every lumel. `progress` is told after every pass how far
/// it is.
///
/// The noise falls with the root of the samples. It is known from a half of them: as the mean of two
/// independent halves differs from either by half of what they differ by, what is made of one half
/// lies as far from the whole as the whole does from light without noise.
///
/// # Errors
/// A volume that makes no sense: nothing is gathered then. A gatherer that gave up.
pub fn bake(
    wanted: Bake<'_>,
    gatherer: &mut dyn Gather,
    mut progress: impl FnMut(Done),
) -> Result<Baked, SolveError> {
    let Bake { scene, volumes, lightmap, effort, options } = wanted;
    let mean = BlendSettings { ratio: f32::MIN_POSITIVE, significance: f32::INFINITY };
    let mut all = Solver::new(volumes, GatherOptions { blend: mean, ..options })?;
    let ids: Vec<FieldId> = all.ids().collect();
    for Request { job, asked } in
        ids.iter().filter_map(|id| all.look(*id, scene)).collect::<Vec<_>>()
    {
        let ticket = gatherer.submit(job);
        all.take(&asked, &gatherer.wait(ticket).ok_or(SolveError::Gather)?);
    }
    let volumes = ids.len();
    let probes = Course {
        fields: ids,
        of: Receivers::Probes,
        pass: PROBE_PASS,
        most: effort.samples,
        noise: effort.noise,
        solve: |solver| solver.solve_volumes(NOISE_EFFORT),
    };
    let probes = probes.run(&mut all, scene, gatherer, &mut progress)?;
    all.solve_volumes(FIT_EFFORT);
    all.set_lightmap(scene, lightmap);
    let lumels = lightmap.map(|_| Course {
        fields: all.ids().skip(volumes).collect(),
        of: Receivers::Lumels,
        pass: LUMEL_PASS,
        most: effort.lumel_samples,
        noise: effort.noise,
        solve: |solver| solver.solve_lightmaps(BLOCKS_AT_ONCE),
    });
    let lumels = lumels.map(|course| course.run(&mut all, scene, gatherer, &mut progress));
    let lumels = lumels.transpose()?;
    all.solve_lightmaps(BLOCKS_AT_ONCE);
    Ok(Baked { fields: all.into_fields(), probes, lumels })
}

/// What is gathered for some fields until their noise does not show.
struct Course {
    fields: Vec<FieldId>,
    of: Receivers,
    /// Samples of a receiver in one job.
    pass: u32,
    /// Samples of a receiver in all, at most.
    most: u32,
    noise: Option<f32>,
    /// Makes light of what has arrived, well enough to tell the noise.
    solve: fn(&mut Solver),
}

impl Course {
    fn run(
        self,
        all: &mut Solver,
        scene: &Arc<Snapshot>,
        gatherer: &mut dyn Gather,
        progress: &mut dyn FnMut(Done),
    ) -> Result<Spent, SolveError> {
        let Self { fields, of, pass: samples_a_pass, noise: wanted, solve, .. } = self;
        if fields.is_empty() {
            return Ok(Spent::default());
        }
        let mut half = wanted.map(|_| all.clone());
        let most = self.most.max(1);
        let mut done = Done { of, share: 0.0, noise: None };
        let (mut samples, mut pass) = (0, 0);
        // Until then the noise is not looked at.
        let mut until = wanted.map_or(most, |_| most.min(FIRST_CHECK * samples_a_pass));
        while samples < most {
            let now = samples_a_pass.min(most - samples);
            for id in &fields {
                let turn = Turn { previous: None, samples: now, lumels: None, pass };
                let Some(Request { job, asked }) = all.job(*id, scene, turn) else { continue };
                let ticket = gatherer.submit(job);
                let gathered = gatherer.wait(ticket).ok_or(SolveError::Gather)?;
                all.take(&asked, &gathered);
                if let Some(half) = half.as_mut().filter(|_| pass % 2 == 0) {
                    half.take(&asked, &gathered);
                }
            }
            (samples, pass) = (samples + now, pass + 1);
            if samples >= until
                && let Some((wanted, half)) = wanted.zip(half.as_mut())
            {
                solve(all);
                solve(half);
                let noise = noise::shown(all, half, &fields);
                done.noise = Some(noise);
                if noise <= wanted {
                    break;
                }
                let growth = (noise / wanted).powi(2).clamp(LEAST_GROWTH, MOST_GROWTH);
                until = (samples as f32 * growth).min(most as f32) as u32;
            }
            done.share = samples as f32 / until.max(samples) as f32;
            progress(done);
        }
        progress(Done { share: 1.0, ..done });
        Ok(Spent { samples, noise: done.noise })
    }
}
