//! Files that are whole or as they were: written beside their place, then moved there.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, ErrorKind};
use std::path::{Path, PathBuf};

/// Writes a file beside `path`, which then takes its place: a full disk or a crash leaves what was there.
///
/// A link stays one, and its target is replaced. A file keeps its permissions. What is no file, a pipe or a
/// device, is written to as it is.
///
/// # Errors
/// Of the writing; what was there is as it was.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let place = Place::of(path)?;
    let Place::File { target, beside, permissions } = place else {
        return written(OpenOptions::new().write(true).open(path)?, write).map(drop);
    };
    let move_there = || -> io::Result<()> {
        let file = written(create(&beside)?, write)?;
        if let Some(permissions) = permissions {
            file.set_permissions(permissions)?;
        }
        file.sync_all()?;
        fs::rename(&beside, &target)
    };
    move_there().inspect_err(|_| {
        // What is left of it is of no use; that it may not be there is no second fault.
        let _ = fs::remove_file(&beside);
    })
}

/// Finds out whether [`write_whole`] can write there, and leaves everything as it was.
///
/// # Errors
/// Where it cannot: the path is a folder or protected, or its folder is missing or takes no files.
pub fn check_place(path: &Path) -> io::Result<()> {
    let Place::File { target, beside, permissions } = Place::of(path)? else { return Ok(()) };
    if permissions.is_some() {
        OpenOptions::new().write(true).open(&target)?;
    }
    create(&beside)?;
    fs::remove_file(&beside)
}

/// Where a file is to be written.
enum Place {
    /// What takes bytes as they come.
    Stream,
    File {
        /// The path, links followed.
        target: PathBuf,
        /// In the same folder, and hence on the same disk.
        beside: PathBuf,
        /// Of the file that is there.
        permissions: Option<fs::Permissions>,
    },
}

impl Place {
    fn of(path: &Path) -> io::Result<Self> {
        let (target, permissions) = match fs::metadata(path) {
            Ok(there) if there.is_dir() => return Err(ErrorKind::IsADirectory.into()),
            Ok(there) if !there.is_file() => return Ok(Self::Stream),
            Ok(there) => (fs::canonicalize(path)?, Some(there.permissions())),
            Err(error) if error.kind() == ErrorKind::NotFound => (path.to_owned(), None),
            Err(error) => return Err(error),
        };
        let name = target.file_name();
        let name = name.ok_or_else(|| io::Error::new(ErrorKind::InvalidInput, "no file name"))?;
        let mut beside = OsString::from(".");
        beside.push(name);
        beside.push(format!(".{}.tmp", std::process::id()));
        let beside = target.with_file_name(beside);
        Ok(Self::File { target, beside, permissions })
    }
}

/// A new file, in place of one that a process of the same number has left.
fn create(path: &Path) -> io::Result<File> {
    let _ = fs::remove_file(path);
    File::create_new(path)
}

fn written(
    file: File,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<File> {
    let mut out = BufWriter::new(file);
    write(&mut out)?;
    out.into_inner().map_err(io::IntoInnerError::into_error)
}
