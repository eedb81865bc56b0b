//! What the server says over HTTP: the page, the scene's files, its health and its counters.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, PoisonError, RwLock};
use std::time::{Duration, Instant};

use axum::Router;
use axum::extract::{Path, State};
use axum::http::request::Parts;
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::map_response;
use axum::response::{IntoResponse, Response};
use axum::routing::get;

use crate::files::{FileSet, respond};
use crate::metrics::Metrics;
use crate::page;
use crate::resources::Resources;

/// A tick may end so much later than expected before the server calls itself ill.
const PATIENCE: Duration = Duration::from_secs(5);

/// Scripts, styles and connections from this server only; blobs because glTF loaders hand embedded
/// pictures on as such.
const CONTENT_SECURITY_POLICY: &str = "default-src 'self'; script-src 'self'; \
     style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; worker-src 'self' blob:; \
     connect-src 'self' data: blob:; object-src 'none'; base-uri 'none'; form-action 'none'; \
     frame-ancestors 'none'";

/// What the tick and the router share.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) metrics: Metrics,
    /// The page's files.
    pub(crate) page: FileSet,
    /// The scene's files; grows when an edit adds another glTF.
    pub(crate) scene_files: RwLock<FileSet>,
    /// What shapes of fields name, by hash.
    pub(crate) resources: RwLock<Resources>,
    /// Name of the scene and of its broadcast.
    pub(crate) scene: String,
    /// The scene's glTF file under `/scene/`.
    pub(crate) root: String,
    /// The number of the tick under way, or else of the last.
    pub(crate) tick: AtomicU64,
    /// When a tick ended last, and when the next should have.
    pub(crate) ticked: RwLock<Ticked>,
}

/// Whether ticks go on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ticked {
    last: Instant,
    expected: Instant,
}

impl Ticked {
    /// A tick ended at `now`; the next is expected to begin within a period and to take up to three
    /// times as long as this one, `seconds`.
    pub(crate) fn at(now: Instant, period: f64, seconds: f64) -> Self {
        Self { last: now, expected: now + Duration::from_secs_f64(period + 3.0 * seconds) }
    }

    /// What is wrong at `now`.
    fn fault(&self, now: Instant) -> Option<String> {
        let since = now.saturating_duration_since(self.last);
        let stalls = now > self.expected + PATIENCE;
        stalls.then(|| format!("the last tick ended {:.1} s ago", since.as_secs_f64()))
    }
}

/// The routes.
pub(crate) fn router(shared: Arc<Shared>) -> Router {
    Router::new()
        .route("/", get(index))
        .route("/lumencast.json", get(start))
        .route("/scene/{*name}", get(scene_file))
        .route("/resources/{hash}", get(resource))
        .route("/healthz", get(health))
        .route("/metrics", get(metrics))
        .route("/{*name}", get(page_file))
        .with_state(shared)
        .layer(map_response(secured))
}

/// What a client needs to know to begin.
async fn start(State(shared): State<Arc<Shared>>) -> impl IntoResponse {
    let files: Vec<String> = {
        let files = shared.scene_files.read().unwrap_or_else(PoisonError::into_inner);
        files.names().map(str::to_owned).collect()
    };
    let start = serde_json::json!({
        "scene": shared.scene, "root": shared.root, "broadcast": shared.scene, "files": files,
        "tick": shared.tick.load(Ordering::Relaxed),
    });
    ([(header::CONTENT_TYPE, "application/json")], start.to_string())
}

async fn index(shared: State<Arc<Shared>>, asked: Parts) -> Response {
    page_file(shared, Path("index.html".into()), asked).await
}

async fn page_file(
    State(shared): State<Arc<Shared>>,
    Path(name): Path<String>,
    asked: Parts,
) -> Response {
    if name == "index.html" && !shared.page.contains(&name) {
        return axum::response::Html(page::MISSING).into_response();
    }
    let mut response = respond(&name, shared.page.get(&name).cloned(), &asked).await;
    // Vite puts a hash of the contents into the names of these.
    if name.starts_with("assets/") && response.status() == StatusCode::OK {
        let forever = HeaderValue::from_static("public, max-age=31536000, immutable");
        response.headers_mut().insert(header::CACHE_CONTROL, forever);
    }
    response
}

/// A scene's files have one name each; pages ask by what stands in the glTF.
async fn scene_file(
    State(shared): State<Arc<Shared>>,
    Path(name): Path<String>,
    asked: Parts,
) -> Response {
    let padded = name.trim_end_matches('\0');
    let Some(name) = lumencast_scene::file_name(padded) else {
        return respond("", None, &asked).await;
    };
    let contents = {
        let files = shared.scene_files.read().unwrap_or_else(PoisonError::into_inner);
        files.get(&name).cloned()
    };
    respond(&name, contents, &asked).await
}

/// Layouts and charts of lightmaps (docs/wire.md, "Resources"). What is in one never changes.
async fn resource(State(shared): State<Arc<Shared>>, Path(hash): Path<String>) -> Response {
    let resources = shared.resources.read().unwrap_or_else(PoisonError::into_inner);
    let bytes = hash.parse().ok().and_then(|hash| resources.get(hash));
    let Some(bytes) = bytes else { return StatusCode::NOT_FOUND.into_response() };
    let forever = "public, max-age=31536000, immutable";
    let head =
        [(header::CONTENT_TYPE, "application/octet-stream"), (header::CACHE_CONTROL, forever)];
    (head, bytes).into_response()
}

async fn health(State(shared): State<Arc<Shared>>) -> Response {
    let ticked = *shared.ticked.read().unwrap_or_else(PoisonError::into_inner);
    match ticked.fault(Instant::now()) {
        Some(fault) => (StatusCode::SERVICE_UNAVAILABLE, format!("{fault}\n")).into_response(),
        None => "ok\n".into_response(),
    }
}

async fn metrics(State(shared): State<Arc<Shared>>) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], shared.metrics.render())
}

/// Adds to every answer what tells browsers to be strict with it.
async fn secured(mut response: Response) -> Response {
    let headers = response.headers_mut();
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    headers.entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-cache"));
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_ticks_are_no_illness_but_none_are() {
        let now = Instant::now();
        let after = |seconds| now + Duration::from_secs_f64(seconds);
        let quick = Ticked::at(now, 0.04, 0.03);
        assert_eq!(quick.fault(after(5.0)), None);
        let fault = quick.fault(after(6.0)).expect("stalled");
        assert!(fault.contains("6.0 s ago"), "{fault}");
        // A tick every ten seconds, and ticks that take four.
        assert_eq!(Ticked::at(now, 10.0, 0.03).fault(after(14.0)), None);
        assert_eq!(Ticked::at(now, 0.04, 4.0).fault(after(16.0)), None);
        assert!(Ticked::at(now, 10.0, 4.0).fault(after(30.0)).is_some());
    }
}
