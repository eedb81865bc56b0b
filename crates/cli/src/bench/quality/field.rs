//! Fields of light, and pictures drawn under them.

use std::time::Instant;

use anyhow::Result;
use lumencast_light::Light;
use lumencast_scene::{View, VolumeSpec};
use lumencast_shade::{Lighting, Renderer, Settings};
use lumencast_solve::Effort;

use super::reference::Judge;
use super::report::{Errors, Row};
use super::{BenchQuality, Subject};
use crate::arguments::Reading;
use crate::bench::drawing::{cells, draw, sum};
use crate::light_source::Computed;

/// One of the second paper's updates takes so many samples a probe.
pub(super) const UPDATE: u32 = 512;

/// A field as it is measured.
pub(super) struct Field {
    name: String,
    light: Light,
    probes: usize,
    /// The time that an update of [`UPDATE`] samples a probe takes.
    update_seconds: f64,
}

impl BenchQuality {
    pub(super) fn field(
        &self,
        subject: &Subject<'_>,
        spec: VolumeSpec,
        bounces: u32,
        reading: Reading,
    ) -> Result<Field> {
        let (samples, clamp) = (self.probe_samples, self.clamp);
        let how = if reading.fit.is_some() { ", fitted" } else { "" };
        let tracing = self.picture.tracing();
        let effort = Effort::of_samples(samples);
        let computed = Computed { effort, bounces, clamp, reading, tracing };
        let mut gatherer = computed.gatherer()?;
        let start = Instant::now();
        let baked = computed.volumes(&subject.snapshot, &[spec], &mut *gatherer)?;
        let light = Light::new(baked.fields);
        let seconds = start.elapsed().as_secs_f64();
        Ok(Field {
            name: format!("{} L{} {bounces} bounces{how}", cells(&spec), u8::from(spec.order)),
            light,
            probes: spec.grid.probe_count(),
            update_seconds: seconds * f64::from(UPDATE) / f64::from(samples),
        })
    }
}

/// What pictures are drawn by.
pub(super) struct Canvas<'a> {
    pub(super) renderer: &'a mut Renderer,
    pub(super) view: View,
    pub(super) settings: Settings,
}

impl Canvas<'_> {
    /// The errors of direct light alone.
    pub(super) fn direct(&mut self, judge: &Judge) -> Result<Errors> {
        let direct = draw(self.renderer, self.view, &self.settings, Lighting::DIRECT)?;
        Ok(Errors::of(&judge.compare(&sum(&direct, &judge.reference.indirect))?))
    }

    /// The row of a picture under a field. Its indirect part is drawn first, so that the time of the
    /// whole picture holds nothing that only a first picture takes.
    pub(super) fn row(&mut self, field: &Field, judge: &Judge) -> Result<Row> {
        self.renderer.set_light(&field.light)?;
        let indirect = draw(self.renderer, self.view, &self.settings, Lighting::INDIRECT)?;
        let start = Instant::now();
        let whole = draw(self.renderer, self.view, &self.settings, Lighting::FIELD)?;
        let picture_seconds = start.elapsed().as_secs_f64();
        let indirect = judge.compare(&sum(&judge.reference.direct, &indirect))?;
        Ok(Row {
            indirect: Some(Errors::of(&indirect)),
            probes: Some(field.probes),
            ..Row::new(
                field.name.clone(),
                [field.update_seconds, picture_seconds],
                judge.compare(&whole)?,
                whole,
            )
        })
    }
}
