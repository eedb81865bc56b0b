//! Fitting probes to surfaces.
//!
//! A client reads volumes by trilinear interpolation, which knows no walls: where cells are as large
//! as rooms, light of the bright side reaches the dark one, and probes inside walls darken both. But
//! what a volume publishes need not be the light that arrives at its probes. Here the coefficients c
//! of all volumes are chosen so that what clients read on surfaces is as near as possible to what
//! arrives there: they minimise
//!
//! Σₚ wₚ |Eₚ − Rₚ c|² + Σⱼ sⱼ/4π Σₖ A²ₖ |cⱼₖ − gⱼₖ|²
//!
//! - Eₚ is the irradiance at point p of a surface, and Rₚ reads it just as a client does: from all
//!   volumes that [count](lumencast_light::Light::shares) there, trilinear, off the surface by the
//!   volume's [offset](lumencast_light::Offset), convolved by the cosine. The two sides of a wall are
//!   read from other places and in other directions, so that even a wall within a cell keeps them apart.
//! - Points are those that are [seen](Surroundings) from the probes themselves and from about the
//!   volume, so that a surface counts by how much of it is seen, and the insides of walls not at all.
//! - wₚ makes differences count as they are displayed: the square of the slope of the code v^(1/2.2)
//!   at what the volume shows at p. It is found from the fit itself, in rounds: found from the noisy
//!   Eₚ, it would favour points that are too dark by chance.
//! - The second sum keeps a probe by the light g that was gathered at it, where surfaces leave it
//!   free: Aₖ are the cosine's factors, so that it is the squared error of irradiance, over all
//!   normals, as if sⱼ points of a surface had been there. Free space and moving things are lit by it.
//!
//! Bands above 2 stay what was gathered: irradiance hardly depends on them, specular light does.
//!
//! The idea of choosing the coefficients of an interpolated light map by least squares is Kavan,
//! Bargteil and Sloan's (2011, "Least Squares Vertex Baking"). A client has nothing to do for it, and
//! pays nothing.

mod solve;

use glam::Vec3;
use lumencast_gather::{Receiver, Sums, SumsAt, SurfacePoint};
use lumencast_light::{Light, Place, ProbeVolume, luminance, sh};

use solve::{Row, SIZE, System};

/// Share of its directions in which a probe sees backs above which it counts as being inside of
/// something.
const INSIDE: f32 = 0.3;
/// How much such a probe's own light counts beside that of others.
const INSIDE_TRUST: f32 = 0.05;
/// Darkness, relative to the mean irradiance, below which differences count no more than there.
const DARKEST: f32 = 0.05;
/// 2 (1 − 1/2.2): the squared slope of v^(1/2.2) falls with this power of v.
const SLOPE: f32 = 2.0 * (1.0 - 1.0 / 2.2);

/// How probes are fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitSettings {
    /// s of a probe that is not inside of anything: as many points of surfaces its own light is
    /// worth.
    pub stiffness: f32,
    /// Rounds of weighing points and solving, at least 1.
    pub rounds: u32,
    /// Steps of conjugate gradients a round, at most.
    pub steps: u32,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self { stiffness: 1.0, rounds: 4, steps: 64 }
    }
}

/// A volume to be fitted, and what is known about it.
pub struct Part<'a> {
    /// The light at its probes.
    pub gathered: &'a ProbeVolume,
    /// What its probes see.
    pub around: &'a Surroundings,
    /// The irradiance at each point of its surroundings, lux, where that is known.
    pub irradiance: Vec<Option<Vec3>>,
}

impl Part<'_> {
    /// The points that count, with their irradiance.
    fn points(&self) -> impl Iterator<Item = (SurfacePoint, Vec3)> + '_ {
        let each = self.irradiance.iter().enumerate();
        each.filter(|(point, _)| self.around.counts(*point)).filter_map(|(point, irradiance)| {
            Some((self.around.points[point]?, irradiance.filter(|e| e.is_finite())?))
        })
    }

    /// s of each probe. Their light counts as points' does: by how it is displayed.
    fn stiffness(&self, mean: f32, settings: &FitSettings) -> impl Iterator<Item = f32> {
        let stiffness = settings.stiffness;
        (0..self.gathered.grid.probe_count()).map(move |probe| {
            // Nothing is known of them where none has looked around.
            let is_inside = self.around.inside.get(probe).copied().unwrap_or(false);
            let trust = if is_inside { INSIDE_TRUST } else { 1.0 };
            trust * stiffness * worth(mean_irradiance(self.gathered.probe(probe)) / mean)
        })
    }

    /// Coefficients of a probe that are solved for.
    fn free(&self) -> impl Iterator<Item = usize> {
        let free = self.gathered.order.coefficients().min(SIZE);
        std::iter::repeat_n(free, self.gathered.grid.probe_count())
    }
}

/// Fits all volumes of a light together, since clients read a point's light from all that count there.
/// `light` holds what the fit begins from, such as the last one or the light that was gathered, and then
/// the result; `parts` stand in the order of its volumes.
///
/// Where no light arrives anywhere, the light is what was gathered.
pub fn fit(light: &mut Light, parts: &[Part<'_>], settings: &FitSettings) {
    let points: Vec<(SurfacePoint, Vec3)> = parts.iter().flat_map(Part::points).collect();
    let mean = points.iter().map(|(_, irradiance)| luminance(*irradiance)).sum::<f32>()
        / points.len() as f32;
    if !(mean > 0.0 && mean.is_finite()) {
        for (volume, part) in light.volumes_mut().zip(parts) {
            volume.coefficients.copy_from_slice(&part.gathered.coefficients);
        }
        return;
    }
    let stiffness = parts.iter().flat_map(|part| part.stiffness(mean, settings)).collect();
    let mut system = System::new(stiffness, parts.iter().flat_map(Part::free).collect());
    let volumes: Vec<&ProbeVolume> = light.volumes().collect();
    let first = first_probes(&volumes);
    for (at, irradiance) in points {
        let reads = read_at(light, &volumes, &first, &at);
        let row = Row::new(at.normal, irradiance / mean);
        system.push(row.beside(higher_bands(parts, &first, &reads, at.normal) / mean), reads);
    }
    let gathered = solved_for(parts.iter().map(|part| part.gathered), mean);
    let mut found = solved_for(light.volumes(), mean);
    for _ in 0..settings.rounds.max(1) {
        system.weigh(&found, |shown| worth(luminance(shown)));
        system.solve(&mut found, &gathered, settings.steps);
    }
    let mut found = found.chunks_exact(SIZE);
    for (volume, part) in light.volumes_mut().zip(parts) {
        let free = volume.order.coefficients().min(SIZE);
        for probe in 0..volume.grid.probe_count() {
            let result = volume.probe_mut(probe);
            result.copy_from_slice(part.gathered.probe(probe));
            for (c, x) in result[..free].iter_mut().zip(found.next().into_iter().flatten()) {
                *c = *x * mean;
            }
        }
    }
}

/// The number of each volume's first probe among those of all.
fn first_probes(volumes: &[&ProbeVolume]) -> Vec<u32> {
    let counts = volumes.iter().map(|volume| volume.grid.probe_count() as u32);
    counts
        .scan(0, |next, count| {
            *next += count;
            Some(*next - count)
        })
        .collect()
}

/// The probes that a client reads a point from, and how much each counts; none where the point lies
/// half a cell outside of all volumes and more, whose outermost probes stand in for it.
fn read_at(
    light: &Light,
    volumes: &[&ProbeVolume],
    first: &[u32],
    at: &SurfacePoint,
) -> Vec<(u32, f32)> {
    let (mut reads, mut near) = (Vec::new(), false);
    for (number, part) in light.shares(&Place::on_surface(at.position, at.normal)) {
        let volume = volumes[number];
        let corners = volume.corners(at.position, at.normal);
        near |= volume.grid.reach(volume.grid.cell_from_world(at.position)) > 0.0;
        let probes = corners.probes.into_iter().zip(corners.shares);
        let counting = probes.filter(|(_, share)| *share > 0.0);
        reads.extend(counting.map(|(probe, share)| (first[number] + probe as u32, part * share)));
    }
    if near { reads } else { Vec::new() }
}

/// The irradiance that is read of the bands that stay what was gathered, lux.
fn higher_bands(parts: &[Part<'_>], first: &[u32], reads: &[(u32, f32)], normal: Vec3) -> Vec3 {
    let of = |&(probe, share): &(u32, f32)| {
        let number = first.partition_point(|first| *first <= probe) - 1;
        let volume = parts[number].gathered;
        if volume.order.coefficients() <= SIZE {
            return Vec3::ZERO;
        }
        let basis = sh::cosine_basis(volume.order, normal);
        let light = volume.probe((probe - first[number]) as usize).iter().zip(&basis);
        share * light.skip(SIZE).map(|(c, b)| *c * *b).sum::<Vec3>()
    };
    reads.iter().map(of).sum()
}

/// The coefficients that are solved for, in units of the mean; 0 those that a volume's order lacks.
fn solved_for<'a>(volumes: impl IntoIterator<Item = &'a ProbeVolume>, mean: f32) -> Vec<Vec3> {
    let mut all = Vec::new();
    for volume in volumes {
        for probe in 0..volume.grid.probe_count() {
            let light = volume.probe(probe).iter().take(SIZE).map(|c| *c / mean);
            all.extend(light.chain(std::iter::repeat(Vec3::ZERO)).take(SIZE));
        }
    }
    all
}

/// How much differences of an irradiance in units of the mean count: the squared slope of its code.
fn worth(irradiance: f32) -> f32 {
    (irradiance.max(0.0) + DARKEST).powf(-SLOPE)
}

/// Luminance of a probe's irradiance, averaged over all normals.
fn mean_irradiance(probe: &[Vec3]) -> f32 {
    sh::cosine_basis(sh::Order::L1, Vec3::Y)[0] * luminance(probe[0])
}

/// What is seen from a volume's probes, and from other places: for each of them as many directions, and
/// the point of a surface that each meets.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surroundings {
    points: Vec<Option<SurfacePoint>>,
    /// Which of the places are inside of something; what they see does not count.
    inside: Vec<bool>,
}

impl Surroundings {
    /// Of the sums of all probes, in index order, and after them of any other places to look from, of a
    /// job that asked for [`surfaces`](lumencast_gather::Job::surfaces).
    pub fn new(probes: &Sums) -> Self {
        let backs =
            |sums: &SumsAt<'_>| sums.surfaces.iter().flatten().filter(|at| !at.front).count();
        let inside =
            probes.iter().map(|sums| backs(&sums) as f32 > INSIDE * sums.count as f32).collect();
        let points = probes.iter().flat_map(|sums| sums.surfaces.iter().copied()).collect();
        Self { points, inside }
    }

    /// The points, probe by probe, direction by direction; `None` where a direction meets nothing.
    pub fn points(&self) -> &[Option<SurfacePoint>] {
        &self.points
    }

    /// Whether a point is to be lit rightly: it is there, and seen from outside of things.
    pub fn counts(&self, point: usize) -> bool {
        let directions = self.points.len() / self.inside.len().max(1);
        self.points.get(point).is_some_and(Option::is_some)
            && !self.inside[point / directions.max(1)]
    }

    /// All points as receivers of light; those where there is none stand at the origin.
    pub fn receivers(&self) -> impl Iterator<Item = Receiver> + '_ {
        self.points.iter().map(|point| {
            point.map_or(Receiver::point(Vec3::ZERO, Vec3::Y), |at| {
                Receiver::point(at.position, at.normal)
            })
        })
    }
}
