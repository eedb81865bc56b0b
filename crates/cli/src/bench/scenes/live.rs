//! A scene's light as a server casts it: some seconds after the server began, and after a light has moved.

use anyhow::Result;
use lumencast_codec::{LumelCoding, Qp};
use lumencast_gather::Gather;
use lumencast_light::Field;
use lumencast_picture::Picture;
use lumencast_scene::Edit;
use lumencast_server::TickOptions;
use lumencast_shade::{Renderer, Settings};
use lumencast_solve::GatherOptions;
use lumencast_solve::blend::BlendSettings;

use super::report::Beside;
use super::{BenchScenes, Subject, computed, draw_light};
use crate::arguments::Wanted;
use crate::bench::cast::{Cast, moved_light};
use crate::bench::judge::Judge;
use crate::bench::traced::BOUNCES;
use crate::output;

/// A scene that is cast, and what of it.
pub(super) struct Live<'a> {
    pub(super) bench: &'a BenchScenes,
    pub(super) subject: &'a Subject,
    pub(super) wanted: &'a Wanted,
    pub(super) settings: Settings,
}

impl Live<'_> {
    /// Pictures after so many seconds, and after as many once a light has moved, each behind that of
    /// light that has converged.
    pub(super) fn beside(
        &self,
        renderer: &mut Renderer,
        mut gatherer: Box<dyn Gather>,
        judge: &Judge,
        seconds: f64,
    ) -> Result<Vec<Beside>> {
        let Self { bench, subject, wanted, settings } = self;
        let served = bench.reading.served();
        let effort = bench.fields.effort(&bench.effort, bench.probe_samples);
        let mut converged = |subject: &Subject, renderer: &mut Renderer| {
            let light =
                computed(served, effort).light(&subject.snapshot, wanted, &mut *gatherer)?;
            draw_light(renderer, light.fields, subject.view, settings)
        };
        let still = converged(subject, renderer)?;
        let moved = match moved_light(&subject.scene) {
            None => None,
            Some(edit) => {
                let after = subject.edited(&edit)?;
                let picture = converged(&after, renderer)?;
                let judge = bench.judged(&after, renderer, settings, &picture)?.judge;
                Some((edit, picture, judge))
            }
        };
        let gather = served.gathered(BOUNCES - 1, f32::INFINITY, BlendSettings::default());
        let page_size = wanted.lightmap.as_ref().map_or(0, |laid_out| laid_out.layout.page_size);
        let options = TickOptions {
            gather: GatherOptions { directional: wanted.directional, ..gather },
            volumes: wanted.volumes.clone(),
            lightmap: wanted.lightmap.clone(),
            lumel_coding: LumelCoding::H264(Qp::for_pages(page_size)),
            ..TickOptions::default()
        };
        let bar = output::spinner(format!("Casting {}", subject.name));
        let mut cast = Cast::new(subject.again()?.scene, gatherer, options)?;
        let mut beside = Vec::new();
        let mut add = |what: String, picture: &Picture, judge: &Judge| -> Result<()> {
            beside.push(Beside { what, psnr: judge.psnr(picture)? });
            Ok(())
        };
        let mut part = |edits: &[Edit]| {
            cast.go_on(edits, seconds, |_, _| {});
            let fields: Vec<Field> = cast.tick.light().fields().to_vec();
            draw_light(renderer, fields, subject.view, settings)
        };
        let write = |what: &str, picture: &Picture| {
            bench.write(&subject.name, what, picture, settings.pre_exposure)
        };
        add("as served, converged".to_owned(), &still, judge)?;
        let live = part(&[])?;
        write("live", &live)?;
        add(format!("live, after {seconds} s"), &live, judge)?;
        if let Some((edit, converged, judge)) = moved {
            add("a light moved, converged".to_owned(), &converged, &judge)?;
            write("moved", &converged)?;
            let live = part(&[edit])?;
            write("live-moved", &live)?;
            add(format!("live, {seconds} s after it moved"), &live, &judge)?;
        }
        bar.finish_and_clear();
        Ok(beside)
    }
}
