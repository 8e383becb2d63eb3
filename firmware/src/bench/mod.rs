//! Every algorithm of the device, once per call between two markers.
//!
//! Lives here: which algorithms, on which inputs (a fixed seed), and what of
//! their results is summed up. Not here: a clock, or where rows are printed.
//! In: a cycle counter. Out: per algorithm a [`Row`]; its checksum is the same
//! on every machine, its cycles are one machine's.

mod control;
mod haptics;
mod inverse;
mod laws;
mod link;
mod methods;
mod muscle;
mod owners;
mod pulse;

use crate::control::{LawSpec, ResponseSpec};
use crate::muscle::Rung;
use core::fmt;
use core::hint::black_box;
pub use laws::{LawName, run_laws};
pub use methods::{MADE, OUTPUTS_US, RUN_US, run_methods};

/// A counter of core clock cycles that wraps.
pub trait Clock {
    /// Its present value.
    fn cycles(&self) -> u32;
}

/// Counts nothing: for machines whose cycles say nothing about the board's.
pub struct NoClock;

impl Clock for NoClock {
    fn cycles(&self) -> u32 {
        0
    }
}

/// What one algorithm gave and took. Cycles include the two markers and one
/// call: those of the row `empty`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Row<N = &'static str> {
    /// Which algorithm.
    pub name: N,
    /// Times it ran, each on other inputs.
    pub runs: u32,
    /// Of all results (FNV-1a, 32 bits).
    pub checksum: u32,
    /// Fewest cycles of a run.
    pub min: u32,
    /// Cycles of all runs.
    pub total: u64,
    /// Most cycles of a run.
    pub max: u32,
}

impl<N> Row<N> {
    /// Mean cycles of a run, rounded to nearest.
    #[must_use]
    pub const fn mean(&self) -> u64 {
        let runs = if self.runs == 0 { 1 } else { self.runs as u64 };
        (self.total + runs / 2) / runs
    }
}

impl<N: fmt::Display> fmt::Display for Row<N> {
    /// `name runs checksum min mean max`, parted by single spaces.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            name,
            runs,
            checksum,
            min,
            max,
            ..
        } = self;
        let mean = self.mean();
        write!(f, "{name} {runs} {checksum:08x} {min} {mean} {max}")
    }
}

/// Something to be measured, with its state.
trait Algorithm {
    /// Makes the next input; not measured.
    fn prepare(&mut self, random: &mut Random);
    /// What is measured. Allocates nothing, waits for nothing.
    fn run(&mut self);
    /// Sums up what the run changed; not measured.
    fn digest(&self, sum: &mut Checksum);
}

/// Runs all algorithms and hands over each row when it is complete.
pub fn run(clock: &impl Clock, mut row: impl FnMut(&Row)) {
    row(&measure(clock, "empty", 100, Empty));
    row(&measure(
        clock,
        "calcium_force_tick",
        1000,
        muscle::Tick::new(),
    ));
    row(&measure(
        clock,
        "calcium_force_tick_and_pulse",
        1000,
        muscle::TickWithPulse::new(),
    ));
    for (rung, tick, tick_and_pulse) in [
        (Rung::Static, "static_tick", "static_tick_and_pulse"),
        (Rung::Lag, "lag_tick", "lag_tick_and_pulse"),
        (Rung::CalciumForce, "rung_tick", "rung_tick_and_pulse"),
        (
            Rung::CalciumForceFatigue,
            "fatigue_tick",
            "fatigue_tick_and_pulse",
        ),
    ] {
        row(&measure(clock, tick, 1000, muscle::RungTick::new(rung)));
        let with_pulse = muscle::RungTickWithPulse::new(rung);
        row(&measure(clock, tick_and_pulse, 1000, with_pulse));
    }
    row(&measure(
        clock,
        "recruitment_gain",
        1000,
        muscle::GainOfAmplitude::new(),
    ));
    row(&measure(
        clock,
        "recruitment_amplitude",
        1000,
        muscle::AmplitudeForGain::new(),
    ));
    row(&measure(
        clock,
        "recruitment_effort",
        1000,
        muscle::AmplitudeForEffort::new(),
    ));
    row(&measure(
        clock,
        "inverse_force",
        1000,
        inverse::ForceToPulses::new(),
    ));
    row(&measure(
        clock,
        "inverse_table",
        20,
        inverse::Tabling::new(),
    ));
    row(&measure(
        clock,
        "feed_forward",
        1000,
        inverse::AngleToEffort::new(),
    ));
    row(&measure(
        clock,
        "differentiator",
        1000,
        control::Differentiation::new(),
    ));
    row(&measure(
        clock,
        "law_super_twisting",
        1000,
        control::LawAlone::new(LawSpec::RECOMMENDED, None),
    ));
    row(&measure(
        clock,
        "law_and_response",
        1000,
        control::LawAlone::new(LawSpec::RECOMMENDED, Some(ResponseSpec::RECOMMENDED)),
    ));
    let joint = |law| control::Moving::new(law, 1);
    row(&measure(
        clock,
        "joint_super_twisting",
        1000,
        joint(LawSpec::RECOMMENDED),
    ));
    row(&measure(clock, "joint_paper", 1000, joint(LawSpec::PAPER)));
    row(&measure(clock, "joint_pid", 1000, joint(LawSpec::PID)));
    row(&measure(
        clock,
        "joint_without_law",
        1000,
        control::Mapping::new(),
    ));
    row(&measure(clock, "wall_tick", 1000, haptics::Swinging::new()));
    row(&measure(
        clock,
        "render_idle_window",
        400,
        pulse::RenderIdle::new(),
    ));
    row(&measure(clock, "render_window", 800, pulse::Render::new()));
    row(&measure(
        clock,
        "render_window_all_at_once",
        300,
        pulse::RenderTogether::new(),
    ));
    row(&measure(clock, "paint_window", 300, pulse::Paint::new()));
    row(&measure(
        clock,
        "decode_setpoint_frame",
        500,
        link::Decode::new(),
    ));
    row(&measure(
        clock,
        "encode_telemetry_frame",
        500,
        link::EncodeTelemetry::new(),
    ));
    row(&measure(
        clock,
        "session_setpoint",
        300,
        owners::Setpoint::new(),
    ));
    row(&measure(
        clock,
        "owner_control_tick",
        500,
        owners::ControlTick::new(),
    ));
    row(&measure(clock, "owner_refill", 800, owners::Refill::new()));
    row(&measure(
        clock,
        "inverse_table_slow",
        20,
        inverse::SlowTabling::new(),
    ));
}

/// One algorithm, all its runs.
fn measure<A: Algorithm, N>(clock: &impl Clock, name: N, runs: u32, mut algorithm: A) -> Row<N> {
    let mut random = Random::new();
    let mut sum = Checksum::new();
    let (mut min, mut total, mut max) = (u32::MAX, 0u64, 0);
    for _ in 0..runs {
        algorithm.prepare(&mut random);
        let begin = clock.cycles();
        marked(black_box(&mut algorithm));
        let cycles = clock.cycles().wrapping_sub(begin);
        // `runs` of at most 2^32 each.
        (min, total, max) = (min.min(cycles), total + u64::from(cycles), max.max(cycles));
        algorithm.digest(&mut sum);
    }
    Row {
        name,
        runs,
        checksum: sum.0,
        min,
        total,
        max,
    }
}

/// One run, as one function that a profile can name.
#[inline(never)]
fn marked<A: Algorithm>(algorithm: &mut A) {
    algorithm.run();
}

/// What the markers themselves take.
struct Empty;

impl Algorithm for Empty {
    fn prepare(&mut self, _: &mut Random) {}
    fn run(&mut self) {
        black_box(self);
    }
    fn digest(&self, _: &mut Checksum) {}
}

/// Marsaglia's xorshift32 (J. Stat. Softw. 8(14), 2003), one seed for all.
struct Random(u32);

impl Random {
    const fn new() -> Self {
        Self(0x2545_F491)
    }

    const fn word(&mut self) -> u32 {
        let mut x = self.0;
        x ^= x << 13;
        x ^= x >> 17;
        x ^= x << 5;
        self.0 = x;
        x
    }

    /// `low..high`; `high` must be above `low`.
    const fn between(&mut self, low: u32, high: u32) -> u32 {
        let span = high.wrapping_sub(low) as u64;
        // Below span.
        low.wrapping_add(((self.word() as u64 * span) >> 32) as u32)
    }
}

/// FNV-1a over 32-bit words, least significant byte first.
struct Checksum(u32);

impl Checksum {
    const fn new() -> Self {
        Self(0x811C_9DC5)
    }

    fn word(&mut self, word: u32) {
        self.bytes(&word.to_le_bytes());
    }

    fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u32::from(byte)).wrapping_mul(0x0100_0193);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn rows_repeat_and_have_names_of_their_own() {
        let all = || {
            let mut rows = Vec::new();
            run(&NoClock, |row| rows.push(*row));
            rows
        };
        let rows = all();
        assert_eq!(rows, all());
        for (n, row) in rows.iter().enumerate() {
            std::println!("{:28} {:5} {:08x}", row.name, row.runs, row.checksum);
            assert!(rows.iter().skip(n + 1).all(|other| other.name != row.name));
            let is_empty = row.checksum == Checksum::new().0;
            assert_eq!(is_empty, row.name == "empty", "{}", row.name);
        }
    }

    #[test]
    fn the_checksum_is_fnv_1a() {
        let mut sum = Checksum::new();
        sum.bytes(b"foobar");
        assert_eq!(sum.0, 0xBF9C_F968); // published test vector
    }
}
