//! What each algorithm of the device costs, and that it gives the same results
//! wherever it runs.
//!
//! Here: the `bench` image on the host, in QEMU and on the chip simulator
//! ([`bench`]), CoreMark on the chip simulator ([`coremark`]). Not here: the
//! algorithms and their inputs (`firmware::bench`), tables and pictures
//! (`cli`, `figures`). In: this checkout. Out: [`Bench`], [`CoreMark`].

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

/// The row that measures nothing but the markers.
const MARKERS: &str = "empty";

/// Why nothing could be measured.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// An image was not built.
    #[error("E543 {0}")]
    Build(BuildError),
    /// What was built cannot be flashed.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// It did not run to its end on the chip simulator.
    #[error(transparent)]
    Chip(#[from] AloneError),
    /// QEMU.
    #[error("E510 {0}")]
    Qemu(StartError),
    /// The image said something else than rows.
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

/// How fast a machine ran the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speed {
    /// Instructions of the image.
    pub instructions: u64,
    /// Of this computer.
    pub time: Duration,
}

impl Speed {
    /// Million instructions per second.
    pub fn mips(&self) -> f64 {
        self.instructions as f64 * 1e-6 / self.time.as_secs_f64().max(1e-9)
    }
}

/// The algorithms on the chip simulator.
#[derive(Clone, Debug)]
pub struct OnChip {
    /// In the image's order; cycles without the markers'.
    pub rows: Vec<Row>,
    /// The same rows if prefetched lines are not cached.
    pub not_cached: Vec<Row>,
    /// What was taken off: the fewest cycles of the row that measures nothing.
    pub overhead: u64,
    /// The same if prefetched lines are not cached.
    pub overhead_not_cached: u64,
    /// From reset to the end.
    pub cycles: u64,
    /// Of the simulator.
    pub speed: Speed,
}

impl OnChip {
    /// The committed table.
    pub fn csv(&self) -> String {
        csv(&self.rows, &self.not_cached)
    }

    /// Each row in both readings of the flash, the default first.
    pub fn row_pairs(&self) -> impl Iterator<Item = (&Row, &Row)> {
        self.rows.iter().zip(&self.not_cached)
    }

    /// The rows that measure an algorithm, in the default reading.
    pub fn algorithms(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| row.name != MARKERS)
    }
}

/// All machines in one run.
#[derive(Clone, Debug)]
pub struct Bench {
    /// The host build: checksums only.
    pub host: Vec<Row>,
    /// QEMU: checksums only.
    pub qemu: Vec<Row>,
    /// The chip simulator.
    pub chip: OnChip,
    /// QEMU as fast as it can.
    pub qemu_speed: Speed,
    /// QEMU counting instructions, so that runs repeat (`-icount`).
    pub qemu_icount_speed: Speed,
}

impl Bench {
    /// Names of the algorithms whose results are not the same on all three and
    /// in both readings of the flash, or that are missing somewhere.
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

/// Builds the image and runs it everywhere; `step` hears the part done.
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

/// Builds the image and runs it on the chip simulator only, the flash read in
/// both ways.
pub fn on_chip() -> Result<OnChip, BenchError> {
    run_on_chip(&images::find(Image::Bench)?)
}

/// Builds an image that prints rows and runs it on the chip simulator, the
/// flash read in the default way.
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

/// The image's rows without the cycles of its markers, and those.
fn subtract_markers(console: &str) -> Result<(Vec<Row>, u64), RowError> {
    let mut rows = row::parse(console)?;
    let markers = rows.iter().find(|row| row.name == MARKERS);
    let overhead = markers.map_or(0, |row| row.min);
    for row in &mut rows {
        row.subtract_overhead(overhead);
    }
    Ok((rows, overhead))
}
