//! Equirectangular pictures of the environment.

use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use image::{ImageFormat, ImageReader, Limits};

use crate::HdrImage;
use crate::error::Fault;
use crate::gltf::source::{Folder, shorten};
use crate::limits::{self, Budget};

/// Reads an .hdr or .exr file, whose name within the scene's folder is `name`. Texels that are
/// negative or NaN become black, those that are infinite or too bright the largest light. The
/// second value is the number of texels changed.
pub(crate) fn read(
    path: &Path,
    name: &str,
    folder: &Folder,
    budget: &Budget,
) -> Result<(Arc<HdrImage>, usize), Fault> {
    let bytes =
        folder.read_file(path).map_err(|source| Fault::Missing { uri: shorten(name), source })?;
    let fail = |reason: String| Fault::Image { name: name.to_owned(), reason };
    let reader = || {
        let mut reader = ImageReader::new(Cursor::new(&bytes))
            .with_guessed_format()
            .map_err(|e| fail(e.to_string()))?;
        let mut bounds = Limits::default();
        bounds.max_image_width = Some(limits::IMAGE_SIDE);
        bounds.max_image_height = Some(limits::IMAGE_SIDE);
        bounds.max_alloc = Some(32 * u64::from(limits::IMAGE_SIDE).pow(2));
        reader.limits(bounds);
        Ok(reader)
    };
    let first = reader()?;
    if !matches!(first.format(), Some(ImageFormat::Hdr | ImageFormat::OpenExr)) {
        return Err(fail("an environment has to be a .hdr or .exr file".into()));
    }
    let (width, height) = first.into_dimensions().map_err(|e| fail(e.to_string()))?;
    if width == 0 || height == 0 || width.max(height) > limits::IMAGE_SIDE {
        let side = limits::IMAGE_SIDE;
        return Err(fail(format!("{width} × {height} texels; 1 to {side} a side are read")));
    }
    // The budget counts texels of four bytes; a texel here has three floats, so the height counts
    // thrice.
    budget.texels(width, 3 * height)?;
    let decoded = reader()?.decode().map_err(|e| fail(e.to_string()))?.into_rgb32f();
    let mut repaired = 0;
    let texels = decoded.as_chunks::<3>().0.iter().map(|texel| sanitise(*texel, &mut repaired));
    Ok((Arc::new(HdrImage { width, height, texels: texels.collect() }), repaired))
}

fn sanitise(texel: [f32; 3], repaired: &mut usize) -> Vec3 {
    let clean = texel.map(|v| if v > 0.0 { v.min(limits::LIGHT) } else { 0.0 });
    *repaired += usize::from(clean != texel);
    Vec3::from(clean)
}
