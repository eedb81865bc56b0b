//! What paths are: where they begin, how they stand, and what they have seen.

use glam::Vec3;
use lumencast_light::Light;

use super::beam::{Beam, solid_angle};
use crate::accel::{ItemBuffer, Ray};
use crate::sampling::Sampler;
use crate::world::{Itself, Passing};

/// Which paths to follow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Paths<'a> {
    /// Scattering events on a path.
    pub(crate) bounces: u32,
    /// Upper limit of the luminance that a vertex adds to scattered light, cd/m².
    pub(crate) clamp: f32,
    /// Scattering events from which on that holds. Light that is scattered once is direct light to a
    /// camera and indirect light to a probe: so both are held to the limit alike.
    pub(crate) clamp_from: u32,
    /// Scattering events from which on paths may end by chance.
    pub(crate) roulette_from: u32,
    /// The light that the last surface of a path scatters, beside that of punctual lights; without
    /// it, that surface only shines itself.
    pub(crate) previous: Option<&'a Light>,
    /// What finds the same light sooner.
    pub(crate) shortcuts: Shortcuts<'a>,
}

/// Ways on which paths find the same light sooner.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shortcuts<'a> {
    /// The rays of a light that paths are connected to.
    pub(crate) beam: Option<&'a Beam>,
    /// What most paths' first rays meet.
    pub(crate) items: Option<&'a ItemBuffer>,
    /// The punctual light of which to note where paths found it, by its number.
    pub(crate) learn: Option<usize>,
}

impl Paths<'_> {
    /// Paths of so many scattering events, nothing else to be seen to.
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

/// Where to look from, and where to.
#[derive(Clone, Debug)]
pub(crate) struct Look {
    /// Metres.
    pub(crate) origin: Vec3,
    /// Unit.
    pub(crate) direction: Vec3,
    /// Density per steradian with which that was chosen, where sources are reached for from the origin
    /// too ([`super::aim::Aim::reach`]); infinite where they are not.
    pub(crate) pdf: f32,
    /// The numbers of the path that begins here.
    pub(crate) sampler: Sampler,
}

/// What a path found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    /// Radiance, cd/m², of what a client that holds punctual lights draws by itself, had it a camera
    /// here: sources seen, and punctual lights scattered once.
    pub(crate) direct: Vec3,
    /// The rest: all light that fields would have to bring.
    pub(crate) indirect: Vec3,
    /// Metres to the first surface; infinite where there is none.
    pub(crate) distance: f32,
    /// Unit normal of the first surface on the side that is seen; zero where there is none.
    pub(crate) normal: Vec3,
    /// The first surface is seen from its front.
    pub(crate) front: bool,
    /// The first surface shows a back that nobody is meant to see.
    pub(crate) culled: bool,
}

impl Seen {
    pub(super) const NOTHING: Self = Self {
        direct: Vec3::ZERO,
        indirect: Vec3::ZERO,
        distance: f32::INFINITY,
        normal: Vec3::ZERO,
        front: false,
        culled: false,
    };

    /// Arriving radiance, cd/m².
    pub(crate) fn radiance(&self) -> Vec3 {
        self.direct + self.indirect
    }

    pub(super) fn add(&mut self, part: Part, light: Vec3) {
        match part {
            Part::Direct => self.direct += light,
            Part::Indirect => self.indirect += light,
        }
    }
}

/// The two parts of [`Seen`].
#[derive(Clone, Copy, Debug)]
pub(super) enum Part {
    Direct,
    Indirect,
}

impl Part {
    /// Of a source that is met after so many scattering events, or of a punctual light that is
    /// scattered once more.
    pub(super) fn after(scattered: u32) -> Self {
        if scattered == 0 { Self::Direct } else { Self::Indirect }
    }
}

/// The ray in hand, and what is known of how it was chosen.
#[derive(Debug)]
pub(super) struct Segment {
    pub(super) ray: Ray,
    /// The triangle that it starts at.
    pub(super) from: Option<Itself>,
    /// Density per steradian with which the BSDF chose it; infinite where nothing else could have
    /// found the same light.
    pub(super) pdf: f32,
    /// Where it starts; of use only beside a [`Beam`].
    pub(super) start: Start,
}

/// Where a segment starts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// Unit normal of the triangle; zero at a path's beginning.
    pub(super) normal: Vec3,
    /// Density per square metre with which the path chose the point; infinite at its beginning.
    pub(super) density: f32,
}

impl Start {
    /// A path's beginning.
    pub(super) const OF_PATH: Self = Self { normal: Vec3::ZERO, density: f32::INFINITY };
}

impl Segment {
    /// Density per square metre with which it arrives at a point so many metres away, on a surface
    /// with this unit normal.
    #[inline]
    pub(super) fn density_on(&self, distance: f32, normal: Vec3) -> f32 {
        self.pdf * solid_angle(self.ray.direction, normal, distance * distance)
    }
}

/// A path on its way.
#[derive(Debug)]
pub(super) struct Path {
    pub(super) sampler: Sampler,
    pub(super) key: u64,
    pub(super) segment: Segment,
    pub(super) throughput: Vec3,
    pub(super) seen: Seen,
}

/// Light that a path receives if nothing is in between.
#[derive(Debug)]
pub(super) struct Connection {
    pub(super) path: u32,
    pub(super) part: Part,
    pub(super) light: Vec3,
    pub(super) ray: Ray,
    pub(super) passing: Passing,
}
