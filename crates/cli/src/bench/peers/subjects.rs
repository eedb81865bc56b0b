//! The scenes that the published implementation was measured on, and what it reached there.

use glam::{UVec2, UVec3};
use serde::Serialize;

use crate::bench::judge::Psnr;

/// A scene of the protocol.
#[derive(Debug)]
pub(in crate::bench) struct Subject {
    /// Its name on the command line, and that of its files.
    pub(super) name: &'static str,
    /// Its file within the folder of scenes.
    pub(in crate::bench) file: &'static str,
    /// Cells of the published grid, which spans the scene's bounds.
    pub(super) cells: UVec3,
    pub(super) published: Published,
    /// Where the published implementation's faults would be seen.
    pub(super) places: &'static [PlaceOfFault],
}

/// What the published implementation reaches, and three.js r187.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Published {
    pub(super) as_it_comes: Psnr,
    pub(super) best_settings: Psnr,
    pub(super) three: [Rival; 3],
}

/// What a way of three.js to compute indirect light reaches, by settings that suit it best.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Rival {
    pub(super) name: &'static str,
    /// The whole picture, and its indirect part alone beside the path tracer's.
    pub(super) whole: Psnr,
    pub(super) indirect: Psnr,
}

/// A part of the picture.
#[derive(Debug)]
pub(super) struct PlaceOfFault {
    /// What would be wrong there.
    pub(super) fault: &'static str,
    /// First pixel, and the one beyond the last.
    pub(super) from: UVec2,
    pub(super) to: UVec2,
}

pub(in crate::bench) const SUBJECTS: [Subject; 3] = [
    Subject {
        name: "cornell",
        file: "cornell/CornellBoxPoint.glb",
        cells: UVec3::splat(8),
        published: Published {
            as_it_comes: psnr(33.8, 35.1),
            best_settings: psnr(33.8, 35.1),
            three: [
                rival("VXGIVolume", psnr(29.9, 30.4), psnr(27.4, 28.0)),
                rival("LightProbeGrid", psnr(36.5, 38.9), psnr(34.5, 37.5)),
                rival("LightMapper", psnr(36.5, 38.9), psnr(34.3, 37.4)),
            ],
        },
        places: &[
            place("red on the tall box's front", [126, 80], [162, 150]),
            place("short box dark, for probes within it", [158, 122], [202, 164]),
            place("joint of the floor with the back wall", [112, 136], [120, 144]),
            place("joint of the back wall with the ceiling", [110, 34], [210, 44]),
        ],
    },
    Subject {
        name: "breakfast",
        file: "breakfast_room/BreakfastRoom.glb",
        cells: UVec3::new(8, 4, 8),
        published: Published {
            as_it_comes: psnr(16.5, 17.8),
            best_settings: psnr(20.7, 25.0),
            three: [
                rival("VXGIVolume", psnr(24.8, 27.3), psnr(22.7, 24.5)),
                rival("LightProbeGrid", psnr(24.1, 26.2), psnr(22.6, 23.2)),
                rival("LightMapper", psnr(22.3, 24.3), psnr(18.6, 19.4)),
            ],
        },
        places: &[
            place("bright strip along the left joint of walls", [42, 6], [48, 54]),
            place("bright strip along the right joint of walls", [260, 100], [270, 148]),
            place("bright strip along the back wall's foot", [60, 146], [100, 154]),
            place("daylight on the back wall", [52, 4], [108, 24]),
            place("daylight under the window", [274, 100], [316, 150]),
            place("glow lost in the corner", [28, 44], [44, 60]),
            place("lamp's shadow in the glow", [66, 84], [88, 92]),
        ],
    },
    Subject {
        name: "sponza",
        file: "sponza/Sponza.glb",
        cells: UVec3::new(10, 6, 7),
        published: Published {
            as_it_comes: psnr(21.5, 23.3),
            best_settings: psnr(21.8, 23.8),
            three: [
                rival("VXGIVolume", psnr(26.5, 28.6), psnr(26.7, 28.1)),
                rival("LightProbeGrid", psnr(24.1, 25.0), psnr(24.4, 24.9)),
                rival("LightMapper", psnr(22.6, 23.4), psnr(22.2, 22.7)),
            ],
        },
        places: &[
            place("red drape darkened", [62, 80], [98, 160]),
            place("green drape darkened", [226, 80], [260, 150]),
            place("blue banner darkened", [104, 32], [120, 64]),
            place("black on the left arch", [4, 4], [50, 60]),
            place("black on the right arch", [270, 4], [316, 60]),
            place("black on the left pillar", [2, 112], [48, 176]),
            place("black on the right pillar", [282, 112], [318, 176]),
            place("daylight on the far wall", [148, 82], [174, 112]),
        ],
    },
];

const fn psnr(sharp: f64, filtered: f64) -> Psnr {
    Psnr { sharp, filtered }
}

const fn rival(name: &'static str, whole: Psnr, indirect: Psnr) -> Rival {
    Rival { name, whole, indirect }
}

const fn place(fault: &'static str, from: [u32; 2], to: [u32; 2]) -> PlaceOfFault {
    PlaceOfFault { fault, from: UVec2::from_array(from), to: UVec2::from_array(to) }
}
