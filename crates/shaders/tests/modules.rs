//! Modules are what they promise: all import what they need, functions that are shared bind nothing, and
//! what compute shaders need takes no derivatives.

use lumencast_shaders::{MODULES, assemble};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{Expression, Module, SampleLevel};

/// Whether fragment and compute shaders share a module, which therefore binds nothing.
fn is_pure(name: &str) -> bool {
    name.starts_with("common/")
        || ["surface/bsdf", "surface/material", "surface/site", "field/volume"].contains(&name)
}

/// What only fragment shaders can import.
const OF_FRAGMENTS: [&str; 3] = ["shade/depth", "shade/forward", "surface/textures"];

/// Whether a module says all that it needs. `shade/forward` wants one of two modules, which tests of
/// whole shaders choose.
fn stands_alone(name: &str) -> bool {
    name != "shade/forward"
}

fn compiled(name: &str, source: &str) -> Module {
    let module = naga::front::wgsl::parse_str(source)
        .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)));
    Validator::new(ValidationFlags::all(), Capabilities::MULTISAMPLED_SHADING)
        .validate(&module)
        .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)));
    module
}

/// A module with what it imports.
fn alone(name: &str) -> Module {
    let source = assemble(&format!("#import {name}\n")).expect("imports");
    compiled(name, &source)
}

/// Whether functions read derivatives, which compute shaders have none of.
fn takes_derivatives(module: &Module) -> bool {
    let functions = module.functions.iter().map(|(_, function)| function);
    let functions = functions.chain(module.entry_points.iter().map(|entry| &entry.function));
    functions.flat_map(|function| function.expressions.iter()).any(|(_, expression)| {
        matches!(
            expression,
            Expression::Derivative { .. }
                | Expression::ImageSample { level: SampleLevel::Auto | SampleLevel::Bias(_), .. }
        )
    })
}

#[test]
fn every_module_can_be_imported_by_itself() {
    MODULES.iter().filter(|(name, _)| stands_alone(name)).for_each(|(name, _)| drop(alone(name)));
}

/// What `shade/forward` reads is there whichever way surfaces are shaded, and differs in where it is
/// interpolated alone.
#[test]
fn pixels_and_samples_have_the_same_to_shade() {
    let text = |wanted| MODULES.iter().find(|(name, _)| *name == wanted).expect("a module").1;
    let varying = |text: &str| {
        let (_, from) = text.split_once("struct Varying {").expect("a struct");
        from.split_once('}').expect("its end").0.to_owned()
    };
    let pixels = varying(text("shade/by_pixels"));
    assert!(pixels.contains("(perspective, center)"));
    let samples = varying(text("shade/by_samples"));
    assert_eq!(pixels.replace("(perspective, center)", "(perspective, sample)"), samples);
}

#[test]
fn all_files_are_modules() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("wgsl");
    let mut found = Vec::new();
    for entry in std::fs::read_dir(&folder).expect("folders") {
        let folder = entry.expect("a folder").path();
        for entry in std::fs::read_dir(&folder).expect("files") {
            let file = entry.expect("a file").path().with_extension("");
            let name = [folder.file_name(), file.file_name()]
                .map(|part| part.expect("a name").to_string_lossy().into_owned());
            found.push(name.join("/"));
        }
    }
    found.sort();
    assert_eq!(found, MODULES.map(|(name, _)| name));
}

#[test]
fn shared_functions_bind_nothing_and_take_no_derivatives() {
    let pure: Vec<_> = MODULES.iter().filter(|(name, _)| is_pure(name)).collect();
    assert!(pure.len() >= 10, "{pure:?}");
    for (name, _) in pure {
        let module = alone(name);
        let bound: Vec<_> = module.global_variables.iter().map(|(_, v)| v.name.clone()).collect();
        assert!(bound.is_empty(), "{name} binds {bound:?}");
        assert!(!takes_derivatives(&module), "{name}");
    }
}

/// Bindings stand apart from functions.
#[test]
fn only_modules_of_bindings_bind() {
    for (name, text) in MODULES {
        let binds = text.contains("@group(");
        assert_eq!(binds, name.ends_with("bindings"), "{name}");
        assert!(!(binds && text.contains("fn ")), "{name} has functions");
    }
}

#[test]
fn derivatives_are_for_fragments_alone() {
    for (name, _) in MODULES.iter().filter(|(name, _)| stands_alone(name)) {
        let may = OF_FRAGMENTS.contains(name);
        assert!(may || !takes_derivatives(&alone(name)), "{name}");
    }
}

/// A binding and a derivative that are planted are found.
#[test]
fn faults_are_found() {
    let derivative = "fn f(x: f32) -> f32 { return dpdx(x); }";
    assert!(takes_derivatives(&compiled("derivative", derivative)));
    assert!(takes_derivatives(&alone("surface/textures")), "textures with mips");
    assert!(!alone("field/light").global_variables.is_empty());
}
