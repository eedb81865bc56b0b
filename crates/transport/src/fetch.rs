//! Fetches files over HTTP, for clients.

use std::time::Duration;

use url::Url;

use crate::{Error, Result, tls};

/// Longest time for connecting and for each part of an answer.
const PATIENCE: Duration = Duration::from_secs(10);

/// A client that fetches files and reuses its connections.
#[derive(Clone, Debug)]
pub struct Fetch(reqwest::Client);

impl Fetch {
    /// A new client.
    ///
    /// # Errors
    /// The system's certificates cannot be read.
    pub fn new() -> Result<Self> {
        tls::install_provider();
        let client = reqwest::Client::builder()
            .connect_timeout(PATIENCE)
            .read_timeout(PATIENCE)
            .build()
            .map_err(|error| Error::Setup(describe(&error)))?;
        Ok(Self(client))
    }

    /// Requests the file at an address.
    ///
    /// # Errors
    /// The server cannot be reached, or answers with an error status.
    pub async fn get(&self, url: &Url) -> Result<Fetched> {
        let sent = self.0.get(url.clone()).send().await;
        let answer = sent.and_then(reqwest::Response::error_for_status);
        answer.map(Fetched).map_err(|error| failed(url, &error))
    }
}

/// A file that is being received.
#[derive(Debug)]
pub struct Fetched(reqwest::Response);

impl Fetched {
    /// Waits for the next part; `None` at the end of the file.
    ///
    /// # Errors
    /// The connection is lost, or silent for ten seconds.
    pub async fn next(&mut self) -> Result<Option<bytes::Bytes>> {
        let url = self.0.url().clone();
        self.0.chunk().await.map_err(|error| failed(&url, &error))
    }

    /// Receives the rest of the file.
    ///
    /// # Errors
    /// Those of [`Fetched::next`], and a file of more than `limit` bytes.
    pub async fn all(mut self, limit: usize) -> Result<Vec<u8>> {
        let mut all = Vec::new();
        while let Some(part) = self.next().await? {
            if all.len() + part.len() > limit {
                let url = self.0.url().to_string();
                return Err(Error::Fetch { url, reason: format!("more than {limit} bytes") });
            }
            all.extend_from_slice(&part);
        }
        Ok(all)
    }
}

fn failed(url: &Url, error: &reqwest::Error) -> Error {
    Error::Fetch { url: url.to_string(), reason: describe(error) }
}

/// The cause of an error; the library's own text says only that something failed.
fn describe(error: &reqwest::Error) -> String {
    if let Some(status) = error.status() {
        return status.to_string();
    }
    let mut error: &dyn std::error::Error = error;
    while let Some(cause) = error.source() {
        error = cause;
    }
    error.to_string()
}
