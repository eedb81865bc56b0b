//! `lumencast view`: a scene and its light in a window.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use clap::Args;
use glam::UVec2;
use lumencast_client::{SceneFiles, Session, SessionOptions};
use lumencast_gather::path_trace::Levels;
use lumencast_light::Light;
use lumencast_picture::ToneMap;
use lumencast_scene::{Edit, Scene};
use lumencast_server::{Server, ServerConfig};
use lumencast_shade::Settings;
use lumencast_window::{Controls, Live, Options, Still, World};
use tokio::runtime::Runtime;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

use crate::arguments::{Exposure, GatherArguments, SceneArguments, TickArguments, occlusion};
use crate::camera::{self, CameraArgument, parse_size};
use crate::light_source::{self, is_address};
use crate::values::{parse_occlusion, parse_positive};
use crate::{out_file, output, remote, warnings};

/// How long threads may take to end once the window is closed.
const GRACE: Duration = Duration::from_secs(2);

/// Shows a scene and its light in a window.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast view cornell                                  computes the light here, live
  lumencast view http://127.0.0.1:4443/sponza             a server's scene and light
  lumencast view sponza.glb --light sponza.light          saved light
  lumencast view sponza.glb --light http://10.0.0.2:4443/sponza   the scene from here
  lumencast view cornell --screenshot cornell.png         takes one picture and ends

Drag turns the camera, the right button moves it sideways, the wheel brings it nearer, WASD and QE
walk. What is drawn, exposure, tone map and cameras are in the panel (H hides it), with what the frame took
and how old the light is. P saves a picture in the current folder.")]
pub(crate) struct View {
    #[command(flatten)]
    scene: SceneArguments,
    /// The light: a file of `lumencast bake`, or the address of a server's scene. Computed here, live,
    /// where it is not given.
    #[arg(long, value_name = "FILE|URL")]
    light: Option<String>,
    /// A camera of the scene by name or number, or eye, target and vertical field of view in
    /// degrees; the scene's first camera unless given.
    #[arg(long, value_name = "NAME|INDEX|EYE,TARGET[,FOV]", allow_hyphen_values = true)]
    camera: Option<CameraArgument>,
    /// Width and height, pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    size: UVec2,
    /// Samples a pixel, 1, 2, 4 or 8, as far as the adapter has them at once.
    #[arg(long, value_name = "N", default_value_t = 4,
          value_parser = clap::value_parser!(u32).range(1..=8))]
    multisampling: u32,
    /// Factor on radiance: a number, or auto: what is seen comes to middle grey, without burning out.
    #[arg(long, value_name = "auto|NUMBER", default_value = "auto")]
    exposure: Exposure,
    /// Tone map: gamma, srgb, reinhard, filmic or neutral.
    #[arg(long, value_name = "NAME", default_value_t = ToneMap::Neutral)]
    tone_map: ToneMap,
    /// Takes ringing out of light by a Hann window that ends at this band. None unless given.
    #[arg(long, value_name = "BAND", value_parser = parse_positive)]
    window: Option<f32>,
    /// Takes away indirect light that is hidden within so many metres, which probes are too sparse
    /// for; 0 takes none. Also in the panel.
    #[arg(long, value_name = "METRES", default_value_t = 0.0, value_parser = parse_occlusion)]
    occlusion: f32,
    /// Saves a picture as soon as there is light, and ends; needs no display.
    #[arg(long, value_name = "FILE.png")]
    screenshot: Option<PathBuf>,
    #[command(flatten)]
    gather: GatherArguments,
    #[command(flatten)]
    tick: TickArguments,
}

impl View {
    pub(crate) fn run(self) -> Result<()> {
        if let Some(file) = &self.screenshot {
            let is_png = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
            ensure!(is_png, "{}: screenshots are written as .png", file.display());
            out_file::check(file)?;
        }
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()
            .context("cannot start the network threads")?;
        let mut server = None;
        let mut files = None;
        let shown = match &self.light {
            None if is_address(&self.scene.source.scene) => {
                self.of_server(&runtime, &self.scene.source.scene).map(|(world, downloaded)| {
                    files = Some(downloaded);
                    world
                })
            }
            None => self.here(&runtime).map(|(world, running)| {
                server = Some(running);
                world
            }),
            Some(url) if is_address(url) => self.under_a_servers_light(&runtime, url),
            Some(file) => self.saved(Path::new(file)),
        };
        let opened = shown.and_then(|world| {
            let options = self.options(&*world)?;
            match &self.screenshot {
                Some(file) => lumencast_window::shoot(world, &options, file)?,
                None => lumencast_window::open(world, options)?,
            }
            Ok(())
        });
        // Edits name files of the scene's as long as it is shown, and no longer.
        drop(files);
        let ended = server.map_or(Ok(()), |server| runtime.block_on(server.end()));
        runtime.shutdown_timeout(GRACE);
        opened.and(ended)
    }

    fn options(&self, world: &dyn World) -> Result<Options> {
        let view = match &self.camera {
            Some(camera) => Some(camera::among(world.views(), camera)?),
            None => None,
        };
        let settings = Settings {
            samples: self.multisampling,
            occlusion: occlusion(self.occlusion),
            ..Settings::default()
        };
        let controls = Controls {
            settings,
            offset: self.gather.reading.offset,
            window: self.window,
            tone_map: self.tone_map,
            exposure: lumencast_window::Exposure::new(self.exposure.0),
            panel: true,
        };
        Ok(Options { size: self.size, view, controls, screenshots: PathBuf::from(".") })
    }

    /// The scene, which the picture is not to be written over.
    fn scene(&self) -> Result<Scene> {
        self.edited_scene(&[])
    }

    fn edited_scene(&self, edits: &[Edit]) -> Result<Scene> {
        let scene = self.scene.source.open_edited(edits)?;
        let mut inputs = self.scene.source.files(&scene);
        let light = self.light.as_deref().filter(|light| !is_address(light));
        inputs.extend(light.map(PathBuf::from).into_iter().chain(self.tick.edits.clone()));
        out_file::check_apart(&self.screenshot, &inputs)?;
        Ok(scene)
    }

    /// A scene under a saved field.
    fn saved(&self, file: &Path) -> Result<Box<dyn World>> {
        let name = file.display().to_string();
        let light = light_source::light(&name)?;
        let scene = self.edited_scene(&light.edits)?;
        light.check_fits(&scene);
        Ok(Box::new(Still::new(scene, Light::new(light.fields), name)))
    }

    /// A scene from here under a server's light.
    fn under_a_servers_light(&self, runtime: &Runtime, url: &str) -> Result<Box<dyn World>> {
        let scene = self.scene()?;
        let session = runtime.block_on(connect(url))?;
        if let Some(catalog) = session.catalog() {
            light_source::check_fits(url, &catalog, &scene);
        }
        Ok(world(session, scene))
    }

    /// A server's scene, and the files downloaded for it.
    fn of_server(&self, runtime: &Runtime, url: &str) -> Result<(Box<dyn World>, SceneFiles)> {
        let session = runtime.block_on(connect(url))?;
        let files = remote::download(runtime, url)?;
        let scene = Scene::load(files.root())?;
        warnings::left_out(&scene);
        Ok((world(session, scene), files))
    }

    /// A scene whose light is computed here, by a server of its own.
    fn here(&self, runtime: &Runtime) -> Result<(Box<dyn World>, Running)> {
        let mut scene = self.scene()?;
        let spinner = output::spinner("Starting to compute its light".into());
        let replica = scene.pristine(0.0);
        let loopback = std::net::SocketAddr::from(([127, 0, 0, 1], 0));
        let mut config = ServerConfig::new(lumencast_transport::ServerConfig::new(loopback));
        let mut gatherer = self.gather.gatherer(Levels::Two)?;
        config.tick = self.tick.options(&mut scene, &self.scene, &self.gather, &mut *gatherer)?;
        let (address, running) = runtime.block_on(async {
            let server = Server::bind(scene, gatherer, config).await?;
            let address = format!("http://{}/{}", server.local_addr(), server.scene_name());
            let (stop, stopped) = oneshot::channel::<()>();
            let ended = tokio::spawn(server.run(async {
                // Either way the window is gone.
                let _ = stopped.await;
            }));
            anyhow::Ok((address, Running { stop, ended }))
        })?;
        let session = runtime.block_on(connect(&address));
        spinner.finish_and_clear();
        Ok((world(session?, replica), running))
    }
}

/// A server that computes the window's light.
struct Running {
    stop: oneshot::Sender<()>,
    ended: JoinHandle<Result<(), lumencast_server::ServerError>>,
}

impl Running {
    /// Ends the server.
    async fn end(self) -> Result<()> {
        // A server that has ended by itself hears nothing.
        let _ = self.stop.send(());
        self.ended.await.context("the server")??;
        Ok(())
    }
}

async fn connect(url: &str) -> Result<Session> {
    Ok(Session::connect(url, SessionOptions::default()).await?)
}

fn world(session: Session, scene: Scene) -> Box<dyn World> {
    Box::new(Live::new(session, scene))
}
