//! The reference: accurate light for comparisons, with estimates of its error. [`probe_sh`]
//! computes it at points, [`Renderer`] in pictures. [`Renderer::frame`] gives single samples with
//! the surfaces that they met first, the input of denoisers.
//!
//! It is compared with closed forms and other renderers; light fields are compared with it.

mod film;
mod filter;
mod frame;
mod picture;
mod probe;
mod sun;

pub use film::{Film, Noise};
pub use filter::Filter;
pub use frame::{Frame, Sample, Surface};
pub use picture::{PASS, Parts, PictureSettings, Renderer, Traced};
pub use probe::{ProbeEstimate, ProbeSettings, probe_sh};
