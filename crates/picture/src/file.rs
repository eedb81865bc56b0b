//! Files: PNG, JPEG and OpenEXR written; PNG, OpenEXR and Radiance HDR read.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

use glam::Vec3;
use image::{
    DynamicImage, ExtendedColorType, ImageEncoder, ImageError, ImageFormat, ImageReader, Limits,
    Rgb, RgbImage,
    codecs::{jpeg::JpegEncoder, openexr::OpenExrEncoder, png::PngEncoder},
};

use crate::tone::{gamma_code, linear_from_srgb};
use crate::whole::write_whole;
use crate::{Picture, PictureError, ToneMap};

/// The longest side that is read, pixels.
const SIDE: u32 = 32_768;
/// The most memory that reading may take, bytes: 16 k × 16 k pixels of 12 bytes.
const MEMORY: u64 = 3 << 30;
/// Of 100.
const JPEG_QUALITY: u8 = 85;

/// What a file holds, by its kind.
#[derive(Clone, Debug, PartialEq)]
pub enum Loaded {
    /// PNG: codes of sRGB as stored, 0 to 1.
    Coded(Picture),
    /// OpenEXR and Radiance HDR: linear.
    Linear(Picture),
}

impl Loaded {
    /// Reads a PNG (8 or 16 bits, colour or grey), OpenEXR or Radiance HDR file; its contents tell
    /// which it is. Alpha is ignored, colours are not multiplied by it; colour profiles are too.
    ///
    /// # Errors
    /// The file cannot be read, is of another kind, is broken, or takes more than 3 GiB.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, PictureError> {
        let path = path.as_ref();
        let fail = |error| PictureError::Read { file: path.into(), error };
        let mut reader =
            ImageReader::open(path).map_err(fail)?.with_guessed_format().map_err(fail)?;
        let format = reader.format();
        if !matches!(format, Some(ImageFormat::Png | ImageFormat::OpenExr | ImageFormat::Hdr)) {
            return Err(PictureError::Kind { file: path.into() });
        }
        let mut limits = Limits::default();
        limits.max_image_width = Some(SIDE);
        limits.max_image_height = Some(SIDE);
        limits.max_alloc = Some(MEMORY);
        reader.limits(limits);
        let decoded = reader.decode().map_err(|e| match e {
            ImageError::IoError(source) if source.kind() != io::ErrorKind::UnexpectedEof => {
                fail(source)
            }
            error => PictureError::Decode { file: path.into(), error },
        })?;
        let picture = from_image(decoded)?;
        Ok(match format {
            Some(ImageFormat::Png) => Self::Coded(picture),
            _ => Self::Linear(picture),
        })
    }

    /// Linear colour; codes are decoded by the curve of sRGB, so that 1 is the display's white.
    pub fn linear(&self) -> Picture {
        match self {
            Self::Coded(codes) => codes.map(linear_from_srgb),
            Self::Linear(picture) => picture.clone(),
        }
    }

    /// Codes for a display: those stored, or v^(1/2.2) of linear colour times `exposure`. Nothing
    /// is clamped; see [`gamma_code`] for negative light.
    pub fn display(&self, exposure: f32) -> Picture {
        match self {
            Self::Coded(codes) => codes.clone(),
            Self::Linear(picture) => picture.map(|p| gamma_code(p * exposure)),
        }
    }

    /// What is stored, codes or linear colour.
    pub fn stored(&self) -> &Picture {
        match self {
            Self::Coded(picture) | Self::Linear(picture) => picture,
        }
    }
}

impl Picture {
    /// Writes a PNG of 8 bits a channel, shown by `tone_map` after a factor of `exposure`.
    ///
    /// # Errors
    /// The file cannot be written; one that was there before is left as it was.
    pub fn write_png(
        &self,
        path: impl AsRef<Path>,
        tone_map: ToneMap,
        exposure: f32,
    ) -> Result<(), PictureError> {
        let image = self.coded(tone_map, exposure);
        save(path.as_ref(), |out| image.write_with_encoder(PngEncoder::new(out)))
    }

    /// Writes a JPEG for documents, a tenth of a PNG's size, shown by `tone_map` after a factor of
    /// `exposure`. Not for comparisons: its blocks are changed.
    ///
    /// # Errors
    /// The file cannot be written, as it is not where a side is over 65,535 pixels; one that was there
    /// before is left as it was.
    pub fn write_jpeg(
        &self,
        path: impl AsRef<Path>,
        tone_map: ToneMap,
        exposure: f32,
    ) -> Result<(), PictureError> {
        let image = self.coded(tone_map, exposure);
        save(path.as_ref(), |out| {
            image.write_with_encoder(JpegEncoder::new_with_quality(out, JPEG_QUALITY))
        })
    }

    /// Codes of 8 bits a channel.
    fn coded(&self, tone_map: ToneMap, exposure: f32) -> RgbImage {
        let code = |x, y| {
            let linear = self.pixel(x, y).unwrap_or_default();
            let code = tone_map.encode(linear * exposure).to_array();
            Rgb(code.map(|v| (255.0 * v + 0.5) as u8))
        };
        RgbImage::from_fn(self.width(), self.height(), code)
    }

    /// Writes an OpenEXR of 32-bit floats, channels R, G and B, linear as they are.
    ///
    /// # Errors
    /// The file cannot be written; one that was there before is left as it was.
    pub fn write_exr(&self, path: impl AsRef<Path>) -> Result<(), PictureError> {
        let bytes: Vec<u8> =
            self.pixels().iter().flat_map(|p| p.to_array()).flat_map(f32::to_ne_bytes).collect();
        save(path.as_ref(), |out| {
            OpenExrEncoder::new(out).write_image(
                &bytes,
                self.width(),
                self.height(),
                ExtendedColorType::Rgb32F,
            )
        })
    }
}

fn from_image(decoded: DynamicImage) -> Result<Picture, PictureError> {
    let image = decoded.into_rgb32f();
    let (width, height) = image.dimensions();
    let pixels = image.as_chunks::<3>().0.iter().map(|p| Vec3::from(*p)).collect();
    Picture::new(width, height, pixels)
}

/// Writes a picture's file.
fn save(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), ImageError>,
) -> Result<(), PictureError> {
    let written = write_whole(path, |out| {
        write(out).map_err(|e| match e {
            ImageError::IoError(e) => e,
            e => io::Error::other(e),
        })
    });
    written.map_err(|error| PictureError::Write { file: path.into(), error })
}
