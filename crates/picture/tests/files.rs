//! Files written and read again.

use std::io::Write as _;
use std::path::PathBuf;

use glam::Vec3;
use lumencast_picture::{Loaded, Picture, PictureError, ToneMap, check_place, write_whole};

/// A folder of this test's own, removed at its end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("lumencast-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder");
        Self(path)
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn ramp() -> Picture {
    Picture::from_fn(7, 5, |x, y| Vec3::new(x as f32 / 6.0, y as f32 / 4.0, 0.25))
}

#[test]
fn exr_keeps_every_bit() {
    let folder = Folder::new("exr");
    let picture = ramp().map(|p| p * 1e5 - 3.0);
    picture.write_exr(folder.at("a.exr")).expect("written");
    let read = Loaded::read(folder.at("a.exr")).expect("read");
    assert_eq!(read, Loaded::Linear(picture.clone()));
    assert_eq!(read.linear(), picture);
    // Nothing else is left in the folder.
    assert_eq!(std::fs::read_dir(&folder.0).expect("a folder").count(), 1);
}

#[test]
fn png_keeps_codes_to_half_a_step() {
    let folder = Folder::new("png");
    let path = folder.at("a.png");
    ramp().write_png(&path, ToneMap::Srgb, 0.5).expect("written");
    let read = Loaded::read(&path).expect("read");
    assert!(matches!(read, Loaded::Coded(_)));
    for (code, p) in read.display(7.0).pixels().iter().zip(ramp().pixels()) {
        let off = *code - ToneMap::Srgb.encode(*p * 0.5);
        assert!(off.abs().max_element() < 0.501 / 255.0, "{off}");
    }
    for (linear, p) in read.linear().pixels().iter().zip(ramp().pixels()) {
        assert!((*linear - *p * 0.5).abs().max_element() < 0.005);
    }
}

#[test]
fn jpeg_shows_what_a_png_does() {
    let folder = Folder::new("jpeg");
    let picture = Picture::from_fn(64, 48, |x, y| Vec3::new(x as f32, y as f32, 20.0) / 64.0);
    picture.write_jpeg(folder.at("a.jpg"), ToneMap::Gamma, 0.5).expect("written");
    picture.write_png(folder.at("a.png"), ToneMap::Gamma, 0.5).expect("written");
    let [jpeg, png] = ["a.jpg", "a.png"].map(|name| {
        let file = image::open(folder.at(name)).expect("a picture");
        file.into_rgb8()
    });
    let off = jpeg.iter().zip(png.iter()).map(|(a, b)| f64::from(a.abs_diff(*b)));
    let mean = off.sum::<f64>() / jpeg.len() as f64;
    assert!((0.01..3.0).contains(&mean), "{mean} of 255");
}

#[test]
fn png_of_other_kinds_and_hdr_are_read() {
    let folder = Folder::new("kinds");
    let grey = image::ImageBuffer::from_fn(2, 1, |x, _| image::Luma([60_000 * x as u16]));
    grey.save(folder.at("grey16.png")).expect("written");
    let read = Loaded::read(folder.at("grey16.png")).expect("read");
    assert_eq!(read.stored().pixels(), [Vec3::ZERO, Vec3::splat(60_000.0 / 65_535.0)]);

    let clear = image::RgbaImage::from_pixel(1, 1, image::Rgba([51, 102, 255, 0]));
    clear.save(folder.at("clear.png")).expect("written");
    let read = Loaded::read(folder.at("clear.png")).expect("read");
    assert!((read.stored().pixels()[0] - Vec3::new(0.2, 0.4, 1.0)).length() < 1e-6);

    let bright = image::Rgb32FImage::from_pixel(9, 2, image::Rgb([64.0, 0.5, 0.0]));
    bright.save(folder.at("bright.hdr")).expect("written");
    let read = Loaded::read(folder.at("bright.hdr")).expect("read");
    assert!(matches!(read, Loaded::Linear(_)));
    assert_eq!(read.stored().pixels()[5], Vec3::new(64.0, 0.5, 0.0));
    assert!((read.display(1.0 / 64.0).pixels()[0].x - 1.0).abs() < 1e-6);
}

#[test]
fn bad_files_are_named() {
    let folder = Folder::new("bad");
    ramp().write_exr(folder.at("whole.exr")).expect("written");
    ramp().write_png(folder.at("whole.png"), ToneMap::Gamma, 1.0).expect("written");
    for name in ["whole.exr", "whole.png"] {
        let bytes = std::fs::read(folder.at(name)).expect("read");
        for cut in [bytes.len() / 4, bytes.len() / 2, bytes.len() - 9] {
            let path = folder.at(&name.replace("whole", "cut"));
            std::fs::write(&path, &bytes[..cut]).expect("written");
            let error = Loaded::read(&path).expect_err("it is cut").to_string();
            assert!(error.contains("cut."), "{cut}: {error}");
        }
    }
    std::fs::write(folder.at("words.png"), "not a picture").expect("written");
    let error = Loaded::read(folder.at("words.txt.png")).expect_err("not there");
    assert!(matches!(error, PictureError::Read { .. }), "{error}");
    let error = Loaded::read(folder.at("words.png")).expect_err("no picture").to_string();
    assert!(error.contains("words.png"), "{error}");
    let error = ramp().write_exr(folder.at("no/such/folder.exr")).expect_err("no folder");
    assert!(error.to_string().contains("folder.exr"), "{error}");
    assert!(ramp().write_exr("/").is_err());
}

#[test]
fn a_failed_write_leaves_what_was_there() {
    let folder = Folder::new("kept");
    // A folder of that name cannot be renamed over.
    std::fs::create_dir(folder.at("a.exr")).expect("a folder");
    std::fs::write(folder.at("a.exr/inside"), "kept").expect("written");
    assert!(matches!(ramp().write_exr(folder.at("a.exr")), Err(PictureError::Write { .. })));
    assert_eq!(std::fs::read_dir(&folder.0).expect("a folder").count(), 1);
    assert!(folder.at("a.exr/inside").exists());
}

#[test]
fn what_is_there_stays_until_all_is_written() {
    let folder = Folder::new("whole");
    let path = folder.at("a");
    let count = || std::fs::read_dir(&folder.0).expect("a folder").count();
    for place in [folder.at("no/such/folder"), folder.0.clone(), folder.at("..")] {
        assert!(check_place(&place).is_err(), "{}", place.display());
    }
    check_place(&path).expect("a place");
    assert_eq!(count(), 0, "nothing is left of the trial");

    let write = |bytes: &[u8], end: std::io::Result<()>| {
        write_whole(&path, |out| out.write_all(bytes).and(end))
    };
    write(b"old", Ok(())).expect("written");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let only_mine = std::fs::Permissions::from_mode(0o600);
        std::fs::set_permissions(&path, only_mine).expect("its owner's");
    }
    check_place(&path).expect("a file that may be written");
    write(b"new", Err(std::io::Error::other("no more"))).expect_err("it fails");
    assert_eq!(std::fs::read(&path).expect("there"), b"old");
    write(b"new", Ok(())).expect("written");
    assert_eq!(std::fs::read(&path).expect("there"), b"new");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let mode = std::fs::metadata(&path).expect("there").permissions().mode();
        assert_eq!(mode & 0o777, 0o600, "as it was");
    }
    assert_eq!(count(), 1);
}
