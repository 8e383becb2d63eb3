//! Checks docs/charts/accuracy.csv, accuracy_range.csv and accuracy.svg, the errors and cycles of the
//! integrators. Errors are computed on this computer, cycles by the chip simulator. Both are the same in every run, so
//! every change of code shows in their diff.

use std::path::Path;
use studies::accuracy::range_of_all::{Sample, line};
use studies::accuracy::table::rows;
use studies::accuracy::{Chart, all_errors, cases, digits, measure, settings};
use studies::figures::accuracy_picture;

const RENEW: &str = "cargo run --release -p host-tool -- chart accuracy";

fn committed(name: &str) -> String {
    let charts = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/charts");
    std::fs::read_to_string(charts.join(name)).unwrap_or_default()
}

/// Returns a table's column of errors.
fn errors(csv: &str) -> Vec<&str> {
    let lines = csv.lines().skip(1);
    lines.filter_map(|line| line.split(',').nth(4)).collect()
}

#[test]
fn the_committed_errors_are_those_of_the_code() {
    let errors_now = all_errors(&cases::all_cases(), |_| ()).into_iter();
    let is: Vec<String> = errors_now.map(digits).collect();
    let committed = committed("accuracy.csv");
    assert_eq!(errors(&committed), is, "renew with\n  {RENEW}");
}

#[test]
fn the_committed_chart_is_that_of_the_code_on_the_chip() {
    let chart: Chart = measure(&cases::all_cases(), |_| ()).unwrap_or_else(|e| panic!("{e}"));
    // Floating point with libm's and micromath's functions, and fixed point, give the same bits on
    // this computer and on the simulated Cortex-M4.
    assert_eq!(chart.differing, Vec::<String>::new());
    let (was, is) = (committed("accuracy.csv"), chart.csv());
    let new = is
        .lines()
        .filter(|line| !was.lines().any(|old| old == *line));
    let changed: Vec<&str> = new.take(20).collect();
    assert!(
        was == is,
        "docs/charts/accuracy.csv is not what this code gives (toolchain as pinned, Linux on \
         x86-64); its first new lines:\n  {}\nif that is meant, renew it with\n  {RENEW}",
        changed.join("\n  ")
    );
}

#[test]
fn the_committed_picture_is_that_of_the_table() {
    let picture = accuracy_picture(&rows(&committed("accuracy.csv")).unwrap());
    if std::env::var_os("FLEXOR_OVERWRITE").is_some() {
        let charts = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/charts");
        std::fs::write(charts.join("accuracy.svg"), &picture).unwrap();
    }
    assert!(
        committed("accuracy.svg") == picture,
        "docs/charts/accuracy.svg is stale: renew it with\n  {RENEW}"
    );
}

/// Renewing the table computes every row. This test computes those of the front.
#[test]
fn the_errors_over_the_range_are_those_of_the_code() {
    let chart = rows(&committed("accuracy.csv")).unwrap();
    let range = committed("accuracy_range.csv");
    let range: Vec<&str> = range.split_inclusive('\n').skip(1).collect();
    assert_eq!(
        (chart.len(), chart.len()),
        (range.len(), settings().count())
    );
    let sample = Sample::new();
    let compared = settings().zip(chart).zip(range);
    let mut count = 0;
    for (((setting, output_us), row), was) in compared.filter(|((_, row), _)| row.front == 1) {
        assert_eq!(row.output_us, output_us);
        assert_eq!(
            line(&sample.errors(setting, output_us)),
            was,
            "renew: {RENEW}"
        );
        count += 1;
    }
    assert!(count >= 4, "{count} settings on the front");
}
