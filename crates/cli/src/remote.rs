//! A look at a running server: its catalog, its state, and each region's newest light.

use std::collections::BTreeMap;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use bytes::Bytes;
use lumencast_codec::{Catalog, Field, ProbeDecoder, Region, RegionLight, StateFrame, limits};
use lumencast_light::ProbeVolume;
use lumencast_transport::{Client, ConnectOptions, ReadOptions, TrackReader};

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

/// Connects to the address of a scene and reads one update of every field, not much older than the state: as
/// far as the server's last snapshot lies back, at most.
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
            let (light, size) = region_light(client, field, region, state.tick).await?;
            bytes += size;
            let probes = region.probes(field.grid.resolution);
            for (probe, sh) in probes.zip(light.coefficients.chunks(field.order.coefficients())) {
                volume.probe_mut(probe).copy_from_slice(sh);
            }
        }
    }
    Ok(Seen { catalog, volumes: volumes.into_values().collect(), state: Some(state), bytes })
}

/// A region's light, of this tick or a later one, and the bytes of the frames read. Groups of layer 0 begin
/// with a keyframe; but of a region that nobody has watched for a while, what comes first is what was seen
/// when somebody last did.
async fn region_light(
    client: &Client,
    field: &Field,
    region: Region,
    since: u64,
) -> Result<(RegionLight, u64)> {
    let track = format!("f{}/r{}/l0", field.id, region.id);
    let mut decoder = ProbeDecoder::new(region.size, field.order);
    let mut reader = subscribe(client, &track);
    let mut bytes = 0;
    loop {
        let frame = next(&mut reader, &track).await?;
        bytes += frame.len() as u64;
        let light = decoder.decode(&frame).with_context(|| track.clone())?;
        if light.header.info.tick >= since {
            return Ok((light, bytes));
        }
    }
}

/// The first frame of a track.
async fn first(client: &Client, track: &str) -> Result<Bytes> {
    next(&mut subscribe(client, track), track).await
}

fn subscribe(client: &Client, track: &str) -> TrackReader {
    let options = ReadOptions::default().with_max_frame(limits::FRAME_BYTES);
    client.subscribe(client.scene(), track, options)
}

async fn next(reader: &mut TrackReader, track: &str) -> Result<Bytes> {
    let frame = reader.next().await?;
    Ok(frame.with_context(|| format!("the server has no track {track}"))?.bytes)
}
