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
use hal_sim::chip::alone::{self, AloneError, FlashWait};
use hal_sim::chip::image::{self, ImageError};
use hal_sim::chip::soc::flash::Prefetched;
use hal_sim::images::{BuildError, Image};
use hal_sim::qemu::StartError;
use host_core::run::images;
use std::path::Path;
use std::time::{Duration, Instant};

/// Name of the row that measures only the markers.
const MARKERS: &str = "empty";

/// The reason why a benchmark failed.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// An image was not built.
    #[error("E543 {0}")]
    Build(BuildError),
    /// The built file cannot be flashed.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The image did not run to its end on the chip simulator.
    #[error(transparent)]
    Chip(#[from] AloneError),
    /// QEMU could not run the image.
    #[error("E510 {0}")]
    Qemu(StartError),
    /// The image printed other lines than rows.
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

/// Speed at which a backend ran the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speed {
    /// Number of instructions of the image.
    pub instructions: u64,
    /// Wall time on this computer.
    pub time: Duration,
}

impl Speed {
    /// Returns million instructions per second.
    pub fn mips(&self) -> f64 {
        self.instructions as f64 * 1e-6 / self.time.as_secs_f64().max(1e-9)
    }
}

/// Results of the algorithms on the chip simulator.
#[derive(Clone, Debug)]
pub struct OnChip {
    /// Rows in the image's order; cycles without those of the markers.
    pub rows: Vec<Row>,
    /// The same rows if prefetched lines are not cached.
    pub not_cached: Vec<Row>,
    /// Cycles of the markers that were subtracted: the minimum of the row that measures nothing.
    pub overhead: u64,
    /// The same cycles if prefetched lines are not cached.
    pub overhead_not_cached: u64,
    /// Cycles from reset to the end.
    pub cycles: u64,
    /// Speed of the simulator.
    pub speed: Speed,
}

impl OnChip {
    /// Returns the committed table.
    pub fn csv(&self) -> String {
        csv(&self.rows, &self.not_cached)
    }

    /// Returns each row for both readings of the flash, the default first.
    pub fn row_pairs(&self) -> impl Iterator<Item = (&Row, &Row)> {
        self.rows.iter().zip(&self.not_cached)
    }

    /// Returns the rows that measure an algorithm, for the default reading of the flash.
    pub fn algorithms(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| row.name != MARKERS)
    }
}

/// Results of all backends.
#[derive(Clone, Debug)]
pub struct Bench {
    /// The host build: checksums only.
    pub host: Vec<Row>,
    /// QEMU: checksums only.
    pub qemu: Vec<Row>,
    pub chip: OnChip,
    /// Speed of QEMU without instruction counting.
    pub qemu_speed: Speed,
    /// Speed of QEMU with instruction counting, which makes runs repeatable (`-icount`).
    pub qemu_icount_speed: Speed,
}

impl Bench {
    /// Returns the names of algorithms whose results differ between the three backends or the two
    /// readings of the flash, or are missing somewhere.
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

/// Builds the image and runs it on all backends; `step` receives the finished part.
pub fn bench(step: impl Fn(f64)) -> Result<Bench, BenchError> {
    let elf = images::find(Image::Bench)?;
    step(0.3);
    let mut host = Vec::new();
    firmware::bench::run(&NoClock, |row| host.push(Row::from(row)));
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

/// Builds the image and runs it on the chip simulator only, with both readings of the flash.
pub fn on_chip() -> Result<OnChip, BenchError> {
    run_on_chip(&images::find(Image::Bench)?)
}

/// Builds an image that prints rows and runs it on the chip simulator, with the default reading of
/// the flash.
pub fn rows_on_chip(image: Image) -> Result<Vec<Row>, BenchError> {
    let elf = images::find(image)?;
    let ended = alone::run(&image::Image::open(&elf)?, FlashWait::default())?;
    Ok(row::parse(&ended.console)?)
}

fn run_on_chip(elf: &Path) -> Result<OnChip, BenchError> {
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

/// Returns the rows without the cycles of the markers, and those cycles.
fn subtract_markers(console: &str) -> Result<(Vec<Row>, u64), RowError> {
    let mut rows = row::parse(console)?;
    let markers = rows.iter().find(|row| row.name == MARKERS);
    let overhead = markers.map_or(0, |row| row.min);
    for row in &mut rows {
        row.subtract_overhead(overhead);
    }
    Ok((rows, overhead))
}
