//! Fields while they are computed: what stands between sums of arriving light and what is published.
//!
//! A [`Solver`] keeps the fields of a scene. It says what to gather ([`Solver::job`]), takes in the
//! sums that a gatherer brings ([`Solver::take`]), and makes light of them ([`Solver::solve`]). It owns
//! no gatherer and no clock: [`bake`] steps it until the light has converged, a server tick by tick.
//!
//! ```no_run
//! use lumencast_gather::path_trace::{CpuPathTracer, Options};
//! use lumencast_light::Light;
//! use lumencast_scene::Scene;
//! use lumencast_solve::{Bake, Effort, GatherOptions, bake, volumes};
//!
//! let mut scene = Scene::open("cornell")?;
//! let mut tracer = CpuPathTracer::new(Options::default())?;
//! let volumes = volumes(&mut scene, &mut tracer)?;
//! let (effort, options) = (Effort::of_samples(1024), GatherOptions::default());
//! let scene = &scene.snapshot();
//! let wanted = Bake { scene, volumes: &volumes, lightmap: None, effort, options };
//! let baked = bake(wanted, &mut tracer, |_| ())?;
//! let light = Light::new(baked.fields);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

mod bake;
pub mod blend;
mod error;
mod field;
pub mod fit;
mod lightmap;
mod newcomers;
mod noise;
mod options;
mod placement;
#[cfg(test)]
mod random;
mod request;
mod solver;
mod surfaces;
mod volume;
mod walls;

pub use bake::{Bake, Baked, Done, Effort, Receivers, Spent, bake};
pub use error::SolveError;
pub use lightmap::{BLOCKS_AT_ONCE, LightmapSolver, SeamPoints, spread, with_backs};
pub use newcomers::{Newcomers, Placed};
pub use options::{FitOptions, GatherOptions};
pub use placement::{Survey, default_volume, survey, volumes};
pub use request::{Asked, Request, Turn};
pub use solver::{FitEffort, Solver};
