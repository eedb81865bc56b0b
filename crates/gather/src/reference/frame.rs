//! Frames of one sample a pixel with the surfaces met first: the input of denoisers for real-time
//! path tracing.

use glam::{UVec2, Vec3};

use super::Renderer;
use super::picture::assemble;
use crate::accel::{Hit, Ray, Stacks};
use crate::path_trace::integrator::Integrator;
use crate::path_trace::paths::{Look, Shortcuts};
use crate::world::{Passing, World};

/// One sample a pixel, row by row from the upper left.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Pixels in width and height.
    pub size: UVec2,
    /// One sample for each pixel.
    pub samples: Vec<Sample>,
}

/// One path from the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Arriving radiance, direct and indirect, cd/m².
    pub radiance: Vec3,
    /// The part of it that the first surface or the environment emits towards the camera; it has no
    /// noise.
    pub emitted: Vec3,
    /// The surface met first, where it scatters light.
    pub surface: Option<Surface>,
}

/// A surface at the point where a camera ray met it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surface {
    /// World position, metres.
    pub position: Vec3,
    /// World unit shading normal, on the camera's side.
    pub normal: Vec3,
    /// Linear base colour, 0 to 1.
    pub base_color: Vec3,
}

impl Renderer {
    /// Traces one sample a pixel: the `number`-th of each pixel's sequence, placed by the filter.
    /// Frames 0, 1, 2, … together hold what a [`super::Film`] of as many samples holds. For
    /// comparisons of the two, use different seeds.
    #[must_use]
    pub fn frame(&self, number: u32) -> Frame {
        let tiles = self.tiles(self.paths(Shortcuts::default()), |integrator, corner| {
            self.samples(integrator, corner, number)
        });
        let size = self.settings.size;
        Frame { size, samples: assemble(size, &tiles) }
    }

    fn samples(&self, integrator: &mut Integrator<'_>, corner: UVec2, number: u32) -> Vec<Sample> {
        let looks: Vec<Look> = self.looks(corner, &[number]).collect();
        let mut samples = first_met(&self.world, &looks);
        for (sample, seen) in samples.iter_mut().zip(integrator.radiance(looks)) {
            sample.radiance = seen.radiance();
        }
        samples
    }
}

/// The surfaces that rays meet first, without radiance; paths with the same numbers meet the same
/// ones.
fn first_met(world: &World, looks: &[Look]) -> Vec<Sample> {
    let mut samples = vec![Sample::default(); looks.len()];
    let ray =
        |look: &Look| Ray { origin: look.origin, direction: look.direction, t_max: f32::INFINITY };
    let rays = looks.iter().map(ray).zip(0..);
    let passing = |n: u32| Passing { ends: [None; 2], key: looks[n as usize].sampler.key() };
    world.closest(rays, &mut Stacks::default(), passing, |n, hit| {
        samples[n as usize] = met(world, looks[n as usize].direction, hit);
    });
    samples
}

fn met(world: &World, direction: Vec3, hit: Option<Hit>) -> Sample {
    let Some(hit) = hit else {
        return Sample { emitted: world.lights.sky.radiance(direction), ..Sample::default() };
    };
    let Some(point) = world.point(&hit, direction) else { return Sample::default() };
    let surface = point.shading_normal(world.model).map(|normal| Surface {
        position: point.place.position + world.origin(),
        normal,
        base_color: point.spot.base_color(),
    });
    Sample { emitted: point.emission(world.model), surface, ..Sample::default() }
}
