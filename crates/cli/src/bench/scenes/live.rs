//! A scene's light as a server casts it, some seconds after the server began.

use anyhow::Result;
use lumencast_codec::Epoch;
use lumencast_gather::Gather;
use lumencast_light::Field;
use lumencast_scene::Scene;
use lumencast_server::{Mail, Tick, TickOptions};

use crate::bench::Nobody;
use crate::output;

/// The light of a server's ticks after so many seconds. The scene's time stands still.
pub(super) fn light(
    scene: Scene,
    gatherer: Box<dyn Gather>,
    options: TickOptions,
    seconds: f64,
) -> Result<Vec<Field>> {
    let ticks = (seconds / options.period).ceil() as u64;
    let mut tick = Tick::new(scene, gatherer, options, Epoch(0))?;
    let bar = output::bar(ticks, "Ticks");
    for _ in 0..ticks {
        tick.step(0.0, Mail::default(), &mut Nobody { watches: false });
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(tick.light().fields().to_vec())
}
