//! Every shader is valid WGSL, assembled as at run time, and every struct lies in memory as Rust has it.

use std::mem::{offset_of, size_of};

use lumencast_shaders::{
    Shading, background, deform, depth, forward, layout, meter, occlusion, pages, screen,
};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{Module, TypeInner};

fn compiled(name: &str, source: &str) -> Module {
    let module = naga::front::wgsl::parse_str(source)
        .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)));
    let capabilities = Capabilities::MULTISAMPLED_SHADING;
    Validator::new(ValidationFlags::all(), capabilities)
        .validate(&module)
        .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)));
    module
}

#[test]
fn every_shader_is_valid() {
    for (name, source, entries) in [
        ("forward, by pixels", forward(Shading::Pixels), 3),
        ("forward, by samples", forward(Shading::Samples), 3),
        ("depth", depth(), 4),
        ("background", background(), 2),
        ("pages", pages(), 2),
        ("deform", deform(), 1),
        ("occlusion", occlusion(), 3),
        ("screen", screen(), 2),
        ("meter", meter(), 1),
    ] {
        assert_eq!(compiled(name, &source).entry_points.len(), entries, "{name}");
    }
}

#[test]
fn samples_are_shaded_one_by_one_only_where_asked() {
    assert!(!forward(Shading::Pixels).contains("sample_index"));
    let samples = forward(Shading::Samples);
    assert!(samples.contains("sample_index") && !samples.contains("perspective, center"));
}

/// Names and offsets of a struct's members, and its size.
fn of_shader(modules: &[Module], name: &str) -> (Vec<(String, usize)>, usize) {
    let found = modules.iter().flat_map(|m| m.types.iter()).find_map(|(_, ty)| match &ty.inner {
        TypeInner::Struct { members, span } if ty.name.as_deref() == Some(name) => {
            let member =
                |m: &naga::StructMember| (m.name.clone().unwrap_or_default(), m.offset as usize);
            Some((members.iter().map(member).collect(), *span as usize))
        }
        _ => None,
    });
    found.unwrap_or_else(|| panic!("the shaders have no struct {name}"))
}

macro_rules! same {
    ($modules:expr, $ty:ident { $($field:ident),* $(,)? }) => {{
        let rust = vec![$((stringify!($field).to_owned(), offset_of!(layout::$ty, $field))),*];
        let (shader, size) = of_shader($modules, stringify!($ty));
        assert_eq!(shader, rust, "{}", stringify!($ty));
        assert_eq!(size, size_of::<layout::$ty>(), "size of {}", stringify!($ty));
    }};
}

fn volumes_agree(modules: &[Module]) {
    same!(
        modules,
        Volume {
            cell_from_world,
            spacing,
            scale,
            resolution,
            texels,
            origin,
            _pad0,
            offset,
            _pad1
        }
    );
}

#[test]
fn layouts_agree() {
    let modules = [
        compiled("forward", &forward(Shading::Pixels)),
        compiled("deform", &deform()),
        compiled("occlusion", &occlusion()),
        compiled("screen", &screen()),
    ];
    let m = &modules;
    same!(
        m,
        View { clip_from_world, world_from_clip, view_from_clip, eye, perspective, forward, turn }
    );
    same!(m, Instance { world_from_object, normal_from_object, mirrors, lumels, still, _pad0 });
    same!(m, Rectangle { corner, layer, share, slopes, _pad0 });
    same!(
        m,
        Frame {
            light_count,
            parts,
            filter_samples,
            search_samples,
            pre_exposure,
            sample_count,
            filter_radius,
            frame,
            occlusion_radius,
            still,
            moving,
            look,
        }
    );
    same!(m, Environment { zenith, kind, ground, turn, horizon, _pad });
    same!(
        m,
        PunctualLight {
            position,
            kind,
            direction,
            size,
            intensity,
            window,
            cone_scale,
            cone_offset,
            first_shadow,
            shadow_count,
        }
    );
    same!(m, ShadowView { clip_from_world, texel, near, depth_range, search, reach, _pad0, _pad1 });
    same!(m, Fields { count, lumel_scale, age_side, age_columns });
    volumes_agree(m);
    same!(m, Map { row0, row1 });
    same!(m, Deform { vertices, morphs, joints, influences, flags });
    same!(m, Influence { weights, joints, _pad });
    same!(m, Morph { number, weight });
    same!(m, Occlusion { radius, directions, steps, _pad });
    same!(m, Screen { factor, tone_map, step, _pad });
    same!(
        m,
        Material {
            base_color,
            emissive,
            metallic,
            specular_color,
            roughness,
            transmission,
            ior,
            specular,
            normal_scale,
            occlusion_strength,
            cutoff,
            flags,
            _pad,
            base_color_map,
            metallic_roughness_map,
            normal_map,
            emissive_map,
            specular_map,
            specular_color_map,
            transmission_map,
            occlusion_map,
        }
    );
}

/// The comparison of layouts notices a member that has moved.
#[test]
#[should_panic(expected = "Volume")]
fn a_moved_member_is_noticed() {
    let sound = "    scale: f32,\n    resolution: vec3f,\n";
    let moved = "    resolution: vec3f,\n    scale: f32,\n";
    let shader = forward(Shading::Pixels);
    assert!(shader.contains(sound));
    let moved = shader.replace(sound, moved);
    let modules = [compiled("moved", &moved)];
    volumes_agree(&modules);
}

/// Numbers that shaders and Rust both name.
#[test]
fn constants_agree() {
    use layout::{deform as bits, light, look, material, meter as bins, parts, tone};
    let screen = compiled("screen", &screen());
    let forward = compiled("forward", &forward(Shading::Pixels));
    let deform = compiled("deform", &deform());
    let meter = compiled("meter", &meter());
    let value = |module: &Module, name: &str| {
        let (_, constant) = module
            .constants
            .iter()
            .find(|(_, constant)| constant.name.as_deref() == Some(name))
            .unwrap_or_else(|| panic!("the shader has no constant {name}"));
        match module.global_expressions[constant.init] {
            naga::Expression::Literal(naga::Literal::U32(n)) => f64::from(n),
            naga::Expression::Literal(naga::Literal::F32(x)) => f64::from(x),
            ref other => panic!("{name} is {other:?}"),
        }
    };
    for (module, name, number) in [
        (&screen, "TONE_GAMMA", tone::GAMMA),
        (&screen, "TONE_SRGB", tone::SRGB),
        (&screen, "TONE_REINHARD", tone::REINHARD),
        (&screen, "TONE_FILMIC", tone::FILMIC),
        (&screen, "TONE_NEUTRAL", tone::NEUTRAL),
        (&forward, "PART_EMISSION", parts::EMISSION),
        (&forward, "PART_DIRECT", parts::DIRECT),
        (&forward, "PART_INDIRECT", parts::INDIRECT),
        (&forward, "LOOK_LIGHT", look::LIGHT),
        (&forward, "LOOK_LUMELS", look::LUMELS),
        (&forward, "LOOK_AGE", look::AGE),
        (&forward, "LIGHT_POINT", light::POINT),
        (&forward, "LIGHT_SPOT", light::SPOT),
        (&forward, "LIGHT_DIRECTIONAL", light::DIRECTIONAL),
        (&forward, "MATERIAL_DOUBLE_SIDED", material::DOUBLE_SIDED),
        (&forward, "MATERIAL_UNLIT", material::UNLIT),
        (&forward, "MATERIAL_BLEND", material::BLEND),
        (&forward, "MATERIAL_LAMBERT", material::LAMBERT),
        (&deform, "DEFORM_SKINNED", bits::SKINNED),
        (&deform, "DEFORM_FLAT", bits::FLAT),
    ] {
        assert_eq!(value(module, name), f64::from(number), "{name}");
    }
    assert_eq!(value(&meter, "METER_BINS"), bins::BINS as f64);
    assert_eq!(value(&meter, "METER_LEAST"), f64::from(bins::LEAST));
    assert_eq!(value(&meter, "METER_BINS_A_STOP"), f64::from(bins::BINS_A_STOP));
}
