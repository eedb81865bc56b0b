//! How near lumels come to converged light while a scene moves, and after a lamp has moved. Work is
//! counted in samples, so that machines and their load do not matter.
//!
//! `cargo run --release -p lumencast-solve --example motion -- tomb 750 16000`
//!
//! Arguments: a built-in scene or a file; ticks of a sixtieth of a second; samples a tick; ticks after the
//! scene's first lamp has moved by half a metre (0); samples a lumel of the converged light (256).
//!
//! Error: irradiance as luminance, gamma 2.2, where the brightest hundredth of the converged light is
//! white.
#![expect(clippy::print_stdout, reason = "a program for the terminal")]

use std::sync::Arc;

use glam::Vec3;
use lumencast_charts::{LaidOut, laid_out, lumels_on_pages, sheets};
use lumencast_gather::path_trace::{CpuPathTracer, Levels, Options};
use lumencast_gather::{Budget, Gather, Job};
use lumencast_light::{FieldId, Light, Lightmap, luminance};
use lumencast_scene::{Edit, NodeInfo, Scene, Snapshot, Transform};
use lumencast_solve::blend::BlendSettings;
use lumencast_solve::{LightmapSolver, with_backs};

const TICK: f64 = 1.0 / 60.0;
const LUMELS: FieldId = FieldId(0);
/// All samples weigh alike.
const MEAN: BlendSettings = BlendSettings { ratio: f32::MIN_POSITIVE, significance: f32::INFINITY };
/// Samples of a lumel in a pass of the converged light.
const PASS: u32 = 32;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// A scene whose lumels are gathered at.
struct Subject {
    scene: Scene,
    laid_out: LaidOut,
    tracer: CpuPathTracer,
    passes: u64,
}

impl Subject {
    fn open(name: &str) -> Result<Self> {
        let mut scene = Scene::open(name)?;
        let snapshot = scene.snapshot();
        let mut tracer = CpuPathTracer::new(Options { levels: Levels::Two, ..Options::default() })?;
        let all = with_backs(sheets(&snapshot, None, &|_| true)?.sheets, &snapshot, &mut tracer)?;
        let laid_out = laid_out(&all, scene.lightmap())?;
        Ok(Self { scene, laid_out, tracer, passes: 0 })
    }

    fn solver(&self, scene: &Snapshot, settings: BlendSettings) -> LightmapSolver {
        LightmapSolver::new(LUMELS, scene, &self.laid_out, settings)
    }

    fn gather(&mut self, solver: &mut LightmapSolver, job: Job, budgets: &[Budget]) -> Result<()> {
        self.passes += 1;
        let ticket = self.tracer.submit(Job { seed: self.passes, ..job });
        solver.take(&self.tracer.wait(ticket).ok_or("gathering ended early")?, budgets);
        Ok(())
    }

    /// Lets the scene and its lumels go on for so many ticks.
    fn go_on(
        &mut self,
        solver: &mut LightmapSolver,
        shown: &mut Lightmap,
        ticks: u64,
        samples: u64,
    ) -> Result<()> {
        for _ in 0..ticks {
            self.scene.advance(TICK);
            let (job, budgets) = solver.next_job(self.scene.snapshot(), samples);
            self.gather(solver, job, &budgets)?;
            solver.solve(true, &Light::default(), shown);
        }
        Ok(())
    }

    /// The converged light of now.
    fn converged(&mut self, samples: u32) -> Result<Lightmap> {
        let snapshot: Arc<Snapshot> = self.scene.snapshot();
        let mut solver = self.solver(&snapshot, MEAN);
        for _ in 0..samples.div_ceil(PASS) {
            let job = solver.job(snapshot.clone(), PASS);
            let budgets = job.budgets.clone();
            self.gather(&mut solver, job, &budgets)?;
        }
        let mut light = solver.dark();
        solver.solve(true, &Light::default(), &mut light);
        Ok(light)
    }

    /// Moves the first lamp that stands somewhere.
    fn move_lamp(&mut self) -> Result<()> {
        let place = |node: NodeInfo<'_>| Some((node.id, node.light?, node.transform.translation?));
        let lamp = self.scene.nodes().find_map(place);
        let (node, _, at) = lamp.ok_or("the scene has no lamp")?;
        let translation = Some(at + Vec3::new(0.3, -0.2, 0.35));
        self.scene.apply(&Edit::MoveNode {
            node,
            transform: Transform { translation, ..Transform::default() },
        })?;
        Ok(())
    }
}

/// How near light comes to what is converged, decibels.
fn psnr(converged: &Lightmap, shown: &Lightmap) -> f64 {
    let layout = &converged.layout;
    let covered = layout.surfaces().iter().flat_map(|surface| lumels_on_pages(layout, surface));
    let covered: Vec<usize> = covered.map(|(lumel, _)| lumel).collect();
    let level = |light: &Lightmap, lumel: &usize| luminance(light.irradiance[*lumel]);
    let mut levels: Vec<f32> = covered.iter().map(|lumel| level(converged, lumel)).collect();
    levels.sort_by(f32::total_cmp);
    let white = levels[levels.len() * 99 / 100];
    let display = |level: f32| f64::from((level / white).clamp(0.0, 1.0).powf(1.0 / 2.2));
    let error =
        |lumel: &usize| (display(level(converged, lumel)) - display(level(shown, lumel))).powi(2);
    -10.0 * (covered.iter().map(error).sum::<f64>() / covered.len() as f64).log10()
}

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "tomb".into());
    let mut number = |otherwise: u64| arguments.next().map_or(Ok(otherwise), |n| n.parse());
    let (ticks, samples, after, converged) =
        (number(750)?, number(16_000)?, number(0)?, number(256)?);
    let mut subject = Subject::open(&name)?;
    let snapshot = subject.scene.snapshot();
    let mut solver = subject.solver(&snapshot, BlendSettings::default());
    let mut shown = solver.dark();
    subject.go_on(&mut solver, &mut shown, ticks, samples)?;
    if after > 0 {
        subject.move_lamp()?;
        solver.expect_change();
        subject.go_on(&mut solver, &mut shown, after, samples)?;
    }
    let converged = subject.converged(u32::try_from(converged)?)?;
    println!("{name},{},{:.2}", solver.lumel_count(), psnr(&converged, &shown));
    Ok(())
}
