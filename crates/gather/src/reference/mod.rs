//! The reference: light with its uncertainty, at points ([`probe_sh`]) and in pictures
//! ([`Renderer`]). What is compared with closed forms, with other renderers, and what our own light
//! fields are compared with.

mod film;
mod picture;
mod probe;
mod view;

pub use film::{Film, Noise};
pub use picture::{PASS, Parts, PictureSettings, Renderer, Traced};
pub use probe::{ProbeEstimate, ProbeSettings, probe_sh};
pub use view::{Filter, View};
