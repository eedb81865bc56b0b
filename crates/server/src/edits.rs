//! Edits of clients: their broadcasts, read into the inbox.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use lumencast_codec::limits;
use lumencast_transport::{Announcement, Announcements, Error, ReadOptions, RemoteBroadcast};
use tokio::sync::Semaphore;
use tokio::task::JoinSet;

use crate::inbox::{Inbox, MAX_CLIENTS, Verdict};

/// Edits older than this are not worth waiting for when a newer group is there.
const MAX_AGE: Duration = Duration::from_secs(5);

/// Reads the edits of every client that announces some, until the server closes. `clock` is the
/// server's.
pub(crate) async fn collect(
    mut announcements: Announcements,
    inbox: Arc<Mutex<Inbox>>,
    clock: Instant,
) {
    let room = Arc::new(Semaphore::new(MAX_CLIENTS));
    let mut readers = JoinSet::new();
    loop {
        let announcement = tokio::select! {
            announcement = announcements.next() => announcement,
            Some(_) = readers.join_next() => continue,
        };
        let broadcast = match announcement {
            Some(Announcement::Appeared(broadcast)) => broadcast,
            // Its reader takes what is still on its way and then ends by itself.
            Some(Announcement::Gone(_)) => continue,
            None => return,
        };
        let Some(client) = client_name(broadcast.path()) else {
            tracing::warn!(path = broadcast.path(), "edits under a name that is none");
            continue;
        };
        let Ok(permit) = room.clone().try_acquire_owned() else {
            tracing::warn!(%client, "too many clients publish edits");
            continue;
        };
        let inbox = inbox.clone();
        readers.spawn(async move {
            read(&client, &broadcast, &inbox, clock).await;
            drop(permit);
        });
    }
}

/// Reads one client's edits until its broadcast ends or it is cut off.
async fn read(client: &str, broadcast: &RemoteBroadcast, inbox: &Mutex<Inbox>, clock: Instant) {
    tracing::info!(client, "edits a scene");
    let options = ReadOptions::default().with_max_age(MAX_AGE).with_max_frame(limits::EDIT_BYTES);
    let mut track = broadcast.subscribe("edits", options);
    loop {
        let frame = match track.next().await {
            Ok(Some(frame)) => frame.bytes,
            Ok(None) => break,
            // Counted as rubbish.
            Err(Error::FrameTooLarge { .. }) => bytes::Bytes::new(),
            Err(error) => {
                tracing::info!(client, %error, "edits ended");
                break;
            }
        };
        let now = clock.elapsed().as_secs_f64();
        let verdict =
            inbox.lock().unwrap_or_else(PoisonError::into_inner).receive(client, &frame, now);
        if verdict == Verdict::CutOff {
            tracing::warn!(client, "cut off: too many frames that are no edits");
            break;
        }
    }
}

/// The client's name in `<scene>/edits/<client>`, if the path is of that form.
fn client_name(path: &str) -> Option<String> {
    let mut parts = path.split('/');
    let (Some(_), Some("edits"), Some(name), None) =
        (parts.next(), parts.next(), parts.next(), parts.next())
    else {
        return None;
    };
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    ((1..=64).contains(&name.len()) && name.chars().all(allowed)).then(|| name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names() {
        assert_eq!(client_name("sponza/edits/A-z_09").as_deref(), Some("A-z_09"));
        for wrong in [
            "",
            "sponza",
            "sponza/edits/",
            "sponza/edits/a b",
            "sponza/edits/ä",
            "sponza/edits/x/victim",
            "sponza/else/a",
            "a",
        ] {
            assert_eq!(client_name(wrong), None, "{wrong}");
        }
        assert_eq!(client_name(&format!("s/edits/{}", "x".repeat(65))), None);
    }
}
