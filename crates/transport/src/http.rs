//! The TCP side of the server: WebSocket sessions, the certificate's fingerprint, and whatever the
//! application serves; all behind the check of hosts and origins.

use std::sync::Arc;

use axum::Router;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::any;
use tower::ServiceExt as _;

use crate::access::Sessions;
use crate::origin_check::OriginCheck;
use crate::tls::Fingerprint;

/// Where the fingerprint of the development certificate is served, as the MoQ clients expect it.
const FINGERPRINT: &str = "/certificate.sha256";

#[derive(Clone)]
struct Front {
    check: Arc<OriginCheck>,
    sessions: Sessions,
    fingerprint: Fingerprint,
    /// The relay's routes, of which only its WebSocket is used.
    relay: Router,
    application: Router,
}

/// The one router in front of the relay's and the application's. Every path is a route of its own
/// (not a fallback, which the relay's server would replace by its own page).
pub(crate) fn router(
    check: Arc<OriginCheck>,
    sessions: Sessions,
    fingerprint: Fingerprint,
    relay: Router,
    application: Router,
) -> Router {
    let front = Front { check, sessions, fingerprint, relay, application };
    Router::new().route("/", any(answer)).route("/{*path}", any(answer)).with_state(front)
}

async fn answer(State(front): State<Front>, mut request: Request) -> Response {
    if let Err(reason) = checked(&front.check, &request) {
        tracing::info!(path = request.uri().path(), %reason, "HTTP request refused");
        return (StatusCode::FORBIDDEN, format!("{reason}\n")).into_response();
    }
    if is_websocket(request.headers()) {
        if front.sessions.full() {
            let text = "too many sessions are open; try again later\n";
            return (StatusCode::SERVICE_UNAVAILABLE, text).into_response();
        }
        return front.relay.oneshot(request).await.into_response();
    }
    if request.uri().path() == FINGERPRINT {
        let fingerprint = front.fingerprint.read().map(|text| text.clone());
        return match fingerprint {
            Ok(Some(fingerprint)) => fingerprint.into_response(),
            _ => StatusCode::NOT_FOUND.into_response(),
        };
    }
    // The path matched a parameter of this router, which the application's must not find among its
    // own; there is nothing else in here for it.
    request.extensions_mut().clear();
    front.application.oneshot(request).await.into_response()
}

fn checked(check: &OriginCheck, request: &Request) -> Result<(), String> {
    let headers = request.headers();
    let host = match single(headers, header::HOST)? {
        Some(host) => Some(host),
        None => request.uri().authority().map(|authority| authority.as_str()),
    };
    let origin = single(headers, header::ORIGIN)?;
    check.check(host, origin).map_err(|refusal| refusal.to_string())?;
    // Browsers send no `Origin` with images, scripts and the like, but say that a page of another
    // site wants them. Following a link is no harm.
    let fetch = |name: &str| headers.get(name).map(|value| value.as_bytes());
    let cross_site = fetch("sec-fetch-site") == Some(b"cross-site");
    if origin.is_none() && cross_site && fetch("sec-fetch-mode") != Some(b"navigate") {
        return Err(crate::origin_check::Refusal::CrossSite.to_string());
    }
    Ok(())
}

/// The value of a header that may occur once.
fn single(headers: &HeaderMap, name: header::HeaderName) -> Result<Option<&str>, String> {
    let mut values = headers.get_all(&name).iter();
    let value = values.next().map(|value| value.to_str());
    match (value, values.next()) {
        (None, _) => Ok(None),
        (Some(Ok(value)), None) => Ok(Some(value)),
        _ => Err(format!("the header {name} is not one readable value")),
    }
}

fn is_websocket(headers: &HeaderMap) -> bool {
    let upgrade = headers.get(header::UPGRADE).and_then(|value| value.to_str().ok());
    upgrade.is_some_and(|value| value.eq_ignore_ascii_case("websocket"))
}
