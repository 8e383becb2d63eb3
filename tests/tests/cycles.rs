//! docs/charts/cycles.csv and .svg are what the chip simulator counts: cycles
//! are the same in every run, so every change of code shows in their diff.
//! `cargo verify budgets` holds the table to tests/budgets.toml.

use host_tool::bench;
use std::path::Path;

const RENEW: &str = "cargo run --release -p host-tool -- bench \
                     --csv docs/charts/cycles.csv --svg docs/charts/cycles.svg";

#[test]
fn the_committed_cycles_are_those_of_the_code() {
    let charts = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/charts");
    let committed = |name| std::fs::read_to_string(charts.join(name)).unwrap_or_default();
    let found = bench::on_chip().unwrap_or_else(|e| panic!("{e}"));
    let (was, is) = (committed("cycles.csv"), found.csv());
    let changed: Vec<String> = is
        .lines()
        .filter(|line| !was.lines().any(|old| old == *line))
        .map(|line| {
            let name = line.split(',').next().unwrap_or_default();
            let old = was.lines().find(|old| old.split(',').next() == Some(name));
            format!("  was {}\n  is  {line}", old.unwrap_or("nothing"))
        })
        .collect();
    assert!(
        was == is,
        "docs/charts/cycles.csv is not what this code takes (toolchain as pinned, Linux on \
         x86-64):\n{}\nif that is meant, renew it with\n  {RENEW}",
        changed.join("\n")
    );
    let same_picture = committed("cycles.svg") == found.svg();
    assert!(
        same_picture,
        "docs/charts/cycles.svg is stale: renew it with\n  {RENEW}"
    );
}
