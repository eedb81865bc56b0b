//! Charts kept in files from one start to the next.
//!
//! A file's name is the hash of what its charts were cut from, and of what cuts them. Its last bytes
//! are the hash of the others: a file that is not whole counts as none.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use lumencast_light::Charts;
use sha2::{Digest, Sha256};

use crate::cut::{Cut, CutVertex, MOST_CHARTS, Shape};

/// What cuts charts: another number where the same surface would be cut in another way.
const MAKER: &[u8] = b"lumencast charts 1, uvunwrap 0.3.0\n";
/// Bytes of the largest file that is read.
const LARGEST: u64 = 1 << 30;
/// Bytes of all files together: beyond that, those that have not been used for longest go.
const MOST_BYTES: u64 = 1 << 30;
const HASH: usize = 32;

/// A folder of files of charts.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

/// The hash of what charts are cut from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Key([u8; HASH]);

impl Key {
    pub(crate) fn of(shape: &Shape<'_>) -> Self {
        let mut hash = Sha256::new();
        hash.update(MAKER);
        for (name, bytes) in [
            (b'p', bytemuck::cast_slice(&shape.positions)),
            (b't', bytemuck::cast_slice::<_, u8>(shape.triangles)),
            (b'u', bytemuck::cast_slice(shape.uv.unwrap_or_default())),
        ] {
            hash.update([name]);
            hash.update((bytes.len() as u64).to_le_bytes());
            hash.update(bytes);
        }
        Self(hash.finalize().into())
    }
}

impl Store {
    /// Files in this folder, which is made when the first one is written.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// The user's: `lumencast/charts` in the folder of the system for what can be made again. None
    /// where the system names no such folder.
    pub fn of_user() -> Option<Self> {
        Some(Self::new(dirs::cache_dir()?.join("lumencast").join("charts")))
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn path(&self, key: Key) -> PathBuf {
        let digits: String = key.0.iter().map(|byte| format!("{byte:02x}")).collect();
        self.folder.join(digits)
    }

    /// What was kept for a shape, if it is whole and fits it.
    pub(crate) fn load(&self, key: Key, shape: &Shape<'_>) -> Option<Cut> {
        let mut file = File::open(self.path(key)).ok()?;
        let length = file.metadata().ok().filter(|meta| meta.is_file())?.len();
        if length > LARGEST {
            return None;
        }
        let mut bytes = Vec::with_capacity(length as usize);
        file.read_to_end(&mut bytes).ok()?;
        let cut = decode(&bytes)?;
        // It was used: others go first.
        drop(file.set_modified(SystemTime::now()));
        let is_of = |(own, placed): (&[u32; 3], &[u32; 3])| fits(own, placed, &cut);
        let same = cut.triangles.len() == shape.triangles.len()
            && shape.triangles.iter().zip(&cut.triangles).all(is_of);
        same.then_some(cut)
    }

    /// Keeps what a shape was cut into.
    pub(crate) fn save(&self, key: Key, cut: &Cut) -> io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let mut file = tempfile::NamedTempFile::new_in(&self.folder)?;
        file.write_all(&encode(cut))?;
        file.persist(self.path(key)).map_err(|error| error.error)?;
        self.tidy()
    }

    /// Removes what has not been used for longest where there is too much.
    fn tidy(&self) -> io::Result<()> {
        let mut files = Vec::new();
        for entry in fs::read_dir(&self.folder)? {
            let entry = entry?;
            if let Ok(meta) = entry.metadata()
                && meta.is_file()
            {
                files.push((meta.modified().unwrap_or(SystemTime::UNIX_EPOCH), meta.len(), entry));
            }
        }
        files.sort_by_key(|(used, _, _)| *used);
        let mut bytes: u64 = files.iter().map(|(_, length, _)| length).sum();
        for (_, length, entry) in files {
            if bytes <= MOST_BYTES {
                break;
            }
            // Another process may have removed it.
            drop(fs::remove_file(entry.path()));
            bytes -= length;
        }
        Ok(())
    }
}

/// Whether a triangle of charts stands for a triangle of the shape.
fn fits(own: &[u32; 3], placed: &[u32; 3], cut: &Cut) -> bool {
    *placed == Charts::NOWHERE
        || own.iter().zip(placed).all(|(own, v)| cut.vertices[*v as usize].source == *own)
}

fn encode(cut: &Cut) -> Vec<u8> {
    let mut bytes = Vec::from(MAKER);
    for count in [cut.charts, cut.vertices.len() as u32, cut.triangles.len() as u32] {
        bytes.extend_from_slice(&count.to_le_bytes());
    }
    bytes.extend_from_slice(bytemuck::cast_slice(&cut.vertices));
    bytes.extend_from_slice(bytemuck::cast_slice(&cut.triangles));
    let hash = Sha256::digest(&bytes);
    bytes.extend_from_slice(&hash);
    bytes
}

/// Nothing where the bytes are not those of charts.
fn decode(bytes: &[u8]) -> Option<Cut> {
    let (bytes, hash) = bytes.split_at_checked(bytes.len().checked_sub(HASH)?)?;
    if Sha256::digest(bytes)[..] != *hash {
        return None;
    }
    let (counts, rest) = bytes.strip_prefix(MAKER)?.split_at_checked(12)?;
    let [charts, vertices, triangles]: [u32; 3] =
        *bytemuck::pod_collect_to_vec::<u8, u32>(counts).as_array()?;
    let (vertex_bytes, triangle_bytes) =
        rest.split_at_checked(vertices as usize * size_of::<CutVertex>())?;
    if triangle_bytes.len() != triangles as usize * size_of::<[u32; 3]>() || charts > MOST_CHARTS {
        return None;
    }
    let vertices: Vec<CutVertex> = bytemuck::pod_collect_to_vec(vertex_bytes);
    let triangles: Vec<[u32; 3]> = bytemuck::pod_collect_to_vec(triangle_bytes);
    let is_sound = |vertex: &CutVertex| vertex.at.is_finite();
    let exists = |triangle: &[u32; 3]| {
        *triangle == Charts::NOWHERE
            || triangle
                .iter()
                .all(|v| vertices.get(*v as usize).is_some_and(|vertex| vertex.chart < charts))
    };
    let sound = vertices.iter().all(is_sound) && triangles.iter().all(exists);
    sound.then_some(Cut { vertices, triangles, charts })
}
