//! CoreMark on the chip simulator: a benchmark to which no parameter was fitted.

use super::{BenchError, RowError};
use hal_sim::chip::alone::{self, FlashWait};
use hal_sim::chip::image::Image;
use host_core::run::images;

/// CoreMark per MHz as published: by ST for the STM32F405 at 168 MHz, and by Arm for the Cortex-M4.
/// Both are results of the C program with other compilers.
pub const PUBLISHED: [f64; 2] = [3.37, 3.40];

/// CoreMark's result with one model of the flash timing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Model of the flash's wait states.
    pub wait: FlashWait,
    /// Number of iterations that were timed.
    pub iterations: u64,
    /// Core clock cycles of all measured iterations together.
    pub cycles: u64,
    /// Core clock cycles of the same number of iterations with the flash prefetch switched off.
    pub cycles_without_prefetch: u64,
}

impl Reading {
    /// Returns the usual CoreMark score: iterations per second and MHz.
    pub fn per_mhz(&self) -> f64 {
        self.iterations as f64 * 1e6 / self.cycles.max(1) as f64
    }

    /// Returns the CoreMark score with the flash prefetch switched off, iterations per second and
    /// MHz.
    pub fn per_mhz_without_prefetch(&self) -> f64 {
        self.iterations as f64 * 1e6 / self.cycles_without_prefetch.max(1) as f64
    }
}

/// Results of CoreMark with all models of the flash timing.
#[derive(Clone, Debug, PartialEq)]
pub struct CoreMark {
    /// One result for each of [`FlashWait::ALL`], from the same program.
    pub readings: Vec<Reading>,
    /// Compiler and its options, as the program prints them.
    pub compiler: String,
    /// Instructions of a whole run divided by all its iterations: an upper bound for one iteration.
    pub instructions_per_iteration: u64,
}

/// Builds CoreMark and runs it once with each model of the flash timing.
///
/// # Errors
/// Returns [`BenchError`] if the build or a run fails, or the results are wrong.
pub fn coremark() -> Result<CoreMark, BenchError> {
    let elf = images::find_coremark()?;
    let image = Image::open(&elf)?;
    let mut readings = Vec::new();
    let mut compiler = String::new();
    let mut instructions_per_iteration = 0;
    for wait in FlashWait::ALL {
        let ended = alone::run(&image, wait)?;
        let result = read(wait, &ended.console);
        let (reading, words) = result.ok_or_else(|| RowError::new(&ended.console))?;
        // The program runs one iteration, then one and the measured ones, then all of that again
        // with prefetch off.
        instructions_per_iteration = ended.instructions / (2 * (reading.iterations + 2));
        readings.push(reading);
        compiler = words;
    }
    Ok(CoreMark {
        readings,
        compiler,
        instructions_per_iteration,
    })
}

/// Parses the console output: the lines `iterations N cycles N`, `CoreMark/MHz X COMPILER` and
/// `prefetch off: iterations N cycles N`. Returns the result and the compiler.
fn read(wait: FlashWait, console: &str) -> Option<(Reading, String)> {
    let lines: Vec<&str> = console.lines().collect();
    let [_, counts, words, _, without, ..] = lines[..] else {
        return None;
    };
    let (iterations, cycles) = parse_counts(counts)?;
    let (as_many, cycles_without_prefetch) = parse_counts(without.strip_prefix("prefetch off: ")?)?;
    let (_, compiler) = words.strip_prefix("CoreMark/MHz ")?.split_once(' ')?;
    let reading = Reading {
        wait,
        iterations,
        cycles,
        cycles_without_prefetch,
    };
    (as_many == iterations).then(|| (reading, compiler.to_owned()))
}

/// Parses both numbers of a line `iterations N cycles N`.
fn parse_counts(line: &str) -> Option<(u64, u64)> {
    let counts: Vec<&str> = line.split(' ').collect();
    let ["iterations", iterations, "cycles", cycles] = counts[..] else {
        return None;
    };
    Some((iterations.parse().ok()?, cycles.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_words_are_read() {
        let console = "crclist e714 valid\niterations 10 cycles 5000000\n\
                       CoreMark/MHz 2.000 rustc 1.95.0 opt-level=3\n\
                       prefetch off: crclist e714 valid\n\
                       prefetch off: iterations 10 cycles 4000000\n\
                       prefetch off: CoreMark/MHz 2.500 rustc 1.95.0 opt-level=3\n";
        let (reading, compiler) = read(FlashWait::Never, console).unwrap();
        assert_eq!(reading.per_mhz(), 2.0);
        assert_eq!(reading.per_mhz_without_prefetch(), 2.5);
        assert_eq!(compiler, "rustc 1.95.0 opt-level=3");
        let other = console.replace("iterations 10 cycles 4", "iterations 9 cycles 4");
        for wrong in ["crclist\niterations ten cycles 1\n", &other] {
            assert_eq!(read(FlashWait::Never, wrong), None);
        }
    }
}
