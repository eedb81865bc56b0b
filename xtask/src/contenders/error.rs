//! Squared error at equal time beside Mitsuba's: 320×180, 64 samples a pixel, all materials Lambert,
//! 4 bounces, box filter, the scene's first camera.
//!
//! In a round each renderer draws two pictures with seeds of their own, in turns. Time is without
//! loading: ours holds following the sun and all else but building, Mitsuba's (independent sampler,
//! passes of 8 samples) the writing of its small files. Squared error times seconds, ours over
//! Mitsuba's, is the error at equal time, since both errors fall as one over time.
//!
//! The error is told in two ways:
//! - Against a picture that Mitsuba converged: of two independent halves A and B of its samples, the
//!   error of P is the mean of (P−A)(P−B) = ((P−A)² + (P−B)² − (A−B)²) / 2. The noise of A and B is
//!   not in its expectation; it is P's variance and the square of what the renderers disagree in.
//! - Half the squared difference of the renderer's own two pictures: its variance alone.
//!
//! Both are of linear values times one exposure, 1 over the 99th percentile of the converged picture's
//! luminance, and of what is displayed: those, clamped to 0 to 1, to the power of 1/2.2.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::{Value, json};

use super::{Effort, Measured, Subject, listed, median, number};
use crate::figures::json_of;
use crate::oracles::Mitsuba;
use crate::run::{command, target_dir};

const WIDTH: &str = "320";
const HEIGHT: &str = "180";
/// Surface scattering events on a path.
const BOUNCES: &str = "4";
/// Seeds of the halves of the converged picture. What is measured has those that follow.
const HALVES: [u32; 2] = [1, 2];

pub(super) fn measure(
    program: &Path,
    mitsuba: &Mitsuba,
    subjects: &[Subject],
    effort: &Effort,
) -> Result<Measured> {
    let folder = target_dir().join("contenders");
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let mut figures = Vec::new();
    let mut table = TABLE.to_owned();
    for subject in subjects {
        let bench = Bench { program, mitsuba, subject, effort, folder: &folder };
        let converged = bench.converge()?;
        println!("\n── error at equal time beside Mitsuba: {}", subject.name);
        let rounds = (0..effort.rounds)
            .map(|round| bench.round(round, &converged))
            .collect::<Result<Vec<_>>>()?;
        figures.push(bench.figures(&rounds, &converged, &mut table)?);
    }
    Ok(Measured { figures: figures.into(), table })
}

const TABLE: &str = "\n\
    Squared error beside Mitsuba's, below 1 ours is smaller; speed, above 1 ours is faster. At equal \
    samples, at equal time, and at equal time of the picture as displayed; medians, with the rounds \
    at equal time:\n\n\
    | scene | measured | speed | equal samples | equal time | as displayed | rounds |\n\
    | --- | --- | --- | --- | --- | --- | --- |\n";

/// Squared error of linear values, and of the picture as displayed.
type Squared = [f64; 2];

/// Who draws.
#[derive(Clone, Copy)]
enum Renderer {
    Mitsuba,
    Ours,
    /// Ours, with `--follow-sun false`.
    OursPlain,
}

/// In the order of their turns.
const RENDERERS: [Renderer; 3] = [Renderer::Mitsuba, Renderer::Ours, Renderer::OursPlain];

impl Renderer {
    const fn key(self) -> &'static str {
        match self {
            Self::Mitsuba => "mitsuba",
            Self::Ours => "ours",
            Self::OursPlain => "ours_sun_not_followed",
        }
    }
}

/// One renderer's part of a round.
struct Turn {
    /// Of one picture, the mean of two.
    seconds: f64,
    /// Against the converged picture.
    converged: Squared,
    /// Half the squared difference of its own two pictures.
    own: Squared,
}

impl Turn {
    fn figures(&self) -> Value {
        json!({
            "seconds": self.seconds,
            "against_converged": { "linear": self.converged[0], "displayed": self.converged[1] },
            "between_seeds": { "linear": self.own[0], "displayed": self.own[1] },
        })
    }
}

/// A picture by Mitsuba with little noise.
struct Converged {
    halves: [PathBuf; 2],
    /// The factor on all linear values.
    exposure: f64,
    /// Squared difference of the halves: four times the squared error of their mean.
    between: Squared,
}

struct Bench<'a> {
    program: &'a Path,
    mitsuba: &'a Mitsuba,
    subject: &'a Subject,
    effort: &'a Effort,
    /// Where pictures lie.
    folder: &'a Path,
}

impl Bench<'_> {
    fn converge(&self) -> Result<Converged> {
        let samples = self.effort.reference_spp.div_ceil(2);
        println!("\n── a converged picture: {}, twice {samples} samples", self.subject.name);
        let draw = |seed| -> Result<PathBuf> {
            let file = self.file(&format!("half-{seed}"));
            let seconds = self.draw(Renderer::Mitsuba, samples, seed, &file)?;
            println!("half {seed}: {seconds:.0} s");
            Ok(file)
        };
        let [first, second] = HALVES.map(draw);
        let halves: [PathBuf; 2] = [first?, second?];
        let report = self.compare(&halves[0], &halves[1], None)?;
        let exposure = number(&report, "/exposure")?;
        let between = squared(&report)?;
        println!("its own squared error: {:.2e}", 0.25 * between[0]);
        Ok(Converged { halves, exposure, between })
    }

    /// Two pictures by each, in turns; then their errors.
    fn round(&self, round: u32, converged: &Converged) -> Result<[Turn; 3]> {
        let mut seconds = [0.0; 3];
        let file =
            |renderer: Renderer, picture| self.file(&format!("{}-{picture}", renderer.key()));
        for picture in 0..2 {
            // Every seed once.
            let seed = HALVES[1] + 1 + 2 * round + picture;
            for (renderer, seconds) in RENDERERS.into_iter().zip(&mut seconds) {
                let file = file(renderer, picture);
                *seconds += 0.5 * self.draw(renderer, self.effort.spp, seed, &file)?;
            }
        }
        let mut turns = Vec::new();
        for (renderer, seconds) in RENDERERS.into_iter().zip(seconds) {
            let pair = [0, 1].map(|picture| file(renderer, picture));
            let turn = self.turn(seconds, &pair, converged)?;
            println!(
                "round {}, {}: {seconds:.2} s, squared error {:.2e}, between seeds {:.2e}",
                round + 1,
                renderer.key(),
                turn.converged[0],
                turn.own[0]
            );
            turns.push(turn);
        }
        turns.try_into().ok().context("three renderers")
    }

    fn turn(&self, seconds: f64, pair: &[PathBuf; 2], converged: &Converged) -> Result<Turn> {
        let difference =
            |a: &Path, b: &Path| squared(&self.compare(a, b, Some(converged.exposure))?);
        let [a, b] = &converged.halves;
        let mut errors = [0.0; 2];
        for picture in pair {
            let to_halves = [difference(a, picture)?, difference(b, picture)?];
            let error = without_noise(to_halves, converged.between);
            errors = [errors[0] + 0.5 * error[0], errors[1] + 0.5 * error[1]];
        }
        let own = difference(&pair[0], &pair[1])?.map(|squared| 0.5 * squared);
        Ok(Turn { seconds, converged: errors, own })
    }

    /// Draws and returns the seconds that it took, without loading.
    fn draw(&self, renderer: Renderer, samples: u32, seed: u32, file: &Path) -> Result<f64> {
        let (samples, seed) = (samples.to_string(), seed.to_string());
        let mut draw = match renderer {
            Renderer::Mitsuba => {
                let mut draw = self.mitsuba.tool("mitsuba_ref.py", &["render"]);
                draw.arg(&self.subject.converted).arg(file);
                draw.args(["--width", WIDTH, "--height", HEIGHT]);
                draw
            }
            Renderer::Ours | Renderer::OursPlain => {
                let mut draw = command(&self.program.to_string_lossy(), &["render", "--json"]);
                draw.arg(&self.subject.gltf).arg("--output").arg(file);
                draw.args(["--materials", "lambert", "--size", &format!("{WIDTH}x{HEIGHT}")]);
                let follow = matches!(renderer, Renderer::Ours).to_string();
                draw.args(["--restart", "--follow-sun", &follow]);
                draw
            }
        };
        draw.args(["--bounces", BOUNCES, "--spp", &samples, "--seed", &seed]);
        number(&json_of(draw)?, "/seconds")
    }

    fn compare(&self, a: &Path, b: &Path, exposure: Option<f64>) -> Result<Value> {
        let mut compare = command(&self.program.to_string_lossy(), &["compare", "--json"]);
        compare.arg(a).arg(b).arg("--exposure");
        compare.arg(exposure.map_or("auto".to_owned(), |factor| factor.to_string()));
        json_of(compare)
    }

    fn file(&self, name: &str) -> PathBuf {
        let scene = self.subject.gltf.file_stem().unwrap_or_default().display();
        self.folder.join(format!("{scene}-{name}.exr"))
    }

    /// What is kept; adds the scene's rows to the table.
    fn figures(
        &self,
        rounds: &[[Turn; 3]],
        converged: &Converged,
        table: &mut String,
    ) -> Result<Value> {
        let mut medians = serde_json::Map::new();
        for (index, renderer) in RENDERERS.into_iter().enumerate().skip(1) {
            let label = match renderer {
                Renderer::OursPlain => format!("{}, the sun not followed", self.subject.name),
                _ => self.subject.name.to_owned(),
            };
            let pairs: Vec<_> = rounds.iter().map(|turns| (&turns[index], &turns[0])).collect();
            let against = Ratios::of(&pairs, |turn| turn.converged);
            let between = Ratios::of(&pairs, |turn| turn.own);
            for (measured, ratios) in
                [("against a converged picture", &against), ("between seeds", &between)]
            {
                writeln!(table, "| {label} | {measured} | {}", ratios.cells())?;
            }
            medians.insert(
                renderer.key().into(),
                json!({ "against_converged": against.figures(), "between_seeds": between.figures() }),
            );
        }
        let named = |turns: &[Turn; 3]| -> Value {
            let turns = RENDERERS.into_iter().zip(turns);
            turns.map(|(renderer, turn)| (renderer.key().to_owned(), turn.figures())).collect()
        };
        let error = converged.between.map(|squared| 0.25 * squared);
        Ok(json!({
            "scene": self.subject.name,
            "samples": self.effort.spp,
            "exposure": converged.exposure,
            "converged": {
                "samples": 2 * self.effort.reference_spp.div_ceil(2),
                "squared_error": { "linear": error[0], "displayed": error[1] },
            },
            "medians": medians,
            "rounds": rounds.iter().map(named).collect::<Vec<_>>(),
        }))
    }
}

/// Ours over Mitsuba's, one of each round.
struct Ratios {
    speed: Vec<f64>,
    equal_samples: Vec<f64>,
    equal_time: Vec<f64>,
    displayed: Vec<f64>,
}

impl Ratios {
    fn of(pairs: &[(&Turn, &Turn)], error: impl Fn(&Turn) -> Squared) -> Self {
        let each = |ratio: &dyn Fn(&Turn, &Turn) -> f64| {
            pairs.iter().map(|(ours, theirs)| ratio(ours, theirs)).collect()
        };
        let of_errors =
            |ours: &Turn, theirs: &Turn, kind: usize| error(ours)[kind] / error(theirs)[kind];
        let time = |ours: &Turn, theirs: &Turn| ours.seconds / theirs.seconds;
        Self {
            speed: each(&|ours, theirs| 1.0 / time(ours, theirs)),
            equal_samples: each(&|ours, theirs| of_errors(ours, theirs, 0)),
            equal_time: each(&|ours, theirs| of_errors(ours, theirs, 0) * time(ours, theirs)),
            displayed: each(&|ours, theirs| of_errors(ours, theirs, 1) * time(ours, theirs)),
        }
    }

    fn medians(&self) -> [f64; 4] {
        [&self.speed, &self.equal_samples, &self.equal_time, &self.displayed]
            .map(|ratios| median(ratios.iter().copied()))
    }

    fn cells(&self) -> String {
        let medians = self.medians().map(|ratio| format!("{ratio:.2}")).join(" | ");
        format!("{medians} | {} |", listed(self.equal_time.iter().copied()))
    }

    fn figures(&self) -> Value {
        let [speed, equal_samples, equal_time, displayed] = self.medians();
        json!({
            "speed": speed,
            "equal_samples": equal_samples,
            "equal_time": equal_time,
            "equal_time_displayed": displayed,
        })
    }
}

/// Mean squared differences that `lumencast compare` told.
fn squared(report: &Value) -> Result<Squared> {
    // Of pictures that are equal when displayed it is infinite, which JSON lacks.
    let displayed = match &report["psnr"] {
        Value::Null => 0.0,
        psnr => 10f64.powf(-0.1 * psnr.as_f64().context("PSNR is no number")?),
    };
    Ok([number(report, "/mse")?, displayed])
}

/// The squared error of a picture from its squared differences to two independent halves of a
/// reference, and that of the halves: the mean of (P−A)(P−B).
fn without_noise([to_a, to_b]: [Squared; 2], between: Squared) -> Squared {
    [0, 1].map(|kind| 0.5 * (to_a[kind] + to_b[kind] - between[kind]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_of_the_halves_is_left_out() {
        // P = 4, A = 1, B = 3
        assert_eq!(
            without_noise([[9.0, 0.0], [1.0, 0.0]], [4.0, 0.0]),
            [(4.0 - 1.0) * (4.0 - 3.0), 0.0]
        );
    }

    #[test]
    fn errors_are_read_from_comparisons() {
        let read = squared(&json!({ "mse": 0.25, "psnr": 20.0 })).expect("numbers");
        assert!(read[0] == 0.25 && (read[1] - 0.01).abs() < 1e-12);
        assert_eq!(squared(&json!({ "mse": 0.0, "psnr": null })).expect("numbers"), [0.0, 0.0]);
        assert!(squared(&json!({ "psnr": 20.0 })).is_err());
        assert!(squared(&json!({ "mse": 1.0, "psnr": "no" })).is_err());
    }

    #[test]
    fn half_the_error_in_twice_the_time_is_as_good() {
        let turn = |seconds, error| Turn { seconds, converged: [error; 2], own: [error; 2] };
        let ratios = Ratios::of(&[(&turn(2.0, 0.5), &turn(1.0, 1.0))], |turn| turn.converged);
        assert_eq!(ratios.medians(), [0.5, 0.5, 1.0, 1.0]);
    }
}
