//! Tables of docs/evidence/methods.md that repeat numbers of docs/charts: each must be what its CSV file says.
//! `FLEXOR_OVERWRITE=1 cargo test -p tests --test suite methods_document` writes them again.

use serde::Deserialize;
use std::path::{Path, PathBuf};
use studies::accuracy::table::ChartRow;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn rows<T: for<'a> Deserialize<'a>>(name: &str) -> Vec<T> {
    let path = root().join("docs/charts").join(name);
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader.deserialize().map(|row| row.unwrap()).collect()
}

/// Returns error, cycles per second and worst tick as the document shows them.
fn figures(row: &ChartRow) -> String {
    format!(
        "{} %, {}, {}",
        two_digits(row.error_pct),
        rounded(row.cycles_per_s),
        row.worst_tick_cycles
    )
}

/// Formats a number of cycles, rounded to hundreds.
fn rounded(cycles: u64) -> String {
    grouped(cycles.div_ceil(50) / 2 * 100)
}

/// Formats a number with two significant digits.
fn two_digits(value: f64) -> String {
    let decimals = (1.0 - value.abs().log10().floor()).max(0.0) as usize;
    format!("{value:.decimals$}")
}

fn grouped(value: u64) -> String {
    match value {
        0..1_000 => value.to_string(),
        _ => format!("{},{:03}", grouped(value / 1_000), value % 1_000),
    }
}

/// Replaces the table below `heading` in the document by `table`, or compares them.
#[track_caller]
fn check(heading: &str, table: &str) {
    let path = root().join("docs/evidence/methods.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let begin = text.find(heading).unwrap_or_else(|| panic!("no {heading}"));
    let end = begin + text[begin..].find("\n\n").unwrap() + 1;
    if &text[begin..end] == table {
        return;
    }
    if std::env::var_os("FLEXOR_OVERWRITE").is_some() {
        let new = format!("{}{table}{}", &text[..begin], &text[end..]);
        std::fs::write(path, new).unwrap();
        return;
    }
    panic!(
        "docs/evidence/methods.md differs from docs/charts: run this test with FLEXOR_OVERWRITE=1 and \
         review the text around the table\nis\n{}should be\n{table}",
        &text[begin..end]
    );
}

const NAMES: [(&str, &str); 14] = [
    ("hermite_simpson", "Hermite–Simpson"),
    ("rk4_exact_c", "RK4"),
    ("heun_exact_c", "Heun"),
    ("gauss_exponential", "Gauss exponential"),
    ("etd_midpoint", "ETD midpoint"),
    ("log_flow", "log-C flow"),
    ("segments", "segments"),
    ("log_table", "log-C table"),
    ("rosenbrock_euler", "exponential Rosenbrock–Euler"),
    ("rosenbrock_3", "exponential Rosenbrock, order 3"),
    ("event_driven_2", "event-driven, 2 nodes"),
    ("event_driven_3", "event-driven, 3 nodes"),
    ("event_driven_4", "event-driven, 4 nodes"),
    ("rk4", "RK4 on C and F"),
];

fn name(point: &ChartRow) -> String {
    let known = NAMES.iter().find(|(method, _)| *method == point.method);
    let name = known.map_or(point.method.as_str(), |(_, name)| name);
    let arithmetic = match point.arithmetic.as_str() {
        "q7_24" => ", Q7.24",
        "q15_16" => ", Q15.16",
        "f32" => ", f32",
        "f32_micromath" => ", micromath",
        "f64" => ", f64",
        "device" if !matches!(point.method.as_str(), "segments" | "shipped") => {
            ", device's formats"
        }
        _ => "",
    };
    format!("{name}{arithmetic}")
}

#[test]
fn the_documents_tables_are_those_of_the_charts() {
    let points: Vec<ChartRow> = rows("accuracy.csv");
    let heading = "| force read every | shipped: error, cycles/s, worst tick |";
    let mut table =
        format!("{heading} cheapest method within 0.02 % | shipped costs |\n|---|---|---|---|\n");
    for (output_us, words) in [(1_000, "1 ms"), (20_000, "20 ms")] {
        let read = || points.iter().filter(move |p| p.output_us == output_us);
        let shipped = read().find(|p| p.method == "shipped").unwrap();
        let exact = read().filter(|p| p.error_pct <= 0.02);
        let cheapest = exact.min_by_key(|p| p.cycles_per_s).unwrap();
        let (best, ratio) = match cheapest.method.as_str() {
            "shipped" => ("the shipped one".to_owned(), String::new()),
            _ => (
                format!("{}: {}", name(cheapest), figures(cheapest)),
                format!(
                    "{:.1} times ",
                    shipped.cycles_per_s as f64 / cheapest.cycles_per_s as f64
                ),
            ),
        };
        let words = format!("| {words} | {} | {best} | {ratio}|\n", figures(shipped));
        table.push_str(&words);
    }
    check(heading, &table);

    let heading = "| method | step 4 ms | step 8 ms |";
    let mut table = format!("{heading}\n|---|---|---|\n");
    for (method, words) in &NAMES[..5] {
        let cells = [4_000, 8_000].map(|step| {
            let point = points.iter().find(|p| {
                (p.method.as_str(), p.arithmetic.as_str(), p.reading.as_str())
                    == (*method, "f32", "cubic")
                    && (p.step_us, p.output_us) == (Some(step), 1_000)
            });
            figures(point.unwrap_or_else(|| panic!("{method} {step}")))
        });
        table.push_str(&format!("| {words} | {} | {} |\n", cells[0], cells[1]));
    }
    check(heading, &table);
}

/// Families of methods, and what each is good for.
const FAMILIES: [(&str, &str, &str); 16] = [
    (
        "shipped",
        "shipped",
        "the smallest errors in integers; a table of up to 3.3 kB for each muscle",
    ),
    (
        "segments",
        "segments",
        "muscles without a table, and fatigue",
    ),
    (
        "log_flow",
        "log-C flow",
        "few readings; a table of 1.5 kB for each muscle, slow to build",
    ),
    (
        "log_table",
        "log-C table",
        "as the flow, with a larger table; constants must not change",
    ),
    (
        "hermite_simpson",
        "Hermite–Simpson",
        "the best without a table; one division a step",
    ),
    (
        "rk4_exact_c",
        "RK4 along exact C",
        "the same where floating point is at hand; long steps diverge",
    ),
    ("heun_exact_c", "Heun along exact C", "errors of a percent"),
    (
        "euler_exact_c",
        "Euler along exact C",
        "nothing: diverges beyond 2 τ1",
    ),
    (
        "etd_midpoint",
        "ETD midpoint",
        "errors of a percent at steps that other methods cannot take",
    ),
    (
        "etd1",
        "ETD1",
        "nothing: as cheap methods are ten times as exact",
    ),
    (
        "gauss_exponential",
        "Gauss exponential",
        "stiff muscles and the smallest errors",
    ),
    (
        "rosenbrock_euler",
        "exponential Rosenbrock–Euler",
        "nothing: order 3 costs little more",
    ),
    (
        "rosenbrock_3",
        "exponential Rosenbrock, order 3",
        "errors of a percent; a step up to τ has no exponential",
    ),
    (
        "event_driven_3",
        "event-driven, 3 nodes",
        "one reading per pulse; each reading is an integral",
    ),
    ("rk4", "RK4 on C and F", "a reference: C needs no steps"),
    (
        "rk4_snapped",
        "the paper's",
        "a reference: pulses on the grid cost 0.47 %",
    ),
];

/// Returns the cheapest cycles per second of `method` within `error_pct`, without double precision.
fn cheapest(points: &[ChartRow], method: &str, output_us: u32, error_pct: f64) -> String {
    let matching = points.iter().filter(|p| {
        p.method == method
            && p.output_us == output_us
            && p.error_pct <= error_pct
            && p.arithmetic != "f64"
    });
    let least = matching.map(|p| p.cycles_per_s).min();
    least.map_or("–".into(), |cycles| {
        grouped(cycles.div_ceil(50) / 2 * 100)
    })
}

#[test]
fn every_family_says_what_it_is_good_for() {
    let points: Vec<ChartRow> = rows("accuracy.csv");
    let heading = "| family | good for | read every 1 ms: 0.02 %; 1 % |";
    let mut table = format!("{heading} every 20 ms: 0.02 %; 1 % |\n|---|---|---|---|\n");
    for (method, name, purpose) in FAMILIES {
        let cells = [1_000, 20_000].map(|output_us| {
            [0.02, 1.0]
                .map(|error| cheapest(&points, method, output_us, error))
                .join("; ")
        });
        table.push_str(&format!(
            "| {name} | {purpose} | {} | {} |\n",
            cells[0], cells[1]
        ));
    }
    check(heading, &table);
}

/// Returns the cheapest settings of `method` within 0.02 % in these arithmetics and with these
/// kinds of reading, for readings every 1 and 20 ms.
fn cheapest_of(
    points: &[ChartRow],
    method: &str,
    arithmetics: &[&str],
    readings: &[&str],
) -> String {
    let cells = [1_000, 20_000].map(|output_us| {
        let is_one = |p: &&ChartRow| {
            arithmetics.contains(&p.arithmetic.as_str()) && readings.contains(&p.reading.as_str())
        };
        let own: Vec<ChartRow> = points.iter().filter(is_one).cloned().collect();
        cheapest(&own, method, output_us, 0.02)
    });
    cells.join("; ")
}

#[test]
fn the_formats_and_readings_of_rivals_are_compared() {
    let points: Vec<ChartRow> = rows("accuracy.csv");
    let heading = "| rule, within 0.02 % | f32, Q15.16, Q7.24 |";
    let mut table = format!(
        "{heading} the same on demand | device's formats | the same on demand |\n\
         |---|---|---|---|---|\n"
    );
    let generic = ["f32", "q15_16", "q7_24"];
    for (method, name) in [
        ("hermite_simpson", "Hermite–Simpson"),
        ("gauss_exponential", "Gauss exponential"),
        ("etd_midpoint", "ETD midpoint"),
    ] {
        let cells = [
            (&generic[..], &["steps", "cubic"][..]),
            (&generic[..], &["demand"][..]),
            (&["device"][..], &["cubic"][..]),
            (&["device"][..], &["demand"][..]),
        ]
        .map(|(arithmetics, readings)| cheapest_of(&points, method, arithmetics, readings));
        table.push_str(&format!("| {name} | {} |\n", cells.join(" | ")));
    }
    check(heading, &table);
}

#[derive(Deserialize)]
struct RangeRow {
    method: String,
    arithmetic: String,
    step_us: Option<u32>,
    output_us: u32,
    reading: String,
    median_pct: f64,
    p95_pct: f64,
    worst_pct: f64,
}

#[test]
fn the_errors_over_the_range_are_those_of_their_table() {
    let points: Vec<ChartRow> = rows("accuracy.csv");
    let range: Vec<RangeRow> = rows("accuracy_range.csv");
    let heading = "| setting | read every | 140 trains | range: median |";
    let mut table = format!("{heading} 95 % | worst |\n|---|---|---|---|---|---|\n");
    let digits = |value: f64| match value {
        0.0..100.0 => two_digits(value),
        _ => "beyond 100".to_owned(),
    };
    for (point, row) in points.iter().zip(range) {
        assert_eq!(
            (&point.method, &point.arithmetic, &point.reading),
            (&row.method, &row.arithmetic, &row.reading)
        );
        assert_eq!(
            (point.step_us, point.output_us),
            (row.step_us, row.output_us)
        );
        let is_device = matches!(point.method.as_str(), "shipped" | "segments");
        if !is_device && (point.front == 0 || point.error_pct > 10.0) {
            continue;
        }
        let step = match point.step_us {
            Some(us) if !is_device => format!(", {} ms", f64::from(us) / 1e3),
            _ => String::new(),
        };
        table.push_str(&format!(
            "| {}{step}{} | {} ms | {} | {} | {} | {} |\n",
            name(point),
            match point.reading.as_str() {
                "demand" => ", on demand",
                "cubic" => ", cubic",
                _ => "",
            },
            point.output_us / 1_000,
            digits(point.error_pct),
            digits(row.median_pct),
            digits(row.p95_pct),
            digits(row.worst_pct)
        ));
    }
    check(heading, &table);
}

#[derive(Deserialize)]
struct Cycles {
    algorithm: String,
    mean_cycles: u64,
    max_cycles: u64,
}

#[test]
fn the_ticks_are_those_of_the_benchmark() {
    let rows: Vec<Cycles> = rows("cycles.csv");
    let words = |name: &str| {
        let row = rows.iter().find(|row| row.algorithm == name).unwrap();
        format!("{}, {}", row.mean_cycles, row.max_cycles)
    };
    let heading = "| call | without a pulse | with one |";
    let mut table = format!("{heading}\n|---|---|---|\n");
    for (call, name) in [
        (
            "the model by itself (`calcium_force_tick`)",
            "calcium_force_tick",
        ),
        (
            "through the model selection, as the controller calls it (`rung_tick`)",
            "rung_tick",
        ),
        (
            "with fatigue (`fatigue_tick`; its update once a second)",
            "fatigue_tick",
        ),
    ] {
        let with_pulse = words(&format!("{name}_and_pulse"));
        table.push_str(&format!("| {call} | {} | {with_pulse} |\n", words(name)));
    }
    check(heading, &table);
}

#[derive(Deserialize)]
struct Flags {
    opt_level: String,
    inline: u32,
    unroll: u32,
    flash_bytes: u64,
    cycles: f64,
    cycles_not_cached: f64,
    load_percent: Option<f64>,
    refill_margin_cycles: Option<i64>,
    usb_latency_cycles: Option<u64>,
    chosen: u8,
}

#[test]
fn the_flags_are_those_of_their_chart() {
    let heading = "| level | inline | flash, bytes | cycles, two readings |";
    let mut table =
        format!("{heading} load, % | refill margin | USB waits |\n|---|---|---|---|---|---|---|\n");
    for row in rows::<Flags>("flags.csv") {
        let unroll = if row.unroll == 150 { "" } else { ", unroll 50" };
        let star = if row.chosen == 1 { " (chosen)" } else { "" };
        let load = match (
            row.load_percent,
            row.refill_margin_cycles,
            row.usb_latency_cycles,
        ) {
            (Some(load), Some(margin), Some(usb)) => {
                format!("{load:.2} | {} | {}", grouped(margin as u64), grouped(usb))
            }
            _ => "does not play: fault 2 | |".to_owned(),
        };
        table.push_str(&format!(
            "| {} | {}{unroll}{star} | {} | {:.3}, {:.3} | {load} |\n",
            row.opt_level,
            row.inline,
            grouped(row.flash_bytes),
            row.cycles,
            row.cycles_not_cached
        ));
    }
    check(heading, &table);
}
