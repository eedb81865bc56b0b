//! Where shadow maps look from.
//!
//! Spots have one map, or six where their cone is too wide for one; points six, the faces of a cube;
//! directional lights a cascade of maps (Engel 2006) over parts of the view, each twice to four times
//! as deep as the one before. A cascade's map covers what of its part lies within the scene; where
//! cameras move it covers the sphere around it instead and moves by whole texels, so that edges stand
//! still. It ends before its border by the widest edge that is filtered there (the second paper's
//! guard band, chapter 4.2.3).

use std::f32::consts::FRAC_PI_2;

use glam::{Mat4, Vec2, Vec3, Vec4};
use lumencast_scene::{Aabb, LightKind, PlacedLight};
use lumencast_shaders::layout;

use crate::camera::Camera;
use crate::settings::Shadows;

/// Lights draw shadows of what is so far away, metres.
const NEAR: f32 = 0.005;
/// Spots whose half-angle is larger have six maps.
const WIDEST_SPOT: f32 = 1.2;
/// Maps have no fewer texels a side where there is not enough memory: rather no shadow.
const LEAST_RESOLUTION: u32 = 128;
/// Part of the depth of a view that is divided logarithmically, the rest evenly (Zhang et al. 2006).
const LOGARITHMIC: f32 = 0.85;
/// Texels that the filter reaches beyond its radius, and one by which maps are moved.
const MARGIN: f32 = 3.0;
/// The widest edge that is looked for in parallel light, texels.
const WIDEST_SEARCH: f32 = 96.0;

/// All shadow maps of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ShadowPlan {
    /// Texels along the side of every map.
    pub(crate) resolution: u32,
    pub(crate) views: Vec<layout::ShadowView>,
    /// First view and number of views of each light.
    pub(crate) lights: Vec<(u32, u32)>,
    /// Lights that cast no shadow, because there is no room for their maps.
    pub(crate) left_out: usize,
}

/// What shadows are drawn for.
#[derive(Clone, Copy)]
pub(crate) struct Sight<'a> {
    pub(crate) cameras: &'a [Camera],
    /// The bounds of everything that casts shadows.
    pub(crate) bounds: &'a Aabb,
    pub(crate) settings: &'a Shadows,
}

impl Sight<'_> {
    /// How many maps a directional light has.
    fn cascades(&self) -> u32 {
        self.settings.cascades.clamp(1, 4)
    }
}

impl ShadowPlan {
    /// The maps of lights, at most `most_layers` of them.
    pub(crate) fn new(lights: &[PlacedLight], sight: Sight<'_>, most_layers: u32) -> Self {
        if sight.settings.resolution == 0 || sight.bounds.is_empty() {
            return Self { lights: vec![(0, 0); lights.len()], ..Self::default() };
        }
        let cascades = sight.cascades();
        let wanted: Vec<u32> =
            lights.iter().map(|light| maps(&light.light.kind, cascades)).collect();
        let (resolution, chosen) = room(lights, &wanted, sight.settings, most_layers);
        let mut plan = Self { resolution, ..Self::default() };
        for ((light, &count), chosen) in lights.iter().zip(&wanted).zip(chosen) {
            let first = plan.views.len() as u32;
            if !chosen {
                plan.left_out += 1;
                plan.lights.push((0, 0));
                continue;
            }
            match light.light.kind {
                LightKind::Directional { angle } => {
                    plan.directional(light.direction, (0.5 * angle).tan(), sight);
                }
                LightKind::Spot { outer, radius, .. } if count == 1 => {
                    let axes = (light.direction, up_for(light.direction));
                    plan.perspective(light.position, axes, outer, radius);
                }
                LightKind::Point { radius } | LightKind::Spot { radius, .. } => {
                    for axes in FACES {
                        plan.perspective(light.position, axes, 0.5 * FRAC_PI_2, radius);
                    }
                }
            }
            plan.lights.push((first, plan.views.len() as u32 - first));
        }
        plan
    }

    /// Adds the map of a square pyramid of which the half angle is given, along `forward`.
    fn perspective(
        &mut self,
        eye: Vec3,
        (forward, up): (Vec3, Vec3),
        half_angle: f32,
        radius: f32,
    ) {
        let tan = half_angle.tan();
        let clip_from_view =
            Mat4::from_cols(Vec4::X / tan, Vec4::Y / tan, Vec4::NEG_W, Vec4::Z * NEAR);
        self.views.push(layout::ShadowView {
            clip_from_world: clip_from_view * Mat4::look_to_rh(eye, forward, up),
            texel: 2.0 * tan / self.resolution as f32,
            near: NEAR,
            reach: Vec2::ONE,
            // Casters a quarter of the way from the light have an edge so wide.
            search: 3.0 * radius,
            ..layout::ShadowView::default()
        });
    }

    /// Adds the cascades of a light from afar. `size` is the tangent of half its angle.
    fn directional(&mut self, direction: Vec3, size: f32, sight: Sight<'_>) {
        let Sight { cameras, bounds, settings } = sight;
        let light_from_world = Mat4::look_to_rh(Vec3::ZERO, direction, up_for(direction));
        let all = bounds.transformed(|corner| light_from_world.transform_point3(corner));
        let farthest = cameras.iter().map(|c| farthest(c, bounds)).fold(1e-2, f32::max);
        let nearest = 0.005 * farthest;
        let cascades = sight.cascades();
        for cascade in 0..cascades {
            let from = if cascade == 0 { 0.0 } else { split(nearest, farthest, cascade, cascades) };
            let to = split(nearest, farthest, cascade + 1, cascades);
            let seen = match settings.steady {
                true => around_sphere(&light_from_world, cameras, from, to),
                false => around(&light_from_world, slices(cameras, from, to)),
            };
            let mut view = self.cascade(&seen, &all, size, settings);
            view.clip_from_world *= light_from_world;
            if cascade + 1 == cascades {
                view.reach = Vec2::ONE;
            }
            self.views.push(view);
        }
    }

    /// The map of what is `seen` of `all`: boxes as the light sees them, in which space the view is.
    fn cascade(
        &self,
        seen: &Aabb,
        all: &Aabb,
        size: f32,
        settings: &Shadows,
    ) -> layout::ShadowView {
        let depth_range = (all.max.z - all.min.z).max(1e-3) * 1.001;
        // What lies outside the scene needs no map.
        let (low, high) = (seen.min.max(all.min), seen.max.min(all.max));
        let (low, high) = (low.truncate().min(high.truncate()), high.truncate());
        let middle = 0.5 * (low + high);
        let texels = self.resolution as f32;
        let inner = (0.5 * (high - low)).max(Vec2::splat(1e-3));
        let search = (size * depth_range).min(WIDEST_SEARCH * 2.0 * inner.max_element() / texels);
        // The map is wider by what edges at the border reach beyond it.
        let extra = (settings.filter_radius + MARGIN).min(0.25 * texels);
        let wide = inner + search;
        let widest_texel = 2.0 * wide.max_element() / (texels - 2.0 * extra);
        let half = wide + extra * widest_texel;
        let texel = 2.0 * half / texels;
        let snapped = (middle / texel).floor() * texel;
        layout::ShadowView {
            // Depth 1 is nearest to the light, which looks along −z.
            clip_from_world: Mat4::from_cols(
                Vec4::X / half.x,
                Vec4::Y / half.y,
                Vec4::Z / depth_range,
                Vec4::new(
                    -snapped.x / half.x,
                    -snapped.y / half.y,
                    1.0 - all.max.z / depth_range,
                    1.0,
                ),
            ),
            texel: widest_texel,
            depth_range,
            // Its middle is moved by less than a texel.
            reach: (inner + widest_texel) / half,
            search,
            ..layout::ShadowView::default()
        }
    }
}

/// Directions and ups of a cube's faces, in the order in which the shader numbers them.
const FACES: [(Vec3, Vec3); 6] = [
    (Vec3::X, Vec3::Y),
    (Vec3::NEG_X, Vec3::Y),
    (Vec3::Y, Vec3::Z),
    (Vec3::NEG_Y, Vec3::Z),
    (Vec3::Z, Vec3::Y),
    (Vec3::NEG_Z, Vec3::Y),
];

/// How many maps a light wants.
fn maps(kind: &LightKind, cascades: u32) -> u32 {
    match kind {
        LightKind::Directional { .. } => cascades,
        LightKind::Spot { outer, .. } if *outer <= WIDEST_SPOT => 1,
        LightKind::Spot { .. } | LightKind::Point { .. } => 6,
    }
}

/// How large all maps can be, and which lights get some: the most intense first.
fn room(
    lights: &[PlacedLight],
    wanted: &[u32],
    settings: &Shadows,
    most_layers: u32,
) -> (u32, Vec<bool>) {
    let layers_of = |resolution: u32| {
        let layer = 4 * u64::from(resolution) * u64::from(resolution);
        ((settings.memory / layer).min(u64::from(most_layers))) as u32
    };
    let total: u32 = wanted.iter().sum();
    let mut resolution = settings.resolution;
    while layers_of(resolution) < total.min(most_layers) && resolution / 2 >= LEAST_RESOLUTION {
        resolution /= 2;
    }
    let mut free = layers_of(resolution);
    let power = |light: &PlacedLight| (light.light.color * light.light.intensity).max_element();
    let mut order: Vec<usize> = (0..lights.len()).collect();
    order.sort_by(|&a, &b| power(&lights[b]).total_cmp(&power(&lights[a])));
    let mut chosen = vec![false; lights.len()];
    for i in order {
        if wanted[i] <= free {
            chosen[i] = true;
            free -= wanted[i];
        }
    }
    (resolution, chosen)
}

/// A direction that is not along the given one.
fn up_for(direction: Vec3) -> Vec3 {
    if direction.y.abs() > 0.99 { Vec3::Z } else { Vec3::Y }
}

/// How far along its axis a camera sees anything.
fn farthest(camera: &Camera, bounds: &Aabb) -> f32 {
    bounds.corners().map(|c| (c - camera.eye).dot(camera.forward)).fold(0.0, f32::max)
}

/// Where part `i` of `n` of the view begins, metres.
fn split(nearest: f32, farthest: f32, i: u32, n: u32) -> f32 {
    let t = i as f32 / n as f32;
    let even = nearest + (farthest - nearest) * t;
    let logarithmic = nearest * (farthest / nearest).powf(t);
    even + (logarithmic - even) * LOGARITHMIC
}

/// The corners of what cameras see between two distances.
fn slices(cameras: &[Camera], from: f32, to: f32) -> Vec<Vec3> {
    cameras.iter().flat_map(|camera| camera.slice(from, to)).collect()
}

/// The box around points, seen from a light.
fn around(light_from_world: &Mat4, points: Vec<Vec3>) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    points.iter().for_each(|p| bounds.grow(light_from_world.transform_point3(*p)));
    bounds
}

/// The box around the sphere around what cameras see: as large whichever way they turn.
fn around_sphere(light_from_world: &Mat4, cameras: &[Camera], from: f32, to: f32) -> Aabb {
    let points = slices(cameras, from, to);
    let center = points.iter().sum::<Vec3>() / points.len().max(1) as f32;
    let radius = points.iter().map(|p| p.distance(center)).fold(0.0, f32::max);
    // Rounded, it stays the same while the camera moves.
    let radius = (radius * 16.0).ceil() / 16.0;
    let center = light_from_world.transform_point3(center);
    Aabb { min: center - radius, max: center + radius }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{UVec2, Vec2};
    use lumencast_scene::{NodeId, PunctualLight, View};

    fn placed(kind: LightKind, intensity: f32) -> PlacedLight {
        PlacedLight {
            node: NodeId(0),
            light: PunctualLight { kind, color: Vec3::ONE, intensity, range: None },
            position: Vec3::new(0.0, 3.0, 0.0),
            direction: Vec3::new(0.3, -1.0, 0.2).normalize(),
        }
    }

    const BOUNDS: Aabb = Aabb { min: Vec3::splat(-10.0), max: Vec3::splat(10.0) };

    fn plan(lights: &[PlacedLight], settings: &Shadows) -> ShadowPlan {
        let view = View::look_at(Vec3::new(0.0, 1.0, 8.0), Vec3::ZERO, 0.9).unwrap();
        let camera = Camera::new(&view, UVec2::new(160, 90), Vec2::ZERO);
        ShadowPlan::new(lights, Sight { cameras: &[camera], bounds: &BOUNDS, settings }, 256)
    }

    fn in_clip(view: &layout::ShadowView, point: Vec3) -> Vec3 {
        let clip = view.clip_from_world * point.extend(1.0);
        clip.truncate() / clip.w
    }

    /// Whether a cascade is used for a point, unless one before it is.
    fn is_reached(view: &layout::ShadowView, point: Vec3) -> bool {
        in_clip(view, point).truncate().abs().cmplt(view.reach).all()
    }

    /// Where a cascade is used, all that is looked up about a point lies on its map: the widest edge that
    /// its sun casts, and what the filter reaches beyond.
    #[test]
    fn edges_stay_on_their_cascades_map() {
        let view = View::look_at(Vec3::new(0.0, 1.0, 8.0), Vec3::ZERO, 0.9).unwrap();
        let camera = Camera::new(&view, UVec2::new(160, 90), Vec2::ZERO);
        for (angle, steady) in [(0.0, false), (0.009, false), (0.009, true), (0.1, false)] {
            let settings = Shadows { steady, ..Shadows::default() };
            let plan = plan(&[placed(LightKind::Directional { angle }, 1.0)], &settings);
            let mut nearest = [f32::INFINITY; 4];
            for step in 1..1700_u16 {
                let distance = 0.01 * f32::from(step);
                let [a, b, c, d] = *camera.slice(distance, distance).first_chunk().unwrap();
                let across = |u: f32, v: f32| a.lerp(b, u).lerp(d.lerp(c, u), v);
                let points = [0.0, 0.3, 0.6, 1.0].map(|v| [0.0, 0.4, 1.0].map(|u| across(u, v)));
                for point in points.into_iter().flatten() {
                    if point != point.clamp(BOUNDS.min, BOUNDS.max) {
                        continue;
                    }
                    let used = plan.views.iter().position(|view| is_reached(view, point));
                    let used = used.expect("a cascade for what is seen");
                    let view = &plan.views[used];
                    let clip = in_clip(view, point).abs();
                    let metres = |axis: usize| {
                        (1.0 - clip[axis]) / view.clip_from_world.row(axis).truncate().length()
                    };
                    nearest[used] = nearest[used].min(metres(0)).min(metres(1));
                }
            }
            for (view, nearest) in plan.views.iter().zip(nearest) {
                let widest =
                    ((0.5 * angle).tan() * view.depth_range).min(WIDEST_SEARCH * view.texel);
                assert!(view.search >= 0.9 * widest, "{angle}: {} of {widest} m", view.search);
                let needed = view.search + settings.filter_radius * view.texel;
                assert!(nearest >= needed, "{angle}, {steady}: {nearest} of {needed} m");
            }
            assert!(nearest[0].is_finite() && nearest[1].is_finite(), "{nearest:?}");
        }
    }

    #[test]
    fn cascades_see_what_the_camera_sees() {
        let angle = 0.01;
        for steady in [false, true] {
            cascades_see(angle, &Shadows { steady, ..Shadows::default() });
        }
    }

    fn cascades_see(angle: f32, settings: &Shadows) {
        let plan = plan(&[placed(LightKind::Directional { angle }, 1.0)], settings);
        assert_eq!(plan.lights, [(0, 4)]);
        let view = View::look_at(Vec3::new(0.0, 1.0, 8.0), Vec3::ZERO, 0.9).unwrap();
        let camera = Camera::new(&view, UVec2::new(160, 90), Vec2::ZERO);
        let mut used = [false; 4];
        for distance in [0.05, 0.5, 2.0, 5.0, 9.0, 17.0] {
            for corner in &camera.slice(distance, distance)[..4] {
                let point = corner.clamp(BOUNDS.min, BOUNDS.max);
                let first = plan.views.iter().position(|view| is_reached(view, point));
                let Some(first) = first else { panic!("{point} at {distance}") };
                used[first] = true;
                let depth = in_clip(&plan.views[first], point).z;
                assert!((0.0..=1.0).contains(&depth), "{depth}");
                // Metres towards the light, by which depth grows.
                let nearer = point - 0.5 * placed(LightKind::Point { radius: 0.0 }, 1.0).direction;
                let gain = in_clip(&plan.views[first], nearer).z - depth;
                assert!((gain * plan.views[first].depth_range - 0.5).abs() < 1e-3, "{gain}");
            }
        }
        assert!(used.iter().filter(|used| **used).count() >= 3, "{used:?}");
        assert!(plan.views.windows(2).all(|pair| pair[0].texel <= pair[1].texel));
    }

    #[test]
    fn faces_are_those_that_the_shader_chooses() {
        let plan = plan(&[placed(LightKind::Point { radius: 0.1 }, 1.0)], &Shadows::default());
        assert_eq!(plan.lights, [(0, 6)]);
        for d in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
            let face = FACES.iter().position(|(forward, _)| *forward == d).unwrap();
            let point = Vec3::new(0.0, 3.0, 0.0) + 2.0 * d + 0.4 * d.any_orthonormal_vector();
            let at = in_clip(&plan.views[face], point);
            assert!(at.truncate().abs().max_element() < 0.5, "{d}: {at}");
            // Depth is near over distance.
            assert!((at.z - NEAR / 2.0).abs() < 1e-5, "{at}");
        }
    }

    #[test]
    fn memory_is_kept_to() {
        let spot = LightKind::Spot { inner: 0.1, outer: 0.6, radius: 0.0 };
        let many: Vec<_> = (0..500).map(|i| placed(spot, i as f32)).collect();
        let settings = Shadows { memory: 64 << 20, ..Shadows::default() };
        let plan = plan(&many, &settings);
        let bytes = 4 * u64::from(plan.resolution).pow(2) * plan.views.len() as u64;
        assert!(bytes <= settings.memory && plan.resolution >= LEAST_RESOLUTION, "{bytes}");
        assert_eq!(plan.left_out, 500 - plan.views.len());
        assert_eq!(plan.lights[499].1, 1, "the most intense has one");
        assert_eq!(plan.lights[0].1, 0);
        let none = Shadows { resolution: 0, ..settings };
        let none = Sight { cameras: &[], bounds: &BOUNDS, settings: &none };
        let none = ShadowPlan::new(&many, none, 256);
        assert!(none.views.is_empty() && none.lights.len() == 500);
    }

    #[test]
    fn wide_spots_have_a_cube() {
        let spot = |outer| placed(LightKind::Spot { inner: 0.0, outer, radius: 0.0 }, 1.0);
        let plan = plan(&[spot(0.5), spot(1.5)], &Shadows::default());
        assert_eq!(plan.lights, [(0, 1), (1, 6)]);
    }
}
