//! Rooms far from the world's origin are drawn as near it.

use glam::{DVec3, Quat, UVec3, Vec3};
use lumencast_light::{FieldId, Grid, Light, Order, ProbeVolume};
use lumencast_scene::View;
use lumencast_shade::{Gpu, Lighting, Renderer, Settings};
use lumencast_testkit::rooms::{Placed, Rooms};

use crate::common::direct;

/// Light that differs from probe to probe, about the rooms.
fn light(rooms: &Rooms) -> Light {
    let grid = Grid {
        center: rooms.world(Vec3::new(0.0, 1.5, 0.0)),
        rotation: Quat::IDENTITY,
        size: Vec3::new(8.0, 3.0, 4.0),
        resolution: UVec3::new(6, 3, 4),
    };
    let mut volume = ProbeVolume::dark(FieldId(0), grid, Order::L1);
    for probe in 0..grid.probe_count() {
        volume.probe_mut(probe)[0] = Vec3::splat(1.0 + (7 * probe % 11) as f32);
    }
    Light::new(vec![volume])
}

/// What is seen of a point of the rooms.
fn seen(renderer: &mut Renderer, rooms: &Rooms, eye: Vec3, settings: &Settings) -> Vec<Vec3> {
    // A far target, so that rounding turns the view little.
    let target = eye + 1e4 * Vec3::new(0.4, -0.5, -1.0);
    let (eye, target) = (rooms.world(eye), rooms.world(target));
    let view = View::look_at(eye, target, 1.2).expect("two points");
    renderer.pictures(&[view], settings).expect("a picture").remove(0)
}

#[test]
fn far_rooms_look_as_near_ones() {
    let (lit, dark) = (Vec3::new(-2.0, 1.2, 0.5), Vec3::new(2.0, 1.2, 0.5));
    let mean = |picture: &[Vec3]| picture.iter().map(|p| p.x).sum::<f32>() / picture.len() as f32;
    let mut renderer = Renderer::new(Gpu::new().expect("an adapter"), &direct());
    for distance in [1e5, 1e6] {
        for placed in [Placed::Flat, Placed::Nested] {
            let at = DVec3::new(distance + 0.37, 0.013 * distance, 0.71 - 1.3 * distance);
            let rooms = Rooms { at, placed, emission: 0.0 };
            let mut all = [Vec::new(), Vec::new()];
            // The same points near the origin as the world's digits let them be far away.
            let lit = [rooms.local(rooms.world(lit)), lit];
            for (n, rooms) in [rooms.near(), rooms].into_iter().enumerate() {
                renderer.set_light(&light(&rooms)).expect("a field");
                renderer.set_scene(&rooms.scene().snapshot());
                for lighting in [Lighting::DIRECT, Lighting::INDIRECT] {
                    let settings = Settings { lighting, ..direct() };
                    all[n].push(seen(&mut renderer, &rooms, lit[n], &settings));
                    if lighting == Lighting::DIRECT {
                        let picture = seen(&mut renderer, &rooms, dark, &settings);
                        let lit = picture.iter().filter(|p| **p != Vec3::ZERO).count();
                        assert_eq!(lit, 0, "{rooms:?}: light in the dark");
                    }
                }
            }
            let [near, far] = all;
            for (near, far) in near.iter().zip(&far) {
                let off: f32 = near.iter().zip(far).map(|(a, b)| (a.x - b.x).abs()).sum();
                let off = off / near.len() as f32;
                // The field, too, lies where it does to the last digit.
                assert!(off < 0.03 * mean(near), "{rooms:?}: {off} of {}", mean(near));
                assert!(mean(near) > 0.1);
            }
        }
    }
}
