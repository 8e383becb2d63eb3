//! Figure of error against device load for the families of integrators, drawn from the committed
//! table: one panel for each interval of reading, each family with its best settings only.

use crate::accuracy::WANTED_PCT;
use crate::accuracy::table::ChartRow;
use host_core::plot::ink::{BROWN, INK, MUTED, PALETTE, SKY, stroke};
use host_core::plot::{At, Axis, Color, Figure, Mark, Paint, Panel, Scale, Shape};
use methods::bench::OUTPUTS_US;

/// Methods that are drawn as one family.
struct Family {
    /// Name in the figure.
    name: &'static str,
    /// What the family is good for.
    purpose: &'static str,
    /// Names of the methods in the table.
    methods: &'static [&'static str],
    color: Color,
    shape: Shape,
}

const FAMILIES: [Family; 9] = [
    Family {
        name: "SHIPPED: table over intervals of log C",
        purpose: "the smallest errors in integers; needs a table for each muscle",
        methods: &["shipped"],
        color: INK,
        shape: Shape::Star,
    },
    Family {
        name: "segments",
        purpose: "the device's model where a muscle has no table, or tires",
        methods: &["segments"],
        color: INK,
        shape: Shape::Square,
    },
    Family {
        name: "Hermite–Simpson",
        purpose: "the best without a table",
        methods: &["hermite_simpson"],
        color: PALETTE[5],
        shape: Shape::Disc,
    },
    Family {
        name: "Runge–Kutta along exact C",
        purpose: "simple code in floating point; diverges at long steps of a fast muscle",
        methods: &["euler_exact_c", "heun_exact_c", "rk4_exact_c"],
        color: PALETTE[1],
        shape: Shape::Diamond,
    },
    Family {
        name: "exponential (Gauss, midpoint)",
        purpose: "never diverges, also at steps far beyond a time constant",
        methods: &["etd1", "etd_midpoint", "gauss_exponential"],
        color: PALETTE[0],
        shape: Shape::Up,
    },
    Family {
        name: "exponential Rosenbrock",
        purpose: "errors of a percent; elsewhere the exponential methods are cheaper",
        methods: &["rosenbrock_euler", "rosenbrock_3"],
        color: SKY,
        shape: Shape::Down,
    },
    Family {
        name: "exact solution from a table",
        purpose: "few readings; the table is slow to build, and constants must not change",
        methods: &["log_flow", "log_table"],
        color: PALETTE[2],
        shape: Shape::Square,
    },
    Family {
        name: "integral from pulse to pulse",
        purpose: "one reading per pulse or less",
        methods: &["event_driven_2", "event_driven_3", "event_driven_4"],
        color: BROWN,
        shape: Shape::Up,
    },
    Family {
        name: "Runge–Kutta on C and F",
        purpose: "a reference: C needs no steps",
        methods: &["rk4"],
        color: MUTED,
        shape: Shape::Diamond,
    },
];

/// The setting of Lee 2020, which has a mark of its own.
const PAPER: &str = "rk4_snapped";
/// Error above which people notice a difference of force, %; drawn as a line.
const NOTICED_PCT: f64 = 10.0;
/// Range of the errors, as powers of ten of %.
const ERRORS: (i32, i32) = (-4, 1);
/// Range of the load, cycles per second, and the loads with a label.
const LOAD: At = (2e4, 2e6);
const LABELLED: [f64; 7] = [2e4, 5e4, 1e5, 2e5, 5e5, 1e6, 2e6];
/// Core clock cycles per second.
const CORE_HZ: f64 = 168e6;

/// Draws the figure from the rows of docs/charts/accuracy.csv as an SVG file and returns its text.
pub fn picture(rows: &[ChartRow]) -> String {
    let panel = |output_us| vec![panel(rows, output_us)];
    let purposes = FAMILIES
        .iter()
        .map(|f| format!("{}: {}.", f.name, f.purpose));
    let notes = [
        "Lower is more exact, further left is cheaper. A mark is one setting (step and arithmetic); \
         a family shows only its settings that no other of the family beats, without double \
         precision. Errors are the worst of 140 trains, in % of the largest force of the train. \
         Simulated: cycles are counted by the chip simulator.",
        "",
        "What each family is good for",
    ];
    Figure {
        title: "What does a muscle's force cost on the device, and how exact is it?".to_owned(),
        description:
            "Worst error in percent of peak force against core clock cycles per simulated \
                      second, for families of integrators"
                .to_owned(),
        rows: OUTPUTS_US.into_iter().map(panel).collect(),
        notes: notes
            .into_iter()
            .map(str::to_owned)
            .chain(purposes)
            .collect(),
        ..Figure::default()
    }
    .file()
}

fn at(row: &ChartRow) -> At {
    (row.cycles_per_s as f64, row.error_pct)
}

fn is_inside(row: &&ChartRow) -> bool {
    let errors = 10f64.powi(ERRORS.0)..=10f64.powi(ERRORS.1);
    errors.contains(&row.error_pct) && (LOAD.0..=LOAD.1).contains(&(row.cycles_per_s as f64))
}

/// Returns the settings that no other of `rows` beats in error or load without being worse in the
/// other, the cheapest first.
fn best<'a>(rows: impl Iterator<Item = &'a ChartRow>) -> Vec<&'a ChartRow> {
    let mut rows: Vec<&ChartRow> = rows.collect();
    rows.sort_by(|a, b| {
        at(a)
            .partial_cmp(&at(b))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    let mut least = f64::INFINITY;
    rows.retain(|row| {
        let is_better = row.error_pct < least;
        least = least.min(row.error_pct);
        is_better
    });
    rows
}

fn panel(rows: &[ChartRow], output_us: u32) -> Panel {
    let usual = || rows.iter().filter(|row| row.arithmetic != "f64");
    let read = || usual().filter(|row| row.output_us == output_us);
    let share = |cycles: f64| format!("{} ({} %)", grouped(cycles), percent(cycles));
    let ticks = LABELLED.map(|cycles| (cycles, share(cycles)));
    let x = Axis::new(
        "device load of one muscle: cycles per second (share of a 168 MHz core)",
        Scale::Log(LOAD.0, LOAD.1),
    )
    .ticks(ticks.to_vec());
    let (low, high) = ERRORS;
    let errors = (low..=high).map(|n| (10f64.powi(n), plain(n)));
    let y = Axis::new(
        "worst error (% of peak force)",
        Scale::Log(10f64.powi(low), 10f64.powi(high)),
    )
    .ticks(errors.collect())
    .reference_line(NOTICED_PCT, "people notice", MUTED)
    .reference_line(WANTED_PCT, "goal, 0.02 %", MUTED);
    let mut marks = Vec::new();
    let front: Vec<&ChartRow> = best(read()).into_iter().filter(is_inside).collect();
    marks.push(Mark::Line(staircase(&front), stroke(MUTED, 2.6)));
    let mut labels = Vec::new();
    for family in &FAMILIES {
        let own = read().filter(|row| family.methods.contains(&row.method.as_str()));
        let own: Vec<&ChartRow> = best(own).into_iter().filter(is_inside).collect();
        let radius = if family.shape == Shape::Star {
            6.0
        } else {
            3.5
        };
        marks.push(Mark::Line(
            own.iter().map(|row| at(row)).collect(),
            stroke(family.color, 1.4),
        ));
        let dot =
            |row: &&ChartRow| Mark::Dot(at(row), family.shape, radius, Paint::Full(family.color));
        marks.extend(own.iter().map(dot));
        if let Some(row) = own.get(own.len() * 3 / 4) {
            labels.push(Mark::Label(at(row), family.name.to_owned(), INK));
        }
    }
    if let Some(row) = read().find(|row| row.method == PAPER) {
        marks.push(Mark::Dot(at(row), Shape::Disc, 5.0, Paint::Ring(INK, 1.6)));
        let words = "Lee 2020: steps of 0.2 ms";
        labels.push(Mark::Label(at(row), words.to_owned(), INK));
    }
    if let Some(row) = front.first() {
        let words = "front: nothing is both cheaper and more exact";
        labels.push(Mark::Label(at(row), words.to_owned(), MUTED));
    }
    marks.extend(labels);
    let title = format!(
        "Force read {} times a second (every {} ms)",
        1_000_000 / output_us,
        output_us / 1000
    );
    Panel {
        marks,
        ..Panel::new(&title, x, y, 320.0)
    }
}

/// Returns a Pareto front as a staircase.
fn staircase(front: &[&ChartRow]) -> Vec<At> {
    let mut path: Vec<At> = Vec::new();
    for row in front {
        let before = path.last().map(|(_, y)| (at(row).0, *y));
        path.extend(before);
        path.push(at(row));
    }
    path
}

/// Formats a power of ten as a decimal number.
fn plain(n: i32) -> String {
    format!("{:.*}", usize::try_from(-n).unwrap_or(0), 10f64.powi(n))
}

/// Formats a number of cycles with separators.
fn grouped(cycles: f64) -> String {
    let thousands = (cycles / 1e3).round() as u32;
    match thousands {
        1_000.. => format!("{},{:03},000", thousands / 1_000, thousands % 1_000),
        _ => format!("{thousands},000"),
    }
}

/// Formats the share of the core that these cycles per second take, %.
fn percent(cycles: f64) -> String {
    let share = 100.0 * cycles / CORE_HZ;
    let decimals = if share < 0.1 { 3 } else { 2 };
    format!("{share:.decimals$}")
}
