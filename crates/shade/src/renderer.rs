//! The renderer: scene and light in, pictures out.

use std::mem;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use lumencast_gpu::Gpu;
use lumencast_light::{Light, LumelAges};
use lumencast_scene::{Snapshot, View};

use crate::ShadeError;
use crate::camera::{Camera, jitter};
use crate::charted::SurfaceLayouts;
use crate::draw::{Depths, Picture};
use crate::drawn::Drawn;
use crate::field::GpuField;
use crate::frame::Frame;
use crate::lights::GpuLights;
use crate::occlusion::Occluder;
use crate::pages::FlatPages;
use crate::passes::{Passes, Viewers};
use crate::pipelines::{Layouts, Pipelines, Variant};
use crate::scene::GpuScene;
use crate::screen::{Screen, Show};
use crate::settings::{Materials, Settings, Shading};
use crate::shadows::{ShadowPlan, Sight};
use crate::target::Target;
use crate::timing::{Commands, Timed};

/// Draws pictures of a scene under the light of a field.
///
/// ```no_run
/// use lumencast_light::Light;
/// use lumencast_scene::Scene;
/// use lumencast_shade::{Gpu, Renderer, Settings};
///
/// let mut scene = Scene::open("cornell")?;
/// let settings = Settings::default();
/// let mut renderer = Renderer::new(Gpu::new()?, &settings);
/// renderer.set_scene(&scene.snapshot());
/// renderer.set_light(&Light::default())?;
/// let view = scene.cameras()[0].view();
/// let pictures = renderer.pictures(&[view], &settings)?;
/// assert_eq!(pictures[0].len(), 1280 * 720);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Renderer {
    gpu: Gpu,
    layouts: Layouts,
    pipelines: Option<Pipelines>,
    target: Option<Target>,
    scene: GpuScene,
    shown: Option<Shown>,
    wanted: Option<Arc<Snapshot>>,
    lights: GpuLights,
    field: GpuField,
    occluder: Occluder,
    /// The shadow maps that are on the device.
    shadows: Option<ShadowPlan>,
}

/// What of a scene is on the device.
#[derive(Clone, Debug)]
struct Shown {
    snapshot: Arc<Snapshot>,
    materials: Materials,
    layouts: SurfaceLayouts,
}

impl Renderer {
    /// A renderer of an empty scene without light. Of the settings only what textures need counts.
    pub fn new(gpu: Gpu, settings: &Settings) -> Self {
        let (lights, field) = (GpuLights::new(&gpu), GpuField::new(&gpu));
        let scene = GpuScene::new(&gpu, settings.anisotropy);
        Self {
            layouts: Layouts::new(&gpu, &lights.layout, &field.layout, &scene.material_layout),
            scene,
            lights,
            field,
            occluder: Occluder::new(&gpu),
            gpu,
            pipelines: None,
            target: None,
            shown: None,
            wanted: None,
            shadows: None,
        }
    }

    /// What it draws with.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Draws this moment of a scene from now on. What it shares with the one before stays on the
    /// device.
    pub fn set_scene(&mut self, snapshot: &Arc<Snapshot>) {
        self.wanted = Some(snapshot.clone());
    }

    /// Takes indirect light from this field from now on, read where its volumes say.
    ///
    /// # Errors
    /// Where it does not fit the device's textures.
    pub fn set_light(&mut self, light: &Light) -> Result<(), ShadeError> {
        self.field.update(&self.gpu, light)
    }

    /// Takes it from now on that the light of lumels came so long ago, which
    /// [`LumelLook::Age`](crate::LumelLook::Age) shows. Fields that the light does not have are passed over.
    pub fn set_lumel_ages(&mut self, ages: Vec<LumelAges>) {
        self.field.set_lumel_ages(&self.gpu, ages);
    }

    /// One picture a view, all under the same light: radiance (cd/m²), row by row from the top left.
    /// What does not depend on the view, shadow maps and the field, is drawn once for all.
    ///
    /// # Errors
    /// Where the device fails or the size is none that it draws.
    pub fn pictures(
        &mut self,
        views: &[View],
        settings: &Settings,
    ) -> Result<Vec<Vec<Vec3>>, ShadeError> {
        self.pictures_with(views, settings).map(|(pictures, _)| pictures)
    }

    /// As [`Renderer::pictures`], with what it took.
    ///
    /// # Errors
    /// As [`Renderer::pictures`].
    pub fn pictures_with(
        &mut self,
        views: &[View],
        settings: &Settings,
    ) -> Result<(Vec<Vec<Vec3>>, Drawn), ShadeError> {
        self.gpu.check_size(settings.size)?;
        let one_by_one =
            settings.shading == Shading::Samples && !self.gpu.abilities().sample_shading;
        let wanted = if one_by_one { 1 } else { settings.samples.max(1) };
        let samples = self.gpu.samples_at_once(wanted);
        let frames = settings.samples.max(1).div_ceil(samples);
        let mut commands = Commands::new(&self.gpu);
        self.prepare(settings, samples, &mut commands);
        let pixels = settings.size.as_usizevec2().element_product();
        let mut pictures = vec![vec![Vec3::ZERO; pixels]; views.len()];
        let weight = 1.0 / (settings.pre_exposure * frames as f32);
        let mut drawn = Drawn { frames, samples, ..Drawn::default() };
        let Some(snapshot) = self.snapshot() else { return Ok((pictures, drawn)) };
        let camera = |view: &View, moved| {
            Camera::new(&view.relative_to(snapshot.origin), settings.size, moved)
        };
        // The plan is the same for all frames, so that its maps are drawn once.
        let still: Vec<Camera> = views.iter().map(|view| camera(view, Vec2::ZERO)).collect();
        let plan = self.shadow_plan(&snapshot, &still, settings);
        for number in 0..frames {
            // Samples of a pixel are spread over strata along both axes; frames move them within.
            let moved = jitter(number, frames) / samples as f32;
            let cameras: Vec<Camera> = views.iter().map(|view| camera(view, moved)).collect();
            let mut copies = Vec::with_capacity(views.len());
            let frame = Frame { snapshot: &snapshot, plan: &plan, settings, samples, number };
            self.frame(&mut commands, frame, &cameras, |gpu, commands, target| {
                copies.push(target.copy(gpu, commands));
            });
            let submitted = mem::replace(&mut commands, Commands::new(&self.gpu));
            let timed = Timed::submit(submitted, &self.gpu);
            for (picture, copy) in pictures.iter_mut().zip(copies) {
                copy.add_to(&self.gpu, picture, weight)?;
            }
            if let Some(timed) = timed {
                *drawn.time.get_or_insert_default() += timed.wait(&self.gpu)?;
            }
        }
        drawn.shadows(&plan);
        Ok((pictures, drawn))
    }

    /// Draws a view and shows it on a texture of the settings' size, without waiting for it. Of the
    /// samples, no more are drawn than the adapter multisamples at once. What the picture turned out
    /// to be, and what it took, [`Screen::measured`] tells later.
    ///
    /// # Errors
    /// Where the device has failed or the size is none that it draws.
    pub fn show(
        &mut self,
        view: &View,
        settings: &Settings,
        screen: &mut Screen,
        show: Show,
        onto: &wgpu::TextureView,
    ) -> Result<Drawn, ShadeError> {
        self.gpu.check_size(settings.size)?;
        self.gpu.check("showing a picture")?;
        let samples = self.gpu.samples_at_once(settings.samples.max(1));
        let mut commands = Commands::new(&self.gpu);
        self.prepare(settings, samples, &mut commands);
        let mut drawn = Drawn { frames: 1, samples, ..Drawn::default() };
        let Some(snapshot) = self.snapshot() else { return Ok(drawn) };
        let view = view.relative_to(snapshot.origin);
        let cameras = [Camera::new(&view, settings.size, Vec2::ZERO)];
        let plan = self.shadow_plan(&snapshot, &cameras, settings);
        drawn.shadows(&plan);

        let frame = Frame { snapshot: &snapshot, plan: &plan, settings, samples, number: 0 };
        // The picture is pre-exposed already.
        let shown = Show { exposure: show.exposure / settings.pre_exposure, ..show };
        let mut histogram = None;
        self.frame(&mut commands, frame, &cameras, |gpu, commands, target| {
            let picture = target.picture();
            screen.draw(gpu, commands, picture, shown, onto);
            histogram = screen.measure(gpu, commands, picture);
        });
        let timed = Timed::submit(commands, &self.gpu);
        if let Some(histogram) = histogram {
            screen.submitted(timed, histogram, settings.pre_exposure);
        }
        Ok(drawn)
    }

    fn snapshot(&self) -> Option<Arc<Snapshot>> {
        self.shown.as_ref().map(|shown| shown.snapshot.clone())
    }

    /// Makes ready what the settings ask for; `commands` bring the scene to its moment.
    fn prepare(&mut self, settings: &Settings, samples: u32, commands: &mut Commands) {
        let variant = Variant {
            samples,
            // A pixel of one sample is shaded once either way.
            shading: match samples > 1 && self.gpu.abilities().sample_shading {
                true => settings.shading,
                false => Shading::Pixels,
            },
            transparency: settings.transparency,
            occluded: settings.drawn_occlusion().is_some(),
        };
        if self.pipelines.as_ref().is_none_or(|p| p.variant != variant) {
            self.pipelines = Some(Pipelines::new(&self.gpu, &self.layouts, variant));
        }
        if self.target.as_ref().is_none_or(|target| !target.fits(settings.size, samples)) {
            self.target = Some(Target::new(&self.gpu, settings.size, samples));
        }
        if variant.occluded {
            self.occluder.prepare(&self.gpu, &self.layouts.pass, settings.size);
        }
        let Some(wanted) = &self.wanted else { return };
        self.field.place_about(&self.gpu, wanted.origin);
        let (materials, layouts) = (settings.materials, &self.field.layouts);
        let is_shown = |shown: &Shown| {
            Arc::ptr_eq(&shown.snapshot, wanted)
                && shown.materials == materials
                && shown.layouts.is(layouts)
        };
        if !self.shown.as_ref().is_some_and(is_shown) {
            self.scene.update(&self.gpu, commands, (wanted, layouts), materials);
            let (snapshot, layouts) = (wanted.clone(), layouts.clone());
            self.shown = Some(Shown { snapshot, materials, layouts });
            self.shadows = None;
        }
    }

    /// Draws one frame of each camera: shadow maps, then occlusion, surfaces, what lies behind them, and
    /// pages of lumels before all.
    /// `taken` is called after each camera's commands, before the next one's overwrite the picture.
    fn frame(
        &mut self,
        commands: &mut Commands,
        frame: Frame<'_>,
        cameras: &[Camera],
        mut taken: impl FnMut(&Gpu, &mut Commands, &Target),
    ) {
        let redraws = self.shadows.as_ref() != Some(frame.plan);
        let viewers = Viewers {
            shadows: if redraws { &frame.plan.views } else { &[] },
            cameras,
            transparency: frame.settings.transparency,
            turn: frame.turn(),
        };
        let passes = Passes::new(&self.gpu, &self.layouts.pass, &self.scene, &viewers);
        if redraws {
            self.draw_shadows(commands, &passes, frame.plan);
        }
        let light = self.lights.group(&self.gpu, &frame, &self.occluder);
        let occlusion = frame.settings.drawn_occlusion();
        let occlusion = occlusion.and_then(|settings| self.occluder.groups(&self.gpu, settings));
        let flat = || FlatPages::new(&self.gpu, &self.field.layouts, frame.settings.size);
        let pages = frame.settings.pages.then(flat);
        let (Some(target), Some(pipelines)) = (&self.target, &self.pipelines) else { return };
        let picture = Picture {
            scene: &self.scene,
            pipelines,
            light: &light,
            field: &self.field.group,
            background: frame.settings.lighting.emission,
            pages: pages.as_ref(),
        };
        for pass in passes.cameras() {
            if let Some(groups) = &occlusion {
                self.depths().of_pixels(commands, pass, self.occluder.depth());
                self.occluder.draw(commands, groups, |encoded| pass.bind(encoded));
            }
            picture.draw(commands, pass, target);
            taken(&self.gpu, commands, target);
        }
    }

    /// Draws all shadow maps anew.
    fn draw_shadows(&mut self, commands: &mut Commands, passes: &Passes, plan: &ShadowPlan) {
        let layers = self.lights.shadow_maps(&self.gpu, plan);
        for (pass, layer) in passes.shadows().zip(&layers) {
            self.depths().shadow_map(commands, pass, layer);
        }
        self.shadows = Some(plan.clone());
    }

    fn depths(&self) -> Depths<'_> {
        Depths { scene: &self.scene, layouts: &self.layouts }
    }

    fn shadow_plan(
        &self,
        snapshot: &Snapshot,
        cameras: &[Camera],
        settings: &Settings,
    ) -> ShadowPlan {
        let limits = self.gpu.device().limits();
        let mut shadows = settings.shadows;
        shadows.resolution = shadows.resolution.min(limits.max_texture_dimension_2d);
        if !settings.lighting.direct {
            shadows.resolution = 0;
        }
        let sight = Sight { cameras, bounds: &self.scene.bounds, settings: &shadows };
        ShadowPlan::new(&snapshot.lights, sight, limits.max_texture_array_layers)
    }
}
