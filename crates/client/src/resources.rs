//! What fields name by hash, from the server's HTTP address.

use lumencast_codec::{ResourceHash, limits};
use lumencast_transport::Fetch;

use crate::download::beside;
use crate::error::ClientError;

/// The bytes that a server has under a hash; whether they are those that it names is not looked at.
///
/// # Errors
/// A server that cannot be reached, or has none.
pub(crate) async fn fetch(url: &str, hash: ResourceHash) -> Result<Vec<u8>, ClientError> {
    let failed = |reason: String| ClientError::Download { url: url.to_owned(), reason };
    let address =
        beside(url, &format!("resources/{hash}")).map_err(|error| failed(error.to_string()))?;
    Ok(Fetch::new()?.get(&address).await?.all(limits::RESOURCE_BYTES).await?)
}
