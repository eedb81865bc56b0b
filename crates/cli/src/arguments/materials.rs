//! How surfaces reflect.

use std::fmt;

use clap::ValueEnum;
use lumencast_gather::path_trace::MaterialModel;

/// How surfaces reflect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Materials {
    /// As their materials say.
    Full,
    /// As opaque two-sided Lambert with their base colour, for comparisons.
    Lambert,
}

impl Materials {
    pub(crate) fn model(self) -> MaterialModel {
        match self {
            Self::Full => MaterialModel::Full,
            Self::Lambert => MaterialModel::Lambert,
        }
    }

    /// The same for what an adapter draws.
    #[cfg(feature = "gpu")]
    pub(crate) fn drawn(self) -> lumencast_shade::Materials {
        match self {
            Self::Full => lumencast_shade::Materials::Full,
            Self::Lambert => lumencast_shade::Materials::Lambert,
        }
    }
}

impl fmt::Display for Materials {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Full => "full",
            Self::Lambert => "lambert",
        })
    }
}
