//! HTTP answers: WebSocket sessions, the certificate's fingerprint, and the application. The check
//! of hosts and origins comes before all of them.

use std::sync::Arc;

use axum::Router;
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use tower::ServiceExt as _;

use crate::guests::Guests;
use crate::origin_check::{OriginCheck, Refusal};
use crate::peer::Peer;
use crate::progress::{Patience, Progress, under_way};
use crate::refusals::RefusalKind;
use crate::session::Backend;
use crate::tls::Fingerprint;
use crate::websocket;

/// Path at which the fingerprint of the development certificate is served, as MoQ clients expect.
const FINGERPRINT: &str = "/certificate.sha256";

/// The first handler of every request.
#[derive(Clone)]
pub(crate) struct Front {
    pub(crate) backend: Backend,
    pub(crate) fingerprint: Fingerprint,
    pub(crate) application: Router,
    /// TCP connections open for HTTP.
    pub(crate) connections: Arc<Guests>,
    /// Requests being answered.
    pub(crate) requests: Arc<Guests>,
    pub(crate) patience: Patience,
}

impl Front {
    /// Answers one request of a connection.
    pub(crate) async fn answer(
        self,
        request: Request,
        peer: Peer,
        progress: &Arc<Progress>,
    ) -> Response {
        let answering = progress.request();
        let Some(guest) = self.requests.enter(peer.remote.ip()) else {
            self.backend.sessions.refusals.count(RefusalKind::Requests);
            let again = [(header::RETRY_AFTER, "1")];
            let reason = "too many requests are under way; try again later\n";
            return (StatusCode::SERVICE_UNAVAILABLE, again, reason).into_response();
        };
        under_way(self.checked_answer(request, peer).await, answering, guest)
    }

    async fn checked_answer(self, request: Request, peer: Peer) -> Response {
        if let Err(refusal) = checked(&self.backend.check, &request) {
            let reason = refusal.to_string();
            self.backend.refuse(refusal.kind(), peer.remote, &reason);
            return (StatusCode::FORBIDDEN, format!("{reason}\n")).into_response();
        }
        if websocket::is_upgrade(request.headers()) {
            return websocket::upgrade(request, peer, self.backend).await;
        }
        // The origin has passed the check, so its pages may read the answer.
        let origin = request.headers().get(header::ORIGIN).cloned();
        let mut response = match request.uri().path() {
            FINGERPRINT => self.fingerprint(),
            _ => self.application.oneshot(request).await.into_response(),
        };
        if let Some(origin) = origin {
            let headers = response.headers_mut();
            headers.insert(header::ACCESS_CONTROL_ALLOW_ORIGIN, origin);
            headers.append(header::VARY, HeaderValue::from_static("origin"));
        }
        response
    }

    fn fingerprint(&self) -> Response {
        match self.fingerprint.read().map(|fingerprint| fingerprint.clone()) {
            Ok(Some(fingerprint)) => fingerprint.into_response(),
            _ => StatusCode::NOT_FOUND.into_response(),
        }
    }
}

fn checked(check: &OriginCheck, request: &Request) -> Result<(), Refusal> {
    let headers = request.headers();
    let host = match single(headers, header::HOST)? {
        Some(host) => Some(host),
        None => request.uri().authority().map(|authority| authority.as_str()),
    };
    let origin = single(headers, header::ORIGIN)?;
    check.check(host, origin)?;
    // Browsers send no `Origin` with requests for images or scripts. They mark those from pages of
    // other sites as cross-site. Following a link from another site is harmless.
    let fetch = |name: &str| headers.get(name).map(|value| value.as_bytes());
    let cross_site = fetch("sec-fetch-site") == Some(b"cross-site");
    if origin.is_none() && cross_site && fetch("sec-fetch-mode") != Some(b"navigate") {
        return Err(Refusal::CrossSite);
    }
    Ok(())
}

/// Value of a header that may occur at most once.
fn single(headers: &HeaderMap, name: header::HeaderName) -> Result<Option<&str>, Refusal> {
    let mut values = headers.get_all(&name).iter();
    let value = values.next().map(|value| value.to_str());
    match (value, values.next()) {
        (None, _) => Ok(None),
        (Some(Ok(value)), None) => Ok(Some(value)),
        _ => Err(Refusal::Unreadable(name)),
    }
}
