//! `lumencast serve`: the server.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Args;
use lumencast_gather::path_trace::Levels;
use lumencast_server::{Server, ServerConfig};
use lumencast_transport::{Access, Key, Tls};
use serde_json::json;

use crate::arguments::{DEFAULT_PORT, GatherArguments, SceneArguments, TickArguments};
use crate::charting::Lumels;
use crate::{
    interrupt,
    output::{self, say, tell},
};

/// Loads a scene, computes its light continuously and casts it; serves the page that shows it.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast serve cornell
  lumencast serve sponza.glb --volume 10x6x7 --samples 16..128
  lumencast serve sponza.glb --environment sky:1000
  lumencast serve cornell --edits benches/minute.jsonl
  lumencast serve sponza.glb --listen 0.0.0.0:4443 --token-key key.jwk \\
      --tls-cert cert.pem --tls-key key.pem

Ctrl-C stops it; a second Ctrl-C stops it at once.")]
pub(crate) struct Serve {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    gather: GatherArguments,
    /// Address for HTTP and WebSocket (TCP) and WebTransport (UDP). Other than on loopback, edits
    /// need a token or --open.
    #[arg(long, value_name = "ADDRESS:PORT", help_heading = "Network",
          default_value_t = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), DEFAULT_PORT))]
    listen: SocketAddr,
    /// Lets everyone who reaches the server edit the scene.
    #[arg(long, conflicts_with = "token_key", help_heading = "Network")]
    open: bool,
    /// Lets those edit who have a token signed with this key; see `lumencast token`.
    #[arg(long, value_name = "FILE", help_heading = "Network")]
    token_key: Option<PathBuf>,
    /// Reading light and the scene's state needs a token too; the page's and the scene's files stay
    /// open to all who reach the server.
    #[arg(long, requires = "token_key", help_heading = "Network")]
    token_to_read: bool,
    /// Certificate chain (PEM); without it a development certificate is made.
    #[arg(long, value_name = "FILE", requires = "tls_key", help_heading = "Network")]
    tls_cert: Option<PathBuf>,
    /// Key of the certificate (PEM).
    #[arg(long, value_name = "FILE", requires = "tls_cert", help_heading = "Network")]
    tls_key: Option<PathBuf>,
    /// A name under which this server is reached, besides localhost and addresses; repeatable.
    #[arg(long, value_name = "NAME", help_heading = "Network")]
    allow_host: Vec<String>,
    /// An origin, as in https://host:port, whose pages may connect, besides the server's own; repeatable.
    #[arg(long, value_name = "ORIGIN", help_heading = "Network")]
    allow_origin: Vec<String>,
    /// Sessions open at once, at most; further ones are refused until one ends.
    #[arg(long, value_name = "N", default_value_t = 256, help_heading = "Network",
          value_parser = clap::value_parser!(u32).range(1..))]
    clients: u32,
    /// Names that one session may edit under at a time: a relay needs one for each of its editors.
    #[arg(long, value_name = "N", default_value_t = 4, help_heading = "Network",
          value_parser = clap::value_parser!(u32).range(1..))]
    names: u32,
    #[command(flatten)]
    tick: TickArguments,
    /// The page's files, in place of those compiled in.
    #[arg(long, value_name = "DIR", env = "LUMENCAST_PAGE")]
    page: Option<PathBuf>,
    /// Prints a line of JSON once it is ready, instead of words.
    #[arg(long)]
    json: bool,
}

impl Serve {
    pub(crate) fn run(self) -> Result<()> {
        let network = self.network()?;
        let mut scene = self.scene.source.open()?;
        let mut gatherer = self.gather.gatherer(Levels::Two)?;
        let options = self.tick.options(&mut scene, &self.scene, &self.gather, &mut *gatherer)?;
        let mut config = ServerConfig::new(network);
        let some = options.lightmap.as_ref().filter(|lumels| !lumels.layout.surfaces().is_empty());
        let lumels = some.map(Lumels::of);
        config.tick = options;
        config.page = self.page.clone();

        let runtime = tokio::runtime::Builder::new_multi_thread()
            // The network needs little; the processor is for the light.
            .worker_threads(2)
            .enable_all()
            .build()
            .context("cannot start the network threads")?;
        runtime.block_on(async {
            let server = Server::bind(scene, gatherer, config).await?;
            self.announce(&server, lumels);
            server.run(interrupt::first()).await?;
            Ok(())
        })
    }

    fn network(&self) -> Result<lumencast_transport::ServerConfig> {
        let mut network = lumencast_transport::ServerConfig::new(self.listen);
        network.access = match &self.token_key {
            Some(path) => Access::Token { key: Key::read(path)?, to_read: self.token_to_read },
            None if self.open => Access::Open,
            None if self.listen.ip().is_loopback() => Access::Loopback,
            None => bail!(
                "{} is not a loopback address: say who may edit, with --token-key FILE \
                 (see lumencast token) or with --open",
                self.listen
            ),
        };
        if let (Some(cert), Some(key)) = (&self.tls_cert, &self.tls_key) {
            network.tls = Tls::Files { cert: cert.clone(), key: key.clone() };
        }
        network.max_sessions = self.clients as usize;
        network.max_names = self.names as usize;
        network.allowed_hosts.clone_from(&self.allow_host);
        network.allowed_origins.clone_from(&self.allow_origin);
        Ok(network)
    }

    /// Says where the page is, and what lights it.
    fn announce(&self, server: &Server, lumels: Option<Lumels>) {
        let scheme = if self.tls_cert.is_some() { "https" } else { "http" };
        let address = server.local_addr();
        let host = match address.ip() {
            ip if ip.is_unspecified() => format!("THIS-MACHINE:{}", address.port()),
            _ => address.to_string(),
        };
        if self.tls_cert.is_none() && !address.ip().is_loopback() {
            let what =
                if self.open { "whoever is on the way may edit" } else { "tokens can be read" };
            tell!(
                "warning: plain HTTP beyond this machine: {what}, and browsers offer pages no \
                 WebTransport or WebGPU; give --tls-cert and --tls-key, or put a proxy with TLS in front"
            );
        }
        let page = format!("{scheme}://{host}/");
        let probes = server.tick().light().probe_count();
        if self.json {
            let ready = json!({
                "address": page, "scene": server.scene_name(), "port": address.port(),
                "epoch": server.tick().catalog().epoch, "probes": probes, "lumels": lumels,
            });
            output::json_line(&ready);
            return;
        }
        let pages = lumels.map_or(String::new(), |lumels| format!("; lumels on {lumels}"));
        say!("{}: {probes} probes at {} Hz{pages}", server.scene_name(), self.tick.rate);
        say!("{page}");
        if !lumencast_server::page_is_embedded() && self.page.is_none() {
            tell!("warning: compiled without its page; give --page DIR, or build web/viewer first");
        }
        say!("Ctrl-C stops the server.");
    }
}
