//! A part of a scene's light, path-traced: what drawn pictures are compared with.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use glam::UVec2;
use lumencast_gather::path_trace::MaterialModel;
use lumencast_gather::reference::{self, Film, Parts, PictureSettings};
use lumencast_picture::Picture;
use lumencast_scene::{Scene, Snapshot, View};

use crate::film_file::{FilmFile, KeptFilm};
use crate::fingerprint;

/// The pictures' width and height, pixels.
pub(super) const SIZE: UVec2 = UVec2::new(320, 180);
/// Bounces of the reference; probes have one fewer.
pub(super) const BOUNCES: u32 = 4;
/// A reference begins with so many samples a pixel.
pub(super) const FIRST_SPP: u32 = 64;

/// What is traced.
pub(super) struct Subject<'a> {
    pub(super) scene: &'a Scene,
    pub(super) snapshot: &'a Arc<Snapshot>,
    pub(super) view: View,
    /// Where pictures are kept, to go on from.
    pub(super) keep: Option<&'a Path>,
}

/// A part of a reference, while it is refined.
pub(super) struct Traced {
    renderer: reference::Renderer,
    kept: KeptFilm,
}

impl Traced {
    pub(super) fn new(subject: &Subject<'_>, parts: Parts) -> Result<Self> {
        let settings = PictureSettings {
            size: SIZE,
            bounces: BOUNCES,
            parts,
            materials: MaterialModel::Lambert,
            ..PictureSettings::default()
        };
        let renderer = reference::Renderer::new(subject.snapshot, subject.view, settings)
            .context("cannot start the threads that trace")?;
        let file = match subject.keep {
            Some(folder) => {
                let key = fingerprint::of(subject.scene, format!("{BOUNCES} {parts:?}"))?;
                let file = format!("{}-{key:016x}.film", subject.scene.name());
                Some(FilmFile { path: folder.join(file), key })
            }
            None => None,
        };
        Ok(Self { renderer, kept: KeptFilm::begun(file, SIZE, FIRST_SPP) })
    }

    /// Refines it to so many samples a pixel.
    pub(super) fn to(&mut self, samples: u32) -> Result<()> {
        self.kept.refine(&self.renderer, samples, "Tracing the reference").map(drop)
    }

    pub(super) fn film(&self) -> &Film {
        &self.kept.film
    }

    pub(super) fn picture(&self) -> Result<Picture> {
        Ok(Picture::new(SIZE.x, SIZE.y, self.film().picture())?)
    }
}
