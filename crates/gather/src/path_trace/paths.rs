//! Paths: their limits, their origins, their state and their results.

use glam::Vec3;
use lumencast_light::Light;

use super::beam::{Beam, solid_angle};
use crate::accel::{ItemBuffer, Ray};
use crate::sampling::Sampler;
use crate::world::{Itself, Passing};

/// Limits and shortcuts of the paths to follow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Paths<'a> {
    /// Largest number of scattering events on a path.
    pub(crate) bounces: u32,
    /// Upper limit of the luminance that a vertex adds to scattered light, cd/m².
    pub(crate) clamp: f32,
    /// Number of scattering events from which on the limit holds. Light that is scattered once is
    /// direct to a camera and indirect to a probe. With a number for each, both limit the same
    /// light.
    pub(crate) clamp_from: u32,
    /// Number of scattering events from which on paths may end by Russian roulette.
    pub(crate) roulette_from: u32,
    /// Light that the last surface of a path scatters, besides that of punctual lights. Without it
    /// that surface only emits.
    pub(crate) previous: Option<&'a Light>,
    /// Ways to find the same light sooner.
    pub(crate) shortcuts: Shortcuts<'a>,
}

/// Ways on which paths find the same light sooner.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shortcuts<'a> {
    /// The beam that paths connect to.
    pub(crate) beam: Option<&'a Beam>,
    /// First hits of most paths' first rays.
    pub(crate) items: Option<&'a ItemBuffer>,
    /// Index of a punctual light: the points where paths found its light are recorded.
    pub(crate) learn: Option<usize>,
}

impl Paths<'_> {
    /// Paths of up to `bounces` scattering events, without other limits or shortcuts.
    pub(crate) fn new(bounces: u32) -> Self {
        Self {
            bounces,
            clamp: f32::INFINITY,
            clamp_from: 1,
            roulette_from: u32::MAX,
            previous: None,
            shortcuts: Shortcuts::default(),
        }
    }
}

/// Origin and direction of a path's first ray.
#[derive(Clone, Debug)]
pub(crate) struct Look {
    /// Metres.
    pub(crate) origin: Vec3,
    /// Unit.
    pub(crate) direction: Vec3,
    /// Density per steradian of the direction, where sources are also sampled from the origin
    /// ([`super::aim::Aim::reach`]). Infinite where they are not.
    pub(crate) pdf: f32,
    /// The random numbers of the path.
    pub(crate) sampler: Sampler,
}

/// The result of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    /// Radiance, cd/m², that a client with punctual lights would compute itself for a camera here:
    /// visible sources, and punctual light scattered once.
    pub(crate) direct: Vec3,
    /// All other radiance, cd/m², which fields would have to provide.
    pub(crate) indirect: Vec3,
    /// Metres to the first surface; infinite where there is none.
    pub(crate) distance: f32,
    /// Unit normal of the first surface on the seen side; zero where there is none.
    pub(crate) normal: Vec3,
    /// Whether the first surface is seen from its front.
    pub(crate) front: bool,
    /// Whether the first surface is seen from the back of a single-sided material.
    pub(crate) culled: bool,
    /// Whether the first surface emits to the seen side.
    pub(crate) shines: bool,
    /// Whether the path found a source of light, not only light that was known.
    pub(crate) lit: bool,
}

impl Seen {
    pub(super) const NOTHING: Self = Self {
        direct: Vec3::ZERO,
        indirect: Vec3::ZERO,
        distance: f32::INFINITY,
        normal: Vec3::ZERO,
        front: false,
        culled: false,
        shines: false,
        lit: false,
    };

    /// Arriving radiance, cd/m².
    pub(crate) fn radiance(&self) -> Vec3 {
        self.direct + self.indirect
    }

    /// Adds radiance of a source.
    pub(super) fn add(&mut self, part: Part, light: Vec3) {
        self.lit |= light != Vec3::ZERO;
        match part {
            Part::Direct => self.direct += light,
            Part::Indirect => self.indirect += light,
        }
    }

    /// Adds radiance of light that was known.
    pub(super) fn add_known(&mut self, light: Vec3) {
        self.indirect += light;
    }
}

/// The two parts of [`Seen`].
#[derive(Clone, Copy, Debug)]
pub(super) enum Part {
    Direct,
    Indirect,
}

impl Part {
    /// The part for a source that is met after `scattered` scattering events, or for a punctual
    /// light that is scattered once more.
    pub(super) fn after(scattered: u32) -> Self {
        if scattered == 0 { Self::Direct } else { Self::Indirect }
    }
}

/// The current ray of a path, and how it was chosen.
#[derive(Debug)]
pub(super) struct Segment {
    pub(super) ray: Ray,
    /// The triangle that it starts at.
    pub(super) from: Option<Itself>,
    /// Density per steradian with which the BSDF chose it. Infinite where no other strategy finds
    /// the same light.
    pub(super) pdf: f32,
    /// The start of the segment; only used with a [`Beam`].
    pub(super) start: Start,
}

/// The start of a segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// Unit normal of the triangle; zero at a path's beginning.
    pub(super) normal: Vec3,
    /// Density per square metre with which the path chose the point; infinite at its beginning.
    pub(super) density: f32,
}

impl Start {
    /// The start of a path.
    pub(super) const OF_PATH: Self = Self { normal: Vec3::ZERO, density: f32::INFINITY };
}

impl Segment {
    /// Density per square metre with which the segment arrives at a point at `distance` metres, on
    /// a surface with this unit normal.
    #[inline]
    pub(super) fn density_on(&self, distance: f32, normal: Vec3) -> f32 {
        self.pdf * solid_angle(self.ray.direction, normal, distance * distance)
    }
}

/// The state of a path.
#[derive(Debug)]
pub(super) struct Path {
    pub(super) sampler: Sampler,
    pub(super) key: u64,
    pub(super) segment: Segment,
    pub(super) throughput: Vec3,
    pub(super) seen: Seen,
}

/// Light that a path receives if nothing occludes it.
#[derive(Debug)]
pub(super) struct Connection {
    pub(super) path: u32,
    pub(super) part: Part,
    pub(super) light: Vec3,
    pub(super) ray: Ray,
    pub(super) passing: Passing,
}
