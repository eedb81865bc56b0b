//! Cuts a scene's surfaces and lays them out: `lay_out SCENE [size=N|texel=M]`.
use lumencast_charts::*;
use lumencast_scene::{LightmapSpec, Scene};
use std::time::Instant;
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let name = std::env::args().nth(1).unwrap();
    let mut scene = Scene::open(&name)?;
    let spec = match std::env::args().nth(2) {
        Some(s) if s.starts_with("size=") => LightmapSpec::Size(s[5..].parse()?),
        Some(s) => LightmapSpec::Texel(s[6..].parse()?),
        None => scene.lightmap().unwrap_or_default(),
    };
    let store = Store::new("/tmp/charts-store");
    let start = Instant::now();
    let snapshot = scene.snapshot();
    let all = sheets(&snapshot, Some(&store), &|_| true)?;
    let cut = start.elapsed();
    let start = Instant::now();
    let out = laid_out(&all.sheets, spec)?;
    let lay = start.elapsed();
    let start = Instant::now();
    let l: Vec<Lumel> = out.layout.surfaces().iter().flat_map(|s| lumels(&s.charts)).collect();
    let held = l.iter().filter(|l| l.holds_middle).count();
    let rects: u32 = out.layout.surfaces().iter().flat_map(|s| &s.charts.sizes).map(|s| s.element_product()).sum();
    println!("{name}: sheets {} charts {} notes {:?}\n cut {cut:?} lay {lay:?} lumels {:?}: pages {}x{}² texel {:.4} coarser {} lumels {} ({} hold middle) rectangles {rects}, used {:.2}",
        all.sheets.len(), all.sheets.iter().map(Sheet::charts).sum::<usize>(), all.notes, start.elapsed(),
        out.layout.pages, out.layout.page_size, out.texel, out.coarser, l.len(), held,
        l.len() as f64 / (out.layout.pages * out.layout.page_size.pow(2)) as f64);
    Ok(())
}
