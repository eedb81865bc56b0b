//! Charts kept from one start to the next.

use std::fs;

use lumencast_charts::{Sheets, Store, laid_out, sheets};
use lumencast_scene::{LightmapSpec, Scene, Snapshot};

/// What comes out, and for how many triangles it was cut anew.
fn cut(scene: &Snapshot, store: &Store) -> (Sheets, usize) {
    let total = std::sync::atomic::AtomicUsize::new(0);
    let found = sheets(scene, Some(store), &|progress| {
        total.store(progress.total, std::sync::atomic::Ordering::Relaxed);
        true
    });
    (found.unwrap(), total.into_inner())
}

#[test]
fn the_second_start_cuts_nothing_and_broken_files_are_cut_anew() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::new(folder.path().join("charts"));
    let mut scene = Scene::open("cornell").unwrap();
    let snapshot = scene.snapshot();
    let layout = |all: &Sheets| laid_out(&all.sheets, LightmapSpec::Size(256)).unwrap();
    let (first, all) = cut(&snapshot, &store);
    assert!(all > 0);
    let (second, again) = cut(&snapshot, &store);
    assert_eq!(again, 0);
    assert_eq!(layout(&second), layout(&first));

    let files: Vec<_> =
        fs::read_dir(store.folder()).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert_eq!(files.len(), 4, "a file for each primitive");
    for (file, fault) in files.iter().zip(0..) {
        let mut bytes = fs::read(file).unwrap();
        match fault {
            0 => bytes.truncate(bytes.len() / 2),
            1 => bytes[100] ^= 1,
            2 => bytes.clear(),
            _ => bytes.extend_from_slice(b"more"),
        }
        fs::write(file, bytes).unwrap();
    }
    let (third, anew) = cut(&snapshot, &store);
    assert_eq!(anew, all, "no file is believed that is not whole");
    assert_eq!(layout(&third), layout(&first));
}

/// A folder that cannot be written costs the next start, and nothing else.
#[test]
fn a_store_that_cannot_be_written_is_done_without() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "not a folder").unwrap();
    let mut scene = Scene::open("cornell").unwrap();
    let (found, _) = cut(&scene.snapshot(), &Store::new(&file));
    assert_eq!(found.sheets.len(), 4);
    assert_eq!(fs::read(&file).unwrap(), b"not a folder");
}
