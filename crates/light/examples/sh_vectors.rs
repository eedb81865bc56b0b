//! Writes `vectors/sh.json`, by which every implementation of the light's mathematics is tested:
//! `cargo run -p lumencast-light --example sh_vectors > vectors/sh.json`.
//!
//! `basis`: the 25 functions at unit vectors. `irradiance`: coefficients, a normal, lux.
//! `ggx`: roughness and multipliers of bands 0 to 4. `rotation`: coefficients, a quaternion, rotated
//! coefficients. `atlas`: a volume's coefficients and its texture as bits of half floats.

#![expect(clippy::print_stdout, reason = "its purpose is to print a file")]

use glam::{Quat, UVec3, Vec3};
use lumencast_light::sh::{Rotation, basis};
use lumencast_light::{Atlas, FieldId, Grid, Order, ProbeVolume, Sh, zh};
use serde_json::{Value, json};

fn main() {
    let directions =
        [Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::new(1.0, 2.0, 3.0), Vec3::new(-5.0, 2.0, -2.0)]
            .map(Vec3::normalize);
    let light = |order: Order| {
        let mut light = Sh::dark(order);
        for (i, c) in light.values_mut().iter_mut().enumerate() {
            let i = i as f32;
            *c = Vec3::new(1.0 / (1.0 + i), 0.5 - 0.125 * i, 3.0 / (2.0 + i * i));
        }
        light
    };
    let orders = [Order::L1, Order::L2, Order::L3, Order::L4];
    let basis: Vec<Value> = directions
        .iter()
        .map(|&d| json!({ "direction": d, "values": basis(Order::L4, d).to_vec() }))
        .collect();
    let irradiance: Vec<Value> = orders
        .iter()
        .flat_map(|&order| directions.map(|normal| {
            let light = light(order);
            json!({ "order": order, "coefficients": light.values(), "normal": normal, "lux": light.irradiance(normal) })
        }))
        .collect();
    let ggx: Vec<Value> = [0.0, 0.1, 0.25, 0.5, 0.75, 1.0]
        .iter()
        .map(|&roughness| json!({ "roughness": roughness, "bands": zh::ggx(roughness) }))
        .collect();
    let quaternion = Quat::from_xyzw(0.1, -0.5, 0.3, 0.8).normalize();
    let rotation: Vec<Value> = orders
        .iter()
        .map(|&order| {
            let light = light(order);
            let rotated = Rotation::new(order, quaternion).apply(&light);
            json!({ "order": order, "quaternion": quaternion, "coefficients": light.values(), "rotated": rotated.values() })
        })
        .collect();
    let atlas: Vec<Value> = orders.iter().map(|&order| atlas(order)).collect();
    let all = json!({ "basis": basis, "irradiance": irradiance, "ggx": ggx, "rotation": rotation, "atlas": atlas });
    println!("{}", serde_json::to_string(&all).expect("plain values"));
}

/// A volume of 2×1×2 probes whose values need rounding, clamping and subnormal halves.
fn atlas(order: Order) -> Value {
    let resolution = UVec3::new(2, 1, 2);
    let grid = Grid { center: Vec3::ZERO, rotation: Quat::IDENTITY, size: Vec3::ONE, resolution };
    let mut volume = ProbeVolume::dark(FieldId(0), grid, order);
    for (i, c) in volume.coefficients.iter_mut().enumerate() {
        let i = i as f32;
        *c = Vec3::new(100.0 / (1.0 + i), -0.001 * i * i, 2e-6 * i);
    }
    volume.coefficients[1] = Vec3::new(1e7, -1e7, 1.0009765);
    let atlas = Atlas::pack(&volume, 4);
    json!({
        "order": order, "resolution": resolution, "scale_log2": 4, "size": atlas.size,
        "coefficients": volume.coefficients, "halves": atlas.halves,
    })
}
