//! What fields name by hash, from the server's HTTP address into the cache.

use std::collections::HashSet;
use std::sync::Arc;
use std::time::Duration;

use lumencast_codec::{ResourceHash, limits};
use lumencast_transport::Fetch;

use crate::download::beside;
use crate::error::ClientError;
use crate::session::Shared;

/// From one try to the next, where a resource cannot be had.
const AGAIN: Duration = Duration::from_secs(1);

/// Fetches what is wanted, for as long as it is asked to.
pub(crate) async fn read_resources(url: String, shared: Arc<Shared>) {
    let mut news = shared.subscribe();
    let mut failed: HashSet<ResourceHash> = HashSet::new();
    loop {
        let wanted = shared.wanted_resources();
        let Some(hash) = wanted.iter().copied().find(|hash| !failed.contains(hash)) else {
            failed.retain(|hash| wanted.contains(hash));
            if failed.is_empty() {
                if news.changed().await.is_err() {
                    return;
                }
            } else {
                tokio::time::sleep(AGAIN).await;
                failed.clear();
            }
            continue;
        };
        match fetch(&url, hash).await {
            Ok(bytes) => shared.add_resource(&bytes),
            Err(error) => {
                tracing::debug!(%hash, %error, "a resource cannot be had");
                failed.insert(hash);
            }
        }
    }
}

async fn fetch(url: &str, hash: ResourceHash) -> Result<Vec<u8>, ClientError> {
    let failed = |reason: String| ClientError::Download { url: url.to_owned(), reason };
    let address =
        beside(url, &format!("resources/{hash}")).map_err(|error| failed(error.to_string()))?;
    Ok(Fetch::new()?.get(&address).await?.all(limits::RESOURCE_BYTES).await?)
}
