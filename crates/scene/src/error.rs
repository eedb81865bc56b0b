//! What can be wrong with a scene.

use std::path::PathBuf;

/// A scene that cannot be loaded: which file, and what is wrong with it.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", file.display())]
pub struct SceneError {
    /// The glTF or TOML file at fault, as it was named.
    pub file: PathBuf,
    /// What is wrong.
    pub fault: Fault,
}

/// What is wrong with a scene's file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// Neither a file nor a built-in scene.
    #[error("no such file, and no built-in scene of that name; there are {builtins}")]
    Unknown {
        /// The names there are.
        builtins: String,
    },
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Read(std::io::Error),
    /// A file that the scene refers to cannot be read.
    #[error("refers to {uri:?}, which cannot be read: {source}; put it beside the scene")]
    Missing {
        /// As the scene names it.
        uri: String,
        /// Why.
        source: std::io::Error,
    },
    /// A URI leads out of the scene's folder or to another machine.
    #[error("refers to {uri:?}; only files in the scene's own folder are read: copy it there")]
    Outside {
        /// As the scene names it.
        uri: String,
    },
    /// A URI that can be no file's name.
    #[error("refers to {uri:?}, {why}")]
    Name {
        /// As the scene names it.
        uri: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// Not JSON, or not of glTF's form.
    #[error("is not valid glTF: {0}")]
    Json(serde_json::Error),
    /// Not TOML, or not of the form of a scene's settings.
    #[error("{0}")]
    Toml(toml::de::Error),
    /// The file contradicts itself or glTF; the text says where.
    #[error("{0}")]
    Invalid(String),
    /// An extension is required that this program does not know.
    #[error(
        "unknown required extension {0}; export the scene again without it (compressed meshes and \
         textures are not read)"
    )]
    UnknownExtension(String),
    /// Nothing to draw.
    #[error("has no triangles in its scene; points, lines and hidden nodes are not drawn")]
    NoTriangles,
    /// More than a server should hold.
    #[error("{what} exceed the limit of {limit}")]
    TooLarge {
        /// What there is too much of.
        what: String,
        /// How much there may be.
        limit: u64,
    },
    /// A picture cannot be decoded.
    #[error("image {name:?} cannot be decoded: {reason}")]
    Image {
        /// Its URI or index.
        name: String,
        /// Why.
        reason: String,
    },
    /// What was found when the file was last read.
    #[error("{0}")]
    Remembered(String),
}

impl Fault {
    /// Says where: `invalid("…").at("mesh 3")` reads `mesh 3: …`.
    pub(crate) fn at(self, place: &str) -> Self {
        match self {
            Self::Invalid(what) => Self::Invalid(format!("{place}: {what}")),
            Self::TooLarge { what, limit } => {
                Self::TooLarge { what: format!("{place}: {what}"), limit }
            }
            other => other,
        }
    }

    pub(crate) fn of(self, file: impl Into<PathBuf>) -> SceneError {
        SceneError { file: file.into(), fault: self }
    }
}

/// Shorthand for [`Fault::Invalid`].
pub(crate) fn invalid(what: impl Into<String>) -> Fault {
    Fault::Invalid(what.into())
}

/// Adds the place to a fault on its way up.
pub(crate) trait At<T> {
    fn at(self, place: impl FnOnce() -> String) -> Result<T, Fault>;
}

impl<T> At<T> for Result<T, Fault> {
    fn at(self, place: impl FnOnce() -> String) -> Self {
        self.map_err(|fault| fault.at(&place()))
    }
}
