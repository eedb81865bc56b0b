//! Why a surface has no lumels.

/// Why a surface has no lumels.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ChartError {
    /// All its triangles are points or lines.
    #[error("it has no area")]
    NoArea,
    /// It falls into more charts than pages are worth.
    #[error("it falls into {charts} charts or more; {most} are the most")]
    TooManyCharts {
        /// As many as there would be, at least.
        charts: u32,
        /// As many as are cut.
        most: u32,
    },
    /// Its progress was told to someone who wished it to end.
    #[error("it was interrupted")]
    Interrupted,
    /// The unwrapper failed, or returned what cannot be used.
    #[error("it cannot be unwrapped: {0}")]
    Unwrap(String),
    /// No page has room for it.
    #[error("no page has room for it")]
    NoRoom,
}
