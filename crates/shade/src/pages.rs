//! Pages of lumels, flat before a picture: where each lies, and how they are drawn.

use bytemuck::{Pod, Zeroable};
use glam::{UVec2, Vec2};
use lumencast_gpu::Gpu;

use crate::charted::SurfaceLayouts;

/// So much of the picture's height or width is theirs, whichever is less for them.
const SHARE: f32 = 0.86;

/// A page, as `pages_vertex` of the shader takes it: 24 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct FlatPage {
    /// The upper left corner, in clip coordinates.
    corner: [f32; 2],
    /// From there to the lower right one.
    size: [f32; 2],
    /// Lumels along its side.
    lumels: f32,
    /// The layer of the pages' texture.
    layer: u32,
}

const ATTRIBUTES: [wgpu::VertexAttribute; 4] =
    wgpu::vertex_attr_array![0 => Float32x2, 1 => Float32x2, 2 => Float32, 3 => Uint32];

/// The layout of the vertex buffer, an instance for each page.
pub(crate) const VERTEX_LAYOUT: wgpu::VertexBufferLayout<'_> = wgpu::VertexBufferLayout {
    array_stride: size_of::<FlatPage>() as u64,
    step_mode: wgpu::VertexStepMode::Instance,
    attributes: &ATTRIBUTES,
};

/// The pages that are drawn before a picture.
#[derive(Debug)]
pub(crate) struct FlatPages {
    buffer: wgpu::Buffer,
    count: u32,
}

impl FlatPages {
    /// The pages of light before a picture of a size.
    pub(crate) fn new(gpu: &Gpu, layouts: &SurfaceLayouts, size: UVec2) -> Self {
        let pages = arranged(layouts, size.as_vec2());
        let (contents, least) = (bytemuck::cast_slice(&pages), size_of::<FlatPage>() as u64);
        let buffer = gpu.buffer("pages", wgpu::BufferUsages::VERTEX, contents, least);
        Self { buffer, count: pages.len() as u32 }
    }

    /// Draws them. The pipeline is that of pages, and groups 1 and 2 are bound.
    pub(crate) fn draw(&self, encoded: &mut wgpu::RenderPass<'_>) {
        encoded.set_vertex_buffer(0, self.buffer.slice(..));
        encoded.draw(0..4, 0..self.count);
    }
}

/// Rows of cells as large as the largest page, as square as can be, in the middle of the picture.
fn arranged(layouts: &SurfaceLayouts, picture: Vec2) -> Vec<FlatPage> {
    let all = layouts.all();
    let count: u32 = all.iter().map(|placed| placed.layout.pages).sum();
    let side = all.iter().map(|placed| placed.layout.page_size).max().unwrap_or(0) as f32;
    let columns = f64::from(count).sqrt().ceil() as u32;
    let cells = Vec2::new(columns as f32, count.div_ceil(columns.max(1)) as f32);
    // Pixels of a lumel, and clip coordinates of it, in which y goes up.
    let scale = SHARE * (picture / (side * cells)).min_element();
    let clip_from_lumel = Vec2::new(2.0, -2.0) * scale / picture;
    let pages = all.iter().flat_map(|placed| {
        let lumels = placed.layout.page_size as f32;
        (placed.first_layers[0]..).take(placed.layout.pages as usize).map(move |l| (lumels, l))
    });
    let flat = |((lumels, layer), number): ((f32, u32), u32)| {
        let cell = UVec2::new(number % columns, number / columns).as_vec2();
        FlatPage {
            corner: (clip_from_lumel * side * (cell - 0.5 * cells)).to_array(),
            size: (clip_from_lumel * lumels).to_array(),
            lumels,
            layer,
        }
    };
    pages.zip(0..).map(flat).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use lumencast_light::{Field, FieldId, Layout, Light, Lightmap};

    use super::*;

    fn layouts(lightmaps: &[(u32, u32, bool)]) -> SurfaceLayouts {
        let lightmap = |(&(page_size, pages, slopes), id): (&(u32, u32, bool), u32)| {
            let layout = Arc::new(Layout::new(page_size, pages, Vec::new()));
            Field::from(Lightmap::dark(FieldId(id), layout).with_slopes(slopes))
        };
        SurfaceLayouts::of(&Light::new(lightmaps.iter().zip(0..).map(lightmap)))
    }

    #[test]
    fn pages_stand_in_rows_and_slopes_are_left_out() {
        let picture = Vec2::new(400.0, 200.0);
        let pages = arranged(&layouts(&[(64, 2, true), (32, 1, false)]), picture);
        assert_eq!(pages.iter().map(|page| page.layer).collect::<Vec<_>>(), [0, 1, 4]);
        // Two rows of two cells take 86 pixels each.
        let pixels =
            |clip: [f32; 2]| (Vec2::from(clip) * Vec2::new(1.0, -1.0) + 1.0) * 0.5 * picture;
        let corners = [(114.0, 14.0), (200.0, 14.0), (114.0, 100.0)];
        for (page, (x, y)) in pages.iter().zip(corners) {
            assert!(pixels(page.corner).abs_diff_eq(Vec2::new(x, y), 1e-3), "{page:?}");
        }
        let sides = pages.iter().map(|page| 200.0 * page.size[0]).collect::<Vec<_>>();
        assert!(sides.iter().zip([86.0, 86.0, 43.0]).all(|(a, b)| (a - b).abs() < 1e-3));
        assert!(pages.iter().all(|page| page.size[1] == -2.0 * page.size[0]));
    }

    #[test]
    fn one_page_fills_the_lesser_side_and_none_nothing() {
        let [page] = arranged(&layouts(&[(64, 1, false)]), Vec2::new(100.0, 300.0))[..] else {
            panic!("one page")
        };
        assert!((page.corner[0] + 0.86).abs() < 1e-5 && (page.size[0] - 1.72).abs() < 1e-5);
        assert!((page.corner[1] - 0.86 / 3.0).abs() < 1e-5, "{page:?}");
        assert!(arranged(&layouts(&[]), Vec2::ONE).is_empty());
    }
}
