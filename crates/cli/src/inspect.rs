//! `lumencast inspect`: what is in saved light, a running server or a scene.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args;
use glam::Vec3;
use lumencast_charts::{chart_count, lumels_on_pages};
use lumencast_codec::{Catalog, FieldInfo, LightFile, SavedFile, Shape, UnknownField};
use lumencast_light::{Field, Lightmap, ProbeVolume, luminance};
use lumencast_picture::{Picture, ToneMap, exposure};
use lumencast_scene::{MeshId, NodeInfo, Scene};
use serde_json::{Value, json};

use crate::arguments::{LightmapArguments, scene_name};
use crate::lightmap_report::lightmap_report;
use crate::output::{self, say};
use crate::remote::Seen;
use crate::{light_source, out_file, remote, warnings, words};

/// Says what is in a file (.light, .gltf, .glb), a built-in scene, or a running server.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast inspect sponza.light
  lumencast inspect sponza.glb
  lumencast inspect sponza.glb --charts --texel 0.05
  lumencast inspect http://127.0.0.1:4443/cornell --json")]
pub(crate) struct Inspect {
    /// A file, the name of a built-in scene, or the address of a server's scene.
    #[arg(value_name = "FILE|URL", value_parser = scene_name())]
    what: String,
    /// Cuts a scene's still surfaces into charts and says what pages of lumels they would fill. The
    /// charts are kept in the user's cache folder.
    #[arg(long)]
    charts: bool,
    #[command(flatten)]
    lightmap: LightmapArguments,
    /// Writes the pages of lumels of saved light or a server's into this folder, as EXR (lux) and as PNG
    /// (exposed so that the brightest hundredth is white).
    #[arg(long, value_name = "FOLDER")]
    pages: Option<PathBuf>,
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
}

impl Inspect {
    pub(crate) fn run(self) -> Result<()> {
        if let Some(folder) = &self.pages {
            out_file::check_folder(folder)?;
        }
        let report = if light_source::is_address(&self.what) {
            let seen = remote::look_at_scene(&self.what)?;
            self.write_pages(&seen.fields)?;
            server_report(&seen)
        } else if let Some(bytes) = light_file(Path::new(&self.what))? {
            let read = || -> Result<_> {
                let file = LightFile::read(&bytes)?;
                let fields = file.fields()?;
                Ok((file, fields))
            };
            let (file, fields) = read().with_context(|| self.what.clone())?;
            self.write_pages(&fields)?;
            saved_report(&file, &fields, bytes.len() as u64)
        } else {
            ensure!(
                self.pages.is_none(),
                "a scene has no light yet: bake it, and ask for the pages of the file"
            );
            let mut scene = Scene::open(&self.what)?;
            let mut report = scene_report(&mut scene);
            if self.charts {
                let spec = self.lightmap.spec(&scene);
                report["lightmap"] = lightmap_report(&mut scene, spec)?;
            }
            report
        };
        if self.json {
            return output::json(&report);
        }
        for line in words::lines(&report) {
            say!("{line}");
        }
        Ok(())
    }
}

impl Inspect {
    /// Writes all pages of lumels, where that is asked for.
    fn write_pages(&self, fields: &[Field]) -> Result<()> {
        let Some(folder) = &self.pages else { return Ok(()) };
        let lightmaps: Vec<&Lightmap> = fields.iter().filter_map(Field::as_lightmap).collect();
        ensure!(!lightmaps.is_empty(), "{} has no pages of lumels", self.what);
        for lightmap in lightmaps {
            let side = lightmap.layout.page_size;
            let pages = lightmap.irradiance.chunks((side as usize).pow(2));
            for (number, page) in pages.enumerate() {
                let picture = Picture::new(side, side, page.to_vec())?;
                let path = folder.join(format!("field{}-page{number}.exr", lightmap.id.0));
                picture.write_exr(&path)?;
                picture.write_png(
                    path.with_extension("png"),
                    ToneMap::Gamma,
                    exposure(&picture),
                )?;
            }
        }
        Ok(())
    }
}

/// The bytes of a file that says it holds light, or is called one.
fn light_file(path: &Path) -> Result<Option<Vec<u8>>> {
    let called = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("light"));
    if !called && !path.is_file() {
        return Ok(None);
    }
    let mut start = Vec::new();
    let mut file =
        std::fs::File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
    std::io::Read::read_to_end(&mut std::io::Read::take(&mut file, 8), &mut start)?;
    if !called && start != b"LUMENCST" {
        return Ok(None);
    }
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(Some(bytes))
}

fn light_report(catalog: &Catalog, fields: &[Field], bytes: u64) -> Value {
    let report = |info: &FieldInfo| {
        let field = fields.iter().find(|field| field.id().0 == info.id);
        let mut report = json!({
            "id": info.id,
            "kind": info.shape.kind(),
            "source": Some(&info.source).filter(|source| !source.is_empty()),
            "epoch": catalog.epoch_of(info),
            "use": info.usage,
            "regions": info.shape.regions().count(),
            "layers": info.shape.layers(),
            "scale_log2": info.scale_log2,
        });
        let own = match &info.shape {
            Shape::Volume(shape) => json!({
                "order": shape.order,
                "grid": shape.grid,
                "probes": shape.grid.probe_count(),
                "c0": field.and_then(Field::as_volume).map(c0_statistics),
            }),
            Shape::Lightmap(shape) => json!({
                "page_size": shape.page_size,
                "pages": shape.pages,
                "slopes": shape.slopes,
                "layout": shape.layout.to_string(),
                "lightmap": field.and_then(Field::as_lightmap).map(lightmap_statistics),
            }),
        };
        if let (Value::Object(report), Value::Object(own)) = (&mut report, own) {
            report.extend(own);
        }
        report
    };
    let unknown = |field: &UnknownField| json!({ "id": field.id, "kind": field.kind });
    json!({
        "epoch": catalog.epoch,
        "scene": catalog.scene,
        "tick_seconds": catalog.tick_seconds,
        "bytes": bytes,
        "fields": catalog.fields.iter().map(report).collect::<Vec<_>>(),
        "unknown_fields": catalog.unknown.iter().map(unknown).collect::<Vec<_>>(),
    })
}

/// A file's light, with what else it holds.
fn saved_report(file: &LightFile, fields: &[Field], bytes: u64) -> Value {
    let mut report = light_report(&file.catalog, fields, bytes);
    report["edits"] = file.edits.len().into();
    let kept = |file: &SavedFile| json!({ "name": file.name, "bytes": file.bytes.len() });
    report["files"] = file.files.iter().map(kept).collect();
    report
}

/// A server's light, with its state and the lights of its scene.
fn server_report(seen: &Seen) -> Value {
    let mut report = light_report(&seen.catalog, &seen.fields, seen.bytes);
    let state = &seen.state;
    report["state"] = json!({
        "tick": state.tick,
        "time": state.time,
        "version": state.version,
        "tick_ms": state.tick_ms,
        "samples": state.samples,
        "edits_since_load": seen.edits,
    });
    report["lights"] = seen.scene.as_ref().map(lights).into();
    report
}

/// Luminance of the first coefficient, cd/m²: 2√π ≈ 3.54 times the mean radiance at a probe.
fn c0_statistics(volume: &ProbeVolume) -> Value {
    let luminances: Vec<f64> = (0..volume.grid.probe_count())
        .map(|probe| f64::from(volume.probe(probe)[0].dot(Vec3::new(0.2126, 0.7152, 0.0722))))
        .collect();
    let sum: f64 = luminances.iter().sum();
    json!({
        "min": luminances.iter().copied().fold(f64::INFINITY, f64::min),
        "mean": sum / luminances.len() as f64,
        "max": luminances.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    })
}

/// Surfaces of a lightmap and their charts, and the illuminance on lumels that surfaces cover, lux.
fn lightmap_statistics(lightmap: &Lightmap) -> Value {
    let layout = &lightmap.layout;
    let mut illuminances = Vec::new();
    for surface in layout.surfaces() {
        let covered = lumels_on_pages(layout, surface);
        illuminances
            .extend(covered.map(|(index, _)| f64::from(luminance(lightmap.irradiance[index]))));
    }
    let sum: f64 = illuminances.iter().sum();
    json!({
        "surfaces": layout.surfaces().len(),
        "backs": layout.surfaces().iter().filter(|surface| surface.id.back).count(),
        "charts": layout.surfaces().iter().map(|surface| chart_count(&surface.charts)).sum::<usize>(),
        "lumels": illuminances.len(),
        "coverage": illuminances.len() as f64 / layout.lumel_count().max(1) as f64,
        "illuminance": {
            "min": illuminances.iter().copied().reduce(f64::min),
            "mean": sum / illuminances.len().max(1) as f64,
            "max": illuminances.iter().copied().reduce(f64::max),
        },
    })
}

fn scene_report(scene: &mut Scene) -> Value {
    // Only what is drawn counts: the one scene that the file names, with each of a node's instances.
    let snapshot = scene.snapshot();
    let triangles: usize = snapshot.instances.iter().map(|i| i.mesh.triangle_count()).sum();
    let nodes: Vec<Value> = scene
        .drawn_nodes()
        .map(|n| json!({ "node": n.id, "name": n.name, "parent": n.parent, "mesh": n.mesh }))
        .collect();
    let shown: BTreeSet<MeshId> = scene.drawn_nodes().filter_map(|node| node.mesh).collect();
    let meshes: Vec<Value> = shown
        .into_iter()
        .filter_map(|id| Some((id, scene.meshes().get(id.0 as usize)?)))
        .map(|(id, mesh)| {
            json!({ "mesh": id, "name": mesh.name, "triangles": mesh.triangle_count() })
        })
        .collect();
    let cameras: Vec<Value> = scene
        .cameras()
        .iter()
        .map(|camera| {
            let position = camera.world_from_camera.transform_point3(Vec3::ZERO);
            json!({
                "node": camera.node, "name": camera.node_name, "position": position.to_array(),
            })
        })
        .collect();
    let animations: Vec<Value> = scene
        .animations()
        .map(|a| json!({ "animation": a.id, "name": a.name, "seconds": a.duration }))
        .collect();
    let dark = scene.is_dark().then(|| warnings::DARK.to_owned());
    let warnings: Vec<String> = scene.warnings().iter().cloned().chain(dark).collect();
    let (bounds, volumes) = (scene.bounds(), scene.volumes());
    json!({
        "scene": scene.name(),
        "root": scene.root_file(),
        "triangles": triangles,
        "instances": snapshot.instances.len(),
        "bounds": { "min": bounds.min, "max": bounds.max },
        "nodes": nodes,
        "meshes": meshes,
        "materials": scene.materials().len(),
        "lights": lights(scene),
        "cameras": cameras,
        "animations": animations,
        "environment": scene.environment(),
        // Only rays tell where the default one is, and none are traced here.
        "default_volume": volumes.is_empty(),
        "volumes": volumes,
        "files": scene.files().into_iter().map(|file| file.name).collect::<Vec<_>>(),
        "warnings": warnings,
    })
}

/// The punctual lights of a scene.
fn lights(scene: &Scene) -> Vec<Value> {
    let light = |node: NodeInfo<'_>| {
        let light = node.light?;
        Some(json!({ "node": node.id, "name": node.name, "light": light }))
    };
    scene.drawn_nodes().filter_map(light).collect()
}
