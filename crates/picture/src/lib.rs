//! Pictures as data: linear colour, the files it is kept in, how it is shown, and how far two
//! pictures differ.
//!
//! ```
//! use glam::Vec3;
//! use lumencast_picture::{Picture, ToneMap, exposure};
//!
//! let picture = Picture::from_fn(4, 2, |x, y| Vec3::new(x as f32, y as f32, 100.0));
//! let brightest = Vec3::new(3.0, 1.0, 100.0) * exposure(&picture);
//! let code = ToneMap::Gamma.encode(brightest);
//! assert!(code.max_element() <= 1.0);
//! ```

#![forbid(unsafe_code)]

mod error;
mod file;
mod picture;
mod tone;

pub use error::PictureError;
pub use file::Loaded;
pub use picture::{Picture, exposure, luminance};
pub use tone::{ToneMap, gamma_code, linear_from_srgb, srgb_from_linear};
