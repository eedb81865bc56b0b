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
//!
//! Errors are functions of a [`Pair`]; [`compare`] gives them all for two files.
//!
//! ```
//! # use glam::Vec3;
//! # use lumencast_picture::{Loaded, PIXELS_PER_DEGREE, Picture, compare};
//! let reference = Loaded::Linear(Picture::from_fn(40, 30, |x, _| Vec3::splat(x as f32)));
//! let picture = Loaded::Linear(reference.stored().map(|p| p * 1.02));
//! let found = compare(&reference, &picture, None, PIXELS_PER_DEGREE)?;
//! assert!(found.psnr > 35.0 && found.flip.mean() < 0.1);
//! # Ok::<(), lumencast_picture::CompareError>(())
//! ```

#![forbid(unsafe_code)]

mod compare;
mod difference;
mod error;
mod file;
mod flip;
mod magma;
mod pair;
mod picture;
mod plane;
mod ssim;
mod tone;
mod whole;

pub use compare::{Comparison, compare};
pub use difference::{mse, psnr, relative_mse};
pub use error::{CompareError, PictureError};
pub use file::Loaded;
pub use flip::{ErrorMap, HdrFlip, PIXELS_PER_DEGREE, flip, hdr_flip, pixels_per_degree};
pub use magma::magma;
pub use pair::Pair;
pub use picture::{Picture, exposure, luminance};
pub use ssim::ssim;
pub use tone::{ToneMap, gamma_code, linear_from_srgb, srgb_from_linear};
pub use whole::{check_place, write_whole};
