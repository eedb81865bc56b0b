//! How a picture is drawn.

use glam::UVec2;
use lumencast_gpu::Abilities;
pub use lumencast_shaders::Shading;

/// Which light is drawn. Direct, indirect and emission add up to the whole picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Lighting {
    /// Emissive surfaces, unlit ones and the environment, as the camera sees them.
    pub emission: bool,
    /// Light of punctual lights, scattered once.
    pub direct: bool,
    /// Light of the field.
    pub indirect: bool,
}

impl Lighting {
    /// All light.
    pub const FIELD: Self = Self { emission: true, direct: true, indirect: true };
    /// What a client draws by itself (`Parts::Direct` of the reference).
    pub const DIRECT: Self = Self { indirect: false, ..Self::FIELD };
    /// What the field brings (`Parts::Indirect` of the reference).
    pub const INDIRECT: Self = Self { emission: false, direct: false, indirect: true };
    /// What shines by itself.
    pub const NONE: Self = Self { direct: false, ..Self::DIRECT };
}

/// How strong indirect light is drawn: 1 is as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strengths {
    /// On what neither moves nor deforms.
    pub still: f32,
    /// On all else.
    pub moving: f32,
}

impl Default for Strengths {
    fn default() -> Self {
        Self { still: 1.0, moving: 1.0 }
    }
}

/// What surfaces that have lumels show, and pages of lumels: the light, or what one looks into it by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LumelLook {
    /// The light.
    #[default]
    Light,
    /// The lumels themselves, as a checkerboard: in place of all light, whatever its exposure.
    Lumels,
    /// How long ago the light of lumels came ([`Renderer::set_lumel_ages`](crate::Renderer::set_lumel_ages)),
    /// likewise: green up to 0.1 s, by yellow at 1 s to red from 10 s on; black where none has come.
    Age,
}

/// Which materials to believe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Materials {
    /// As glTF describes them.
    #[default]
    Full,
    /// Every surface an opaque two-sided Lambert one with its base colour, without normal maps
    /// and occlusion, emitting from its front only: for comparisons with other renderers.
    Lambert,
}

/// How surfaces that cover in part are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Transparency {
    /// They cover as large a part of a pixel's samples, chosen at random. Right on average in any
    /// order, as far as there are samples: with one a pixel it is noise.
    #[default]
    Coverage,
    /// They are mixed with what was drawn before, the farthest instance first: smooth, but wrong
    /// where instances interpenetrate.
    Sorted,
}

/// How shadows are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shadows {
    /// Texels along the side of a shadow map; fewer where all of them would take more than
    /// `memory`. 0 draws no shadows.
    pub resolution: u32,
    /// Bytes for all maps.
    pub memory: u64,
    /// Maps of a directional light, for nearer and farther parts of the view, 1 to 4.
    pub cascades: u32,
    /// Whether cascades keep their size while the camera turns, so that edges do not shimmer; else
    /// they fit the view, which is up to twice as sharp.
    pub steady: bool,
    /// Samples of a shadow's edge (percentage-closer filtering).
    pub filter_samples: u32,
    /// Samples of the search for what casts it, which tells how wide the edge of a light with a size
    /// is (percentage-closer soft shadows); 0 gives every light sharp edges.
    pub search_samples: u32,
    /// How far edges are softened at least, texels.
    pub filter_radius: f32,
}

impl Default for Shadows {
    fn default() -> Self {
        Self {
            resolution: 2048,
            memory: 512 << 20,
            cascades: 4,
            steady: false,
            filter_samples: 16,
            search_samples: 16,
            filter_radius: 1.0,
        }
    }
}

/// Ambient occlusion of short range, from the depth of the picture: what hides indirect light at a
/// distance for which probes are too sparse. Blended surfaces neither hide nor lose any, and what the
/// picture does not show hides nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Occlusion {
    /// How far light is hidden, metres; at half of it three quarters as much as next to a surface.
    pub radius: f32,
    /// Slices of space through a pixel; 16 pixels beside each other take different ones, and are
    /// averaged. Cost grows with `directions * steps`, and noise falls.
    pub directions: u32,
    /// Samples to either side of a slice. Thin things far from a point may lie between them.
    pub steps: u32,
}

impl Default for Occlusion {
    fn default() -> Self {
        Self { radius: 0.25, directions: 2, steps: 6 }
    }
}

/// How pictures are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Pixels in width and height.
    pub size: UVec2,
    /// Samples a pixel. As many as the adapter multisamples at once, 1, 2, 4 or 8, cost one frame;
    /// for more, frames are averaged whose pixels lie between each other.
    pub samples: u32,
    /// How often surfaces are shaded.
    pub shading: Shading,
    /// Which light.
    pub lighting: Lighting,
    /// How strong indirect light is.
    pub strengths: Strengths,
    /// What is shown at lumels.
    pub look: LumelLook,
    /// Whether the pages of lumels are shown flat before the picture, as bright as white surfaces that
    /// they lit.
    pub pages: bool,
    /// Which materials.
    pub materials: Materials,
    /// Shadows of punctual lights.
    pub shadows: Shadows,
    /// Ambient occlusion of indirect light, none by default.
    pub occlusion: Option<Occlusion>,
    /// Blended surfaces.
    pub transparency: Transparency,
    /// Multiplies all light before it is stored in half floats; pictures come back divided by it.
    /// Best where it makes the brightest that matters about 1.
    pub pre_exposure: f32,
    /// Texels across a pixel that textures are averaged over where surfaces are seen at an angle; 1
    /// for none.
    pub anisotropy: u16,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            size: UVec2::new(1280, 720),
            samples: 4,
            shading: Shading::Pixels,
            lighting: Lighting::FIELD,
            strengths: Strengths::default(),
            look: LumelLook::Light,
            pages: false,
            materials: Materials::Full,
            shadows: Shadows::default(),
            occlusion: None,
            transparency: Transparency::Coverage,
            pre_exposure: 1.0,
            anisotropy: 8,
        }
    }
}

impl Settings {
    /// What pictures by these settings have to do without on an adapter of these abilities, for
    /// people.
    pub fn missing(&self, abilities: Abilities) -> Vec<&'static str> {
        let mut missing = Vec::new();
        let shades_samples = self.shading == Shading::Samples && self.samples > 1;
        if shades_samples && !abilities.sample_shading {
            missing.push(
                "the adapter cannot shade single samples of a pixel: pictures are averaged over \
                 frames of one sample, windows are shaded once a pixel",
            );
        }
        if !abilities.clock {
            missing.push("the adapter has no clock: passes are not timed");
        }
        missing
    }

    /// The occlusion, where there is anything for it to hide.
    pub(crate) fn drawn_occlusion(&self) -> Option<Occlusion> {
        let is_drawn = |radius: f32| self.lighting.indirect && radius > 0.0 && radius.is_finite();
        self.occlusion.filter(|occlusion| is_drawn(occlusion.radius))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_said_where_it_is_asked_for() {
        let all = Abilities { samples: 4, sample_shading: true, clock: true };
        let samples = Settings { samples: 8, shading: Shading::Samples, ..Settings::default() };
        assert!(samples.missing(all).is_empty());
        let none = Abilities { samples: 1, sample_shading: false, clock: false };
        assert_eq!(samples.missing(none).len(), 2);
        let pixels = Settings { shading: Shading::Pixels, ..samples };
        assert!(pixels.missing(none)[0].contains("clock"));
    }
}
