//! What `flexor chart ladder` measured, read from the tables that it commits.

use super::grid::{
    BURSTS_MS, LAW_PERIODS_MS, LOOP_BURSTS_MS, LOOP_RAMPS_MS, LOOP_RATES_MHZ, RAMPS_MS, RATES_MHZ,
    SESSIONS_S, STEPS_MS, TELEMETRY_MS, WORK_BURSTS_MS, WORK_RAMPS_MS, WORK_RATES_MHZ,
    WORK_SESSIONS_S,
};
use super::{Cycles, Share};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;
use std::sync::LazyLock;

/// The measurements that this program chooses by.
pub const COMMITTED: &str = include_str!("../../../../docs/charts/ladder.csv");
const CYCLES_CSV: &str = include_str!("../../../../docs/charts/cycles.csv");

/// Names of the rungs in rows.
pub const RUNG_NAMES: [&str; 4] = ["static", "lag", "calcium-force", "calcium-force-fatigue"];
/// Names of the discretizations in rows, explicit and implicit.
pub const DISCRETIZATION_NAMES: [&str; 2] = ["explicit", "implicit"];

/// The algorithms of `docs/charts/cycles.csv` that are a rung's tick without
/// and with a pulse, as the device runs it.
#[rustfmt::skip]
const CYCLE_ROWS: [[&str; 2]; 4] = [
    ["static_tick", "static_tick_and_pulse"],
    ["lag_tick", "lag_tick_and_pulse"],
    ["rung_tick", "rung_tick_and_pulse"],
    ["fatigue_tick", "fatigue_tick_and_pulse"],
];

/// What a row is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// Force of a rested muscle by a rung.
    Force,
    /// Force of a muscle at work, without or with fatigue in the model.
    Fatigue,
    /// Force drawn again from telemetry.
    Telemetry,
    /// Tracking of an angle, by law period and discretization.
    Law,
    /// Motion of the simulated body, by its step.
    Body,
    /// True force of a rested muscle in closed loop, if the top rung takes a
    /// rung's place.
    Change,
    /// The same of a muscle at work, for want of fatigue in the model.
    Tiring,
}

/// One measurement, in percent of the scene's peak.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// What is measured.
    pub quantity: Quantity,
    /// Burst, ms.
    pub burst_ms: Option<u32>,
    /// Ramp, ms.
    pub ramp_ms: Option<u32>,
    /// Lowest pulse rate, mHz.
    pub slowest_mhz: Option<u32>,
    /// Highest pulse rate, mHz.
    pub fastest_mhz: Option<u32>,
    /// Time at work, s.
    pub session_s: Option<u32>,
    /// Rung, period, discretization or step.
    pub candidate: String,
    /// Worst error over subjects and seeds.
    pub worst_pct: f64,
    /// Worst root-mean-square error.
    pub rms_pct: Option<f64>,
    /// Worst difference from the top rung's prediction.
    pub against_top_pct: Option<f64>,
}

impl Row {
    /// Where it belongs: its quantity, its scene and who was measured.
    #[must_use]
    pub fn key(&self) -> (Quantity, [Option<u32>; 5], &str) {
        let rates = [self.slowest_mhz, self.fastest_mhz];
        let [slowest, fastest] = rates;
        let scene = [
            self.burst_ms,
            self.ramp_ms,
            slowest,
            fastest,
            self.session_s,
        ];
        (self.quantity, scene, &self.candidate)
    }

    /// Its worst error, hundredths of a percent rounded up.
    #[must_use]
    pub fn share(&self) -> Share {
        // Rows have four decimals, so that 0.0100 is not rounded up to 0.02.
        let tenthousandths = (self.worst_pct * 1e4).round().clamp(0.0, 6_553_500.0) as u32;
        Share(tenthousandths.div_ceil(100) as u16) // at most 65 535
    }
}

/// The rows of a table.
///
/// # Errors
/// What cannot be read, with its line.
pub fn parse(text: &str) -> Result<Vec<Row>, csv::Error> {
    csv::Reader::from_reader(text.as_bytes())
        .deserialize()
        .collect()
}

/// What varies along an axis of a [`Table`], and its rising points.
type Axis = (fn(&Row) -> Option<u32>, &'static [u32]);

const BURST: fn(&Row) -> Option<u32> = |row| row.burst_ms;
const RAMP: fn(&Row) -> Option<u32> = |row| row.ramp_ms;
const SLOWEST: fn(&Row) -> Option<u32> = |row| row.slowest_mhz;
const FASTEST: fn(&Row) -> Option<u32> = |row| row.fastest_mhz;
const SESSION: fn(&Row) -> Option<u32> = |row| row.session_s;

impl Quantity {
    const ALL: [Self; 7] = [
        Self::Force,
        Self::Fatigue,
        Self::Telemetry,
        Self::Law,
        Self::Body,
        Self::Change,
        Self::Tiring,
    ];

    /// What it was measured over, in the order of a table's places.
    #[rustfmt::skip]
    const fn axes(self) -> &'static [Axis] {
        match self {
            Self::Force => &[(BURST, &BURSTS_MS), (RAMP, &RAMPS_MS), (SLOWEST, &RATES_MHZ), (FASTEST, &RATES_MHZ)],
            Self::Fatigue => &[(SESSION, &SESSIONS_S), (FASTEST, &RATES_MHZ)],
            Self::Telemetry => &[(BURST, &BURSTS_MS), (SLOWEST, &RATES_MHZ)],
            Self::Law | Self::Body => &[(RAMP, &RAMPS_MS)],
            Self::Change => &[(BURST, &LOOP_BURSTS_MS), (RAMP, &LOOP_RAMPS_MS), (SLOWEST, &LOOP_RATES_MHZ), (FASTEST, &LOOP_RATES_MHZ)],
            Self::Tiring => &[(SESSION, &WORK_SESSIONS_S), (BURST, &WORK_BURSTS_MS), (RAMP, &WORK_RAMPS_MS), (SLOWEST, &WORK_RATES_MHZ), (FASTEST, &WORK_RATES_MHZ)],
        }
    }

    /// Who was measured: of the law explicit at each period, then implicit.
    fn candidates(self) -> Vec<String> {
        fn ms<T: ToString>(all: &[T], name: &str) -> Vec<String> {
            let each = all.iter().map(|ms| format!("{name}{} ms", ms.to_string()));
            each.collect()
        }
        let rungs = RUNG_NAMES.map(str::to_owned);
        match self {
            Self::Force => rungs[..3].to_vec(),
            Self::Fatigue => rungs[2..].to_vec(),
            Self::Telemetry => ms(&TELEMETRY_MS, ""),
            Self::Law => [
                ms(&LAW_PERIODS_MS, "explicit "),
                ms(&LAW_PERIODS_MS, "implicit "),
            ]
            .concat(),
            Self::Body => ms(&STEPS_MS, ""),
            Self::Change => rungs[..2].to_vec(),
            Self::Tiring => rungs[2..3].to_vec(),
        }
    }
}

/// The shares of one quantity over some axes and, last, its candidates.
pub(super) struct Table {
    lengths: Vec<usize>,
    cells: Vec<Option<u16>>,
}

impl Table {
    fn of(all: &[Row], quantity: Quantity) -> Self {
        let (axes, candidates) = (quantity.axes(), quantity.candidates());
        let lengths = axes.iter().map(|(_, points)| points.len());
        let lengths: Vec<usize> = lengths.chain([candidates.len()]).collect();
        let mut cells = vec![None; lengths.iter().product()];
        for row in all.iter().filter(|row| row.quantity == quantity) {
            // A pair of rates has its cell in either order.
            let turned = Row {
                slowest_mhz: row.fastest_mhz,
                fastest_mhz: row.slowest_mhz,
                ..row.clone()
            };
            for row in [row, &turned] {
                let place = |(of, points): &Axis| points.iter().position(|p| Some(*p) == of(row));
                let candidate = candidates.iter().position(|name| *name == row.candidate);
                let mut places = axes.iter().map(place).chain([candidate]).zip(&lengths);
                if let Some(cell) = places.try_fold(0, |at, (n, length)| Some(at * length + n?)) {
                    cells[cell] = Some(row.share().0);
                }
            }
        }
        Self { lengths, cells }
    }

    /// A table of these cells, for tests.
    #[cfg(test)]
    pub(super) fn by(lengths: &[usize], cell: impl Fn(usize) -> Option<u16>) -> Self {
        Self {
            lengths: lengths.to_vec(),
            cells: (0..lengths.iter().product()).map(cell).collect(),
        }
    }

    /// How many points each axis has, the candidates last.
    pub(super) fn lengths(&self) -> &[usize] {
        &self.lengths
    }

    /// A cell by its place in the order of the axes; `None` if it was not measured.
    pub(super) fn cell(&self, at: usize) -> Option<u16> {
        self.cells.get(at).copied().flatten()
    }

    /// The worst of a candidate over a box of points; `None` if one of them was not
    /// measured.
    pub(super) fn worst<const N: usize>(
        &self,
        around: [RangeInclusive<usize>; N],
        candidate: usize,
    ) -> Option<u16> {
        let around = around.into_iter().chain([candidate..=candidate]);
        let cells = around
            .zip(&self.lengths)
            .fold(vec![0], |cells, (points, length)| {
                let along = |at| points.clone().map(move |point| at * length + point);
                cells.into_iter().flat_map(along).collect()
            });
        let mut found = cells.into_iter().map(|cell| self.cell(cell));
        found.try_fold(0, |worst: u16, cell| Some(worst.max(cell?)))
    }
}

/// [`COMMITTED`], by quantity.
static TABLES: LazyLock<[Table; 7]> = LazyLock::new(|| {
    let rows = parse(COMMITTED).expect("the committed table reads");
    Quantity::ALL.map(|quantity| Table::of(&rows, quantity))
});

/// All that was measured of a quantity.
pub(super) fn table(quantity: Quantity) -> &'static Table {
    &TABLES[quantity as usize]
}

/// Most cycles of each rung's tick on the chip simulator, cheapest rung first.
pub(super) static CYCLES: LazyLock<[Cycles; 4]> = LazyLock::new(cycles);

/// The columns `algorithm` and `max_cycles` of the cycles' table.
#[derive(Deserialize)]
struct CycleRow {
    algorithm: String,
    max_cycles: u32,
}

fn cycles() -> [Cycles; 4] {
    let mut reader = csv::Reader::from_reader(CYCLES_CSV.as_bytes());
    let rows: Vec<CycleRow> = reader.deserialize().flatten().collect();
    let most = |name: &str| {
        let row = rows.iter().find(|row| row.algorithm == name);
        row.map_or(u16::MAX, |row| {
            u16::try_from(row.max_cycles).unwrap_or(u16::MAX)
        })
    };
    CYCLE_ROWS.map(|[tick, with_pulse]| Cycles {
        tick: most(tick),
        tick_with_pulse: most(with_pulse),
    })
}
