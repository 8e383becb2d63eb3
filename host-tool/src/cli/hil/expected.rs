//! Predicted edges of a session at the pins of a board, from the native simulator.

use super::Output;
use anyhow::Context;
use firmware::board::wiring::Pin;
use firmware::pulse::tape::PUMP_SLOTS;
use hal_sim::trace::{Levels, State};
use hil::expected::{SECOND_PORT_SKEW_NS, from_levels};
use hil::line::{Expected, TogglingLine};
use hil::plan::{Plan, plan};
use host_core::run::{Board, DeviceName, SessionFile, run};

/// Name of the sync output.
const SYNC: &str = hil::expected::SYNC;
/// Name of the pump, which the tape toggles at all times. A breadboard has none.
const PUMP: &str = "pump";

/// Distributes the lines of `board` over captures. Every capture also records sync, or if the
/// session does not move sync, the line that the session moves most often.
///
/// # Errors
/// E820 if the session moves no line, or the analyser has too few inputs.
pub fn plan_captures(expected: &Expected, board: Board, inputs: usize) -> anyhow::Result<Plan> {
    let edges = |name: &str| {
        let line = expected.lines.iter().find(|line| line.name == name);
        line.map_or(0, |line| line.edges_us.len())
    };
    let names: Vec<String> = pins(board).into_iter().map(|(name, _)| name).collect();
    // Of equal lines, the first.
    let busiest = names.iter().rev().max_by_key(|name| edges(name));
    let common = match edges(SYNC) {
        0 => busiest.filter(|name| edges(name) > 0).cloned(),
        _ => Some(SYNC.to_owned()),
    };
    let common = common.context(
        "E820 the session moves no line of the board, so there is nothing to compare; use a session \
         that stimulates",
    )?;
    let others = names.into_iter().filter(|name| *name != common);
    let plan = plan(&others.collect::<Vec<_>>(), &common, inputs);
    plan.map_err(|why| anyhow::anyhow!("E820 {why}"))
}

/// Returns every line of `board` with its pin: `c1` is the cathodic line of channel 1, `a1` the
/// anodic.
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
    if board.pins().breadboard.is_none() {
        pins.push((PUMP.to_owned(), outputs.pump.pin()));
    }
    pins.push((SYNC.to_owned(), outputs.sync));
    pins
}

/// Longest part of a session that is predicted, microseconds.
const LONGEST_US: u64 = 600_000_000;

/// Returns the edges that the pins of a board show while it plays `session`, from its first pulse
/// to its end. The native simulator predicts them.
///
/// The whole session is predicted, whatever the captures show: an edge outside the prediction could
/// not be judged, and a capture may have been recorded at any time.
///
/// # Errors
/// Fails if the session cannot be run.
pub fn predict(session: &SessionFile, board: Board, output: Output) -> anyhow::Result<Expected> {
    let mut session = session.clone();
    session.session.duration_us = session.session.duration_us.min(LONGEST_US);
    let port = DeviceName::Native.open(&session.session, 1)?;
    let bar = output.bar("predicting");
    let (outcome, port) = run(&session, port, None, |part| bar.set(part));
    bar.finish();
    if let Some(error) = outcome.error {
        return Err(error.into());
    }
    let mut port = port.context("the simulator is gone")?;
    let world = port.world().context("the simulator has no world")?;
    let epoch = outcome.epoch_us.context("the session did not start")?;
    let until_us = session.session.duration_us;
    let wiring = board.pins();
    let trace = &world.recorder.trace;
    let (pump, lines): (Vec<_>, Vec<_>) =
        pins(board).into_iter().partition(|(name, _)| name == PUMP);
    let lines = lines.into_iter().map(|(name, pin)| {
        let is_second = pin.is_on(wiring.outputs.ports[1]);
        let skew_ns = if is_second { SECOND_PORT_SKEW_NS } else { 0.0 };
        let high = |levels| is_high(&name, levels);
        let initial = high(trace.start.0);
        let changes: Vec<(u64, bool)> = trace.levels.iter().map(|&(t, l)| (t, high(l))).collect();
        from_levels(name, skew_ns, initial, changes, (epoch, epoch + until_us))
    });
    Ok(Expected {
        from_us: 0,
        until_us,
        lines: lines.collect(),
        toggling: pump
            .into_iter()
            .map(|(name, _)| TogglingLine {
                name,
                half_period_us: PUMP_SLOTS as f64,
            })
            .collect(),
    })
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
