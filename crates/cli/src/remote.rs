//! A look at a running server: its catalog, its state, and each region's newest light.

use std::collections::BTreeMap;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use lumencast_codec::{Catalog, Field, ProbeDecoder, Region, RegionLight, StateFrame, limits};
use lumencast_light::ProbeVolume;
use lumencast_transport::{Client, ConnectOptions, ReadOptions};

/// How long a server may take to show its light.
const PATIENCE: Duration = Duration::from_secs(15);

/// How long the connection may take.
const CONNECTION: Duration = Duration::from_secs(5);

/// What there was to see.
pub(crate) struct Seen {
    pub(crate) catalog: Catalog,
    pub(crate) volumes: Vec<ProbeVolume>,
    pub(crate) state: Option<StateFrame>,
    /// Bytes of the frames read.
    pub(crate) bytes: u64,
}

/// Connects to the address of a scene and reads one update of every field.
pub(crate) fn look(url: &str) -> Result<Seen> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .context("cannot start the network threads")?;
    let seen = runtime.block_on(async {
        let mut options = ConnectOptions::default();
        options.timeout = CONNECTION;
        let client = Client::connect(url, options).await?;
        match tokio::time::timeout(PATIENCE, read(&client)).await {
            Ok(seen) => seen,
            Err(_) => bail!("{url}: connected, but no light came within {PATIENCE:?}"),
        }
    });
    runtime.shutdown_timeout(Duration::from_secs(1));
    seen
}

async fn read(client: &Client) -> Result<Seen> {
    let frame = first(client, "catalog").await?;
    let mut bytes = frame.len() as u64;
    let catalog = Catalog::decode(&frame).context("the catalog")?;
    let frame = first(client, "state").await?;
    bytes += frame.len() as u64;
    let state = StateFrame::decode(&frame).context("the state")?;

    let mut volumes: BTreeMap<u32, ProbeVolume> = BTreeMap::new();
    for field in &catalog.fields {
        let volume = field.dark();
        let volume = volumes.entry(field.id).or_insert(volume);
        for &region in &field.regions {
            let (light, size) = region_light(client, field, region).await?;
            bytes += size;
            let probes = region.probes(field.grid.resolution);
            for (probe, sh) in probes.zip(light.coefficients.chunks(field.order.coefficients())) {
                volume.probe_mut(probe).copy_from_slice(sh);
            }
        }
    }
    Ok(Seen { catalog, volumes: volumes.into_values().collect(), state: Some(state), bytes })
}

/// The first keyframe of a region: groups of layer 0 begin with one.
async fn region_light(
    client: &Client,
    field: &Field,
    region: Region,
) -> Result<(RegionLight, u64)> {
    let track = format!("f{}/r{}/l0", field.id, region.id);
    let frame = first(client, &track).await?;
    let light = ProbeDecoder::new(region.size, field.order).decode(&frame).context(track)?;
    Ok((light, frame.len() as u64))
}

/// The first frame of a track.
async fn first(client: &Client, track: &str) -> Result<bytes::Bytes> {
    let mut reader = client.subscribe(
        client.scene(),
        track,
        ReadOptions::default().with_max_frame(limits::FRAME_BYTES),
    );
    let frame = reader.next().await?;
    Ok(frame.with_context(|| format!("the server has no track {track}"))?.bytes)
}
