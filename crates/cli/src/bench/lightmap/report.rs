//! What was measured of a scene's lumels, for people and for machines.

use serde_json::{Value, json};

use super::coded::Judged;
use super::directional::Directional;
#[cfg(feature = "gpu")]
use super::handover::Handover;
use super::live::Live;
use super::reference::Reference;
use crate::arguments::Materials;
use crate::charting::Lumels;
use crate::output::say;

/// What was measured of a scene's lumels.
pub(super) struct Report {
    pub(super) scene: String,
    pub(super) pages: Lumels,
    pub(super) surfaces: usize,
    /// How many of the surfaces are backs.
    pub(super) backs: usize,
    pub(super) lumels: usize,
    /// How many of the lumels lie within something.
    pub(super) buried: usize,
    /// Bytes of memory: what is known of lumels, and the light that is shown.
    pub(super) bytes: usize,
    /// Samples a lumel.
    pub(super) samples: u32,
    pub(super) bounces: u32,
    pub(super) materials: Materials,
    /// Irradiance as gathered and as filtered, decibels.
    pub(super) as_gathered: f64,
    pub(super) filtered: f64,
    /// What clients are sent, and its irradiance, decibels.
    pub(super) coded: Vec<Judged>,
    pub(super) seam_points: usize,
    /// By which share of their light both sides of seams differ in the 99th percentile.
    pub(super) seam: Option<f64>,
    /// Codes by which light from beyond charts changes points.
    pub(super) poison: f64,
    pub(super) directional: Option<Directional>,
    #[cfg(feature = "gpu")]
    pub(super) handover: Option<Handover>,
    pub(super) live: Option<Live>,
    pub(super) reference: Reference,
    /// Laying out, gathering, and filtering.
    pub(super) seconds: [f64; 3],
}

impl Report {
    /// Bytes a lumel that a chart covers.
    fn bytes_a_lumel(&self) -> f64 {
        self.bytes as f64 / self.lumels.max(1) as f64
    }

    /// Bytes a lumel, covered or not.
    fn bytes_a_lumel_of_pages(&self) -> f64 {
        self.bytes as f64 / f64::from(self.pages.pages * self.pages.page_size.pow(2)).max(1.0)
    }

    pub(super) fn json(&self) -> Value {
        let [layout, gather, filter] = self.seconds;
        let coded = self.coded.iter().map(Judged::json);
        #[cfg(feature = "gpu")]
        let handover = self.handover.as_ref().map(Handover::json);
        #[cfg(not(feature = "gpu"))]
        let handover = Value::Null;
        json!({
            "scene": self.scene,
            "pages": self.pages.pages,
            "page_size": self.pages.page_size,
            "texel": self.pages.texel,
            "largest_texel": self.pages.largest,
            "surfaces": self.surfaces,
            "backs": self.backs,
            "lumels": self.lumels,
            "buried": self.buried,
            "bytes_a_lumel": self.bytes_a_lumel(),
            "bytes_a_lumel_of_pages": self.bytes_a_lumel_of_pages(),
            "samples": self.samples,
            "bounces": self.bounces,
            "materials": self.materials.to_string(),
            "points": self.reference.judged(),
            "irradiance_db": { "gathered": self.as_gathered, "filtered": self.filtered },
            "coded": coded.collect::<Vec<_>>(),
            "seams": {
                "points": self.seam_points,
                "p99": self.seam,
            },
            "poison_codes": self.poison,
            "directional": self.directional.as_ref().map(Directional::json),
            "handover": handover,
            "live": self.live.as_ref().map(Live::json),
            "reference": { "noise_db": self.reference.noise, "samples": self.reference.samples },
            "seconds": { "layout": layout, "gather": gather, "filter": filter },
        })
    }

    pub(super) fn say(&self) {
        say!(
            "{}: {}, {} lumels ({} within something), {:.0} bytes each, {:.0} a lumel of the pages",
            self.scene,
            self.pages,
            self.lumels,
            self.buried,
            self.bytes_a_lumel(),
            self.bytes_a_lumel_of_pages()
        );
        say!(
            "irradiance: {:.1} dB, as gathered {:.1} dB, {} samples a lumel",
            self.filtered,
            self.as_gathered,
            self.samples
        );
        for Judged { coded, irradiance_db, seam_codes } in &self.coded {
            let seams =
                seam_codes.map_or(String::new(), |codes| format!(", seams {codes:.1} codes"));
            say!(
                "coded: {irradiance_db:.1} dB{seams} by {}, qp {}, keyframe {:.1} KB, {:.1} ms, decoded \
                 in {:.1} ms",
                coded.name(),
                coded.qp,
                coded.bytes as f64 / 1e3,
                1e3 * coded.encode_seconds,
                1e3 * coded.decode_seconds
            );
        }
        if let Some(seam) = self.seam {
            say!("seams: both sides differ by {:.2} % in the 99th percentile", 100.0 * seam);
        }
        say!("light from beyond charts changes points by {:.1} codes at most", self.poison);
        if let Some(directional) = &self.directional {
            directional.say();
        }
        #[cfg(feature = "gpu")]
        if let Some(handover) = &self.handover {
            handover.say();
        }
        if let Some(live) = &self.live {
            live.say();
        }
        say!(
            "reference: {} points, noise {:.1} dB after {} samples",
            self.reference.judged(),
            self.reference.noise,
            self.reference.samples
        );
        let [layout, gather, filter] = self.seconds;
        say!("seconds: layout {layout:.1}, light {gather:.1}, filter {filter:.1}");
    }
}
