//! What a picture has gathered so far, kept in a file to go on from.
//!
//! One line that names the format, then little-endian numbers: a key of all that the picture depends
//! on (u64), width and height, samples planned and samples of both halves (u32), the sums of both (f32), a
//! hash of all before (u64).

use std::borrow::Cow;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use glam::{UVec2, Vec3};
use lumencast_gather::reference::{Film, Renderer};

use crate::out_file;
use crate::output::{self, tell};

const MAGIC: &[u8] = b"lumencast picture 2\n";

/// A film that grows is written at least so often.
const KEEP_EVERY: Duration = Duration::from_secs(60);

/// A picture's film, and the file that keeps it while it grows, where one does.
#[derive(Debug)]
pub(crate) struct KeptFilm {
    pub(crate) film: Film,
    file: Option<FilmFile>,
    /// When the file was last read or written.
    seen: Instant,
}

impl KeptFilm {
    /// The film begins with what the file holds of its picture, or else empty, with so many `planned`
    /// samples a pixel. People are told which of the two where there is a file.
    pub(crate) fn begun(file: Option<FilmFile>, size: UVec2, planned: u32) -> Self {
        let found = file.as_ref().and_then(|file| file.found(size));
        let film = found.unwrap_or_else(|| Film::new(size, planned));
        Self { film, file, seen: Instant::now() }
    }

    /// The film begins empty, whatever the file holds.
    pub(crate) fn anew(file: Option<FilmFile>, size: UVec2, planned: u32) -> Self {
        Self { film: Film::new(size, planned), file, seen: Instant::now() }
    }

    /// Writes the film to its file.
    pub(crate) fn keep(&mut self) -> Result<()> {
        if let Some(file) = &self.file {
            file.write(&self.film)?;
        }
        self.seen = Instant::now();
        Ok(())
    }

    /// Writes the film where that was long ago.
    pub(crate) fn keep_at_times(&mut self) -> Result<()> {
        if self.seen.elapsed() > KEEP_EVERY { self.keep() } else { Ok(()) }
    }

    /// Refines the film to so many samples a pixel under a bar that says `what` goes on, and keeps it.
    /// Returns the seconds that tracing took.
    pub(crate) fn refine(
        &mut self,
        renderer: &Renderer,
        samples: u32,
        what: impl Into<Cow<'static, str>>,
    ) -> Result<f64> {
        if self.film.samples() >= samples {
            return Ok(0.0);
        }
        let bar = output::bar(samples.into(), what);
        bar.set_position(self.film.samples().into());
        bar.reset_eta();
        let mut seconds = 0.0;
        while self.film.samples() < samples {
            let start = Instant::now();
            // Every pass is finished: nothing tells it to stop.
            renderer.pass(&mut self.film, samples, &|_| true);
            seconds += start.elapsed().as_secs_f64();
            bar.set_position(self.film.samples().into());
            if self.film.samples() < samples {
                self.keep_at_times()?;
            }
        }
        bar.finish_and_clear();
        self.keep()?;
        Ok(seconds)
    }
}

/// Where a film is kept.
#[derive(Debug)]
pub(crate) struct FilmFile {
    pub(crate) path: PathBuf,
    /// The key of all that the picture depends on.
    pub(crate) key: u64,
}

impl FilmFile {
    /// Writes a film; a crash leaves either the old file or the new one.
    fn write(&self, film: &Film) -> Result<()> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(self.key.to_le_bytes());
        let [a, b] = film.parts();
        for number in [film.size().x, film.size().y, film.planned(), a.1, b.1] {
            bytes.extend(number.to_le_bytes());
        }
        for sum in a.0.iter().chain(b.0) {
            sum.to_array().iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        }
        bytes.extend(hash(&bytes).to_le_bytes());
        out_file::write(&self.path, &bytes).context("cannot keep the picture so far")
    }

    /// The film that the file holds, if it is one to go on with. People are told whether it is.
    fn found(&self, size: UVec2) -> Option<Film> {
        let film = self.read(size);
        let path = self.path.display();
        match &film {
            Some(film) => tell!("Going on from {} samples in {path}.", film.samples()),
            None if self.path.exists() => {
                tell!("{path} belongs to another picture or is damaged: beginning anew.");
            }
            None => {}
        }
        film
    }

    /// The film that the file holds, if there is one, it is whole, and its key is this.
    fn read(&self, size: UVec2) -> Option<Film> {
        let bytes = fs::read(&self.path).ok()?;
        let (content, end) = bytes.split_last_chunk::<8>()?;
        let rest = content.strip_prefix(MAGIC)?;
        let (found, rest) = rest.split_first_chunk::<8>()?;
        let (numbers, sums) = rest.split_first_chunk::<20>()?;
        let number = |i: usize| Some(u32::from_le_bytes(*numbers[4 * i..].first_chunk()?));
        let same = u64::from_le_bytes(*found) == self.key
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
}

fn hash(bytes: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    bytes.hash(&mut hasher);
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: UVec2 = UVec2::new(3, 2);

    fn film() -> Film {
        let sums = |f: f32| (0..6).map(|i| Vec3::splat(f * i as f32)).collect::<Vec<_>>();
        Film::from_parts(SIZE, 16, [(sums(0.5), 8), (sums(2.0), 5)]).expect("six pixels")
    }

    fn file(name: &str, key: u64) -> FilmFile {
        let name = format!("lumencast-{name}-{}.part", std::process::id());
        FilmFile { path: std::env::temp_dir().join(name), key }
    }

    #[test]
    fn comes_back_or_not_at_all() {
        let file = file("film", 7);
        let path = &file.path;
        file.write(&film()).expect("a folder for temporary files");
        assert_eq!(file.read(SIZE), Some(film()));
        let other = FilmFile { path: path.clone(), key: 8 };
        assert_eq!(other.read(SIZE), None, "other settings");
        assert_eq!(file.read(UVec2::new(2, 3)), None, "other size");
        let whole = fs::read(path).expect("just written");
        for length in 0..whole.len() {
            fs::write(path, &whole[..length]).expect("as above");
            assert_eq!(file.read(SIZE), None, "cut to {length}");
        }
        let mut turned = whole;
        turned[60] ^= 1;
        fs::write(path, turned).expect("as above");
        assert_eq!(file.read(SIZE), None, "one bit turned");
        fs::remove_file(path).expect("there");
        assert_eq!(file.read(SIZE), None, "no file");
    }

    #[test]
    fn a_kept_film_goes_on_unless_it_is_to_begin_anew() {
        let kept = |key| Some(file("kept", key));
        let mut first = KeptFilm { film: film(), file: kept(7), seen: Instant::now() };
        first.keep().expect("a folder for temporary files");
        assert_eq!(KeptFilm::begun(kept(7), SIZE, 16).film, film());
        for empty in [
            KeptFilm::begun(kept(8), SIZE, 16),
            KeptFilm::begun(None, SIZE, 16),
            KeptFilm::anew(kept(7), SIZE, 16),
        ] {
            assert_eq!(empty.film.samples(), 0);
        }
        fs::remove_file(file("kept", 7).path).expect("there");
    }
}
