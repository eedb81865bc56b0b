//! Images and textures.

use std::io::Cursor;
use std::path::PathBuf;
use std::sync::Arc;

use glam::{Affine2, Mat2, Vec2};
use image::{ImageFormat, ImageReader, Limits};
use rayon::prelude::*;

use super::accessor::Accessors;
use super::json;
use super::source::{Folder, data_uri, shorten};
use super::uv_sets::UvSets;
use crate::error::{At, Fault, invalid};
use crate::limits;
use crate::material::{Filter, Image, TextureRef, Wrap};

/// A file that a glTF refers to: its name within the scene's folder, and its path on disk.
pub(super) type Referred = (String, PathBuf);

/// Decoded images by index. Images that no material's texture shows are not decoded.
#[derive(Debug, Default)]
pub(super) struct Images {
    images: Vec<Option<Arc<Image>>>,
    pub(super) files: Vec<Referred>,
}

/// Decodes the images that are used, on all cores.
pub(super) fn read_images(
    accessors: Accessors<'_>,
    folder: Option<&Folder>,
    used: &[usize],
) -> Result<Images, Fault> {
    let read: Vec<_> = used
        .par_iter()
        .map(|&index| read_image(accessors, folder, index).at(|| format!("image {index}")))
        .collect::<Result<_, _>>()?;
    let mut images = Images::default();
    images.images.resize(accessors.root.images.len(), None);
    for (&index, (image, file)) in used.iter().zip(read) {
        images.images[index] = Some(Arc::new(image));
        images.files.extend(file);
    }
    Ok(images)
}

fn read_image(
    accessors: Accessors<'_>,
    folder: Option<&Folder>,
    index: usize,
) -> Result<(Image, Option<Referred>), Fault> {
    let json = &accessors.root.images[index];
    let mut file = None;
    let read;
    let bytes: &[u8] = match (&json.uri, json.buffer_view) {
        (_, Some(view)) => accessors.view(view)?,
        (Some(uri), None) => {
            read = match data_uri(uri) {
                Some(bytes) => bytes?,
                None => {
                    let folder = folder.ok_or_else(|| Fault::Outside { uri: shorten(uri) })?;
                    let (name, path, bytes) = folder.read(uri)?;
                    file = Some((name, path));
                    bytes
                }
            };
            &read
        }
        (None, None) => return Err(invalid("it has neither a uri nor a bufferView")),
    };
    let name = match &json.uri {
        _ if !json.name.is_empty() => json.name.clone(),
        Some(uri) if !uri.starts_with("data:") => shorten(uri),
        _ => format!("image {index}"),
    };
    let image = decode(bytes, &name, accessors)?;
    Ok((image, file))
}

fn decode(bytes: &[u8], name: &str, accessors: Accessors<'_>) -> Result<Image, Fault> {
    let fail = |reason: String| Fault::Image { name: name.to_owned(), reason };
    let reader = || {
        ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| fail(e.to_string()))
    };
    let first = reader()?;
    if !matches!(first.format(), Some(ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP)) {
        return Err(fail("PNG, JPEG and WebP are read; convert it".into()));
    }
    let (width, height) = first.into_dimensions().map_err(|e| fail(e.to_string()))?;
    let side = limits::IMAGE_SIDE;
    if width.max(height) > side {
        let limit = format!("{width} × {height} texels, where {side} × {side} are possible");
        return Err(fail(format!("{limit}; scale it down")));
    }
    accessors.budget.texels(width, height)?;
    let mut second = reader()?;
    let mut bounds = Limits::default();
    bounds.max_image_width = Some(side);
    bounds.max_image_height = Some(side);
    // Decoding takes up to 16 bits a channel, and as much again for the decoder itself.
    bounds.max_alloc = Some(16 * u64::from(side).pow(2));
    second.limits(bounds);
    let decoded = second.decode().map_err(|e| fail(e.to_string()))?.into_rgba8();
    let (width, height) = decoded.dimensions();
    let texels = decoded.into_raw().as_chunks::<4>().0.to_vec();
    if width == 0 || height == 0 {
        return Err(fail("it is empty".into()));
    }
    Ok(Image { name: name.to_owned(), width, height, texels })
}

/// Index of the image that a texture shows; `None` where its only image has a format that is not
/// read.
pub(super) fn image_of(root: &json::Root, texture: usize) -> Result<Option<usize>, Fault> {
    let there = root.textures.len();
    let json = root
        .textures
        .get(texture)
        .ok_or_else(|| invalid(format!("texture {texture} of {there} does not exist")))?;
    let source = json.extensions.webp.as_ref().map(|w| w.source).or(json.source);
    match source {
        Some(image) if image >= root.images.len() => {
            Err(invalid(format!("texture {texture}: image {image} does not exist")))
        }
        source => Ok(source),
    }
}

impl Images {
    /// The texture that a material refers to; `None` where it cannot be shown.
    pub(super) fn texture(
        &self,
        root: &json::Root,
        info: &json::TextureInfo,
        sets: UvSets,
        warnings: &mut Vec<String>,
    ) -> Result<Option<TextureRef>, Fault> {
        let index = info.index;
        let Some(image) = image_of(root, index)?.and_then(|i| self.images[i].clone()) else {
            warnings.push(format!("texture {index} has no image in a format that is read"));
            return Ok(None);
        };
        let transform = info.extensions.transform.as_ref();
        let set = info.uv_set();
        let Some(tex_coord) = sets.place(set) else {
            warnings.push(format!(
                "texture {index} is left out: it uses TEXCOORD_{set}, a third set of its material"
            ));
            return Ok(None);
        };
        let sampler =
            match root.textures[index].sampler {
                None => None,
                Some(s) => Some(root.samplers.get(s).ok_or_else(|| {
                    invalid(format!("texture {index}: sampler {s} does not exist"))
                })?),
            };
        let texture_from_mesh = match transform {
            None => Affine2::IDENTITY,
            Some(transform) => texture_from_mesh(transform)?,
        };
        Ok(Some(TextureRef {
            image,
            tex_coord,
            texture_from_mesh,
            wrap: [wrap(sampler.and_then(|s| s.wrap_s)), wrap(sampler.and_then(|s| s.wrap_t))],
            filter: match sampler.and_then(|s| s.mag_filter) {
                Some(9728) => Filter::Nearest,
                _ => Filter::Linear,
            },
        }))
    }
}

/// KHR_texture_transform: translation · rotation · scale. A positive rotation turns texture
/// coordinates counter-clockwise in an image whose v runs down.
fn texture_from_mesh(transform: &json::TextureTransform) -> Result<Affine2, Fault> {
    let (sin, cos) = transform.rotation.sin_cos();
    let rotation = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
    let matrix = Affine2::from_mat2_translation(
        rotation * Mat2::from_diagonal(transform.scale.into()),
        transform.offset.into(),
    );
    match matrix.is_finite() {
        true => Ok(matrix),
        false => Err(invalid("a KHR_texture_transform is not finite")),
    }
}

fn wrap(code: Option<u32>) -> Wrap {
    match code {
        Some(33_071) => Wrap::Clamp,
        Some(33_648) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}
