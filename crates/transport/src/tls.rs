//! The server's certificate: from files, or generated for development.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Once, RwLock};
use std::time::Duration;

use moq_tokio::rustls::ServerConfig as RustlsConfig;
use moq_tokio::tls::{Identity, Listen, ReloadingServerConfig};
use tokio_rustls::TlsAcceptor;
use web_transport_moq::noq;

use crate::{Error, Result};

/// Source of the server's certificate.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub enum Tls {
    /// A certificate for development, generated at the start and renewed every week. Browsers
    /// accept it for WebTransport by its fingerprint, which is served at `/certificate.sha256`.
    /// HTTP and WebSocket stay unencrypted.
    #[default]
    SelfSigned,
    /// A certificate chain and its key, as PEM files; also for HTTPS and WebSocket. The files are
    /// read again when they change.
    Files {
        /// The chain, the server's own certificate first.
        cert: PathBuf,
        /// The key.
        key: PathBuf,
    },
}

/// Interval at which a development certificate is replaced. Browsers accept by fingerprint only
/// certificates that are valid for at most 14 days.
pub(crate) const RENEWAL: Duration = Duration::from_secs(7 * 24 * 3600);

/// Configuration of the QUIC endpoint's certificate.
pub(crate) struct Identified {
    config: Arc<RustlsConfig>,
    /// SHA-256 of a development certificate, in hexadecimal; `None` for one that clients trust by
    /// its chain.
    pub(crate) fingerprint: Option<String>,
    /// Watches the certificate's files while it exists.
    _reloading: Option<ReloadingServerConfig>,
}

/// The fingerprint that is served; it changes with the certificate.
pub(crate) type Fingerprint = Arc<RwLock<Option<String>>>;

/// Chooses the cryptography of the process, unless the program has chosen it.
pub(crate) fn install_provider() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // This fails only if the program has chosen first, which is fine.
        let _ = moq_tokio::rustls::crypto::aws_lc_rs::default_provider().install_default();
    });
}

impl Tls {
    /// The configuration for QUIC. It must be called inside a Tokio runtime.
    pub(crate) fn for_quic(&self) -> Result<Identified> {
        let alpn = vec![web_transport_moq::ALPN.as_bytes().to_vec()];
        match self {
            Self::SelfSigned => {
                let identity = Identity::generate(["localhost"]).map_err(tls_error)?;
                let fingerprint = Some(identity.fingerprint().to_owned());
                let mut listen = Listen::default();
                listen.identity = Some(identity);
                let config = listen.server_config(alpn).map_err(tls_error)?;
                Ok(Identified { config, fingerprint, _reloading: None })
            }
            Self::Files { cert, key } => {
                let reloading = reloading(cert, key, alpn)?;
                let config = reloading.config();
                Ok(Identified { config, fingerprint: None, _reloading: Some(reloading) })
            }
        }
    }

    /// The configuration of the TCP side: HTTPS with certificate files, otherwise `None` for plain
    /// HTTP. The second part watches the files while it exists.
    pub(crate) fn for_http(&self) -> Result<Option<(TlsAcceptor, ReloadingServerConfig)>> {
        let Self::Files { cert, key } = self else { return Ok(None) };
        let alpn = vec![b"h2".to_vec(), b"http/1.1".to_vec()];
        let reloading = reloading(cert, key, alpn)?;
        Ok(Some((TlsAcceptor::from(reloading.config()), reloading)))
    }
}

/// A configuration that is reloaded when its files change.
fn reloading(cert: &Path, key: &Path, alpn: Vec<Vec<u8>>) -> Result<ReloadingServerConfig> {
    let mut listen = Listen::default();
    listen.cert = vec![cert.to_owned()];
    listen.key = vec![key.to_owned()];
    listen.server_config_reloading(alpn).map_err(|err| {
        Error::Tls(format!("certificate {}, key {}: {err}", cert.display(), key.display()))
    })
}

/// A QUIC configuration that closes a silent connection after three seconds, so that both ends soon
/// know.
pub(crate) fn quic_config(identified: &Identified) -> Result<noq::ServerConfig> {
    let crypto = noq::crypto::rustls::QuicServerConfig::try_from(identified.config.clone())
        .map_err(tls_error)?;
    let mut transport = noq::TransportConfig::default();
    let idle = noq::IdleTimeout::try_from(crate::IDLE_TIMEOUT).map_err(tls_error)?;
    transport.max_idle_timeout(Some(idle));
    transport.keep_alive_interval(Some(crate::KEEP_ALIVE));
    let streams = noq::VarInt::from_u32(crate::session::MAX_STREAMS);
    transport.max_concurrent_bidi_streams(streams);
    transport.max_concurrent_uni_streams(streams);
    transport.receive_window(noq::VarInt::from_u32(RECEIVE_WINDOW));
    // BBR reacts to delay rather than loss; light is only useful while it is new.
    let congestion = noq::congestion::Bbr3Config::default();
    transport.congestion_controller_factory(Arc::new(congestion));
    let mut config = noq::ServerConfig::with_crypto(Arc::new(crypto));
    config.transport_config(Arc::new(transport));
    Ok(config)
}

/// Greatest number of unread bytes from a client, over all its streams.
const RECEIVE_WINDOW: u32 = 8 << 20;

fn tls_error(err: impl std::fmt::Display) -> Error {
    Error::Tls(err.to_string())
}
