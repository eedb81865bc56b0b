//! `lumencast bench lightmap`: how right the light of lumels is.

mod coded;
mod directional;
mod display;
mod edges;
#[cfg(feature = "gpu")]
mod handover;
mod live;
mod reference;
mod report;

use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::Args;
use glam::Vec3;
use lumencast_charts::LaidOut;
use lumencast_codec::{LumelCoding, Qp};
use lumencast_gather::path_trace::{CpuPathTracer, Levels, Options};
use lumencast_gather::{Gather, Job, Receiver};
use lumencast_light::{FieldId, Light, Lightmap, Place};
use lumencast_scene::{Scene, Snapshot};
use lumencast_server::TickOptions;
use lumencast_solve::blend::BlendSettings;
use lumencast_solve::{GatherOptions, LightmapSolver, SeamPoints, spread};

use self::coded::{Coded, Judged};
use self::directional::Directional;
#[cfg(feature = "gpu")]
use self::handover::Handover;
use self::live::{Goals, Live};
use self::reference::{Reference, psnr, white};
use self::report::Report;
use crate::arguments::{LightmapArguments, Materials, SceneSource};
use crate::bench::cast::moved_light;
use crate::charting::{self, Lumels};
use crate::output;

/// Points of surfaces at which light is judged.
const POINTS: usize = 4096;
/// The same where light from beyond charts is looked for.
const POISON_POINTS: usize = 1 << 17;
/// Samples that lumels, and points of the reference, take at a time.
const PASS: u32 = 16;
const REFERENCE_PASS: u32 = 256;
/// All samples weigh alike.
const MEAN: BlendSettings = BlendSettings { ratio: f32::MIN_POSITIVE, significance: f32::INFINITY };
/// Shares of backs above which a point lies within something.
const BURIED: f32 = 0.5;

/// Measures how near the irradiance of lumels comes to the path tracer's.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast bench lightmap cornell
  lumencast bench lightmap sponza.glb --environment sky:1000 --texel 0.1 --samples 256 --json

Irradiance is read at 4,096 points spread evenly by area over the surfaces that have lumels. It is
compared as E/π, gamma 2.2, clamped, where the brightest hundredth of the reference is white. Points
within something are left out.")]
pub(crate) struct BenchLightmap {
    #[command(flatten)]
    scene: SceneSource,
    #[command(flatten)]
    lightmap: LightmapArguments,
    /// Surface scattering events on a path, seen from a lumel.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(0..=64))]
    bounces: u32,
    /// How surfaces reflect.
    #[arg(long, value_enum, default_value_t = Materials::Full)]
    materials: Materials,
    /// Samples a lumel.
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    samples: u32,
    /// The reference's noise at which it is good enough, decibels.
    #[arg(long, value_name = "DB", default_value_t = 55.0)]
    reference_noise: f64,
    /// Samples of a point of the reference, at most.
    #[arg(long, default_value_t = 65_536, value_parser = clap::value_parser!(u32).range(512..=1 << 24))]
    reference_samples: u32,
    /// Lets lumels also tell how light depends on the normal, and judges that on the normals of normal
    /// maps. Where there are none, normals are tilted by up to 30 degrees.
    #[arg(long)]
    directional: bool,
    /// Also casts the scene for 20 seconds as `serve` does, and moves a light half-way.
    #[arg(long)]
    live: bool,
    /// Also draws the scene while all its surfaces pass from lumels to probes, as those of a thing do that
    /// begins to move.
    #[cfg(feature = "gpu")]
    #[arg(long)]
    handover: bool,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

/// Bytes of memory of the light that is shown.
fn lightmap_bytes(lightmap: &Lightmap) -> usize {
    let slopes = lightmap.slopes.as_ref().map_or(0, |slopes| size_of_val(&**slopes));
    size_of_val(&*lightmap.irradiance) + slopes
}

impl BenchLightmap {
    pub(crate) fn run(self) -> Result<()> {
        let mut scene = self.scene.open()?;
        let name = scene.name().to_owned();
        let snapshot = scene.snapshot();
        let mut tracer =
            CpuPathTracer::new(self.options()).context("cannot start the threads that trace")?;

        let spec = self.lightmap.spec(&scene);
        let start = Instant::now();
        let laid_out = charting::lay_out(&snapshot, spec, &mut tracer)?
            .context("the scene has no still surface that lumels can lie on")?;
        let layout_seconds = start.elapsed().as_secs_f64();

        let start = Instant::now();
        let mut solver = self.gather(self.directional, &snapshot, &laid_out, &mut tracer)?;
        let gather_seconds = start.elapsed().as_secs_f64();
        let mut gathered = solver.dark();
        solver.clone().solve(false, &Light::default(), &mut gathered);
        let start = Instant::now();
        let mut lightmap = solver.dark();
        solver.solve(true, &Light::default(), &mut lightmap);
        let filter_seconds = start.elapsed().as_secs_f64();

        let seams = SeamPoints::new(&snapshot, &laid_out.layout);
        let sides = seams.sides(&lightmap);
        let seam = edges::relative(&sides);

        let places = spread(&snapshot, &laid_out.layout, POINTS);
        let own = |place: &Place| Receiver::point(place.position, place.normal);
        let reference = self.reference(places.iter().map(own), &snapshot, &mut tracer)?;
        let psnr = |lightmap: &Lightmap| {
            reference.psnr(&places, |place| lightmap.irradiance_at(place.on.as_ref()?))
        };
        let (as_gathered, filtered) = (psnr(&gathered), psnr(&lightmap));

        let judge = |coded: Coded| {
            let seam_codes = edges::codes(&seams.sides(&coded.shown), reference.white);
            Judged { irradiance_db: psnr(&coded.shown), seam_codes, coded }
        };
        let coded: Vec<Judged> = Coded::all(&lightmap)?.into_iter().map(judge).collect();
        let sent = coded.iter().find(|judged| judged.coded.is_default());
        let shown = sent.map_or(&lightmap, |judged| &judged.coded.shown);
        let many = spread(&snapshot, &laid_out.layout, POISON_POINTS);
        let poison = edges::poisoned(shown, &many, reference.white);

        let directional = match self.directional {
            true => {
                let places = directional::shaded(&snapshot, &places);
                let receivers = places.iter().map(|shaded| shaded.receiver());
                let shaded = self.reference(receivers, &snapshot, &mut tracer)?;
                let coded = coded.iter().map(|judged| &judged.coded);
                let references = [&reference, &shaded];
                Some(Directional::judge(&lightmap, coded, &places, references))
            }
            false => None,
        };

        let live = match self.live {
            true => Some(self.live(scene, &laid_out, &lightmap, reference.white)?),
            false => None,
        };

        #[cfg(feature = "gpu")]
        let handover = match self.handover {
            true => Some(Handover::measure(
                self.scene.open()?,
                &lightmap,
                &mut tracer,
                reference.white,
            )?),
            false => None,
        };

        let layout = &laid_out.layout;
        let report = Report {
            scene: name,
            pages: Lumels::of(&laid_out),
            surfaces: layout.surfaces().len(),
            backs: layout.surfaces().iter().filter(|surface| surface.id.back).count(),
            lumels: solver.lumel_count(),
            buried: solver.buried_count(),
            bytes: solver.bytes() + lightmap_bytes(&lightmap),
            samples: self.samples,
            bounces: self.bounces,
            materials: self.materials,
            as_gathered,
            filtered,
            coded,
            seam_points: sides.len(),
            seam,
            poison,
            directional,
            #[cfg(feature = "gpu")]
            handover,
            live,
            reference,
            seconds: [layout_seconds, gather_seconds, filter_seconds],
        };
        if self.json {
            return output::json(&report.json());
        }
        report.say();
        Ok(())
    }

    /// How the lumels of a scene follow it while it is cast.
    fn live(
        &self,
        scene: Scene,
        laid_out: &LaidOut,
        before: &Lightmap,
        white: f32,
    ) -> Result<Live> {
        let options = Options { levels: Levels::Two, ..self.options() };
        let mut tracer =
            CpuPathTracer::new(options).context("cannot start the threads that trace")?;
        let after = match moved_light(&scene) {
            None => None,
            Some(edit) => {
                let mut edited = self.scene.open()?;
                edited.apply(&edit)?;
                let snapshot = edited.snapshot();
                let mut solver = self.gather(false, &snapshot, laid_out, &mut tracer)?;
                let mut lightmap = solver.dark();
                solver.solve(true, &Light::default(), &mut lightmap);
                Some((edit, lightmap))
            }
        };
        let goals = Goals { before: before.clone(), after, white };
        let gather = GatherOptions { bounces: self.bounces, ..GatherOptions::default() };
        let lightmap = Some(laid_out.clone());
        let lumel_coding = LumelCoding::H264(Qp::for_pages(laid_out.layout.page_size));
        let options = TickOptions { gather, lightmap, lumel_coding, ..TickOptions::default() };
        live::measure(scene, Box::new(tracer), options, &goals)
    }

    fn options(&self) -> Options {
        Options { materials: self.materials.model(), threads: None, levels: Levels::One }
    }

    /// What arrives at the lumels of a scene.
    fn gather(
        &self,
        slopes: bool,
        scene: &Arc<Snapshot>,
        laid_out: &LaidOut,
        tracer: &mut CpuPathTracer,
    ) -> Result<LightmapSolver> {
        let mut solver = LightmapSolver::new(FieldId(0), scene, laid_out, MEAN).with_slopes(slopes);
        let bar = output::bar(u64::from(self.samples.div_ceil(PASS)), "Gathering at lumels");
        for (pass, first) in (0..self.samples).step_by(PASS as usize).enumerate() {
            let samples = PASS.min(self.samples - first);
            let job = solver.job(scene.clone(), samples);
            let job = Job { bounces: self.bounces, seed: pass as u64, ..job };
            let budgets = job.budgets.clone();
            let ticket = tracer.submit(job);
            let gathered = tracer.wait(ticket).context("gathering ended early")?;
            solver.take(&gathered, &budgets);
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(solver)
    }

    /// The path tracer's irradiance, refined until noise is as low as asked for.
    fn reference(
        &self,
        receivers: impl Iterator<Item = Receiver>,
        scene: &Arc<Snapshot>,
        tracer: &mut CpuPathTracer,
    ) -> Result<Reference> {
        let receivers: Arc<[Receiver]> = receivers.collect();
        let mut halves = [vec![Vec3::ZERO; receivers.len()], vec![Vec3::ZERO; receivers.len()]];
        let mut backs = vec![0.0; receivers.len()];
        let mut passes = 0;
        let bar = output::spinner("Computing the reference".to_owned());
        loop {
            for half in &mut halves {
                let job = Job {
                    bounces: self.bounces,
                    // Apart from the lumels' seeds.
                    seed: 1 << 32 | u64::from(passes),
                    ..Job::new(scene.clone(), receivers.clone(), REFERENCE_PASS)
                };
                let ticket = tracer.submit(job);
                let gathered = tracer.wait(ticket).context("gathering ended early")?;
                for ((sum, backs), found) in
                    half.iter_mut().zip(&mut backs).zip(gathered.sums.iter())
                {
                    *sum += found.sum[0];
                    *backs += found.dark_back_fraction;
                }
                passes += 1;
            }
            let of_half = (passes / 2 * REFERENCE_PASS) as f32;
            let of = |half: &[Vec3]| -> Vec<Option<Vec3>> {
                let means = half.iter().zip(&backs);
                means
                    .map(|(sum, b)| (*b < BURIED * passes as f32).then(|| *sum / of_half))
                    .collect()
            };
            let [one, other] = [of(&halves[0]), of(&halves[1])];
            let irradiance: Vec<Option<Vec3>> =
                one.iter().zip(&other).map(|(a, b)| Some(0.5 * ((*a)? + (*b)?))).collect();
            let white = white(irradiance.iter().flatten());
            ensure!(white > 0.0, "no light arrives at the scene's still surfaces");
            // Each half lies as far from the other as twice the mean lies from what is right.
            let pairs = one.iter().flatten().copied().zip(other.iter().flatten().copied());
            let noise = psnr(pairs, white) + 20.0 * 2.0f64.log10();
            let samples = passes * REFERENCE_PASS;
            if noise >= self.reference_noise || samples >= self.reference_samples {
                bar.finish_and_clear();
                return Ok(Reference { irradiance, white, noise, samples });
            }
        }
    }
}
