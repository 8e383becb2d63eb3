//! Benchmarks of the muscle model's integrators: each at each setting under the same load.
//!
//! One run simulates 0.4 s of one muscle from rest. Every pulse has its own time in µs; the force
//! is read at equal intervals. The three runs of a row are three muscles at three pulse rates, the
//! same for every setting; total and mean are those of whole runs. Each run is repeated with
//! markers around every reading and the pulses before it, which gives minimum and maximum. The
//! preparation of the muscle (constants, tables) is not measured.

use crate::muscle::{Integrator, Method, Number, Setting};
use core::fmt;
use core::hint::black_box;
use firmware::bench::{Checksum, Clock, Random, Row};
use firmware::muscle::CalciumForceSpec;
use firmware::units::{Micros, us};

/// Simulated duration of a run, µs. It is a whole number of pulse periods at every pulse rate of
/// `LOADS`.
pub const RUN_US: u32 = 400_000;

/// Intervals between two readings of the force, µs: one control period, and the interval of a rate
/// of 50 Hz.
pub const OUTPUTS_US: [u32; 2] = [1000, 20_000];

/// The three runs of a row: subjects K01, K05 and K08 of Lee 2020, table 4, each with its pulse
/// rate in pulses per second.
const LOADS: [(CalciumForceSpec, u32); 3] = [
    (spec([121_900, 300_000, 20_800, 33_100, 194_400]), 40),
    (spec([130_800, 12_000, 11_500, 5_000, 124_100]), 100),
    (spec([218_000, 190_000, 26_300, 10_000, 98_400]), 20),
];

/// The three runs of the row [`MethodName::Corner`]: the muscle with the shortest time constants
/// and the smallest K that the device accepts, at three pulse rates in pulses per second. For this
/// muscle, steps at a fixed fraction of a time constant are most numerous.
const CORNER: [(CalciumForceSpec, u32); 3] = {
    let spec = spec([10_000_000, 2_000, 5_000, 2_200, 1_000]);
    [(spec, 20), (spec, 100), (spec, 200)]
};

const fn spec([a_mn_per_s, k_micro, tau_c_us, tau1_us, tau2_us]: [u32; 5]) -> CalciumForceSpec {
    CalciumForceSpec {
        a_mn_per_s,
        k_micro,
        tau_c_us,
        tau1_us,
        tau2_us,
    }
}

/// Code whose cycles one row of the benchmark gives.
#[derive(Clone, Copy, Debug)]
pub enum MethodName {
    /// The loop over pulses and readings without a muscle. The number is the interval between
    /// readings, µs.
    Empty(u32),
    /// A method with its settings. The number is the interval between readings of the force, µs.
    Run(Setting, u32),
    /// Preparation of the muscle for a method: computation of its constants and tables.
    Make(Setting),
    /// The device's own method with the muscle of `CORNER`. The number is the interval between
    /// readings, µs.
    Corner(u32),
}

impl fmt::Display for MethodName {
    /// Writes `setting@interval`, for instance `rk4/f32/200us@1000us`, or `empty@interval`,
    /// `corner:setting@interval` or `make:setting`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty(output_us) => write!(f, "empty@{output_us}us"),
            Self::Run(setting, output_us) => write!(f, "{setting}@{output_us}us"),
            Self::Make(setting) => write!(f, "make:{setting}"),
            Self::Corner(output_us) => write!(f, "corner:{}@{output_us}us", Setting::SHIPPED),
        }
    }
}

/// Settings whose preparation is measured: that of the device's own method, and those of two
/// methods with tables that the device avoids.
pub const MADE: [Setting; 3] = [
    Setting::SHIPPED,
    Setting::new(Method::LogTable, Number::Q7_24, 1000),
    Setting::new(Method::LogFlow, Number::Q7_24, Setting::WHOLE_US),
];

/// Measures all settings, and passes each row to `row` as soon as the row is complete. For each
/// interval between readings, the first row is the loop without a muscle, then follow all settings,
/// and then the device's own method with the muscle of `CORNER`. The preparations of [`MADE`] come
/// last.
pub fn run_methods(clock: &impl Clock, mut row: impl FnMut(&Row<MethodName>)) {
    for output_us in OUTPUTS_US {
        row(&measure(clock, MethodName::Empty(output_us)));
        for setting in Setting::all(output_us) {
            row(&measure(clock, MethodName::Run(setting, output_us)));
        }
        row(&measure(clock, MethodName::Corner(output_us)));
    }
    for setting in MADE {
        row(&measure(clock, MethodName::Make(setting)));
    }
}

/// Measures one row: three runs, each with its own muscle and pulse rate.
fn measure(clock: &impl Clock, name: MethodName) -> Row<MethodName> {
    let mut sum = Checksum::default();
    let (mut min, mut total, mut max) = (u32::MAX, 0u64, 0);
    let loads = match name {
        MethodName::Corner(_) => &CORNER,
        _ => &LOADS,
    };
    for (spec, rate_hz) in loads {
        let load = Load::new(*rate_hz);
        // Runs a muscle and returns its cycles; with `is_parted` it also measures every reading.
        let mut run = |muscle: &mut dyn Integrator, output_us, is_parted| {
            let muscle = black_box(muscle);
            let begin = clock.cycles();
            let word = if is_parted {
                load.apply(muscle, output_us, |part| {
                    let begin = clock.cycles();
                    let word = part();
                    let cycles = clock.cycles().wrapping_sub(begin);
                    (min, max) = (min.min(cycles), max.max(cycles));
                    word
                })
            } else {
                load.apply(muscle, output_us, |part| part())
            };
            (word, clock.cycles().wrapping_sub(begin))
        };
        let mut with = |name, is_parted| match name {
            MethodName::Empty(output_us) => Ok(run(&mut NoMuscle, output_us, is_parted)),
            MethodName::Run(setting, output_us) => {
                setting.with_integrator(spec, |muscle| run(muscle, output_us, is_parted))
            }
            MethodName::Corner(output_us) => {
                Setting::SHIPPED.with_integrator(spec, |muscle| run(muscle, output_us, is_parted))
            }
            MethodName::Make(setting) => {
                let begin = clock.cycles();
                setting.with_integrator(spec, |muscle| {
                    let cycles = clock.cycles().wrapping_sub(begin);
                    (black_box(muscle).force_bits(), cycles)
                })
            }
        };
        // The parameters of the loads are in range; otherwise the checksum would show it.
        let (word, cycles) = with(name, false).unwrap_or_default();
        sum.add_word(word);
        let _ = with(name, true);
        total += u64::from(cycles); // three of at most 2^32 each
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

/// Times of the pulses of a run, µs, in ascending order.
struct Load(heapless::Vec<Micros, 80>);

impl Load {
    /// Generates the pulse times of a run at `rate_hz`, 1 to 200 pulses per second. Each pulse is
    /// displaced by up to 45 % of a period in either direction.
    fn new(rate_hz: u32) -> Self {
        let mut random = Random::default();
        let period_us = 1_000_000 / rate_hz.max(1);
        let twentieth = period_us / 20;
        let pulses = (0..RUN_US / period_us).map(|n| {
            // Stays within the run.
            let begin = n.wrapping_mul(period_us).wrapping_add(twentieth);
            Micros::new(begin.wrapping_add(random.between(0, twentieth * 18)))
        });
        Self(pulses.take(80).collect())
    }

    /// Runs a muscle and returns a checksum of all its force readings. For each reading, calls
    /// `part` with a function that processes the pulses before the reading and then reads the
    /// force.
    #[inline(never)]
    fn apply(
        &self,
        muscle: &mut dyn Integrator,
        output_us: u32,
        mut part: impl FnMut(&mut dyn FnMut() -> u32) -> u32,
    ) -> u32 {
        let mut pulses = self.0.iter().copied();
        let mut next = pulses.next();
        let mut read = 0u32;
        let mut to = Micros::new(0);
        while to.get() < RUN_US {
            to += us(output_us);
            let word = part(&mut || {
                while let Some(pulse) = next
                    && to.has_reached(pulse)
                {
                    muscle.pulse(pulse);
                    next = pulses.next();
                }
                muscle.read(to)
            });
            read = read.rotate_left(5) ^ word;
        }
        read
    }
}

/// An integrator that does nothing, to measure the cycles of the loop itself.
struct NoMuscle;

impl Integrator for NoMuscle {
    fn pulse(&mut self, _: Micros) {}
    fn advance(&mut self, _: Micros) {}
    fn calcium(&self) -> f64 {
        0.0
    }
    fn force_n(&self) -> f64 {
        0.0
    }
    fn force_bits(&self) -> u32 {
        0
    }
}
