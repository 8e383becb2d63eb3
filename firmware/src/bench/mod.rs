//! Benchmarks of every algorithm of the device, each run between two markers.
//!
//! This module defines the algorithms, their inputs (from a fixed seed) and the results that enter
//! the checksum. The clock and the output of rows are elsewhere.
//! Input is a cycle counter. Output is one [`Row`] per algorithm; its checksum is the same on every
//! machine, and its cycles are those of one machine.

pub mod control;
mod haptics;
mod inverse;
pub mod limb;
mod link;
mod muscle;
mod owners;
mod pulse;

use crate::control::Amplitudes;
use crate::device::MuscleTables;
use core::fmt;
use core::hint::black_box;

/// A counter of core clock cycles that wraps.
pub trait Clock {
    /// Returns the present count.
    fn cycles(&self) -> u32;
}

/// A clock that always returns 0, for machines whose cycles differ from the board's.
pub struct NoClock;

impl Clock for NoClock {
    fn cycles(&self) -> u32 {
        0
    }
}

/// Results and cycles of one algorithm. Cycles include the two markers and one call, which the row
/// of [`measure_empty`] shows alone.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Row<N = &'static str> {
    /// Name of the algorithm.
    pub name: N,
    /// Number of runs, each with other inputs.
    pub runs: u32,
    /// Checksum over all results (FNV-1a, 32 bits).
    pub checksum: u32,
    /// Smallest number of cycles of a run.
    pub min: u32,
    /// Sum of the cycles of all runs.
    pub total: u64,
    /// Largest number of cycles of a run.
    pub max: u32,
}

impl<N> Row<N> {
    /// Returns the mean number of cycles of a run, rounded to nearest.
    #[must_use]
    pub const fn mean(&self) -> u64 {
        let runs = if self.runs == 0 { 1 } else { self.runs as u64 };
        (self.total + runs / 2) / runs
    }
}

impl<N: fmt::Display> fmt::Display for Row<N> {
    /// Writes `name runs checksum min mean max`, separated by single spaces.
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

/// Takes measurements with one clock and passes on each row when it is complete.
pub struct Bench<'a, C, N = &'static str> {
    clock: &'a C,
    report: &'a mut dyn FnMut(&Row<N>),
}

/// State, input, answer and function of one run, in one place.
struct Case<S, I, A, R> {
    state: S,
    input: I,
    answer: A,
    run: R,
}

impl<'a, C: Clock, N> Bench<'a, C, N> {
    /// Creates a benchmark that measures with `clock` and passes each row to `report`.
    pub fn new(clock: &'a C, report: &'a mut dyn FnMut(&Row<N>)) -> Self {
        Self { clock, report }
    }

    /// Measures `run` on `runs` inputs from `prepare`. The measurement allocates nothing and never
    /// waits. `digest` adds the answer or the changes of each run to the checksum.
    pub fn measure<S, I: Default, A: Default>(
        &mut self,
        name: N,
        runs: u32,
        state: S,
        mut prepare: impl FnMut(&mut S, &mut Random) -> I,
        run: impl FnMut(&mut S, &I) -> A,
        digest: impl Fn(&S, &A, &mut Checksum),
    ) {
        let (mut random, mut sum) = (Random::default(), Checksum::default());
        let (mut min, mut total, mut max) = (u32::MAX, 0u64, 0);
        let (input, answer) = (I::default(), A::default());
        let mut case = Case {
            state,
            input,
            answer,
            run,
        };
        for _ in 0..runs {
            case.input = prepare(&mut case.state, &mut random);
            let begin = self.clock.cycles();
            marked(black_box(&mut case));
            let cycles = self.clock.cycles().wrapping_sub(begin);
            // `runs` of at most 2^32 each.
            (min, total, max) = (min.min(cycles), total + u64::from(cycles), max.max(cycles));
            digest(&case.state, &case.answer, &mut sum);
        }
        (self.report)(&Row {
            name,
            runs,
            checksum: sum.value(),
            min,
            total,
            max,
        });
    }
}

/// Performs one run, in a function of its own that a profile can name.
#[inline(never)]
fn marked<S, I, A, R: FnMut(&mut S, &I) -> A>(case: &mut Case<S, I, A, R>) {
    case.answer = (case.run)(&mut case.state, &case.input);
}

/// Measures the two markers of a run without any work between them.
pub fn measure_empty<C: Clock, N>(bench: &mut Bench<'_, C, N>, name: N, runs: u32) {
    let nothing = |state: &mut (), (): &()| {
        black_box(state);
    };
    bench.measure(name, runs, (), |(), _| (), nothing, |(), (), _| ());
}

/// Function that measures the rows of one module; it returns `None` if an input is refused.
type Rows<C> = fn(&mut Bench<'_, C>) -> Option<()>;

/// Runs all algorithms and passes on each row when it is complete. All inputs are constants within
/// their ranges; a row with a refused input would be missing. `tables` may be any.
pub fn run<C: Clock>(clock: &C, tables: &mut MuscleTables, mut row: impl FnMut(&Row)) {
    let mut bench = Bench::new(clock, &mut row);
    measure_empty(&mut bench, "empty", 100);
    let algorithms: [Rows<C>; 6] = [
        muscle::run_benchmarks,
        inverse::run_benchmarks,
        control::run_benchmarks,
        haptics::run_benchmarks,
        pulse::run_benchmarks,
        link::run_benchmarks,
    ];
    for rows in algorithms {
        let _ = rows(&mut bench);
    }
    owners::run_benchmarks(&mut bench, tables);
    let slow: [Rows<C>; 3] = [
        inverse::run_slow_benchmarks,
        limb::run_benchmarks,
        haptics::run_lift_benchmarks,
    ];
    for rows in slow {
        let _ = rows(&mut bench);
    }
}

/// Marsaglia's xorshift32 generator (J. Stat. Softw. 8(14), 2003), with one seed for all
/// benchmarks.
pub struct Random(u32);

impl Default for Random {
    /// Returns the generator with the fixed seed.
    fn default() -> Self {
        Self(0x2545_F491)
    }
}

impl Random {
    /// Returns the next 32 bits.
    pub const fn word(&mut self) -> u32 {
        let mut x = self.0;
        x ^= x << 13;
        x ^= x >> 17;
        x ^= x << 5;
        self.0 = x;
        x
    }

    /// Returns a random number in `low..high`; `high` must be above `low`.
    pub const fn between(&mut self, low: u32, high: u32) -> u32 {
        let span = high.wrapping_sub(low) as u64;
        // Below span.
        low.wrapping_add(((self.word() as u64 * span) >> 32) as u32)
    }
}

/// FNV-1a hash over 32-bit words, least significant byte first.
pub struct Checksum(u32);

impl Default for Checksum {
    /// Returns the initial value of FNV-1a.
    fn default() -> Self {
        Self(0x811C_9DC5)
    }
}

impl Checksum {
    /// Returns the checksum of all bytes so far.
    #[must_use]
    pub const fn value(&self) -> u32 {
        self.0
    }

    /// Adds the four bytes of `word`, least significant first.
    pub fn add_word(&mut self, word: u32) {
        self.add_bytes(&word.to_le_bytes());
    }

    /// Adds channels and amplitudes of a joint or a wall.
    fn add_amplitudes(&mut self, amplitudes: &Amplitudes) {
        for (channel, amplitude) in amplitudes {
            self.add_word(u32::from(*channel));
            self.add_word(amplitude.get());
        }
    }

    /// Adds `bytes` in order.
    pub fn add_bytes(&mut self, bytes: &[u8]) {
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
        let collect_rows = || {
            let mut rows = Vec::new();
            let mut tables = std::boxed::Box::new(MuscleTables::NONE);
            run(&NoClock, &mut tables, |row| rows.push(*row));
            rows
        };
        let rows = collect_rows();
        assert_eq!(rows, collect_rows());
        for (n, row) in rows.iter().enumerate() {
            std::println!("{:28} {:5} {:08x}", row.name, row.runs, row.checksum);
            assert!(rows.iter().skip(n + 1).all(|other| other.name != row.name));
            let is_empty = row.checksum == Checksum::default().0;
            assert_eq!(is_empty, row.name == "empty", "{}", row.name);
        }
    }

    #[test]
    fn the_checksum_is_fnv_1a() {
        let mut sum = Checksum::default();
        sum.add_bytes(b"foobar");
        assert_eq!(sum.0, 0xBF9C_F968); // published test vector
    }
}
