//! Measures the cost of each of the device's algorithms, and checks that every backend computes the
//! same results.
//!
//! Runs the `bench` image on the host, in QEMU and on the chip simulator ([`bench`]), and CoreMark
//! on the chip simulator ([`coremark`]). Returns [`Bench`] and [`CoreMark`]. The algorithms and
//! their inputs are in `firmware::bench`, tables and figures in `cli` and `figures`.

mod coremark;
mod emulator;
mod row;

pub use coremark::{CoreMark, PUBLISHED, Reading, coremark};
pub use row::{Deadline, Row, RowError, csv};

use firmware::bench::NoClock;
use firmware::device::MuscleTables;
use hal_sim::chip::alone::{self, AloneError, FlashWait};
use hal_sim::chip::image::{self, ImageError};
use hal_sim::chip::soc::flash::Prefetched;
use hal_sim::images::{BuildError, Image};
use hal_sim::qemu::StartError;
use host_core::run::images;
use std::path::Path;
use std::time::{Duration, Instant};

/// Name of the row that measures an empty call: only the two readings of the cycle counter around
/// it.
const MARKERS: &str = "empty";

/// The reason why a benchmark failed.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// An image was not built.
    #[error("E543 no firmware image: {0}")]
    Build(BuildError),
    /// The built file cannot be flashed.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The image did not run to its end on the chip simulator.
    #[error(transparent)]
    Chip(#[from] AloneError),
    /// QEMU could not run the image.
    #[error("E510 QEMU is not available: {0}")]
    Qemu(StartError),
    /// A line that the image printed is not a row of the table.
    #[error(transparent)]
    Row(#[from] RowError),
}

impl From<BuildError> for BenchError {
    fn from(error: BuildError) -> Self {
        Self::Build(error)
    }
}

impl From<StartError> for BenchError {
    fn from(error: StartError) -> Self {
        Self::Qemu(error)
    }
}

/// Speed at which a simulator ran the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speed {
    /// Number of instructions that the image executes.
    pub instructions: u64,
    /// Time that the run took on this computer.
    pub time: Duration,
}

impl Speed {
    /// Returns the simulator's speed in million instructions per second.
    pub fn mips(&self) -> f64 {
        self.instructions as f64 * 1e-6 / self.time.as_secs_f64().max(1e-9)
    }
}

/// Results of the algorithms on the chip simulator.
#[derive(Clone, Debug)]
pub struct OnChip {
    /// One row for each algorithm, in the order of the image. The cycles of the measurement itself
    /// ([`Self::overhead`]) are subtracted.
    pub rows: Vec<Row>,
    /// The same rows for the other interpretation of the manual, in which a prefetched flash line
    /// does not enter the instruction cache.
    pub not_cached: Vec<Row>,
    /// Cycles that the measurement itself takes and that are subtracted from all rows: the minimum
    /// of the row that measures nothing.
    pub overhead: u64,
    /// The same as `overhead`, for the rows of `not_cached`.
    pub overhead_not_cached: u64,
    /// Core clock cycles of the whole run, from reset to the end of the image.
    pub cycles: u64,
    /// Speed of the chip simulator during this run.
    pub speed: Speed,
}

impl OnChip {
    /// Formats the rows as the table that is committed in docs/charts.
    pub fn csv(&self) -> String {
        csv(&self.rows, &self.not_cached)
    }

    /// Returns each row of `rows` with its counterpart in `not_cached`.
    pub fn row_pairs(&self) -> impl Iterator<Item = (&Row, &Row)> {
        self.rows.iter().zip(&self.not_cached)
    }

    /// Returns the rows that measure an algorithm, which are all of `rows` except the one that
    /// measures nothing.
    pub fn algorithms(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| row.name != MARKERS)
    }
}

/// Results of the image on the host, in QEMU and on the chip simulator.
#[derive(Clone, Debug)]
pub struct Bench {
    /// Rows of the code compiled for this computer; only calls and checksums are meaningful.
    pub host: Vec<Row>,
    /// Rows that the image printed in QEMU; only calls and checksums are meaningful.
    pub qemu: Vec<Row>,
    pub chip: OnChip,
    /// Speed of QEMU without instruction counting.
    pub qemu_speed: Speed,
    /// Speed of QEMU with instruction counting (`-icount`), which makes its runs repeatable.
    pub qemu_icount_speed: Speed,
}

impl Bench {
    /// Returns the names of algorithms whose results are not the same everywhere: on the host, in
    /// QEMU, and on the chip simulator with either interpretation of the prefetch. Includes
    /// algorithms that are missing in one of them.
    pub fn differing_algorithms(&self) -> Vec<String> {
        let result = |rows: &[Row], name: &str| {
            let row = rows.iter().find(|row| row.name == name)?;
            Some((row.calls, row.checksum))
        };
        let others = [&self.qemu, &self.chip.rows, &self.chip.not_cached];
        let mut names: Vec<_> = others
            .into_iter()
            .chain([&self.host])
            .flatten()
            .map(|row| row.name.clone())
            .collect();
        names.sort();
        names.dedup();
        names.retain(|name| {
            let host = result(&self.host, name);
            host.is_none() || others.iter().any(|rows| host != result(rows, name))
        });
        names
    }
}

/// Builds the image and runs it on all backends; `step` receives the finished part, 0 to 1.
pub fn bench(step: impl Fn(f64)) -> Result<Bench, BenchError> {
    let elf = images::find(Image::Bench)?;
    step(0.3);
    let mut host = Vec::new();
    let mut tables = Box::new(MuscleTables::NONE);
    firmware::bench::run(&NoClock, &mut tables, |row| host.push(Row::from(row)));
    step(0.4);
    let chip = run_on_chip(&elf)?;
    step(0.8);
    let instructions = chip.speed.instructions;
    let speed = |time| Speed { instructions, time };
    let (console, fast) = emulator::run(&elf, &[])?;
    step(0.9);
    let (_, counting) = emulator::run(&elf, &["-icount", "shift=0,sleep=off"])?;
    step(1.0);
    Ok(Bench {
        host,
        qemu: row::parse(&console)?,
        chip,
        qemu_speed: speed(fast),
        qemu_icount_speed: speed(counting),
    })
}

/// Builds the image and runs it on the chip simulator only, once for each interpretation of the
/// flash prefetch.
pub fn on_chip() -> Result<OnChip, BenchError> {
    run_on_chip(&images::find(Image::Bench)?)
}

/// Builds an image that prints rows, runs it on the chip simulator with the default flash timing,
/// and returns its rows.
pub fn rows_on_chip(image: Image) -> Result<Vec<Row>, BenchError> {
    let elf = images::find(image)?;
    let ended = alone::run(&image::Image::open(&elf)?, FlashWait::default())?;
    Ok(row::parse(&ended.console)?)
}

/// Runs the benchmark image `elf` on the chip simulator only, once for each interpretation of the
/// flash prefetch.
pub fn run_on_chip(elf: &Path) -> Result<OnChip, BenchError> {
    let image = image::Image::open(elf)?;
    let begin = Instant::now();
    let ended = alone::run(&image, FlashWait::default())?;
    let time = begin.elapsed();
    let (rows, overhead) = subtract_markers(&ended.console)?;
    let other = alone::run(&image, FlashWait::States(Prefetched::NotCached))?;
    let (not_cached, overhead_not_cached) = subtract_markers(&other.console)?;
    Ok(OnChip {
        rows,
        not_cached,
        overhead,
        overhead_not_cached,
        cycles: ended.cycles,
        speed: Speed {
            instructions: ended.instructions,
            time,
        },
    })
}

/// Parses the rows, subtracts the cycles of the measurement itself from each, and returns them with
/// those cycles.
fn subtract_markers(console: &str) -> Result<(Vec<Row>, u64), RowError> {
    let mut rows = row::parse(console)?;
    let markers = rows.iter().find(|row| row.name == MARKERS);
    let overhead = markers.map_or(0, |row| row.min);
    for row in &mut rows {
        row.subtract_overhead(overhead);
    }
    Ok((rows, overhead))
}
