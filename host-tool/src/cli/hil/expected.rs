//! Predicted edges of a session at the pins of a board, from the native simulator.

use super::Output;
use anyhow::Context;
use firmware::board::wiring::{Pin, Wiring};
use hal_sim::trace::{Levels, State, Trace};
use hil::expected::SECOND_PORT_SKEW_NS;
use hil::line::{Expected, ExpectedLine};
use host_core::run::{Board, DeviceName, SessionFile, run};

/// Name of the sync output.
pub const SYNC: &str = hil::expected::SYNC;

/// Returns the names of the channels' lines that `board` has: `c1` is the cathodic line of channel
/// 1, `a1` the anodic.
#[must_use]
pub fn lines(board: Board) -> Vec<String> {
    let named = pins(board).into_iter().map(|(name, _)| name);
    named.filter(|name| name != SYNC).collect()
}

/// Returns every line of `board` with its pin.
#[must_use]
pub fn pins(board: Board) -> Vec<(String, Pin)> {
    let outputs = board.pins().outputs;
    let mut pins = Vec::new();
    for (n, lines) in outputs.channels.iter().enumerate() {
        if let Some(lines) = lines {
            pins.push((format!("c{}", n + 1), lines.cathodic));
            pins.push((format!("a{}", n + 1), lines.anodic));
        }
    }
    pins.push((SYNC.to_owned(), outputs.sync));
    pins
}

/// Edges that the pins of a board must show.
pub struct Expectation {
    /// Edges from the first pulse on.
    pub expected: Expected,
}

impl Expectation {
    /// Runs `session` on the native simulator.
    ///
    /// # Errors
    /// Fails if the session cannot be run.
    pub fn of(session: &SessionFile, board: Board, output: Output) -> anyhow::Result<Self> {
        let port = DeviceName::Native.open(&session.session, 1)?;
        let bar = output.bar("predicting");
        let (outcome, port) = run(session, port, None, |part| bar.set(part));
        bar.finish();
        if let Some(error) = outcome.error {
            return Err(error.into());
        }
        let mut port = port.context("the simulator is gone")?;
        let world = port.world().context("the simulator has no world")?;
        let epoch = outcome.epoch_us.context("the session did not start")?;
        let until_us = session.session.duration_us;
        let wiring = board.pins();
        let lines = pins(board)
            .into_iter()
            .map(|(name, pin)| line(name, pin, &wiring, &world.recorder.trace, (epoch, until_us)));
        Ok(Self {
            expected: Expected {
                from_us: 0,
                // The electrode check at arming plays pulses before the first one.
                idle_before: false,
                until_us,
                lines: lines.collect(),
            },
        })
    }
}

/// Returns the edges of one line between `epoch` and `length_us` later.
fn line(
    name: String,
    pin: Pin,
    wiring: &Wiring,
    trace: &Trace,
    (epoch, length_us): (u64, u64),
) -> ExpectedLine {
    let level = |levels: Levels| is_high(&name, levels);
    let mut before = false;
    let mut edges_us = Vec::new();
    for &(t_us, levels) in &trace.levels {
        let high = level(levels);
        if high != before && (epoch..=epoch + length_us).contains(&t_us) {
            edges_us.push(t_us - epoch);
        }
        before = high;
    }
    let is_second = pin.is_on(wiring.outputs.ports[1]);
    ExpectedLine {
        skew_ns: if is_second { SECOND_PORT_SKEW_NS } else { 0.0 },
        first_high: false,
        edges_us,
        name,
    }
}

/// Returns whether the line is high at these levels.
fn is_high(name: &str, levels: Levels) -> bool {
    let channel = name.get(1..).and_then(|number| number.parse::<u8>().ok());
    match (name.chars().next(), channel) {
        (Some('c'), Some(n)) => {
            matches!(levels.state(n - 1), State::Cathodic | State::Grounded)
        }
        (Some('a'), Some(n)) => matches!(levels.state(n - 1), State::Anodic | State::Grounded),
        _ => levels.sync(),
    }
}
