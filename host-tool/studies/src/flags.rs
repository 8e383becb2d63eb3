//! Comparison of compiler flags for the device images: cycles, load, margins and latencies against
//! the flash that they take.
//!
//! In: a checkout, in which cargo builds the images `stimulator` and `bench` with each of
//! [`DECLARED`]. Out: one [`Row`] for each, counted by the chip simulator. The choice follows a rule
//! that was fixed before the rows were seen: [`choose`].

use crate::bench::{self, BenchError};
use hal_sim::chip::image::Image as ChipImage;
use hal_sim::chip::profile::exception;
use hal_sim::chip::soc::flash::Prefetched;
use hal_sim::images::Image;
use host_core::clock::ProcessorClock;
use host_core::run::{ProfileError, Profiled, RunError, SessionFile, profile};
use std::path::Path;

/// LLVM's thresholds for inlining and unrolling at these levels.
const DEFAULT_INLINE: u32 = 225;
const DEFAULT_UNROLL: u32 = 150;

/// Flags of the device images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flags {
    /// Level of optimisation.
    pub opt_level: &'static str,
    /// Cost up to which LLVM inlines a function; `#[inline(always)]` has none.
    pub inline: u32,
    /// Cost up to which LLVM unrolls a loop.
    pub unroll: u32,
}

const fn flags(opt_level: &'static str, inline: u32, unroll: u32) -> Flags {
    Flags {
        opt_level,
        inline,
        unroll,
    }
}

/// The compared flags. The first ones are those that the images had before this comparison.
pub const DECLARED: [Flags; 9] = [
    flags("2", 25, 50),
    flags("s", DEFAULT_INLINE, DEFAULT_UNROLL),
    flags("2", 50, DEFAULT_UNROLL),
    flags("2", 100, DEFAULT_UNROLL),
    flags("2", DEFAULT_INLINE, DEFAULT_UNROLL),
    flags("3", 25, DEFAULT_UNROLL),
    flags("3", 50, DEFAULT_UNROLL),
    flags("3", 100, DEFAULT_UNROLL),
    flags("3", DEFAULT_INLINE, DEFAULT_UNROLL),
];

/// Most flash that the choice may take, bytes: half of what `memory.x` leaves to the program.
pub const FLASH_LIMIT: u64 = 384 * 1024;
/// Difference of the mean cycles below which the smaller image is chosen.
pub const SAME: f64 = 0.01;
/// Seed of the simulated wearer.
pub const SEED: u64 = 1;
/// Measured length, s of device time.
pub const SECONDS: f64 = 4.0;

impl Flags {
    /// Returns the arguments of rustc, one word each.
    #[must_use]
    pub fn arguments(self) -> Vec<String> {
        let mut words = vec!["-C".to_owned(), format!("opt-level={}", self.opt_level)];
        let mut llvm = Vec::new();
        if self.inline != DEFAULT_INLINE {
            llvm.push(format!("-inline-threshold={}", self.inline));
        }
        if self.unroll != DEFAULT_UNROLL {
            llvm.push(format!("-unroll-threshold={}", self.unroll));
        }
        if !llvm.is_empty() {
            words.extend(["-C".to_owned(), format!("llvm-args={}", llvm.join(" "))]);
        }
        words
    }

    /// Returns the name in table and figure, such as `3, 100`.
    #[must_use]
    pub fn name(self) -> String {
        match self.unroll {
            DEFAULT_UNROLL => format!("{}, {}", self.opt_level, self.inline),
            unroll => format!("{}, {}, {unroll}", self.opt_level, self.inline),
        }
    }
}

/// Figures of one session on the stimulator's image, each the worse of the two interpretations of
/// the flash prefetch.
#[derive(Clone, Debug, PartialEq)]
pub struct Load {
    /// Share of the time in which the core is awake, %.
    pub load_percent: f64,
    /// Smallest time from the last write of a window to its first read, cycles.
    pub margin: i64,
    /// Longest wait of the control tick's interrupt, cycles.
    pub tick_latency: u64,
    /// Longest wait of USB's interrupt, cycles.
    pub usb_latency: u64,
    /// Deepest stack, bytes.
    pub stack: u32,
    /// Core cycles from power-on until device time runs.
    pub boot: u64,
}

/// Result of one set of flags.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Arguments of the compiler.
    pub flags: Flags,
    /// Flash of the stimulator's image, bytes.
    pub flash: u64,
    /// Geometric mean of the benchmark's mean cycles, relative to the first of [`DECLARED`], in each
    /// interpretation of the prefetch.
    pub cycles: [f64; 2],
    /// Figures under full load; `None` if the session did not play, because the device reported a
    /// fault.
    pub load: Option<Load>,
}

impl Row {
    /// Returns the geometric mean of the cycles over both interpretations of the prefetch.
    #[must_use]
    pub fn mean_cycles(&self) -> f64 {
        let [cached, not_cached] = self.cycles;
        (cached * not_cached).sqrt()
    }
}

/// Reason why the comparison ended.
#[derive(Debug, thiserror::Error)]
pub enum FlagsError {
    /// An image was not built, or did not run.
    #[error(transparent)]
    Bench(#[from] BenchError),
    /// The session did not run.
    #[error(transparent)]
    Profile(#[from] ProfileError),
}

/// Builds and measures each of `declared` in `checkout`; `step` receives the finished part, 0 to 1.
///
/// # Errors
/// Fails if an image cannot be built or does not run.
pub fn compare(
    declared: &[Flags],
    checkout: &Path,
    session: &SessionFile,
    step: impl Fn(f64),
) -> Result<Vec<Row>, FlagsError> {
    let mut first: Option<[Vec<f64>; 2]> = None;
    let mut rows = Vec::new();
    for (n, &flags) in declared.iter().enumerate() {
        step(n as f64 / declared.len() as f64);
        let build = |image: Image| {
            let target = checkout.join("target/flags");
            let built = image.build_with_flags(checkout, &target, &flags.arguments());
            built.map_err(BenchError::from)
        };
        let on_chip = bench::run_on_chip(&build(Image::Bench)?)?;
        let means = [&on_chip.rows, &on_chip.not_cached]
            .map(|rows| rows.iter().map(|row| row.mean as f64).collect::<Vec<_>>());
        let base = first.get_or_insert_with(|| means.clone());
        let ratio = |n: usize| geometric_mean(&means[n], &base[n]);
        let cycles = [ratio(0), ratio(1)];
        let image = ChipImage::open(&build(Image::Stimulator)?).map_err(BenchError::from)?;
        rows.push(Row {
            flags,
            flash: image.size.into(),
            cycles,
            load: load_of(&image, session)?,
        });
    }
    step(1.0);
    Ok(rows)
}

/// Returns the geometric mean of the ratios of `values` to `base`, without pairs in which one is 0:
/// the row that measures nothing.
fn geometric_mean(values: &[f64], base: &[f64]) -> f64 {
    let pairs = values.iter().zip(base);
    let ratios = pairs.filter(|(value, base)| **value > 0.0 && **base > 0.0);
    let logs: Vec<f64> = ratios
        .map(|(value, base)| libm::log(value / base))
        .collect();
    libm::exp(logs.iter().sum::<f64>() / logs.len().max(1) as f64)
}

/// Returns `None` if the device reported a fault.
fn load_of(image: &ChipImage, session: &SessionFile) -> Result<Option<Load>, FlagsError> {
    match measure(image, session) {
        Ok(load) => Ok(Some(load)),
        Err(FlagsError::Profile(ProfileError::Run(RunError::Link(_) | RunError::Ended { .. }))) => {
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

fn measure(image: &ChipImage, session: &SessionFile) -> Result<Load, FlagsError> {
    let run = |prefetched| {
        let clock = ProcessorClock::start();
        profile(session, image, prefetched, SEED, &clock, |_| ())
    };
    let found = [run(Prefetched::Cached)?, run(Prefetched::NotCached)?];
    let worst = |of: &dyn Fn(&Profiled) -> u64| found.iter().map(of).max().unwrap_or(0);
    let latency = |name: &'static str| {
        worst(&|found| {
            let lines = found.summary.lines.iter();
            let named = lines.filter(|line| exception::name(line.number) == name);
            named.map(|line| line.latency.worst).max().unwrap_or(0)
        })
    };
    let margins = found.iter().filter_map(|found| found.summary.margins.worst);
    let loads = found.iter().map(|found| found.summary.load_percent());
    Ok(Load {
        load_percent: loads.fold(0.0, f64::max),
        margin: margins.min().unwrap_or(0),
        tick_latency: latency("TIM7"),
        usb_latency: latency("OTG_FS"),
        stack: worst(&|found| found.summary.stack.used().into()) as u32,
        boot: worst(&|found| found.booted.clock),
    })
}

/// Returns the index of the chosen row: of those that play and are within [`FLASH_LIMIT`] the one
/// with the fewest [cycles](Row::mean_cycles), or the smallest image within [`SAME`] of it.
#[must_use]
pub fn choose(rows: &[Row]) -> Option<usize> {
    let fits = |row: &&Row| row.flash <= FLASH_LIMIT && row.load.is_some();
    let least = rows
        .iter()
        .filter(fits)
        .map(Row::mean_cycles)
        .fold(f64::INFINITY, f64::min);
    let near = rows
        .iter()
        .enumerate()
        .filter(|(_, row)| fits(row) && row.mean_cycles() <= least * (1.0 + SAME));
    near.min_by_key(|(_, row)| row.flash).map(|(n, _)| n)
}

/// Formats the rows as the table docs/charts/flags.csv.
#[must_use]
pub fn csv(rows: &[Row]) -> String {
    let mut out = String::from(
        "opt_level,inline,unroll,flash_bytes,cycles,cycles_not_cached,load_percent,\
         refill_margin_cycles,tick_latency_cycles,usb_latency_cycles,stack_bytes,boot_cycles,chosen\n",
    );
    let chosen = choose(rows);
    for (n, row) in rows.iter().enumerate() {
        let Row {
            flags,
            flash,
            cycles: [cached, not_cached],
            load,
        } = row;
        let load = load.as_ref().map_or(",,,,,".to_owned(), |load| {
            format!(
                "{:.2},{},{},{},{},{}",
                load.load_percent,
                load.margin,
                load.tick_latency,
                load.usb_latency,
                load.stack,
                load.boot
            )
        });
        out.push_str(&format!(
            "{},{},{},{flash},{cached:.4},{not_cached:.4},{load},{}\n",
            flags.opt_level,
            flags.inline,
            flags.unroll,
            u8::from(chosen == Some(n))
        ));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(flash: u64, cycles: f64) -> Row {
        let load = Load {
            load_percent: 16.0,
            margin: 30_000,
            tick_latency: 80,
            usb_latency: 4_000,
            stack: 13_000,
            boot: 1_000_000,
        };
        Row {
            flags: DECLARED[0],
            flash,
            cycles: [cycles; 2],
            load: Some(load),
        }
    }

    #[test]
    fn the_choice_has_few_cycles_and_then_little_flash() {
        let rows = [(250, 1.0), (300, 0.9), (330, 0.895), (400, 0.5)];
        let rows = rows.map(|(kib, cycles)| row(kib * 1024, cycles));
        assert_eq!(choose(&rows), Some(1));
        assert_eq!(choose(&rows[..1]), Some(0));
        assert_eq!(choose(&rows[3..]), None);
        let mut silent = rows;
        silent[1].load = None;
        assert_eq!(
            choose(&silent),
            Some(2),
            "a row that does not play is not chosen"
        );
        assert!(csv(&silent).contains(",0.9000,0.9000,,,,,,,0\n"));
    }

    #[test]
    fn arguments_leave_out_defaults() {
        let words = |flags: Flags| flags.arguments().join(" ");
        assert_eq!(words(DECLARED[8]), "-C opt-level=3");
        assert_eq!(
            words(DECLARED[0]),
            "-C opt-level=2 -C llvm-args=-inline-threshold=25 -unroll-threshold=50"
        );
        assert_eq!(DECLARED[7].name(), "3, 100");
    }

    #[test]
    fn the_mean_of_ratios_is_geometric() {
        assert!((geometric_mean(&[2.0, 8.0], &[1.0, 1.0]) - 4.0).abs() < 1e-12);
        let without = geometric_mean(&[0.0, 2.0, 8.0], &[3.0, 1.0, 1.0]);
        assert!((without - 4.0).abs() < 1e-12, "a row that takes no cycles");
    }
}
