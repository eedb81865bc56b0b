//! The reference: light with its uncertainty, at points ([`probe_sh`]) and in pictures
//! ([`Renderer`]), and single samples with what they met first ([`Renderer::frame`]), which denoisers
//! start from. What is compared with closed forms, with other renderers, and what our own light
//! fields are compared with.

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
