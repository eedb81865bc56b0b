//! How long light is computed.

use std::str::FromStr;

use clap::Args;
use lumencast_solve::Effort;

use crate::values::parse_positive;

/// A probe takes so many samples at most, unless told otherwise.
pub(crate) const MOST_SAMPLES: u32 = 32_768;
/// Light that is computed once may be so noisy, unless told otherwise; codes of 0 to 255.
const NOISE: &str = "0.5";

/// The noise at which computing ends, if it is to end by that.
#[derive(Clone, Copy, Debug)]
struct NoiseArgument(Option<f32>);

impl FromStr for NoiseArgument {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "off" => Ok(Self(None)),
            _ => Ok(Self(Some(parse_positive(text).map_err(|why| format!("{why}, or off"))?))),
        }
    }
}

/// How long light is computed that is computed once.
#[derive(Debug, Args)]
pub(crate) struct EffortArguments {
    /// The noise at which computing ends: root of the mean square of what noise adds to surfaces as
    /// they are displayed, in codes of 0 to 255; off to take all samples.
    #[arg(long, value_name = "CODES|off", default_value = NOISE)]
    noise: NoiseArgument,
}

impl EffortArguments {
    /// The effort of at most so many samples a probe.
    pub(crate) fn with(&self, samples: u32) -> Effort {
        Effort { noise: self.noise.0, ..Effort::of_samples(samples) }
    }
}
