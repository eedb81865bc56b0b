//! What a picture has gathered so far, kept in a file to go on from.
//!
//! One line that names the format, then little-endian numbers: a key of all that the picture depends
//! on (u64), width and height, samples planned and samples of both halves (u32), the sums of both (f32), a
//! hash of all before (u64).

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result};
use glam::{UVec2, Vec3};
use lumencast_gather::reference::Film;

use crate::{out_file, output::tell};

const MAGIC: &[u8] = b"lumencast picture 2\n";

/// A film that grows is written at least so often.
pub(crate) const KEEP_EVERY: Duration = Duration::from_secs(60);

/// Writes a film; a crash leaves either the old file or the new one.
pub(crate) fn write(path: &Path, key: u64, film: &Film) -> Result<()> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(key.to_le_bytes());
    let [a, b] = film.parts();
    for number in [film.size().x, film.size().y, film.planned(), a.1, b.1] {
        bytes.extend(number.to_le_bytes());
    }
    for sum in a.0.iter().chain(b.0) {
        sum.to_array().iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    }
    bytes.extend(hash(&bytes).to_le_bytes());
    out_file::write(path, &bytes).context("cannot keep the picture so far")
}

/// The film to go on with: that of a file, or else one of so many `planned` samples. Says which where
/// there is a file.
pub(crate) fn begun(path: &Path, key: u64, size: UVec2, planned: u32) -> Film {
    match read(path, key, size) {
        Some(film) => {
            tell!("Going on from {} samples in {}.", film.samples(), path.display());
            film
        }
        None => {
            if path.exists() {
                tell!(
                    "{} belongs to another picture or is damaged: beginning anew.",
                    path.display()
                );
            }
            Film::new(size, planned)
        }
    }
}

/// The film kept in a file, if there is one, it is whole, and its key is this.
fn read(path: &Path, key: u64, size: UVec2) -> Option<Film> {
    let bytes = fs::read(path).ok()?;
    let (content, end) = bytes.split_last_chunk::<8>()?;
    let rest = content.strip_prefix(MAGIC)?;
    let (found, rest) = rest.split_first_chunk::<8>()?;
    let (numbers, sums) = rest.split_first_chunk::<20>()?;
    let number = |i: usize| Some(u32::from_le_bytes(*numbers[4 * i..].first_chunk()?));
    let same = u64::from_le_bytes(*found) == key
        && UVec2::new(number(0)?, number(1)?) == size
        && u64::from_le_bytes(*end) == hash(content);
    let (values, rest) = sums.as_chunks::<4>();
    if !same || !rest.is_empty() {
        return None;
    }
    let values: Vec<f32> = values.iter().map(|v| f32::from_le_bytes(*v)).collect();
    let mut sums: Vec<Vec3> = values.chunks_exact(3).map(Vec3::from_slice).collect();
    let second = sums.split_off(sums.len() / 2);
    Film::from_parts(size, number(2)?, [(sums, number(3)?), (second, number(4)?)])
}

fn hash(bytes: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    bytes.hash(&mut hasher);
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comes_back_or_not_at_all() {
        let path = std::env::temp_dir().join(format!("lumencast-{}.part", std::process::id()));
        let size = UVec2::new(3, 2);
        let sums = |f: f32| (0..6).map(|i| Vec3::splat(f * i as f32)).collect::<Vec<_>>();
        let halves = [(sums(0.5), 8), (sums(2.0), 5)];
        let film = Film::from_parts(size, 16, halves).expect("six pixels");
        write(&path, 7, &film).expect("a folder for temporary files");
        assert_eq!(read(&path, 7, size), Some(film));
        assert_eq!(read(&path, 8, size), None, "other settings");
        assert_eq!(read(&path, 7, UVec2::new(2, 3)), None, "other size");
        let whole = fs::read(&path).expect("just written");
        for length in 0..whole.len() {
            fs::write(&path, &whole[..length]).expect("as before");
            assert_eq!(read(&path, 7, size), None, "cut to {length}");
        }
        let mut turned = whole;
        turned[60] ^= 1;
        fs::write(&path, turned).expect("as before");
        assert_eq!(read(&path, 7, size), None, "one bit turned");
        fs::remove_file(&path).expect("there");
        assert_eq!(read(&path, 7, size), None, "no file");
    }
}
