//! Errors of loading a scene.

use std::path::PathBuf;

/// The reason why a scene cannot be loaded, with the file at fault.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", file.display())]
pub struct SceneError {
    /// The glTF or TOML file at fault, as the caller or the scene named it.
    pub file: PathBuf,
    /// What is wrong with the file.
    pub fault: Fault,
}

/// What is wrong with a scene's file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// The name is neither a file nor a built-in scene.
    #[error("no such file, and no built-in scene of that name; there are {builtins}")]
    Unknown {
        /// Names of the built-in scenes.
        builtins: String,
    },
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Read(std::io::Error),
    /// A file that the scene refers to cannot be read.
    #[error("refers to {uri:?}, which cannot be read: {source}; put it beside the scene")]
    Missing {
        /// The URI as the scene writes it.
        uri: String,
        /// Why it cannot be read.
        source: std::io::Error,
    },
    /// A URI leads out of the scene's folder or to another machine.
    #[error("refers to {uri:?}; only files in the scene's own folder are read: copy it there")]
    Outside {
        /// The URI as the scene writes it.
        uri: String,
    },
    /// A URI cannot be the name of a file.
    #[error("refers to {uri:?}, {why}")]
    Name {
        /// The URI as the scene writes it.
        uri: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// The file is not JSON, or lacks the structure of glTF.
    #[error("is not valid glTF: {0}")]
    Json(serde_json::Error),
    /// The file is not TOML, or lacks the structure of a scene's settings.
    #[error("{0}")]
    Toml(toml::de::Error),
    /// The file contradicts itself or glTF; the text says where.
    #[error("{0}")]
    Invalid(String),
    /// The file requires an extension that this program does not know.
    #[error(
        "unknown required extension {0}; export the scene again without it (compressed meshes and \
         textures are not read)"
    )]
    UnknownExtension(String),
    /// The scene has no triangles.
    #[error("has no triangles in its scene; points, lines and hidden nodes are not drawn")]
    NoTriangles,
    /// The scene exceeds a limit.
    #[error("{what} exceed the limit of {limit}")]
    TooLarge {
        /// The quantity that is too large.
        what: String,
        /// Its limit.
        limit: u64,
    },
    /// A picture cannot be decoded.
    #[error("image {name:?} cannot be decoded: {reason}")]
    Image {
        /// Its URI or index.
        name: String,
        /// Why it cannot be decoded.
        reason: String,
    },
    /// The fault that was found when the file was last read.
    #[error("{0}")]
    Remembered(String),
}

impl Fault {
    /// Prefixes the message with a place: `invalid("…").at("mesh 3")` reads `mesh 3: …`.
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

/// Adds a place to the fault of a result.
pub(crate) trait At<T> {
    fn at(self, place: impl FnOnce() -> String) -> Result<T, Fault>;
}

impl<T> At<T> for Result<T, Fault> {
    fn at(self, place: impl FnOnce() -> String) -> Self {
        self.map_err(|fault| fault.at(&place()))
    }
}
