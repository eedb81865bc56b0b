//! Files that edits name: which the scene has still to read, and which it has read.
//!
//! Reading takes long and needs no scene, so a server does it beside its tick.
//! [`Scene::file_to_read`] names the file that an edit waits for. [`FileToRead::read`] reads it on
//! any thread, and [`Scene::take_in`] hands it over. [`Scene::apply`] does all three at once.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use super::Scene;
use crate::asset::Asset;
use crate::error::Fault;
use crate::gltf::{self, source::Folder};
use crate::limits::{self, Budget, Taken};
use crate::{Edit, Environment, HdrImage, InstanceSource, hdr};

/// Number of files that are kept although the scene does not show them; the oldest is dropped
/// first.
const UNUSED: usize = 4;
/// Number of failures that are remembered.
const FAILURES: usize = 64;

/// The kind of a file's contents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Model,
    Picture,
}

/// The contents of a file.
#[derive(Debug)]
enum Contents {
    Model(Arc<Asset>),
    Picture(Arc<HdrImage>),
}

/// A file's state on disk; a file whose state has changed is read again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stamp {
    length: u64,
    modified: Option<SystemTime>,
}

impl Stamp {
    fn of(path: &Path) -> Option<Self> {
        let metadata = std::fs::metadata(path).ok()?;
        Some(Self { length: metadata.len(), modified: metadata.modified().ok() })
    }
}

/// A file that an edit names and that the scene has not read.
#[derive(Debug)]
pub struct FileToRead {
    kind: Kind,
    name: String,
    path: PathBuf,
    folder: Folder,
    budget: Budget,
}

impl FileToRead {
    /// Name of the file within the scene's folder. It is the same however edits write it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Reads the file, and the files that it refers to. This may take seconds.
    pub fn read(self) -> FileRead {
        let Self { kind, name, path, folder, budget } = self;
        let stamp = Stamp::of(&path);
        let before = budget.taken();
        let mut warnings = Vec::new();
        let read = match kind {
            Kind::Model => gltf::read_file(&path, &name, &folder, &budget)
                .map(|asset| Contents::Model(Arc::new(asset))),
            Kind::Picture => {
                hdr::read(&path, &name, &folder, &budget).map(|(picture, repaired)| {
                    if repaired > 0 {
                        warnings
                            .push(format!("{name}: {repaired} texels were negative or not finite"));
                    }
                    Contents::Picture(picture)
                })
            }
        };
        let contents = read.map(|contents| (contents, budget.taken() - before));
        FileRead { kind, name, stamp, contents, warnings }
    }
}

/// A file that was read for a scene, or the reason why it could not be read.
#[derive(Debug)]
pub struct FileRead {
    kind: Kind,
    name: String,
    stamp: Option<Stamp>,
    contents: Result<(Contents, Taken), Fault>,
    warnings: Vec<String>,
}

impl FileRead {
    /// As [`FileToRead::name`].
    pub fn name(&self) -> &str {
        &self.name
    }
}

/// Files that were read and are not shown, and failures.
#[derive(Debug, Default)]
pub(super) struct Shelf {
    unused: VecDeque<(String, Contents, Taken)>,
    failures: VecDeque<Failure>,
}

#[derive(Debug)]
struct Failure {
    kind: Kind,
    name: String,
    stamp: Option<Stamp>,
    reason: String,
}

impl Shelf {
    /// Keeps a file, and drops old ones until all fit the limits beside the `used` amounts. The
    /// newest always stays.
    fn keep(&mut self, name: String, contents: Contents, taken: Taken, used: Taken) {
        let fits = |unused: &VecDeque<(_, _, Taken)>| {
            let unused: Taken = unused.iter().map(|(.., taken)| *taken).sum();
            (used + taken + unused).check().is_ok()
        };
        while self.unused.len() >= UNUSED || (!self.unused.is_empty() && !fits(&self.unused)) {
            self.unused.pop_front();
        }
        self.unused.push_back((name, contents, taken));
    }

    fn has(&self, kind: Kind, name: &str) -> bool {
        self.unused.iter().any(|(other, contents, _)| other == name && contents.kind() == kind)
    }

    /// Takes a file off the shelf to show it, or tells why it is not there.
    fn take(&mut self, kind: Kind, name: &str) -> Result<(Contents, Taken), Fault> {
        let is_it =
            |(other, contents, _): &(String, Contents, _)| other == name && contents.kind() == kind;
        if let Some(place) = self.unused.iter().position(is_it)
            && let Some((_, contents, taken)) = self.unused.remove(place)
        {
            return Ok((contents, taken));
        }
        let failure = self.failures.iter().find(|f| f.kind == kind && f.name == name);
        let unread = || "has not been read; try again".to_owned();
        Err(Fault::Remembered(failure.map_or_else(unread, |failure| failure.reason.clone())))
    }
}

impl Contents {
    fn kind(&self) -> Kind {
        match self {
            Self::Model(_) => Kind::Model,
            Self::Picture(_) => Kind::Picture,
        }
    }
}

/// A picture that the scene shows or its file names.
#[derive(Clone, Debug)]
pub(super) struct Picture {
    image: Arc<HdrImage>,
    taken: Taken,
}

/// A model that is to be added.
pub(super) struct FoundModel {
    pub(super) asset: Arc<Asset>,
    pub(super) taken: Taken,
}

impl Scene {
    /// The file that an edit names, if it has to be read. `None` where the scene has read it, or
    /// failed to and the file is unchanged. `None` also where the edit would be refused whatever
    /// the file holds.
    pub fn file_to_read(&self, edit: &Edit) -> Option<FileToRead> {
        match edit {
            Edit::AddInstance { source: InstanceSource::File(uri), parent, transform, .. } => {
                self.check_addition("the instance", *parent, transform).ok()?;
                self.unread(Kind::Model, uri)
            }
            Edit::SetEnvironment { environment } => {
                environment.check().ok()?;
                self.picture_to_read(environment)
            }
            _ => None,
        }
    }

    /// The file of an environment's picture, likewise.
    pub(super) fn picture_to_read(&self, environment: &Environment) -> Option<FileToRead> {
        let Environment::Image { uri, .. } = environment else { return None };
        self.unread(Kind::Picture, uri)
    }

    fn unread(&self, kind: Kind, uri: &str) -> Option<FileToRead> {
        let folder = self.folder.as_ref()?;
        let (name, path) = folder.resolve(uri).ok()?;
        let is_known = match kind {
            Kind::Model => {
                self.models[1..].iter().any(|model| model.name == name)
                    || self.library.contains_key(&name)
                    || self.models.len() > limits::FILES
            }
            Kind::Picture => self.pictures.contains_key(&name),
        };
        if is_known || self.shelf.has(kind, &name) {
            return None;
        }
        let failed = self.shelf.failures.iter().find(|f| f.kind == kind && f.name == name);
        if failed.is_some_and(|failure| failure.stamp == Stamp::of(&path)) {
            return None;
        }
        let folder = folder.limited(limits::ADDED_FILE_BYTES);
        let budget = Budget::starting_at(self.used_beside(kind));
        Some(FileToRead { kind, name, path, folder, budget })
    }

    /// Takes in a file that [`FileToRead::read`] has read. The scene does not change. Edits that
    /// name the file can be applied without reading it again, or are refused for the fault that was
    /// found.
    pub fn take_in(&mut self, read: FileRead) {
        let FileRead { kind, name, stamp, contents, warnings } = read;
        self.shelf.failures.retain(|failure| failure.kind != kind || failure.name != name);
        for warning in warnings {
            if !self.warnings.contains(&warning) {
                tracing::warn!("{warning}");
                self.warnings.push(warning);
            }
        }
        match contents {
            Ok((contents, taken)) => self.keep(name, contents, taken),
            Err(fault) => {
                if self.shelf.failures.len() >= FAILURES {
                    self.shelf.failures.pop_front();
                }
                let reason = fault.to_string();
                self.shelf.failures.push_back(Failure { kind, name, stamp, reason });
            }
        }
    }

    pub(super) fn read_now(&mut self, file: Option<FileToRead>) {
        if let Some(file) = file {
            self.take_in(file.read());
        }
    }

    /// Amounts of the limits in use beside one more file of a kind. A picture replaces the one that
    /// is shown.
    fn used_beside(&self, kind: Kind) -> Taken {
        let models: Taken = self.models.iter().map(|model| model.taken).sum();
        match kind {
            Kind::Model => self.pictures.values().map(|p| p.taken).sum::<Taken>() + models,
            Kind::Picture => models,
        }
    }

    fn take_off_shelf(&mut self, kind: Kind, name: &str) -> Result<(Contents, Taken), Fault> {
        let (contents, taken) = self.shelf.take(kind, name)?;
        if let Err(fault) = (self.used_beside(kind) + taken).check() {
            self.keep(name.to_owned(), contents, taken);
            return Err(fault);
        }
        Ok((contents, taken))
    }

    /// Keeps a file that the scene does not show.
    fn keep(&mut self, name: String, contents: Contents, taken: Taken) {
        let used = self.used_beside(Kind::Model);
        self.shelf.keep(name, contents, taken, used);
    }

    /// Name of a URI's file within the scene's folder.
    pub(super) fn file_name(&self, uri: &str) -> Result<String, Fault> {
        let folder = self.folder.as_ref().ok_or_else(|| Fault::Outside { uri: uri.into() })?;
        Ok(folder.resolve(uri)?.0)
    }

    /// Takes a model that has been read and is not in the scene.
    pub(super) fn find_model(&mut self, name: &str) -> Result<FoundModel, Fault> {
        if self.models.len() > limits::FILES {
            let limit = limits::FILES as u64;
            return Err(Fault::TooLarge { what: "files added".into(), limit });
        }
        if let Some((asset, taken)) = self.library.get(name) {
            return Ok(FoundModel { asset: asset.clone(), taken: *taken });
        }
        match self.take_off_shelf(Kind::Model, name)? {
            (Contents::Model(asset), taken) => Ok(FoundModel { asset, taken }),
            (Contents::Picture(_), _) => unreachable!("asked for a model"),
        }
    }

    /// Puts back a model that cannot be added.
    pub(super) fn put_back(&mut self, name: &str, FoundModel { asset, taken }: FoundModel) {
        if !self.library.contains_key(name) {
            self.keep(name.to_owned(), Contents::Model(asset), taken);
        }
    }

    /// Fills in the picture of an environment, which must have been read.
    pub(super) fn with_picture(&mut self, environment: Environment) -> Result<Environment, Fault> {
        let Environment::Image { uri, intensity, rotation, .. } = environment else {
            return Ok(environment);
        };
        let name = self.file_name(&uri)?;
        if !self.pictures.contains_key(&name) {
            let (contents, taken) = self.take_off_shelf(Kind::Picture, &name)?;
            let Contents::Picture(image) = contents else { unreachable!("asked for a picture") };
            self.pictures.insert(name.clone(), Picture { image, taken });
        }
        let image = self.pictures.get(&name).map(|picture| picture.image.clone());
        Ok(Environment::Image { uri, intensity, rotation, image })
    }

    /// Moves pictures that neither the scene nor its file shows to the shelf.
    pub(super) fn give_back_pictures(&mut self) {
        let own = self.models[0].asset.settings.environment.as_ref();
        let shown: Vec<_> = [own, Some(&self.environment)]
            .into_iter()
            .flatten()
            .filter_map(|environment| match environment {
                Environment::Image { uri, .. } => self.file_name(uri).ok(),
                _ => None,
            })
            .collect();
        let pictures = std::mem::take(&mut self.pictures);
        let (kept, unused): (Vec<_>, Vec<_>) =
            pictures.into_iter().partition(|(name, _)| shown.contains(name));
        self.pictures = kept.into_iter().collect();
        for (name, Picture { image, taken }) in unused {
            self.keep(name, Contents::Picture(image), taken);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever edits ask for, a scene holds no more than its limits and one file.
    #[test]
    fn unused_files_make_room() {
        let texels = |share: u64| Taken::of_texels(limits::TEXELS / 8 * share);
        let mut shelf = Shelf::default();
        let mut keep = |name: &str, share, used| {
            let contents = Contents::Model(Arc::default());
            shelf.keep(name.into(), contents, texels(share), texels(used));
            shelf.unused.iter().map(|(name, ..)| name.as_str()).collect::<String>()
        };
        assert_eq!(keep("a", 1, 2), "a");
        assert_eq!(keep("b", 2, 2), "ab");
        assert_eq!(keep("c", 3, 2), "abc");
        assert_eq!(keep("d", 1, 2), "bcd");
        assert_eq!(keep("e", 8, 2), "e");
        for (name, kept) in [("f", "ef"), ("g", "efg"), ("h", "efgh"), ("i", "fghi")] {
            assert_eq!(keep(name, 0, 0), kept);
        }
    }
}
