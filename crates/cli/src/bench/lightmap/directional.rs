//! How right the light of lumels is on the normals that surfaces are shaded by.

use std::f32::consts::TAU;

use glam::{Vec3, Vec3Swizzles};
use lumencast_gather::{Receiver, Shading, shading_normal};
use lumencast_light::{Lightmap, OnTriangle, Place, TILT};
use lumencast_scene::Snapshot;
use serde_json::{Value, json};

use super::coded::Coded;
use super::reference::Reference;
use crate::output::say;

/// An additive recurrence apart from that of places (Roberts 2018).
const STEPS: Vec3 = Vec3::new(0.819_172_5, 0.671_043_6, 0.549_700_5);

/// A place, and the normal that it is shaded by.
pub(super) struct Shaded {
    /// Which of the places it is.
    number: usize,
    place: Place,
    on: OnTriangle,
    shading: Vec3,
    by_map: bool,
}

impl Shaded {
    pub(super) fn receiver(&self) -> Receiver {
        let Place { position, normal, .. } = self.place;
        Receiver::point_shaded(position, normal, Shading::By(self.shading))
    }

    fn read(&self, lightmap: &Lightmap) -> Option<Vec3> {
        lightmap.irradiance_on(&self.on, self.place.normal, self.shading)
    }
}

/// Places with the normals that their materials shade them by, or normals tilted evenly by up to
/// [`TILT`]: always the same ones.
pub(super) fn shaded(scene: &Snapshot, places: &[Place]) -> Vec<Shaded> {
    let shaded = |(number, place): (usize, &Place)| {
        let on = place.on?;
        let by_map = shading_normal(scene, &on);
        let u = (STEPS * (number as f32 + 0.5)).fract().xy();
        let (right, up) = place.normal.any_orthonormal_pair();
        let cosine = 1.0 - u.x * (1.0 - TILT.cos());
        let (sin, cos) = (u.y * TAU).sin_cos();
        let sine = (1.0 - cosine * cosine).sqrt();
        let tilted = cosine * place.normal + sine * (cos * right + sin * up);
        let shading = by_map.unwrap_or(tilted.normalize());
        Some(Shaded { number, place: *place, on, shading, by_map: by_map.is_some() })
    };
    places.iter().enumerate().filter_map(shaded).collect()
}

/// Irradiance on normals of shading as one way of coding shows it.
struct AsCoded {
    coding: &'static str,
    qp: u8,
    /// Decibels without slopes, and with.
    db: [f64; 2],
    /// Bytes of a keyframe of irradiance, and of slopes.
    bytes: [usize; 2],
}

/// Irradiance on normals of shading, decibels.
pub(super) struct Directional {
    points: usize,
    by_map: usize,
    /// By irradiance on surfaces' own normals alone.
    flat: f64,
    /// With slopes.
    sloped: f64,
    /// Both where irradiance on surfaces' own normals is the path tracer's: what the normals alone take.
    alone: [f64; 2],
    /// As clients see it.
    coded: Vec<AsCoded>,
    noise: f64,
}

impl Directional {
    /// Judges what was computed, and what clients are sent, beside the path tracer's irradiance on the
    /// normals of shading. `own` has that on surfaces' own.
    pub(super) fn judge<'a>(
        computed: &Lightmap,
        coded: impl Iterator<Item = &'a Coded>,
        places: &[Shaded],
        [own, reference]: [&Reference; 2],
    ) -> Self {
        let both = |lightmap: &Lightmap| {
            let flat = lightmap.clone().with_slopes(false);
            [&flat, lightmap].map(|lightmap| reference.psnr(places, |place| place.read(lightmap)))
        };
        let [flat, sloped] = both(computed);
        let mut even = computed.clone();
        even.irradiance.fill(Vec3::ONE);
        let alone = [even.clone().with_slopes(false), even].map(|even| {
            reference.psnr(places, |place| Some(own.irradiance[place.number]? * place.read(&even)?))
        });
        Self {
            points: places.len(),
            by_map: places.iter().filter(|place| place.by_map).count(),
            flat,
            sloped,
            alone,
            coded: coded
                .map(|coded| AsCoded {
                    coding: coded.name(),
                    qp: coded.qp,
                    db: both(&coded.shown),
                    bytes: [coded.bytes, coded.slope_bytes],
                })
                .collect(),
            noise: reference.noise,
        }
    }

    pub(super) fn json(&self) -> Value {
        let Self { points, by_map, flat, sloped, alone, coded, noise } = self;
        let coded = coded.iter().map(|AsCoded { coding, qp, db, bytes }| {
            json!({
                "coding": coding, "qp": qp,
                "irradiance_db": { "flat": db[0], "sloped": db[1] },
                "keyframe_bytes": { "irradiance": bytes[0], "slopes": bytes[1] },
            })
        });
        json!({
            "points": points,
            "normal_mapped": by_map,
            "irradiance_db": { "flat": flat, "sloped": sloped },
            "normals_alone_db": { "flat": alone[0], "sloped": alone[1] },
            "coded": coded.collect::<Vec<_>>(),
            "reference_noise_db": noise,
        })
    }

    pub(super) fn say(&self) {
        say!(
            "on tilted normals, {} of {} by normal maps: {:.1} dB, without slopes {:.1} dB",
            self.by_map,
            self.points,
            self.sloped,
            self.flat
        );
        let [flat, sloped] = self.alone;
        say!("so where all but normals is right: {sloped:.1} dB, without slopes {flat:.1} dB");
        for AsCoded { coding, qp, db: [flat, sloped], bytes } in &self.coded {
            let [irradiance, slopes] = bytes.map(|bytes| bytes as f64 / 1e3);
            say!(
                "so coded: {sloped:.1} dB, without slopes {flat:.1} dB, by {coding}, qp {qp}, keyframe \
                 {irradiance:.1} KB, of slopes {slopes:.1} KB"
            );
        }
    }
}
