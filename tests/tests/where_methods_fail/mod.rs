//! Tables of docs/evidence/where_methods_fail.md: each number must be that of a CSV file in docs/maps or
//! docs/charts. `FLEXOR_OVERWRITE=1 cargo test -p tests --test suite where_methods_fail` writes them
//! again.

mod statements;

use std::path::{Path, PathBuf};
use studies::accuracy::table::ChartRow;

fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs")
}

/// A committed map.
struct Numbers {
    columns: Vec<String>,
    /// Panel, row, kind of value, and the values of the columns.
    lines: Vec<(String, String, String, Vec<String>)>,
}

impl Numbers {
    fn read(name: &str) -> Self {
        let path = docs().join(format!("maps/{name}.csv"));
        let mut reader = csv::Reader::from_path(path).unwrap();
        let words = |record: &csv::StringRecord| -> Vec<String> {
            record.iter().skip(3).map(str::to_owned).collect()
        };
        let columns = words(reader.headers().unwrap());
        let line = |record: Result<csv::StringRecord, csv::Error>| {
            let record = record.unwrap();
            let [panel, row, value] = [0, 1, 2].map(|n| record[n].to_owned());
            (panel, row, value, words(&record))
        };
        let lines = reader.records().map(line).collect();
        Self { columns, lines }
    }

    /// Returns the rows of a panel in order.
    fn rows(&self, panel: &str) -> Vec<&str> {
        let own = { self.lines.iter() }.filter(|line| line.0 == panel && line.2 == "number");
        own.map(|line| &*line.1).collect()
    }

    fn line(&self, panel: &str, row: &str, value: &str) -> Option<&[String]> {
        let is = |line: &&(String, String, String, Vec<String>)| {
            line.0 == panel && line.1 == row && line.2 == value
        };
        self.lines.iter().find(is).map(|line| &*line.3)
    }

    fn value(&self, panel: &str, row: &str, column: &str, value: &str) -> f64 {
        let n = self.columns.iter().position(|c| c == column).unwrap();
        let line = self.line(panel, row, value);
        let line = line.unwrap_or_else(|| panic!("no row {row} in {panel}"));
        line[n].parse().unwrap()
    }

    fn number(&self, panel: &str, row: &str, column: &str) -> f64 {
        self.value(panel, row, column, "number")
    }

    fn holds(&self, panel: &str, row: &str, column: &str) -> bool {
        self.value(panel, row, column, "verdict") == 0.0
    }

    /// Returns the labels between which a row holds, from column `from` on in both directions;
    /// a dash if it fails there.
    fn along(&self, panel: &str, row: &str, from: &str) -> String {
        let columns: Vec<&str> = self.columns.iter().map(String::as_str).collect();
        around(&columns, from, |column| self.holds(panel, row, column))
    }

    /// Returns the labels of the rows between which a column holds, as [`Self::along`].
    fn down(&self, panel: &str, column: &str, from: &str) -> String {
        around(&self.rows(panel), from, |row| {
            self.holds(panel, row, column)
        })
    }

    /// Returns whether the map has this panel.
    fn has(&self, panel: &str) -> bool {
        self.lines.iter().any(|line| line.0 == panel)
    }
}

/// Returns the first and the last label around `from` of those that hold without a gap.
fn around(labels: &[&str], from: &str, holds: impl Fn(&str) -> bool) -> String {
    let n = labels.iter().position(|label| *label == from).unwrap();
    if !holds(labels[n]) {
        return "–".to_owned();
    }
    let last = labels[n..].iter().take_while(|label| holds(label)).last();
    let first = labels[..=n]
        .iter()
        .rev()
        .take_while(|label| holds(label))
        .last();
    match (first, last) {
        (Some(first), Some(last)) if first != last => format!("{first}…{last}"),
        _ => from.to_owned(),
    }
}

/// Replaces the table below `heading` in the document by `table`, or compares them.
#[track_caller]
fn check(heading: &str, table: &str) {
    let path = docs().join("evidence/where_methods_fail.md");
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
        "docs/evidence/where_methods_fail.md differs from its CSV files: run this test with \
         FLEXOR_OVERWRITE=1 and review the text around the table\nis\n{}should be\n{table}",
        &text[begin..end]
    );
}

const CONTROLLERS: [&str; 4] = [
    "default controller",
    "super-twisting alone",
    "paper's controller",
    "PID controller",
];

/// A row of the table of controllers: what is limited, the map, and the limit of a panel.
type Limit = (&'static str, &'static str, fn(&Numbers, &str) -> String);

const LIMITS: [Limit; 16] = [
    ("added delay at a hold, ms", "muscle_lag", |map, panel| {
        map.along(panel, "1", "0")
    }),
    (
        "the same, muscle twice as slow",
        "muscle_lag",
        |map, panel| map.along(panel, "2", "0"),
    ),
    (
        "lag of the muscle, times nominal",
        "muscle_lag",
        |map, panel| map.down(panel, "0", "1"),
    ),
    ("strength, times nominal", "gain_delay", |map, panel| {
        map.down(panel, "0", "1")
    }),
    ("the same, 50 ms added delay", "gain_delay", |map, panel| {
        map.down(panel, "50", "1")
    }),
    ("control period, ms", "control_period", |map, panel| {
        map.along(panel, "0", "2")
    }),
    (
        "the same, 40 ms added delay",
        "control_period",
        |map, panel| map.along(panel, "40", "2"),
    ),
    (
        "thresholds above the file's, % of the range",
        "thresholds",
        |map, panel| map.down(panel, "0", "0"),
    ),
    ("the same, 40 ms added delay", "thresholds", |map, panel| {
        map.down(panel, "40", "0")
    }),
    (
        "threshold of B above the file's, % of the range",
        "point_thresholds",
        |map, panel| map.down(panel, "0", "0"),
    ),
    (
        "frames per second without noise, Hz",
        "sensor",
        |map, panel| map.down(panel, "0", "90"),
    ),
    (
        "noise at 90 frames per second, °",
        "sensor",
        |map, panel| map.along(panel, "90", "0"),
    ),
    (
        "force left by fatigue, time constant 10 s",
        "fatigue",
        |map, panel| map.down(panel, "10", "1"),
    ),
    (
        "return after 4 s 10° beyond the reach, s",
        "saturation",
        |map, panel| format!("{:.2}", map.number(panel, "10", "4")),
    ),
    (
        "setpoints lost, % (extrapolating 200 ms)",
        "loss",
        |map, panel| map.along(panel, "200", "0"),
    ),
    ("rise that adds at most 1°, ms", "rise", |map, panel| {
        map.down(panel, "0", "10")
    }),
];

#[test]
fn the_limits_of_controllers_are_those_of_the_maps() {
    let heading = "| a finger, up to | default controller |";
    let mut table = format!(
        "{heading} super-twisting alone | paper's controller | PID controller | map \
         |\n|---|---|---|---|---|---|\n"
    );
    for (limit, name, of) in LIMITS {
        let map = Numbers::read(name);
        let cell = |controller: &str| match name {
            "loss" => format!("{controller} on the finger"),
            "saturation" if controller == "paper's controller" => {
                "paper's controller, without anti-windup".to_owned()
            }
            "saturation" if controller != "default controller" => {
                format!("{controller}, with anti-windup")
            }
            _ => controller.to_owned(),
        };
        let cells = CONTROLLERS.map(|controller| {
            let panel = cell(controller);
            match map.has(&panel) {
                true => of(&map, &panel),
                false => String::new(),
            }
        });
        table.push_str(&format!("| {limit} | {} | `{name}` |\n", cells.join(" | ")));
    }
    check(heading, &table);
}

#[test]
fn the_lateness_without_anti_windup_is_that_of_the_map() {
    let map = Numbers::read("saturation");
    let heading = "| s until the finger returns, 10° beyond for | with anti-windup: 1 s |";
    let mut table = format!(
        "{heading} 4 s | 16 s | without: 1 s | 4 s | 16 s |\n|---|---|---|---|---|---|---|\n"
    );
    for controller in &CONTROLLERS[1..] {
        let cells = ["with", "without"].map(|has| {
            let panel = format!("{controller}, {has} anti-windup");
            ["1", "4", "16"]
                .map(|column| match map.number(&panel, "10", column) {
                    late if late.is_finite() => format!("{late:.2}"),
                    _ => "more than 20".to_owned(),
                })
                .join(" | ")
        });
        table.push_str(&format!("| {controller} | {} |\n", cells.join(" | ")));
    }
    check(heading, &table);
}

const FORMS: [&str; 7] = [
    "shipped",
    "proper implicit",
    "proxy",
    "resolvent",
    "koch-reichhartinger",
    "semi-implicit",
    "explicit",
];

/// Returns the number of widened wearers that a control law fails, one-point and two-point.
fn failed(law: &str) -> String {
    let mut reader = csv::Reader::from_path(docs().join("charts/control_widened.csv")).unwrap();
    let headers = reader.headers().unwrap().clone();
    let n = |name: &str| headers.iter().position(|h| h == name).unwrap();
    let records: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    ["one-point", "two-point"]
        .map(|points| {
            let is = |r: &&csv::StringRecord| {
                &r[n("points")] == points
                    && &r[n("law")] == law
                    && &r[n("course")] == "all"
                    && &r[n("seed")] == "1"
            };
            let row = records.iter().find(is);
            row.map_or(String::new(), |row| row[n("failed")].to_owned())
        })
        .join(", ")
}

#[test]
fn the_discretizations_are_those_of_the_maps() {
    let heading = "| discretization | largest \\|σ\\| where the theorem holds, L h² |";
    let mut table = format!(
        "{heading} gains at which it holds 1.1 L h² | failed widened wearers: alone | with add-ons \
         |\n|---|---|---|---|---|\n"
    );
    let map = Numbers::read("sigma_gains");
    for form in FORMS {
        let (mut worst, mut holding, mut cells) = (0.0f64, 0, 0);
        for row in map.rows(form) {
            for column in &map.columns {
                let [k2, k1]: [f64; 2] = [row, column].map(|label| label.parse().unwrap());
                if k2 > 1.0 && k1 * k1 > k2 + 1.0 {
                    worst = worst.max(map.number(form, row, column));
                    holding += u32::from(map.holds(form, row, column));
                    cells += 1;
                }
            }
        }
        let worst = match worst {
            worst if worst < 1000.0 => format!("{worst:.2}"),
            _ => "more than 1000".to_owned(),
        };
        let wearers = match form {
            "shipped" => format!("| {}", failed("device default")),
            _ => format!("{} | {}", failed(form), failed(&format!("{form} +"))),
        };
        table.push_str(&format!(
            "| {form} | {worst} | {holding} of {cells} | {wearers} |\n"
        ));
    }
    check(heading, &table);
}

#[test]
fn the_walls_are_those_of_the_map() {
    let map = Numbers::read("wall");
    let heading = "| stiffest wall on which the arm rests, mA/deg | delay 5 ms |";
    let mut table = format!("{heading} 25 ms | 50 ms | 100 ms |\n|---|---|---|---|---|\n");
    let mut panels: Vec<&str> = map.lines.iter().map(|line| &*line.0).collect();
    panels.dedup();
    for panel in panels {
        let cells = ["5", "25", "50", "100"].map(|delay| {
            let stiff = map
                .columns
                .iter()
                .take_while(|c| map.holds(panel, delay, c));
            stiff.last().map_or("–", String::as_str)
        });
        table.push_str(&format!("| {panel} | {} |\n", cells.join(" | ")));
    }
    check(heading, &table);
}

/// Families of integrators: name in the table, method, where it fails, and what to use there.
const FAMILIES: [(&str, &str, &str, &str); 14] = [
    (
        "shipped",
        "shipped",
        "nowhere in its ranges; refuses a τ1 below them",
        "",
    ),
    (
        "segments",
        "segments",
        "nowhere in its ranges; errs most in weak, slow muscles",
        "shipped",
    ),
    (
        "log_flow",
        "log-C flow",
        "in a muscle that tires: its table is slow to build",
        "shipped",
    ),
    (
        "log_table",
        "log-C table",
        "as the flow, with a larger table",
        "shipped",
    ),
    (
        "hermite_simpson",
        "Hermite–Simpson",
        "loses accuracy beyond 8 ms; in Q7.24 its division is software",
        "Gauss exponential, shipped",
    ),
    (
        "rk4_exact_c",
        "RK4 along exact C",
        "diverges beyond 2.785 τ1",
        "Hermite–Simpson",
    ),
    (
        "heun_exact_c",
        "Heun along exact C",
        "diverges beyond 2 τ1",
        "Hermite–Simpson",
    ),
    (
        "euler_exact_c",
        "Euler along exact C",
        "everywhere: inexact, diverges beyond 2 τ1",
        "any other",
    ),
    (
        "etd_midpoint",
        "ETD midpoint",
        "errors above a percent from 10 ms on",
        "Gauss exponential",
    ),
    (
        "etd1",
        "ETD1",
        "everywhere: inexact at every step",
        "ETD midpoint",
    ),
    (
        "gauss_exponential",
        "Gauss exponential",
        "nowhere; costs more than Hermite–Simpson",
        "",
    ),
    (
        "event_driven_3",
        "event-driven, 3 nodes",
        "where pulses are far apart, without a limit on its stretches",
        "stretches of 10 ms",
    ),
    (
        "rk4",
        "RK4 on C and F",
        "diverges near 1.3 τc and beyond 2.785 τ1",
        "RK4 along exact C",
    ),
    (
        "rk4_snapped",
        "the paper's",
        "where 0.2 ms of a pulse's time matter",
        "pulses at their times",
    ),
];

#[test]
fn the_integrators_are_those_of_the_chart() {
    let mut reader = csv::Reader::from_path(docs().join("charts/accuracy.csv")).unwrap();
    let rows: Vec<ChartRow> = reader.deserialize().map(Result::unwrap).collect();
    let heading = "| family | error, %, at a step of 1 ms |";
    let mut table = format!(
        "{heading} 4 ms | 10 ms | 20 ms | fails | use there |\n|---|---|---|---|---|---|---|\n"
    );
    for (method, name, fails, instead) in FAMILIES {
        let own: Vec<&ChartRow> = { rows.iter() }
            .filter(|row| row.method == method && row.output_us == 1000)
            .filter(|row| row.arithmetic == "f32" || matches!(method, "segments" | "shipped"))
            .filter(|row| row.reading != "demand")
            .collect();
        let worst = |step_us: Option<u32>| {
            let at = own.iter().filter(|row| row.step_us == step_us);
            at.map(|row| row.error_pct).reduce(f64::max)
        };
        let cells = [1000, 4000, 10_000, 20_000].map(|step_us| match worst(Some(step_us)) {
            Some(error) if error > 100.0 => "diverges".to_owned(),
            Some(error) => two_digits(error),
            None => String::new(),
        });
        let cells = match method {
            // They choose their own steps, or have one.
            "shipped" | "segments" | "rk4_snapped" => {
                let error = own.first().map_or(f64::NAN, |row| row.error_pct);
                [
                    two_digits(error),
                    String::new(),
                    String::new(),
                    String::new(),
                ]
            }
            _ => cells,
        };
        table.push_str(&format!(
            "| {name} | {} | {fails} | {instead} |\n",
            cells.join(" | ")
        ));
    }
    check(heading, &table);
}

/// Formats a number with two significant digits.
fn two_digits(value: f64) -> String {
    let decimals = (1.0 - value.abs().log10().floor()).max(0.0) as usize;
    format!("{value:.decimals$}")
}

#[test]
fn the_longest_stable_steps_are_those_of_the_map() {
    let map = Numbers::read("integrator");
    let heading =
        "| method, in f64, pulses at their times | longest step that holds on every subject, ms |";
    let mut table = format!("{heading} on K05, ms | worst error at 1 ms, % |\n|---|---|---|---|\n");
    let mut panels: Vec<&str> = map.lines.iter().map(|line| &*line.0).collect();
    panels.dedup();
    for method in map.rows(panels[0]) {
        let holds = |panel: &str, column: &str| map.holds(panel, method, column);
        let longest = |panels: &[&str]| {
            let all = |column: &&String| panels.iter().all(|panel| holds(panel, column));
            let column = map.columns.iter().take_while(all).last();
            column.map_or("–".to_owned(), |column| {
                match column == map.columns.last().unwrap() {
                    true => format!("{column} or more"),
                    false => column.clone(),
                }
            })
        };
        let k05: Vec<&str> = panels
            .iter()
            .copied()
            .filter(|p| p.starts_with("K05"))
            .collect();
        let errors = panels.iter().map(|panel| map.number(panel, method, "1"));
        table.push_str(&format!(
            "| {} | {} | {} | {} |\n",
            method.replace('_', " "),
            longest(&panels),
            longest(&k05),
            two_digits(errors.fold(0.0, f64::max))
        ));
    }
    check(heading, &table);
}
