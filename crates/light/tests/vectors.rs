//! `vectors/sh.json`, which the TypeScript client reads too.

use glam::{Quat, UVec3, Vec3};
use lumencast_light::sh::{Rotation, basis};
use lumencast_light::{Atlas, FieldId, Grid, Order, ProbeVolume, Sh, zh};
use serde::Deserialize;

#[derive(Deserialize)]
struct Vectors {
    basis: Vec<Basis>,
    irradiance: Vec<Irradiance>,
    ggx: Vec<Ggx>,
    rotation: Vec<Rotated>,
    atlas: Vec<Packed>,
}

#[derive(Deserialize)]
struct Basis {
    direction: Vec3,
    values: Vec<f32>,
}

#[derive(Deserialize)]
struct Irradiance {
    order: Order,
    coefficients: Vec<Vec3>,
    normal: Vec3,
    lux: Vec3,
}

#[derive(Deserialize)]
struct Ggx {
    roughness: f32,
    bands: [f32; 5],
}

#[derive(Deserialize)]
struct Rotated {
    order: Order,
    quaternion: Quat,
    coefficients: Vec<Vec3>,
    rotated: Vec<Vec3>,
}

#[derive(Deserialize)]
struct Packed {
    order: Order,
    resolution: UVec3,
    scale_log2: i8,
    size: UVec3,
    coefficients: Vec<Vec3>,
    halves: Vec<u16>,
}

fn vectors() -> Vectors {
    serde_json::from_str(include_str!("../../../vectors/sh.json")).expect("vectors/sh.json")
}

#[test]
fn functions_are_as_recorded() {
    let vectors = vectors();
    for case in &vectors.basis {
        for (a, b) in basis(Order::L4, case.direction).iter().zip(&case.values) {
            assert!((a - b).abs() < 1e-6);
        }
    }
    for case in &vectors.irradiance {
        let lux = Sh::new(case.order, &case.coefficients).irradiance(case.normal);
        assert!((lux - case.lux).length() < 1e-5);
    }
    for case in &vectors.ggx {
        for (a, b) in zh::ggx(case.roughness).iter().zip(case.bands) {
            assert!((a - b).abs() < 1e-5);
        }
    }
    for case in &vectors.rotation {
        let light = Sh::new(case.order, &case.coefficients);
        let rotated = Rotation::new(case.order, case.quaternion).apply(&light);
        for (a, b) in rotated.values().iter().zip(&case.rotated) {
            assert!((*a - *b).length() < 1e-5);
        }
    }
}

#[test]
fn textures_have_the_recorded_bits() {
    for case in vectors().atlas {
        let grid = Grid {
            center: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            size: Vec3::ONE,
            resolution: case.resolution,
        };
        let mut volume = ProbeVolume::dark(FieldId(0), grid, case.order);
        volume.coefficients.copy_from_slice(&case.coefficients);
        let atlas = Atlas::pack(&volume, case.scale_log2);
        assert_eq!((atlas.size, atlas.halves), (case.size, case.halves));
    }
}
