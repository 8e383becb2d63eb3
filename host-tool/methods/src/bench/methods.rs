//! The muscle model's integrators: each at each setting under the same load.
//!
//! One run is 0.4 simulated seconds of one muscle from rest, its pulses each
//! at its own microsecond, the force read at equal intervals. The three runs of
//! a row are three muscles at three rates, the same for every setting. Making
//! the muscle (constants, tables) is not measured.

use crate::muscle::{Integrator, Method, Number, Setting};
use core::fmt;
use core::hint::black_box;
use firmware::bench::{Checksum, Clock, Random, Row};
use firmware::muscle::CalciumForceSpec;
use firmware::units::{Micros, us};

/// What a run simulates, µs: a whole number of pulses of every load.
pub const RUN_US: u32 = 400_000;

/// How often the force is read, µs: in every control tick, and at 50 Hz.
pub const OUTPUTS_US: [u32; 2] = [1000, 20_000];

/// Subjects K01, K05 and K08 of Lee 2020, table 4, and their pulses per second.
const LOADS: [(CalciumForceSpec, u32); 3] = [
    (spec([121_900, 300_000, 20_800, 33_100, 194_400]), 40),
    (spec([130_800, 12_000, 11_500, 5_000, 124_100]), 100),
    (spec([218_000, 190_000, 26_300, 10_000, 98_400]), 20),
];

const fn spec([a_mn_per_s, k_micro, tau_c_us, tau1_us, tau2_us]: [u32; 5]) -> CalciumForceSpec {
    CalciumForceSpec {
        a_mn_per_s,
        k_micro,
        tau_c_us,
        tau1_us,
        tau2_us,
    }
}

/// What a row measures.
#[derive(Clone, Copy, Debug)]
pub enum MethodName {
    /// The loop around a setting, the force read every so many µs.
    Empty(u32),
    /// A setting, the force read every so many µs.
    Run(Setting, u32),
    /// Making a setting's muscle: constants and tables.
    Make(Setting),
}

impl fmt::Display for MethodName {
    /// `setting@interval`, for instance `rk4/f32/200us@1000us`; `empty@…`;
    /// `make:setting`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty(output_us) => write!(f, "empty@{output_us}us"),
            Self::Run(setting, output_us) => write!(f, "{setting}@{output_us}us"),
            Self::Make(setting) => write!(f, "make:{setting}"),
        }
    }
}

/// The settings whose making is measured: the product's, and the tables that
/// it does without.
pub const MADE: [Setting; 3] = [
    Setting::SHIPPED,
    Setting::new(Method::LogTable, Number::Q7_24, 1000),
    Setting::new(Method::LogFlow, Number::Q7_24, Setting::WHOLE_US),
];

/// Runs all settings and hands over each row when it is complete: for each
/// interval of reading first the loop without a muscle, then every setting;
/// last [`MADE`].
pub fn run_methods(clock: &impl Clock, mut row: impl FnMut(&Row<MethodName>)) {
    for output_us in OUTPUTS_US {
        row(&measure(clock, MethodName::Empty(output_us)));
        for setting in Setting::all(output_us) {
            row(&measure(clock, MethodName::Run(setting, output_us)));
        }
    }
    for setting in MADE {
        row(&measure(clock, MethodName::Make(setting)));
    }
}

/// One row: all loads.
fn measure(clock: &impl Clock, name: MethodName) -> Row<MethodName> {
    let mut sum = Checksum::default();
    let (mut min, mut total, mut max) = (u32::MAX, 0u64, 0);
    for (spec, rate_hz) in &LOADS {
        let load = Load::new(*rate_hz);
        let run = |muscle: &mut dyn Integrator, output_us| {
            let muscle = black_box(muscle);
            let begin = clock.cycles();
            let word = load.apply(muscle, output_us);
            (word, clock.cycles().wrapping_sub(begin))
        };
        let begin = clock.cycles();
        // The loads' parameters are in range; else the checksum tells.
        let (word, cycles) = match name {
            MethodName::Empty(output_us) => run(&mut Nothing, output_us),
            MethodName::Run(setting, output_us) => setting
                .with(spec, |muscle| run(muscle, output_us))
                .unwrap_or_default(),
            MethodName::Make(setting) => setting
                .with(spec, |muscle| {
                    let cycles = clock.cycles().wrapping_sub(begin);
                    (black_box(muscle).force_word(), cycles)
                })
                .unwrap_or_default(),
        };
        sum.word(word);
        // Three of at most 2^32 each.
        (min, total, max) = (min.min(cycles), total + u64::from(cycles), max.max(cycles));
    }
    Row {
        name,
        runs: LOADS.len() as u32,
        checksum: sum.value(),
        min,
        total,
        max,
    }
}

/// Pulse times, µs, ascending.
struct Load(heapless::Vec<Micros, 40>);

impl Load {
    /// A run's pulses at `rate_hz`, 1…100, each up to 45 % of a period off its
    /// place.
    fn new(rate_hz: u32) -> Self {
        let mut random = Random::default();
        let period_us = 1_000_000 / rate_hz.max(1);
        let twentieth = period_us / 20;
        let pulses = (0..RUN_US / period_us).map(|n| {
            // Within the run.
            let begin = n.wrapping_mul(period_us).wrapping_add(twentieth);
            Micros::new(begin.wrapping_add(random.between(0, twentieth * 18)))
        });
        Self(pulses.take(40).collect())
    }

    /// A run of a muscle; of all readings, something to sum up.
    #[inline(never)]
    fn apply(&self, muscle: &mut dyn Integrator, output_us: u32) -> u32 {
        let mut pulses = self.0.iter().copied();
        let mut next = pulses.next();
        let mut read = 0u32;
        let mut to = Micros::new(0);
        while to.get() < RUN_US {
            to += us(output_us);
            while let Some(pulse) = next
                && to.has_reached(pulse)
            {
                muscle.pulse(pulse);
                next = pulses.next();
            }
            muscle.advance(to);
            read = read.rotate_left(5) ^ muscle.force_word();
        }
        read
    }
}

/// No muscle at all.
struct Nothing;

impl Integrator for Nothing {
    fn pulse(&mut self, _: Micros) {}
    fn advance(&mut self, _: Micros) {}
    fn calcium(&self) -> f64 {
        0.0
    }
    fn force_n(&self) -> f64 {
        0.0
    }
    fn force_word(&self) -> u32 {
        0
    }
}
