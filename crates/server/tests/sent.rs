//! What a tick sends: states, catalogs and the light of each field.

mod common;

use std::collections::BTreeSet;

use common::{PERIOD, Stepped, dim, mail, options, shape};
use glam::{UVec3, Vec3};
use lumencast_codec::{Catalog, EncodedRegion, ProbeDecoder, ProbeHeader};
use lumencast_scene::{Edit, MaterialChange, MaterialId, Scene, VolumeSpec};

#[test]
fn state_tells_of_edits_and_the_version_of_the_light() {
    let mut stepped = Stepped::new(options());
    let lamp = stepped.node("lamp");
    stepped.steps(2);
    stepped.step(mail(5, dim(lamp, 2.0)));
    let state = stepped.kept.states.last().expect("a frame a tick");
    assert_eq!(state.edits.len(), 1);
    assert_eq!(state.edits[0].source, Some(("a".into(), 5)));
    assert_eq!(state.edits[0].edit, dim(lamp, 2.0));
    assert_eq!(state.tick, 2);
    assert!((state.time - 2.0 * PERIOD).abs() < 1e-9, "{}", state.time);
    let (_, frame) = stepped.kept.frames.last().expect("light");
    let header = ProbeHeader::read(&frame.bytes).expect("a header");
    assert_eq!((header.info.scene_version, header.info.tick), (state.version, 2));

    // Those who join later learn of it from a snapshot.
    stepped.steps(70);
    let snapshots: Vec<_> =
        stepped.kept.states.iter().filter_map(|state| state.snapshot.as_ref()).collect();
    assert_eq!(snapshots.len(), 2, "at the first tick and after 64");
    let told = snapshots[1].edits.iter().any(|edit| {
        matches!(edit, Edit::SetLight { node, light }
        if *node == lamp && light.intensity == Some(2.0))
    });
    assert!(told, "{:?}", snapshots[1].edits);
}

#[test]
fn what_is_sent_decodes_to_the_light() {
    let mut stepped = Stepped::new(options());
    stepped.steps(9);
    let field = shape(&stepped.tick.catalog(), 0);
    let mut decoders: Vec<ProbeDecoder> =
        field.regions.iter().map(|r| ProbeDecoder::new(r.size, field.order)).collect();
    let mut last = None;
    for (_, frame) in &stepped.kept.frames {
        let light = decoders[frame.region as usize].decode(&frame.bytes).expect("a frame");
        last = Some(light);
    }
    let light = last.expect("light");
    assert_eq!(light.header.info.update, 8);
    let volume = stepped.volume();
    let n = field.order.coefficients();
    for probe in 0..volume.grid.probe_count() {
        let (sent, held) = (&light.coefficients[probe * n..][..n], volume.probe(probe));
        let error: f32 = sent.iter().zip(held).map(|(a, b)| (*a - *b).length_squared()).sum();
        let rms = (error / (3 * n) as f32).sqrt();
        assert!(rms < 0.02 * held[0].length(), "probe {probe}: {rms} of {}", held[0]);
    }
}

#[test]
fn what_nobody_watches_is_not_encoded() {
    let mut stepped = Stepped::new(options());
    stepped.kept.unwatched = true;
    stepped.steps(5);
    assert!(stepped.kept.frames.is_empty());
    assert_eq!(stepped.kept.states.len(), 5, "the state is");
    stepped.kept.unwatched = false;
    stepped.steps(8);
    let (_, first) = stepped.kept.frames.first().expect("light");
    assert!(first.new_group && first.layer == 0, "it begins with a keyframe");
}

/// Volumes come and go while ticks go on: clients are told in the next catalog, what stays keeps its
/// light and its updates, and numbers are never used again.
#[test]
fn fields_come_and_go() {
    let mut stepped = Stepped::new(options());
    stepped.steps(3);
    let mut first: VolumeSpec = Scene::builtin("cornell").unwrap().volumes()[0];
    let own = stepped.volume();
    (first.grid, first.order) = (own.grid, own.order);
    let mut second = first;
    second.grid.center.x += 0.5;
    let ids = |stepped: &Stepped| -> Vec<u32> {
        stepped.tick.catalog().fields.iter().map(|field| field.id).collect()
    };
    let updates = |stepped: &Stepped, field: u32| -> Vec<u64> {
        let of_field = stepped.kept.frames.iter().filter(|(id, _)| *id == field);
        let update = |frame: &EncodedRegion| ProbeHeader::read(&frame.bytes).unwrap().info.update;
        of_field.map(|(_, frame)| update(frame)).collect()
    };

    stepped.tick.set_volumes(&[first, second]).unwrap();
    let before = stepped.kept.catalogs.len();
    stepped.steps(1);
    assert_eq!(ids(&stepped), [0, 1]);
    assert_eq!(stepped.kept.catalogs[before].fields.len(), 2, "told before their light");
    assert_eq!((updates(&stepped, 0), updates(&stepped, 1)), (vec![0, 1, 2, 3], vec![0]));

    stepped.tick.set_volumes(&[second]).unwrap();
    stepped.steps(1);
    stepped.tick.set_volumes(&[second, first]).unwrap();
    stepped.steps(1);
    assert_eq!(ids(&stepped), [1, 2]);
    assert_eq!(updates(&stepped, 1), [0, 1, 2]);
    assert_eq!((updates(&stepped, 0).len(), updates(&stepped, 2)), (4, vec![0]));

    second.grid.resolution.x = 0;
    assert!(stepped.tick.set_volumes(&[second]).is_err());
    assert_eq!(ids(&stepped), [1, 2]);
}

#[test]
fn a_volume_too_deep_for_clients_is_sent_in_pieces() {
    let mut deep = options();
    deep.volumes[0].grid.resolution = UVec3::new(1, 2, 40);
    let whole = deep.volumes[0].grid;
    let mut stepped = Stepped::new(deep);
    let catalog = Catalog::decode(&stepped.tick.catalog().encode()).expect("a catalog");
    let fields: Vec<_> = catalog
        .fields
        .iter()
        .map(|f| (f.id, f.shape.as_volume().unwrap().grid.resolution.z))
        .collect();
    assert_eq!(fields, [(0, 20), (1, 20)]);
    stepped.steps(1);
    let sent: BTreeSet<u32> = stepped.kept.frames.iter().map(|(field, _)| *field).collect();
    assert_eq!(sent, BTreeSet::from([0, 1]));
    let probes = stepped.tick.light().volumes().flat_map(|volume| volume.grid.positions());
    for (probe, of_whole) in probes.zip(whole.positions()) {
        assert!(probe.distance(of_whole) < 1e-5, "{probe} {of_whole}");
    }
}

#[test]
fn light_at_both_ends_of_the_scale_is_carried() {
    for (intensity, low, high) in [(1e-3, 1e-6, 1.0), (1e6, 1e3, 1e9)] {
        let mut stepped = Stepped::new(options());
        let lamp = stepped.node("lamp");
        let dark = Edit::SetMaterial {
            material: emissive(&stepped),
            change: MaterialChange { emissive: Some(Vec3::ZERO), ..Default::default() },
        };
        stepped.step(mail(1, dark));
        stepped.step(mail(2, dim(lamp, intensity)));
        stepped.steps(10);
        let c0 = stepped.mean_c0();
        assert!(c0 > low && c0 < high, "{intensity} cd: {c0}");
        let (_, frame) = stepped.kept.frames.iter().rfind(|(_, f)| f.layer == 0).expect("light");
        assert!(frame.error < 0.01, "{intensity} cd: {}", frame.error);
    }
}

/// The material of the ceiling light.
fn emissive(stepped: &Stepped) -> MaterialId {
    let materials = stepped.tick.scene().materials();
    let index = materials.iter().position(|m| m.emissive != Vec3::ZERO).expect("one shines");
    MaterialId(index as u32)
}

#[test]
fn the_catalog_is_sent_again_when_a_scale_changes() {
    let scales = |catalogs: &[Catalog]| -> Vec<_> {
        catalogs.iter().map(|catalog| catalog.fields[0].scale_log2).collect()
    };
    let mut stepped = Stepped::new(options());
    assert_eq!(stepped.tick.catalog().fields[0].scale_log2, None, "before there is light");
    stepped.steps(30);
    let told = scales(&stepped.kept.catalogs);
    assert_eq!(told.len(), 1, "once there is light: {told:?}");
    let largest = stepped.volume().coefficients.iter().map(|c| c.abs().max_element());
    let ratio = largest.fold(0.0, f32::max) / f32::from(told[0].expect("a scale")).exp2();
    assert!((0.25..2.0).contains(&ratio), "the largest coefficient is {ratio} of the scale");

    // A light that flickers changes the scale with every tick; slow links are not to suffer.
    let lamp = stepped.node("lamp");
    stepped.kept.catalogs.clear();
    for seq in 1..=50 {
        stepped.step(mail(seq, dim(lamp, if seq % 2 == 1 { 1e8 } else { 1e3 })));
    }
    assert_eq!(stepped.kept.catalogs.len(), 2, "{:?}", scales(&stepped.kept.catalogs));
    stepped.steps(100);
    let last = stepped.kept.catalogs.last().expect("catalogs");
    assert_eq!(last, &stepped.tick.catalog(), "the last is true in the end");
    assert!(stepped.kept.catalogs.iter().all(|c| c.fields[0].shape == last.fields[0].shape));
}
