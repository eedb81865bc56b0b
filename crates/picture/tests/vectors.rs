//! Figures of other programs for the same pictures: `vectors/pictures.json`, which
//! `tests/reference.py` wrote.

use glam::{Vec3, Vec3Swizzles};
use lumencast_picture::{
    ErrorMap, PIXELS_PER_DEGREE, Pair, Picture, exposure, flip, gamma_code, hdr_flip, mse, psnr,
    relative_mse, ssim,
};
use serde_json::Value;

/// The largest difference of a mean FLIP, and of a pixel's. Over all pixels of these pictures they
/// are 7e-7 and 6.4e-5; the other program computes with 32-bit floats too.
const FLIP_MEAN: f64 = 1e-5;
const FLIP_PIXEL: f64 = 2e-4;

fn vectors(kind: &str) -> Vec<Value> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../vectors/pictures.json");
    let text = std::fs::read_to_string(path).expect("the vectors");
    let mut all: Value = serde_json::from_str(&text).expect("JSON");
    let Value::Array(cases) = all[kind].take() else { panic!("no {kind}") };
    assert!(!cases.is_empty());
    cases
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn close(what: &str, ours: f64, theirs: &Value, relative: f64) {
    let theirs = number(theirs);
    assert!((ours - theirs).abs() <= relative * theirs.abs(), "{what}: {ours}, not {theirs}");
}

/// One of the two pictures of a case. The functions here are those of `reference.py`.
#[derive(Clone, Copy)]
struct Case {
    width: i64,
    height: i64,
    seed: u32,
    judged: bool,
}

fn noise(x: i64, y: i64, channel: u32, seed: u32) -> u32 {
    let n = (x as u32)
        .wrapping_mul(0x9E37_79B1)
        .wrapping_add((y as u32).wrapping_mul(0x85EB_CA77))
        .wrapping_add(channel.wrapping_mul(0xC2B2_AE3D))
        .wrapping_add(seed.wrapping_mul(0x27D4_EB2F));
    let n = (n ^ (n >> 15)).wrapping_mul(0x2C1B_3C6D);
    let n = (n ^ (n >> 12)).wrapping_mul(0x297A_2D39);
    n ^ (n >> 15)
}

impl Case {
    /// The reference and the picture of a case.
    fn both(case: &Value) -> [Self; 2] {
        [false, true].map(|judged| Self {
            width: case["width"].as_i64().expect("a width"),
            height: case["height"].as_i64().expect("a height"),
            seed: case["seed"].as_u64().expect("a seed") as u32,
            judged,
        })
    }

    fn scene(&self, x: i64, y: i64, c: usize) -> i64 {
        let mut value = [
            x * 1023 / (self.width - 1),
            y * 1023 / (self.height - 1),
            200 + 600 * ((x / 8 + y / 8) % 2),
        ][c];
        if (x - self.width / 3).pow(2) + (y - self.height / 2).pow(2) < 100 {
            value = [900, 120, 60][c];
        }
        if x % 16 == 11 && y > self.height / 2 { 1023 - value } else { value }
    }

    fn code(&self, x: i64, y: i64, c: usize) -> i64 {
        let shift = i64::from(self.judged && y < self.height / 3);
        let mut value = self.scene(x + shift, y, c);
        if self.judged {
            if x < self.width / 2 {
                value += i64::from(noise(x, y, c as u32, self.seed) % 129) - 64;
            }
            if y > 2 * self.height / 3 {
                value += [90, 0, -60][c];
            }
        }
        value.clamp(0, 1023)
    }

    fn picture(&self, pixel: impl Fn(i64, i64, [i64; 3]) -> Vec3) -> Picture {
        Picture::from_fn(self.width as u32, self.height as u32, |x, y| {
            let (x, y) = (i64::from(x), i64::from(y));
            pixel(x, y, [0, 1, 2].map(|c| self.code(x, y, c)))
        })
    }

    fn coded(&self) -> Picture {
        self.picture(|_, _, code| Vec3::from(code.map(|c| c as f32 / 1023.0)))
    }

    fn light(&self) -> Picture {
        self.picture(|x, y, code| {
            let mut value = Vec3::from(code.map(|c| (c * c) as f32 / (1 << 20) as f32));
            if x >= 3 * self.width / 4 && y < self.height / 2 {
                value *= 64.0;
            }
            if noise(x / 2, y / 2, 7, self.seed).is_multiple_of(200) {
                value *= 4096.0;
            }
            if x < 6 && y < 6 { Vec3::ZERO } else { value }
        })
    }
}

/// The differences of the mean and, at most, of a pixel.
fn off(map: &ErrorMap, theirs: &Value) -> (f64, f64) {
    let pixels = theirs["pixels"].as_array().expect("pixels");
    assert!(pixels.len() >= 20);
    let at = |p: &Value, i: usize| p[i].as_u64().expect("a position") as u32;
    let pixel = |p: &Value| {
        let ours = map.value(at(p, 0), at(p, 1)).expect("inside");
        (f64::from(ours) - number(&p[2])).abs()
    };
    let worst = pixels.iter().map(pixel).fold(0.0, f64::max);
    ((map.mean() - number(&theirs["mean"])).abs(), worst)
}

fn agrees(map: &ErrorMap, theirs: &Value) -> bool {
    let (mean, pixel) = off(map, theirs);
    eprintln!("mean {mean:.1e}, pixels at most {pixel:.1e}");
    mean < FLIP_MEAN && pixel < FLIP_PIXEL
}

fn ppd(case: &Value) -> f32 {
    case["ppd"].as_f64().map_or(PIXELS_PER_DEGREE, |ppd| ppd as f32)
}

#[test]
fn codes_have_the_figures_of_other_programs() {
    for case in vectors("coded") {
        let [reference, picture] = Case::both(&case).map(|c| c.coded());
        let pair = Pair::new(&reference, &picture).expect("of one size");
        close("mse", mse(&pair), &case["mse"], 1e-6);
        close("relative mse", relative_mse(&pair), &case["relative_mse"], 1e-6);
        close("psnr", psnr(&pair), &case["psnr"], 1e-6);
        let similarity = ssim(&pair).expect("large enough");
        eprintln!("ssim {:.1e}", (similarity - number(&case["ssim"])).abs());
        close("ssim", similarity, &case["ssim"], 1e-5);
        assert!(agrees(&flip(&pair, ppd(&case)), &case["flip"]));
    }
}

#[test]
fn light_has_the_figures_of_other_programs() {
    for case in vectors("linear") {
        let [reference, picture] = Case::both(&case).map(|c| c.light());
        let factor = exposure(&reference);
        close("exposure", factor.into(), &case["exposure"], 1e-5);
        let [a, b] = [&reference, &picture].map(|p| p.map(|v| v * factor));
        let pair = Pair::new(&a, &b).expect("of one size");
        close("mse", mse(&pair), &case["mse"], 1e-4);
        close("relative mse", relative_mse(&pair), &case["relative_mse"], 1e-4);
        let [a, b] = [a, b].map(|p| p.map(gamma_code));
        let unclamped = psnr(&Pair::new(&a, &b).expect("of one size"));
        close("unclamped", unclamped, &case["psnr_unclamped"], 1e-5);
        let [a, b] = [a, b].map(|p| p.map(|v| v.clamp(Vec3::ZERO, Vec3::ONE)));
        close("psnr", psnr(&Pair::new(&a, &b).expect("of one size")), &case["psnr"], 1e-5);

        let found = hdr_flip(&Pair::new(&reference, &picture).expect("of one size"), ppd(&case));
        let theirs = &case["flip_hdr"];
        close("start", found.start.into(), &theirs["start"], 1e-4);
        close("stop", found.stop.into(), &theirs["stop"], 1e-4);
        assert_eq!(u64::from(found.exposures), theirs["exposures"].as_u64().expect("a number"));
        assert!(agrees(&found.map, theirs));
    }
}

#[test]
fn planted_faults_are_found() {
    let case = &vectors("coded")[0];
    let [reference, picture] = Case::both(case).map(|c| c.coded());
    let of = |a: &Picture, b: &Picture, ppd: f32| {
        let pair = Pair::new(a, b).expect("of one size");
        agrees(&flip(&pair, ppd), &case["flip"])
    };
    assert!(of(&reference, &picture, PIXELS_PER_DEGREE));
    assert!(!of(&reference, &picture, PIXELS_PER_DEGREE * 1.03), "another distance");
    let swapped = [&reference, &picture].map(|p| p.map(|v| v.zyx()));
    assert!(!of(&swapped[0], &swapped[1], PIXELS_PER_DEGREE), "swapped channels");
    assert!(!of(&reference, &picture.map(|v| v * 1.01), PIXELS_PER_DEGREE), "too bright");
    let linear = [&reference, &picture].map(|p| p.map(|v| v.powf(2.2)));
    assert!(!of(&linear[0], &linear[1], PIXELS_PER_DEGREE), "another transfer curve");

    let similarity = ssim(&Pair::new(&swapped[0], &picture).expect("of one size"));
    assert!((similarity.expect("large enough") - number(&case["ssim"])).abs() > 1e-3);

    let case = &vectors("linear")[0];
    let [reference, picture] = Case::both(case).map(|c| c.light());
    // What scales both alike goes unseen; what scales one, or the range of exposures, does not.
    let of = |a: f32, b: f32| {
        let scaled = [reference.map(|v| v * a), picture.map(|v| v * b)];
        let pair = Pair::new(&scaled[0], &scaled[1]).expect("of one size");
        agrees(&hdr_flip(&pair, PIXELS_PER_DEGREE).map, &case["flip_hdr"])
    };
    assert!(of(3.0, 3.0));
    assert!(!of(1.0, 1.01), "too bright");
}
