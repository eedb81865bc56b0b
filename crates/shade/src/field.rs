//! The light on the device: all volumes in one 3D texture, beside the lumels' pages.
//!
//! A volume's atlas (`light::Atlas`) is deep and narrow, so volumes are stacked along z, and where the
//! adapter's textures are not deep enough, in columns side by side. Reading clamps to the outermost
//! probes, so that filtering never reaches a neighbour.

use glam::{Affine3A, Mat3, UVec3, Vec3};
use lumencast_gpu::Gpu;
use lumencast_gpu::bindings::{self, FILTERED, SAMPLER, STORAGE, UNIFORM};
use lumencast_gpu::textures;
use lumencast_light::{Atlas, Grid, Light, LumelAges, ProbeVolume, ScaleRule, atlas_size, texels};
use lumencast_shaders::layout;

use crate::ShadeError;
use crate::ages::AgeGrid;
use crate::charted::SurfaceLayouts;
use crate::lumels::GpuLumels;

/// Group 2 of the shaders.
#[derive(Debug)]
pub(crate) struct GpuField {
    pub(crate) layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    pub(crate) group: wgpu::BindGroup,
    /// What the texture was made for.
    sizes: Vec<UVec3>,
    origins: Vec<UVec3>,
    atlas: wgpu::Texture,
    scales: Vec<ScaleRule>,
    /// The volumes, and how they are described.
    placed: Vec<(Grid, layout::Volume)>,
    /// The point of the world that places are relative to.
    about: Vec3,
    lumels: GpuLumels,
    /// How long ago the light of lumels came.
    ages: Vec<LumelAges>,
    /// Where surfaces lie on the lumels' pages.
    pub(crate) layouts: SurfaceLayouts,
}

/// The bindings of group 2.
fn group_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let atlas = bindings::texture(FILTERED, wgpu::TextureViewDimension::D3);
    let pages = bindings::texture(FILTERED, wgpu::TextureViewDimension::D2Array);
    let types = [UNIFORM, STORAGE, atlas, SAMPLER, pages, STORAGE];
    gpu.group_layout("field", wgpu::ShaderStages::FRAGMENT, &types)
}

impl GpuField {
    /// No light.
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let layout = group_layout(gpu);
        let sampler = gpu.device().create_sampler(&wgpu::SamplerDescriptor {
            label: Some("field"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let atlas = texture(gpu, UVec3::ONE);
        let lumels = GpuLumels::new(gpu);
        let ages = &AgeGrid::new(&[], &SurfaceLayouts::default());
        let bound = Bound { atlas: &atlas, sampler: &sampler, volumes: &[], lumels: &lumels, ages };
        let group = bound.group(gpu, &layout);
        Self {
            layout,
            sampler,
            group,
            sizes: vec![],
            origins: vec![],
            atlas,
            scales: vec![],
            placed: vec![],
            about: Vec3::ZERO,
            lumels,
            ages: vec![],
            layouts: SurfaceLayouts::default(),
        }
    }

    /// Makes places relative to this point of the world.
    pub(crate) fn place_about(&mut self, gpu: &Gpu, origin: Vec3) {
        if self.about != origin {
            self.about = origin;
            self.describe(gpu);
        }
    }

    /// Takes in how long ago the light of lumels came.
    pub(crate) fn set_lumel_ages(&mut self, gpu: &Gpu, ages: Vec<LumelAges>) {
        self.ages = ages;
        self.describe(gpu);
    }

    /// Tells the shaders of the volumes, and of the ages of lumels.
    fn describe(&mut self, gpu: &Gpu) {
        for (grid, volume) in &mut self.placed {
            volume.cell_from_world = cell_from_world(grid, self.about);
        }
        let volumes: Vec<_> = self.placed.iter().map(|(_, volume)| *volume).collect();
        let ages = &AgeGrid::new(&self.ages, &self.layouts);
        let Self { atlas, sampler, lumels, .. } = self;
        let bound = Bound { atlas, sampler, volumes: &volumes, lumels, ages };
        self.group = bound.group(gpu, &self.layout);
    }

    /// Takes in other light. Where fields are as large as before, the textures stay.
    pub(crate) fn update(&mut self, gpu: &Gpu, light: &Light) -> Result<(), ShadeError> {
        self.lumels.update(gpu, light)?;
        self.layouts = SurfaceLayouts::of(light);
        let volumes: Vec<&ProbeVolume> = light.volumes().collect();
        let sizes: Vec<UVec3> =
            volumes.iter().map(|v| atlas_size(v.grid.resolution, v.order)).collect();
        if sizes != self.sizes {
            let limit = gpu.device().limits().max_texture_dimension_3d;
            let (size, origins) = arrange(&sizes, limit)
                .ok_or(ShadeError::Field { volumes: volumes.len(), limit })?;
            self.atlas = texture(gpu, size);
            self.scales = vec![ScaleRule::default(); sizes.len()];
            (self.sizes, self.origins) = (sizes, origins);
        }
        self.placed.clear();
        for ((volume, &origin), rule) in volumes.iter().zip(&self.origins).zip(&mut self.scales) {
            let packed = Atlas::pack(volume, rule.update(&volume.coefficients));
            write(gpu, &self.atlas, origin, &packed);
            self.placed.push((volume.grid, of_volume(volume, origin, packed.scale_log2)));
        }
        self.describe(gpu);
        Ok(())
    }
}

/// Where each of the boxes lies in a texture of at most `limit` texels a side, and how large that is.
fn arrange(sizes: &[UVec3], limit: u32) -> Option<(UVec3, Vec<UVec3>)> {
    let (mut size, mut next, mut column) = (UVec3::ONE, UVec3::ZERO, 0);
    let mut origins = Vec::with_capacity(sizes.len());
    for &own in sizes {
        if next.z + own.z > limit {
            next = UVec3::new(next.x + column, 0, 0);
            column = 0;
        }
        origins.push(next);
        size = size.max(next + own);
        column = column.max(own.x);
        next.z += own.z;
    }
    (size.max_element() <= limit).then_some((size, origins))
}

/// From places relative to an origin: cell = (R⁻¹ (p − centre) / size + ½) · resolution − ½.
fn cell_from_world(grid: &Grid, origin: Vec3) -> layout::Rows {
    let resolution = grid.resolution.as_vec3();
    let linear =
        Mat3::from_diagonal(resolution / grid.size) * Mat3::from_quat(grid.rotation.inverse());
    let translation = 0.5 * resolution - 0.5 - linear * (grid.center - origin);
    layout::rows(&Affine3A::from_mat3_translation(linear, translation))
}

fn of_volume(volume: &ProbeVolume, origin: UVec3, scale_log2: i8) -> layout::Volume {
    let grid = &volume.grid;
    layout::Volume {
        cell_from_world: cell_from_world(grid, Vec3::ZERO),
        spacing: grid.spacing(),
        scale: f32::from(scale_log2).exp2(),
        resolution: grid.resolution.as_vec3(),
        texels: texels(volume.order) as u32,
        origin: origin.as_vec3(),
        _pad0: 0.0,
        offset: volume.offset.in_cells(grid),
        _pad1: 0.0,
    }
}

fn texture(gpu: &Gpu, size: UVec3) -> wgpu::Texture {
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some("field"),
        ..textures::volume(size, wgpu::TextureFormat::Rgba16Float, usage)
    })
}

fn write(gpu: &Gpu, atlas: &wgpu::Texture, origin: UVec3, packed: &Atlas) {
    let UVec3 { x, y, z } = origin;
    let origin = wgpu::Origin3d { x, y, z };
    let to = wgpu::TexelCopyTextureInfo { origin, ..atlas.as_image_copy() };
    gpu.write_texels(to, bytemuck::cast_slice(&packed.halves), textures::volume_size(packed.size));
}

/// What group 2 binds.
struct Bound<'a> {
    atlas: &'a wgpu::Texture,
    sampler: &'a wgpu::Sampler,
    volumes: &'a [layout::Volume],
    lumels: &'a GpuLumels,
    ages: &'a AgeGrid,
}

impl Bound<'_> {
    fn group(&self, gpu: &Gpu, layout: &wgpu::BindGroupLayout) -> wgpu::BindGroup {
        let Self { atlas, sampler, volumes, lumels, ages } = self;
        let fields = layout::Fields {
            count: volumes.len() as u32,
            lumel_scale: lumels.scale(),
            age_side: ages.side,
            age_columns: ages.columns,
        };
        let uniform =
            gpu.buffer("fields", wgpu::BufferUsages::UNIFORM, bytemuck::bytes_of(&fields), 0);
        let least = size_of::<layout::Volume>() as u64;
        let storage = wgpu::BufferUsages::STORAGE;
        let list = gpu.buffer("volumes", storage, bytemuck::cast_slice(volumes), least);
        let ages = gpu.buffer("ages", storage, bytemuck::cast_slice(&ages.seconds), 4);
        let resources = [
            uniform.as_entire_binding(),
            list.as_entire_binding(),
            wgpu::BindingResource::TextureView(&textures::view(atlas)),
            wgpu::BindingResource::Sampler(sampler),
            wgpu::BindingResource::TextureView(&lumels.view()),
            ages.as_entire_binding(),
        ];
        gpu.group("fields", layout, &resources)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec4};
    use lumencast_light::{FieldId, Order};

    #[test]
    fn volumes_do_not_overlap() {
        let sizes = [UVec3::new(8, 8, 70), UVec3::new(4, 9, 70), UVec3::new(5, 2, 180)];
        let (size, origins) = arrange(&sizes, 256).unwrap();
        assert_eq!(origins, [UVec3::ZERO, UVec3::new(0, 0, 70), UVec3::new(8, 0, 0)]);
        assert_eq!(size, UVec3::new(13, 9, 180));
        assert_eq!(arrange(&[UVec3::new(1, 1, 300)], 256), None);
        assert_eq!(arrange(&[UVec3::new(200, 1, 200); 2], 256), None);
    }

    #[test]
    fn cells_are_those_of_the_grid() {
        let grid = Grid {
            center: Vec3::new(1.0, -2.0, 0.5),
            rotation: Quat::from_rotation_y(0.7),
            size: Vec3::new(4.0, 2.0, 6.0),
            resolution: UVec3::new(4, 3, 5),
        };
        let volume = of_volume(&ProbeVolume::dark(FieldId(0), grid, Order::L3), UVec3::X, -3);
        for p in [Vec3::ZERO, Vec3::new(2.0, -1.5, 3.0)] {
            let h: Vec4 = p.extend(1.0);
            let cell = Vec3::from(volume.cell_from_world.map(|row| row.dot(h)));
            assert!((cell - grid.cell_from_world(p)).length() < 1e-5);
            let origin = Vec3::new(2.0, 5.0, -1.0);
            let h = (p - origin).extend(1.0);
            let cell = Vec3::from(cell_from_world(&grid, origin).map(|row| row.dot(h)));
            assert!((cell - grid.cell_from_world(p)).length() < 1e-5);
        }
        assert_eq!((volume.texels, volume.scale), (12, 0.125));
    }
}
