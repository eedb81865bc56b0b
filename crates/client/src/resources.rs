//! What fields name by hash, from the server's HTTP address.

use lumencast_codec::{ResourceHash, limits};
use lumencast_transport::Fetch;

use crate::download::beside;
use crate::error::ClientError;

/// The bytes that a server has under a hash.
///
/// # Errors
/// A server that cannot be reached, or has none, or others than those that the hash names.
pub(crate) async fn fetch(url: &str, hash: ResourceHash) -> Result<Vec<u8>, ClientError> {
    let failed = |reason: String| ClientError::Download { url: url.to_owned(), reason };
    let address =
        beside(url, &format!("resources/{hash}")).map_err(|error| failed(error.to_string()))?;
    let bytes = Fetch::new()?.get(&address).await?.all(limits::RESOURCE_BYTES).await?;
    let other = ResourceHash::of(&bytes);
    if other != hash {
        return Err(failed(format!("the server gave {other} for {hash}")));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};
    use std::net::TcpListener;

    #[tokio::test]
    async fn what_has_another_hash_is_an_error() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("http://{}/scene", listener.local_addr().unwrap());
        // Answers twice, with the same bytes.
        let server = std::thread::spawn(move || {
            for stream in listener.incoming().take(2) {
                let mut stream = stream.unwrap();
                let _ = stream.read(&mut [0; 4096]).unwrap();
                let head = "HTTP/1.1 200 OK\r\ncontent-length: 3\r\nconnection: close\r\n\r\n";
                write!(stream, "{head}one").unwrap();
            }
        });
        assert_eq!(fetch(&url, ResourceHash::of(b"one")).await.unwrap(), b"one");
        let other = fetch(&url, ResourceHash::of(b"two")).await.unwrap_err();
        assert!(other.to_string().contains("the server gave"), "{other}");
        server.join().unwrap();
    }
}
