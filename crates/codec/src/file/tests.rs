//! Files that are written and read, and bytes that are none.

use super::*;
use glam::{Quat, UVec2, UVec3, Vec2, Vec3};
use lumencast_light::{
    ChartVertex, Charts, FieldId, Grid, Layout, Light, Lightmap, Offset, Order, ProbeVolume,
    Rectangle, Surface, SurfaceId,
};

fn file() -> (Vec<ProbeVolume>, LightFile) {
    let volumes: Vec<ProbeVolume> = [(7, UVec3::new(12, 2, 3)), (2, UVec3::ONE)]
        .into_iter()
        .map(|(id, resolution)| {
            let grid = Grid {
                center: Vec3::ONE,
                rotation: Quat::from_rotation_y(1.0),
                size: Vec3::splat(3.0),
                resolution,
            };
            let mut volume = ProbeVolume::dark(FieldId(id), grid, Order::L2);
            volume.offset = Offset::Cells(0.125 * id as f32);
            for (i, c) in volume.coefficients.iter_mut().enumerate() {
                *c = Vec3::new(1.0, 2.0, 3.0) / (1 + i % 9) as f32;
            }
            volume
        })
        .collect();
    let scene = SceneInfo { name: "a".into(), root: "a.glb".into() };
    let fields: Vec<Field> = volumes.iter().cloned().map(Field::from).collect();
    let file = LightFile::of_fields(scene, "a test", &fields, UpdateInfo::default());
    (volumes, file)
}

#[test]
fn files_round_trip() {
    let (volumes, file) = file();
    let read = LightFile::read(&file.write()).unwrap();
    assert_eq!(read, file);
    let decoded = Light::new(read.fields().unwrap());
    assert_eq!(decoded.fields().len(), 2);
    for (volume, decoded) in volumes.iter().zip(decoded.volumes()) {
        assert_eq!(
            (volume.id, volume.order, volume.grid.resolution, volume.offset),
            (decoded.id, decoded.order, decoded.grid.resolution, decoded.offset)
        );
        let worst = volume
            .coefficients
            .iter()
            .zip(&decoded.coefficients)
            .fold(0.0_f32, |w, (a, b)| w.max(a.distance(*b)));
        assert!(worst > 0.0 && worst < 0.03 * volume.coefficients[0].length(), "{worst}");
    }
}

#[test]
fn edits_and_their_files_are_kept_and_unknown_records_passed_over() {
    let (_, mut file) = file();
    let environment = lumencast_scene::Environment::clear_sky(1000.0);
    file.edits = vec![Edit::SetEnvironment { environment }];
    file.files = vec![SavedFile { name: "sky/a b.hdr".into(), bytes: vec![7; 300] }];
    let mut bytes = file.write();
    put_record(&mut bytes, 99, &[b"of a later version"]);
    put_record(&mut bytes, kind::KEYFRAME, &[&[99, 0], b"of a field of a later kind"]);
    assert_eq!(LightFile::read(&bytes), Ok(file.clone()));

    let mut edits = Vec::new();
    put_record(&mut edits, kind::EDITS, &[br#"{"edits":[{"edit":"turn_to_gold"}, 7]}"#]);
    let read = LightFile::read(&[&bytes[..], &edits].concat()).expect("a file");
    assert_eq!(read.edits, []);

    let mut nameless = bytes.clone();
    put_record(&mut nameless, kind::FILE, &[&[2], b"\xff\xff", b"contents"]);
    assert_eq!(LightFile::read(&nameless).map_err(|e| e.kind()), Err("malformed"));
    let mut headless = MAGIC.to_vec();
    headless.push(VERSION);
    put_record(&mut headless, kind::FILE, &[&[1], b"a", b""]);
    assert_eq!(LightFile::read(&headless).map_err(|e| e.kind()), Err("malformed"));
}

#[test]
fn every_truncation_is_refused_or_lacks_frames() {
    let (_, file) = file();
    let bytes = file.write();
    for length in 0..bytes.len() {
        if let Ok(part) = LightFile::read(&bytes[..length]) {
            assert!(part.frames.len() < file.frames.len());
        }
    }
    assert_eq!(LightFile::read(b"LUMENCST\x01").map_err(|e| e.kind()), Err("version"));
    assert_eq!(LightFile::read(b"GIF89a..\x01").map_err(|e| e.kind()), Err("malformed"));
    // A record that claims to be huge allocates nothing.
    let mut claim = b"LUMENCST\x02".to_vec();
    put_varint(&mut claim, (1 << 53) - 1);
    assert_eq!(LightFile::read(&claim).map_err(|e| e.kind()), Err("truncated"));
}

/// Two surfaces of one mesh on the second of two pages.
fn lightmap() -> Lightmap {
    let at = |x: f32, y: f32| ChartVertex { source: 0, rectangle: 0, at: Vec2::new(x, y) };
    let charts = Arc::new(Charts {
        sizes: vec![UVec2::splat(8)],
        vertices: vec![at(0.5, 0.5), at(7.25, 0.5), at(0.5, 7.5)],
        triangles: vec![[0, 1, 2], Charts::NOWHERE],
    });
    let surface = |node: u32| Surface {
        id: SurfaceId { node, ..SurfaceId::default() },
        charts: charts.clone(),
        rectangles: vec![Rectangle { page: 1, corner: UVec2::new(8 * node, 4) }],
    };
    let layout = Layout::new(300, 2, vec![surface(1), surface(0)]);
    let mut lightmap = Lightmap::dark(FieldId(9), Arc::new(layout));
    for (lumel, value) in lightmap.irradiance.iter_mut().enumerate() {
        *value = Vec3::new(1.0, 0.5, 0.25) * (1 + lumel % 1000) as f32;
    }
    lightmap
}

fn lit_file() -> LightFile {
    let (volumes, _) = file();
    let fields = [volumes[0].clone().into(), Field::from(lightmap())];
    let scene = SceneInfo { name: "a".into(), root: "a.glb".into() };
    LightFile::of_fields(scene, "a test", &fields, UpdateInfo::default())
}

#[test]
fn lightmaps_are_kept_with_their_layouts() {
    let file = lit_file();
    assert_eq!((file.resources.len(), file.frames.len()), (2, 2 + 8));
    let read = LightFile::read(&file.write()).unwrap();
    assert_eq!(read, file);
    let fields = read.fields().unwrap();
    // Whole numbers below 1024 and quarters of them: halves hold them.
    assert_eq!(fields[1].as_lightmap(), Some(&lightmap()));
    assert!(fields[0].as_volume().is_some());
}

#[test]
fn lightmaps_without_all_of_their_layouts_are_refused() {
    let file = lit_file();
    let layout = file.catalog.fields[1].shape.as_lightmap().unwrap().layout;
    for kept in [true, false] {
        let mut part = file.clone();
        part.resources.retain(|resource| (resource.hash() == layout) == kept);
        assert_eq!(part.fields().map_err(|error| error.kind()), Err("malformed"), "{kept}");
    }
    let mut other = file.clone();
    let Shape::Lightmap(shape) = &mut other.catalog.fields[1].shape else { panic!("a volume") };
    shape.pages = 3;
    assert_eq!(other.fields().map_err(|error| error.kind()), Err("malformed"), "of other pages");
    let mut dark = file.clone();
    dark.frames.retain(|frame| frame.field != 9 || frame.region == 5);
    let fields = dark.fields().unwrap();
    let light = &fields[1].as_lightmap().unwrap().irradiance;
    assert_eq!(light.iter().filter(|value| **value != Vec3::ZERO).count(), 44 * 256);
}

#[test]
fn deltas_and_frames_of_no_tile_are_refused_or_passed_over() {
    let mut file = lit_file();
    let last = file.frames.pop().unwrap();
    let mut delta = last.clone();
    (delta.bytes[1], delta.bytes[2], delta.bytes[3]) = (0, 4, 1);
    file.frames.push(delta);
    assert_eq!(LightFile::read(&file.write()).map_err(|error| error.kind()), Err("malformed"));
    file.frames.pop();
    file.frames.push(SavedFrame { region: 8, ..last.clone() });
    assert!(LightFile::read(&file.write()).unwrap().fields().is_ok());
    file.frames.push(SavedFrame { region: 0, ..last });
    let error = LightFile::read(&file.write()).unwrap().fields().map_err(|error| error.kind());
    assert_eq!(error, Err("mismatch"), "a tile of another size");
}

#[test]
fn resources_are_bounded() {
    let (_, file) = file();
    let mut bytes = file.write();
    put_record(&mut bytes, kind::RESOURCE, &[&vec![0; limits::RESOURCE_BYTES + 1]]);
    assert_eq!(LightFile::read(&bytes).map_err(|error| error.kind()), Err("limit"));
}
