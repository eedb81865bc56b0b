//! `vectors/sh.json`, which `light` and the TypeScript client read too: the same numbers from the
//! shaders, on whatever adapter there is.

use glam::{Vec3, Vec4};
use lumencast_gpu::{Gpu, Readback, bindings, wgpu};
use lumencast_shaders::assemble;
use serde::Deserialize;

#[derive(Deserialize)]
struct Vectors {
    basis: Vec<Basis>,
    irradiance: Vec<Irradiance>,
}

#[derive(Deserialize)]
struct Basis {
    direction: Vec3,
    values: Vec<f32>,
}

#[derive(Deserialize)]
struct Irradiance {
    coefficients: Vec<Vec3>,
    normal: Vec3,
    lux: Vec3,
}

/// What the shader says of a direction.
#[derive(Clone, Copy)]
struct Answer {
    basis: [f32; 25],
    cosine: [f32; 25],
}

/// Numbers of an answer.
const ANSWER: usize = 50;

/// Asks the functions of `common/harmonics`: direction in, numbers out.
const QUESTIONS: &str = "
#import common/harmonics

@group(0) @binding(0) var<storage, read> asked: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> answers: array<array<f32, 50>>;

fn answer(i: u32, first: u32, l: Lobe) {
    let groups = array(l.g0, l.g1, l.g2, l.g3, l.g4, l.g5);
    for (var g = 0u; g < 6u; g++) {
        for (var k = 0u; k < 4u; k++) {
            answers[i][first + 4u * g + k] = groups[g][k];
        }
    }
    answers[i][first + 24u] = l.g6;
}

@compute @workgroup_size(1)
fn ask(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    answer(i, 0u, lobe(asked[i].xyz, Bands(1.0, 1.0, 1.0, 1.0, 1.0)));
    answer(i, 25u, lobe(asked[i].xyz, cosine_bands()));
}
";

fn ask(asked: &[Vec4]) -> Vec<Answer> {
    let gpu = Gpu::new().expect("an adapter");
    let types = [bindings::STORAGE, bindings::WRITTEN];
    let layout = gpu.group_layout("vectors", wgpu::ShaderStages::COMPUTE, &types);
    let questions = assemble(QUESTIONS).expect("harmonics");
    let pipeline = gpu.compute("vectors", questions, "ask", &[&layout]);
    let storage = wgpu::BufferUsages::STORAGE;
    let input = gpu.buffer("asked", storage, bytemuck::cast_slice(asked), 0);
    let size = (asked.len() * ANSWER * size_of::<f32>()) as u64;
    let output = gpu.buffer("answers", storage | wgpu::BufferUsages::COPY_SRC, &[], size);
    let read = Readback::buffer(&gpu, "answers", size);
    let resources = [&input, &output].map(wgpu::Buffer::as_entire_binding);
    let group = gpu.group("vectors", &layout, &resources);
    let mut encoder = gpu.device().create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(asked.len() as u32, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&output, 0, &read, 0, size);
    gpu.queue().submit([encoder.finish()]);
    let bytes = Readback::begin(read).wait(&gpu, "asking").expect("answers");
    let numbers: &[f32] = bytemuck::cast_slice(&bytes);
    let part = |numbers: &[f32]| Answer {
        basis: numbers[..25].try_into().unwrap(),
        cosine: numbers[25..].try_into().unwrap(),
    };
    numbers.chunks_exact(ANSWER).map(part).collect()
}

#[test]
fn shaders_agree_with_the_vectors() {
    let vectors: Vectors =
        serde_json::from_str(include_str!("../../../vectors/sh.json")).expect("vectors/sh.json");
    let directions: Vec<Vec4> = vectors.basis.iter().map(|v| v.direction.extend(0.0)).collect();
    for (case, answer) in vectors.basis.iter().zip(ask(&directions)) {
        assert_eq!(case.values.len(), 25);
        for (a, b) in answer.basis.iter().zip(&case.values) {
            assert!((a - b).abs() < 2e-6, "{}: {a} {b}", case.direction);
        }
    }
    let normals: Vec<Vec4> = vectors.irradiance.iter().map(|v| v.normal.extend(0.0)).collect();
    for (case, answer) in vectors.irradiance.iter().zip(ask(&normals)) {
        let terms = case.coefficients.iter().zip(answer.cosine);
        let lux: Vec3 = terms.map(|(c, y)| *c * y).sum();
        assert!((lux - case.lux).length() < 2e-5, "{lux} {}", case.lux);
    }
}
