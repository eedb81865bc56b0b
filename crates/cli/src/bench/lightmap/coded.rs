//! What coding lumels as video costs and loses.

use std::time::Instant;

use anyhow::{Context, Result};
use lumencast_codec::{LightmapShape, LumelCoding, LumelDecoder, LumelEncoder, Qp, UpdateInfo};
use lumencast_light::{Lightmap, Told};
use serde_json::{Value, json};

/// Parameters that are tried.
const QPS: [u8; 5] = [9, 12, 15, 18, 24];

/// A lightmap as one way of coding shows it.
pub(super) struct Coded {
    pub(super) qp: u8,
    pub(super) stacked: bool,
    /// What clients see.
    pub(super) shown: Lightmap,
    /// Bytes of a keyframe of the irradiance of all pages.
    pub(super) bytes: usize,
    /// The same of slopes.
    pub(super) slope_bytes: usize,
    pub(super) encode_seconds: f64,
    pub(super) decode_seconds: f64,
}

/// The same, and how it looks beside the reference.
pub(super) struct Judged {
    pub(super) coded: Coded,
    pub(super) irradiance_db: f64,
    /// By how many codes of a display both sides of seams differ; none where there are no seams.
    pub(super) seam_codes: Option<f64>,
}

impl Coded {
    /// Every parameter, with colour at half the resolution and at full.
    pub(super) fn all(lightmap: &Lightmap) -> Result<Vec<Self>> {
        let qps = QPS.into_iter().filter_map(Qp::new);
        let codings = qps.flat_map(|qp| [LumelCoding::H264(qp), LumelCoding::H264Stacked(qp)]);
        let page_size = lightmap.layout.page_size;
        codings
            .filter(|coding| coding.check(page_size).is_ok())
            .map(|coding| Self::of(lightmap, coding))
            .collect()
    }

    fn of(lightmap: &Lightmap, coding: LumelCoding) -> Result<Self> {
        let (LumelCoding::H264(qp) | LumelCoding::H264Stacked(qp)) = coding else {
            anyhow::bail!("not a video coding")
        };
        let shape = LightmapShape::of(lightmap, coding.coding());
        let mut encoder = LumelEncoder::new(shape.clone(), coding);
        let (mut encode_seconds, mut decode_seconds) = (0.0, 0.0);
        let (mut bytes, mut slope_bytes) = (0, 0);
        let mut shown = lightmap.clone();
        // Pages take turns, so that the last has been coded after as many updates as there are pages.
        for update in 0..shape.tiles().count() as u64 {
            let start = Instant::now();
            let info = UpdateInfo { update, ..UpdateInfo::default() };
            let frames = encoder.encode(lightmap, info, |_| true)?;
            encode_seconds += start.elapsed().as_secs_f64();
            for frame in frames.iter().filter(|frame| frame.new_group) {
                let tile = shape.tile(frame.region).context("a page that there is not")?;
                match tile.told {
                    Told::Irradiance => bytes += frame.bytes.len(),
                    Told::Slopes => slope_bytes += frame.bytes.len(),
                }
                let start = Instant::now();
                let light = LumelDecoder::new(shape.coding, tile.size).decode(&frame.bytes)?;
                decode_seconds += start.elapsed().as_secs_f64();
                tile.put(light, &mut shown);
            }
        }
        let stacked = matches!(coding, LumelCoding::H264Stacked(_));
        Ok(Self {
            qp: qp.get(),
            stacked,
            shown,
            bytes,
            slope_bytes,
            encode_seconds,
            decode_seconds,
        })
    }

    /// Whether servers send it so unless told otherwise.
    pub(super) fn is_default(&self) -> bool {
        let default = Qp::for_pages(self.shown.layout.page_size).get();
        (self.qp, self.stacked) == (default, false)
    }

    pub(super) fn name(&self) -> &'static str {
        if self.stacked { "h264-stacked" } else { "h264" }
    }
}

impl Judged {
    pub(super) fn json(&self) -> Value {
        let Self { coded, irradiance_db, seam_codes } = self;
        json!({
            "coding": coded.name(),
            "qp": coded.qp,
            "irradiance_db": irradiance_db,
            "seam_codes_p99": seam_codes,
            "keyframe_bytes": coded.bytes,
            "slope_keyframe_bytes": coded.slope_bytes,
            "encode_ms": 1e3 * coded.encode_seconds,
            "decode_ms": 1e3 * coded.decode_seconds,
        })
    }
}
