//! Light at lumels: where it is read and what it becomes, beside `light`'s own reading on the processor.

use std::f32::consts::PI;
use std::sync::Arc;

use crate::common::{SIZE, renderer};
use glam::{Affine3A, Quat, UVec2, UVec3, Vec2, Vec3};
use lumencast_light::{
    ChartVertex, Charts, Field, FieldId, Grid, Layout, Light, Lightmap, OnTriangle, Order, Place,
    ProbeVolume, Rectangle, Surface, SurfaceId,
};
use lumencast_scene::{Material, Mesh, MeshId, Snapshot, View};
use lumencast_shade::{Lighting, Settings, Strengths};
use lumencast_testkit::scenes::{Stage, lambert};

pub(super) const PAGE: u32 = 64;
const ALBEDO: Vec3 = Vec3::new(0.9, 0.6, 0.3);
/// Metres between the middles of plates.
const APART: f32 = 2.0;

/// Plates of one mesh, a metre wide, side by side in the plane z = 0: one whose back is seen, one that
/// a mirroring shows, one that moves.
pub(super) fn scene() -> Arc<Snapshot> {
    let mut plate = Stage::default();
    let mut stage = Stage::default();
    let grey = stage.material(lambert(ALBEDO, Vec3::ZERO));
    stage.material(lambert(ALBEDO, Vec3::ZERO));
    plate.quad(Vec3::new(-0.5, -0.5, 0.0), Vec3::X, Vec3::Y, grey);
    let primitives = plate.snapshot().instances[0].mesh.primitives.clone();
    let mesh = Arc::new(Mesh { primitives, ..Mesh::default() });
    let places = [
        Affine3A::from_rotation_translation(Quat::from_rotation_y(PI), Vec3::NEG_X * APART),
        Affine3A::from_scale(Vec3::new(1.0, 1.0, -1.0)),
        Affine3A::from_translation(Vec3::X * APART),
    ];
    for place in places {
        stage.instance(MeshId(0), mesh.clone(), place);
    }
    let mut snapshot = Snapshot::clone(&stage.snapshot());
    snapshot.instances[2].still = false;
    snapshot.materials = snapshot
        .materials
        .iter()
        .cloned()
        .map(|material| Material { double_sided: true, ..material })
        .collect();
    Arc::new(snapshot)
}

/// The plate's triangles, each a chart of its own.
fn charts(low: [Vec2; 2]) -> Charts {
    let corner = |source: u32| {
        let [x, y] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]][source as usize];
        8.0 * Vec2::new(x, y)
    };
    let vertices = [[0, 1, 2], [0, 2, 3]].into_iter().zip(low).flat_map(|(triangle, low)| {
        triangle.map(|source| ChartVertex { source, rectangle: 0, at: low + corner(source) })
    });
    Charts {
        sizes: vec![UVec2::splat(32)],
        vertices: vertices.collect(),
        triangles: vec![[0, 1, 2], [3, 4, 5]],
    }
}

/// All plates have lumels on both sides; those of each surface lie elsewhere.
fn layout(scene: &Snapshot) -> Layout {
    let one = Arc::new(charts([Vec2::new(2.5, 2.25), Vec2::new(18.0, 9.5)]));
    let other = Arc::new(charts([Vec2::new(17.5, 3.75), Vec2::new(4.0, 16.5)]));
    let mut surfaces = Vec::new();
    for (number, instance) in scene.instances.iter().enumerate() {
        for back in [false, true] {
            let id = SurfaceId { node: instance.node.0, back, ..SurfaceId::default() };
            let charts = if back { other.clone() } else { one.clone() };
            let corner = UVec2::new(if back { 32 } else { 0 }, if number == 1 { 32 } else { 0 });
            let rectangles = vec![Rectangle { page: number as u32 / 2, corner }];
            surfaces.push(Surface { id, charts, rectangles });
        }
    }
    Layout::new(PAGE, 2, surfaces)
}

/// Linear over each page, so that filtering changes nothing; an even volume beside it.
pub(super) fn light(scene: &Snapshot) -> Light {
    let mut lumels = Lightmap::dark(FieldId(0), Arc::new(layout(scene)));
    for page in 0..2 {
        for y in 0..PAGE {
            for x in 0..PAGE {
                let index = lumels.layout.index(page, UVec2::new(x, y));
                let at = Vec3::new(x as f32, y as f32, 40.0 + 30.0 * page as f32);
                lumels.irradiance[index] = 100.0 * (at + 10.0);
            }
        }
    }
    let grid = Grid {
        center: Vec3::ZERO,
        rotation: Quat::IDENTITY,
        size: Vec3::splat(9.0),
        resolution: UVec3::ONE,
    };
    let mut volume = ProbeVolume::dark(FieldId(1), grid, Order::L1);
    volume.probe_mut(0)[0] = Vec3::splat(2000.0);
    Light::new([Field::from(lumels), volume.into()])
}

pub(super) fn settings() -> Settings {
    Settings {
        size: SIZE,
        samples: 1,
        lighting: Lighting::INDIRECT,
        pre_exposure: 1e-3,
        ..Settings::default()
    }
}

pub(super) fn view(number: usize) -> View {
    let middle = Vec3::X * APART * (number as f32 - 1.0);
    View::look_at(middle + Vec3::new(0.2, 0.3, 1.6), middle, 0.9).unwrap()
}

fn draw(scene: &Arc<Snapshot>, light: &Light) -> Vec<Vec<Vec3>> {
    let mut renderer = renderer(scene, &settings());
    renderer.set_light(light).unwrap();
    renderer.pictures(&[0, 1, 2].map(view), &settings()).unwrap()
}

/// Where a point of z = 0 lies on a plate, if it has lumels.
pub(super) fn on_plate(scene: &Snapshot, number: usize, point: Vec3) -> Option<OnTriangle> {
    let instance = &scene.instances[number];
    let own = instance.world_from_object.inverse().transform_point3(point);
    let (u, v) = (own.x + 0.5, own.y + 0.5);
    let (triangle, weights) = match u >= v {
        true => (0, Vec3::new(1.0 - u, u - v, v)),
        false => (1, Vec3::new(1.0 - v, u, v - u)),
    };
    // The first is turned about, the second mirrored: of both the back is seen.
    let surface = SurfaceId { node: instance.node.0, back: number < 2, ..SurfaceId::default() };
    instance.still.then_some(OnTriangle { surface, triangle, weights })
}

/// The point of z = 0 that a pixel of a plate's picture shows, where it is well within the plate.
pub(super) fn point_of(number: usize, pixel: u32) -> Option<Vec3> {
    let at = (UVec2::new(pixel % SIZE.x, pixel / SIZE.x).as_vec2() + 0.5) / SIZE.as_vec2();
    let (origin, direction) = view(number).ray(at, SIZE.x as f32 / SIZE.y as f32);
    let point = origin - direction * (origin.z / direction.z);
    let beside = (point - Vec3::X * APART * (number as f32 - 1.0)).abs().max_element();
    (beside <= 0.48).then_some(point)
}

/// What a plate shows at a point of z = 0, from what `light` reads on the processor.
fn expected(scene: &Snapshot, light: &Light, number: usize, point: Vec3) -> Vec3 {
    let on = on_plate(scene, number, point);
    let place = Place { on, ..Place::on_surface(point, Vec3::Z) };
    ALBEDO / PI * light.irradiance_at(&place)
}

#[test]
fn read_as_on_the_processor() {
    let scene = scene();
    let light = light(&scene);
    let (mut seen, mut largest) = (0, 0.0f32);
    for light in [passing(&light, 0.25), passing(&light, 0.75), light] {
        for (number, picture) in draw(&scene, &light).iter().enumerate() {
            for (i, pixel) in (0..).zip(picture) {
                let Some(point) = point_of(number, i) else { continue };
                let expected = expected(&scene, &light, number, point);
                let off = (*pixel - expected).abs().max_element() / expected.max_element();
                assert!(off < 0.01, "plate {number} at {point}: {pixel}, not {expected}");
                seen += 1;
                largest = largest.max(expected.max_element());
            }
        }
    }
    assert!(seen > 3000 && largest > 500.0, "{seen} pixels, {largest}");
}

/// The same light, all of whose surfaces have come so far from probes to lumels.
fn passing(light: &Light, way: f32) -> Light {
    Light::new(light.fields().iter().cloned().map(|field| match field {
        Field::Lightmap(lumels) => {
            let layout = Layout::clone(&lumels.layout);
            let shares = layout.surfaces().iter().map(|surface| (surface.id, way)).collect();
            Field::from(Lightmap { layout: Arc::new(layout.with_shares(shares)), ..lumels })
        }
        volume => volume,
    }))
}

/// Indirect light of what is still and of what moves is as strong as is asked for.
#[test]
fn strengths_are_those_of_the_settings() {
    let scene = scene();
    let light = light(&scene);
    let mut renderer = renderer(&scene, &settings());
    renderer.set_light(&light).unwrap();
    let views = [0, 1, 2].map(view);
    let mut pictures = |settings| renderer.pictures(&views, &settings).unwrap();
    let plain = pictures(settings());
    let strengths = Strengths { still: 0.5, moving: 2.0 };
    let weighed = pictures(Settings { strengths, ..settings() });
    for (number, (plain, weighed)) in plain.iter().zip(&weighed).enumerate() {
        let strength = if number == 2 { 2.0 } else { 0.5 };
        for (plain, weighed) in plain.iter().zip(weighed) {
            assert!((strength * *plain - *weighed).length() <= 2e-3 * weighed.length());
        }
    }
}

/// What lies beyond a chart's border by more than filtering reaches never shows.
#[test]
fn what_no_chart_reads_does_not_show() {
    let scene = scene();
    let light = light(&scene);
    let mut poisoned = light.clone();
    for lightmap in poisoned.fields_mut().iter_mut().filter_map(Field::as_lightmap_mut) {
        let mut read = vec![false; lightmap.irradiance.len()];
        for surface in lightmap.layout.surfaces() {
            for (triangle, steps) in [(0, 64), (1, 64)] {
                for k in 0..=steps {
                    for l in 0..=steps - k {
                        let (u, v) = (k as f32 / steps as f32, l as f32 / steps as f32);
                        let (page, at) =
                            surface.at(triangle, Vec3::new(1.0 - u - v, u, v)).unwrap();
                        let taps = lightmap.layout.taps(page, at);
                        taps.iter().filter(|(_, w)| *w > 0.0).for_each(|(l, _)| read[*l] = true);
                    }
                }
            }
        }
        for (irradiance, read) in lightmap.irradiance.iter_mut().zip(read) {
            if !read {
                *irradiance = Vec3::splat(1e4);
            }
        }
    }
    for (right, poisoned) in draw(&scene, &light).iter().zip(&draw(&scene, &poisoned)) {
        for (a, b) in right.iter().zip(poisoned) {
            assert!(a.distance(*b) < 1e-3 * a.length() + 1e-3, "{a}, {b}");
        }
    }
}

/// Specular light stays the probes': metal, which scatters no other, is as it is without lumels.
#[test]
fn metal_reflects_probes_alone() {
    let scene = scene();
    let light = light(&scene);
    let volumes = Light::new(light.volumes().cloned());
    let mut metal = Snapshot::clone(&scene);
    let of_metal =
        |material: &Material| Material { metallic: 1.0, roughness: 0.3, ..material.clone() };
    metal.materials = metal.materials.iter().map(of_metal).collect();
    let metal = Arc::new(metal);
    let drawn = draw(&metal, &light);
    assert_eq!(drawn, draw(&metal, &volumes));
    let brightest = drawn.iter().flatten().map(|pixel| pixel.max_element());
    assert!(brightest.fold(0.0, f32::max) > 0.1);
    assert_ne!(draw(&scene, &light), draw(&scene, &volumes));
}

/// Charts name the file's vertices, which the loader may have split.
#[test]
fn split_vertices_are_those_of_the_file() {
    let scene = scene();
    let light = light(&scene);
    let mut split = Mesh::clone(&scene.instances[0].mesh);
    let primitive = &mut split.primitives[0];
    primitive.sources = primitive.triangles.iter().flatten().copied().collect();
    primitive.triangles = vec![[0, 1, 2], [3, 4, 5]];
    for values in [&mut primitive.vertices.positions, &mut primitive.vertices.normals] {
        *values = primitive.sources.iter().map(|v| values[*v as usize]).collect();
    }
    primitive.uv = Default::default();
    let split = Arc::new(split);
    let mut other = Snapshot::clone(&scene);
    other.instances.iter_mut().for_each(|instance| instance.mesh = split.clone());
    assert_eq!(draw(&Arc::new(other), &light), draw(&scene, &light));
}

/// Lumels of other vertices than the scene's are left alone, and light without lumels takes its place.
#[test]
fn charts_of_another_mesh_are_left_alone() {
    let scene = scene();
    let light = light(&scene);
    let volumes = Light::new(light.volumes().cloned());
    let mut other = light.clone();
    for lightmap in other.fields_mut().iter_mut().filter_map(Field::as_lightmap_mut) {
        let surfaces = lightmap.layout.surfaces().iter().cloned().map(|surface| {
            let mut charts = Charts::clone(&surface.charts);
            charts.vertices[0].source = 3;
            Surface { charts: Arc::new(charts), ..surface }
        });
        lightmap.layout = Arc::new(Layout::new(PAGE, 2, surfaces.collect()));
    }
    let expected = draw(&scene, &volumes);
    assert_ne!(draw(&scene, &light), expected);
    assert_eq!(draw(&scene, &other), expected);
    // Both on one device, one after the other.
    let mut renderer = renderer(&scene, &settings());
    for (light, right) in [(&light, draw(&scene, &light)), (&volumes, expected)] {
        renderer.set_light(light).unwrap();
        assert_eq!(renderer.pictures(&[0, 1, 2].map(view), &settings()).unwrap(), right);
    }
}
