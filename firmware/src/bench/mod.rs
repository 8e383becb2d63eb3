//! Every algorithm of the device, once per call between two markers.
//!
//! Lives here: which algorithms, on which inputs (a fixed seed), and what of
//! their results is summed up. Not here: a clock, or where rows are printed.
//! In: a cycle counter. Out: per algorithm a [`Row`]; its checksum is the same
//! on every machine, its cycles are one machine's.

pub mod control;
mod haptics;
mod inverse;
pub mod limb;
mod link;
mod muscle;
mod owners;
mod pulse;

use crate::control::Amplitudes;
use core::fmt;
use core::hint::black_box;

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
/// call: those of the row `measure_empty`.
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

/// Takes measurements with one clock and hands over each row when it is complete.
pub struct Bench<'a, C, N = &'static str> {
    clock: &'a C,
    report: &'a mut dyn FnMut(&Row<N>),
}

/// One run's state, its input and its answer, in one place.
struct Case<S, I, A, R> {
    state: S,
    input: I,
    answer: A,
    run: R,
}

impl<'a, C: Clock, N> Bench<'a, C, N> {
    /// With this clock, reporting there.
    pub fn new(clock: &'a C, report: &'a mut dyn FnMut(&Row<N>)) -> Self {
        Self { clock, report }
    }

    /// Measures `run` on `runs` inputs that `prepare` makes; it allocates nothing
    /// and waits for nothing. `digest` sums up what each run answered or changed.
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

/// One run, as one function that a profile can name.
#[inline(never)]
fn marked<S, I, A, R: FnMut(&mut S, &I) -> A>(case: &mut Case<S, I, A, R>) {
    case.answer = (case.run)(&mut case.state, &case.input);
}

/// What the markers themselves take.
pub fn measure_empty<C: Clock, N>(bench: &mut Bench<'_, C, N>, name: N, runs: u32) {
    let nothing = |state: &mut (), (): &()| {
        black_box(state);
    };
    bench.measure(name, runs, (), |(), _| (), nothing, |(), (), _| ());
}

/// Rows of one room; `None` where an input is refused.
type Rows<C> = fn(&mut Bench<'_, C>) -> Option<()>;

/// Runs all algorithms and hands over each row when it is complete. All inputs are
/// constants within their ranges; a row whose were refused would be missing.
pub fn run<C: Clock>(clock: &C, mut row: impl FnMut(&Row)) {
    let mut bench = Bench::new(clock, &mut row);
    measure_empty(&mut bench, "empty", 100);
    let rooms: [Rows<C>; 10] = [
        muscle::run_benchmarks,
        inverse::run_benchmarks,
        control::run_benchmarks,
        haptics::run_benchmarks,
        pulse::run_benchmarks,
        link::run_benchmarks,
        owners::run_benchmarks,
        inverse::run_slow_benchmarks,
        limb::run_benchmarks,
        haptics::run_lift_benchmarks,
    ];
    for rows in rooms {
        let _ = rows(&mut bench);
    }
}

/// Marsaglia's xorshift32 (J. Stat. Softw. 8(14), 2003), one seed for all.
pub struct Random(u32);

impl Default for Random {
    /// From the one seed.
    fn default() -> Self {
        Self(0x2545_F491)
    }
}

impl Random {
    /// The next 32 bits.
    pub const fn word(&mut self) -> u32 {
        let mut x = self.0;
        x ^= x << 13;
        x ^= x >> 17;
        x ^= x << 5;
        self.0 = x;
        x
    }

    /// `low..high`; `high` must be above `low`.
    pub const fn between(&mut self, low: u32, high: u32) -> u32 {
        let span = high.wrapping_sub(low) as u64;
        // Below span.
        low.wrapping_add(((self.word() as u64 * span) >> 32) as u32)
    }
}

/// FNV-1a over 32-bit words, least significant byte first.
pub struct Checksum(u32);

impl Default for Checksum {
    /// Of nothing.
    fn default() -> Self {
        Self(0x811C_9DC5)
    }
}

impl Checksum {
    /// Of all so far.
    #[must_use]
    pub const fn value(&self) -> u32 {
        self.0
    }

    /// Adds a word.
    pub fn add_word(&mut self, word: u32) {
        self.add_bytes(&word.to_le_bytes());
    }

    /// Adds what a joint or a wall asks for.
    fn add_amplitudes(&mut self, amplitudes: &Amplitudes) {
        for (channel, amplitude) in amplitudes {
            self.add_word(u32::from(*channel));
            self.add_word(amplitude.get());
        }
    }

    /// Adds bytes.
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
