//! Opening a listed file, such that what has been put in its place since is not served.

use std::fs::{self, File, Metadata};
use std::future::Future;
use std::io::{self, Cursor, SeekFrom};
use std::path::{Path, PathBuf};
use std::pin::Pin;
use std::sync::LazyLock;
use std::task::{Context, Poll};
use std::time::SystemTime;

use axum::body::Bytes;
use tokio::io::{AsyncRead, AsyncSeek, ReadBuf};
use tower_http::services::fs::{self as served, Backend};

use crate::contents::Contents;

/// One file, whatever the path that is asked for; compressed where the path ends so.
#[derive(Clone, Debug)]
pub(crate) struct Resource(pub(crate) Contents);

impl Resource {
    async fn opened(self, path: PathBuf) -> io::Result<Opened> {
        let compressed = path.extension().is_some_and(|extension| extension == "gz");
        match self.0 {
            Contents::Bytes { plain, gzip } => {
                let bytes = if compressed { gzip } else { Some(plain) };
                let bytes = bytes.ok_or(io::ErrorKind::NotFound)?;
                Ok(Opened::Memory(Cursor::new(bytes)))
            }
            Contents::Path(_) if compressed => Err(io::ErrorKind::NotFound.into()),
            Contents::Path(path) => {
                let opened = tokio::task::spawn_blocking(move || open(&path)).await;
                let file = opened.map_err(io::Error::other)??;
                Ok(Opened::Disk(tokio::fs::File::from_std(file)))
            }
        }
    }
}

/// Opens the regular file of a path in which nothing is a link.
fn open(path: &Path) -> io::Result<File> {
    let file = open_without_links(path)?;
    if file.metadata()?.is_file() {
        return Ok(file);
    }
    Err(io::Error::other("it is no longer a file"))
}

#[cfg(target_os = "linux")]
fn open_without_links(path: &Path) -> io::Result<File> {
    use rustix::fs::{CWD, Mode, OFlags, ResolveFlags, openat2};
    // What waits for a writer, as a pipe does, must not be waited for.
    let flags = OFlags::RDONLY | OFlags::CLOEXEC | OFlags::NOCTTY | OFlags::NONBLOCK;
    match openat2(CWD, path, flags, Mode::empty(), ResolveFlags::NO_SYMLINKS) {
        Ok(file) => Ok(file.into()),
        Err(rustix::io::Errno::LOOP) => Err(io::Error::other("a link has taken its place")),
        // Kernels before 5.6, and sandboxes.
        Err(rustix::io::Errno::NOSYS | rustix::io::Errno::PERM) => open_checked(path),
        Err(error) => Err(error.into()),
    }
}

#[cfg(not(target_os = "linux"))]
fn open_without_links(path: &Path) -> io::Result<File> {
    open_checked(path)
}

/// Looks before it opens, where the system has no way to do both at once.
fn open_checked(path: &Path) -> io::Result<File> {
    if path.canonicalize()? != path {
        return Err(io::Error::other("a link has taken its place"));
    }
    if !fs::symlink_metadata(path)?.is_file() {
        return Err(io::Error::other("it is no longer a file"));
    }
    File::open(path)
}

/// A file that is being read.
pub(crate) enum Opened {
    Disk(tokio::fs::File),
    Memory(Cursor<Bytes>),
}

impl Opened {
    async fn told(&self) -> io::Result<About> {
        match self {
            Self::Disk(file) => Ok(About::of(&file.metadata().await?)),
            Self::Memory(bytes) => {
                Ok(About { length: bytes.get_ref().len() as u64, modified: Some(*BUILT) })
            }
        }
    }
}

impl AsyncRead for Opened {
    fn poll_read(
        self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        into: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        match self.get_mut() {
            Self::Disk(file) => Pin::new(file).poll_read(cx, into),
            Self::Memory(bytes) => Pin::new(bytes).poll_read(cx, into),
        }
    }
}

impl AsyncSeek for Opened {
    fn start_seek(self: Pin<&mut Self>, position: SeekFrom) -> io::Result<()> {
        match self.get_mut() {
            Self::Disk(file) => Pin::new(file).start_seek(position),
            Self::Memory(bytes) => Pin::new(bytes).start_seek(position),
        }
    }

    fn poll_complete(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<u64>> {
        match self.get_mut() {
            Self::Disk(file) => Pin::new(file).poll_complete(cx),
            Self::Memory(bytes) => Pin::new(bytes).poll_complete(cx),
        }
    }
}

/// What clients are told of a file.
pub(crate) struct About {
    length: u64,
    modified: Option<SystemTime>,
}

impl About {
    fn of(metadata: &Metadata) -> Self {
        Self { length: metadata.len(), modified: metadata.modified().ok() }
    }
}

/// When what is compiled in was made.
static BUILT: LazyLock<SystemTime> = LazyLock::new(|| {
    let built = std::env::current_exe().and_then(|program| program.metadata()?.modified());
    built.unwrap_or_else(|_| SystemTime::now())
});

impl served::Metadata for About {
    fn is_dir(&self) -> bool {
        false
    }

    fn modified(&self) -> io::Result<SystemTime> {
        self.modified.ok_or_else(|| io::ErrorKind::Unsupported.into())
    }

    fn len(&self) -> u64 {
        self.length
    }
}

type Coming<'a, T> = Pin<Box<dyn Future<Output = io::Result<T>> + Send + 'a>>;

impl served::File for Opened {
    type Metadata = About;
    type MetadataFuture<'a> = Coming<'a, About>;

    fn metadata(&self) -> Self::MetadataFuture<'_> {
        Box::pin(self.told())
    }
}

impl Backend for Resource {
    type File = Opened;
    type Metadata = About;
    type OpenFuture = Coming<'static, Opened>;
    type MetadataFuture = Coming<'static, About>;

    fn open(&self, path: PathBuf) -> Self::OpenFuture {
        Box::pin(self.clone().opened(path))
    }

    fn metadata(&self, path: PathBuf) -> Self::MetadataFuture {
        let resource = self.clone();
        Box::pin(async move { resource.opened(path).await?.told().await })
    }
}
