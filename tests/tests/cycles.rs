//! Checks docs/charts/cycles.csv and .svg, the cycles counted by the chip simulator, which are the
//! same in every run, so every change of code shows in their diff. `cargo verify budgets` compares
//! the table with tests/budgets.toml. Also measures the effect of the flash accelerator on
//! CoreMark.

use hal_sim::chip::alone::FlashWait;
use hal_sim::chip::soc::flash::Prefetched;
use std::path::Path;
use studies::bench::{self, Reading, coremark};
use studies::figures::cycles_picture;

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
    let same_picture = committed("cycles.svg") == cycles_picture(&found);
    assert!(
        same_picture,
        "docs/charts/cycles.svg is stale: renew it with\n  {RENEW}"
    );
}

/// RM0090 section 3.5.2: by CoreMark, the accelerator's performance is "equivalent to 0 wait state"
/// up to 168 MHz. The default reading of that section agrees with this; the other does not, and
/// makes prefetch cost more than it saves. The measured values are bounded from both sides.
#[test]
fn coremark_runs_as_without_wait_states_and_prefetch_does_not_slow_it() {
    let found = coremark().unwrap_or_else(|e| panic!("{e}"));
    let reading = |wait| {
        let found = found.readings.iter().find(|reading| reading.wait == wait);
        *found.unwrap_or_else(|| panic!("no {wait:?}"))
    };
    let [cached, not_cached, ideal] = FlashWait::ALL.map(reading);
    assert_eq!(cached.wait, FlashWait::default());
    assert_eq!(not_cached.wait, FlashWait::States(Prefetched::NotCached));
    let change = |cycles: u64, from: u64| 100.0 * (cycles as f64 / from as f64 - 1.0);
    for Reading { wait, .. } in &found.readings {
        let found = reading(*wait);
        println!(
            "{wait:?}: {:.3}, without prefetch {:.3} CoreMark/MHz",
            found.per_mhz(),
            found.per_mhz_without_prefetch(),
        );
    }
    let over_ideal = change(cached.cycles, ideal.cycles);
    println!("default over no wait states: {over_ideal:.3} %");
    assert!((0.1..0.6).contains(&over_ideal), "{over_ideal} %");
    let by_prefetch = change(cached.cycles, cached.cycles_without_prefetch);
    println!("default, by prefetch: {by_prefetch:.3} %");
    assert!((-1.0..-0.2).contains(&by_prefetch), "{by_prefetch} %");
    let other = change(not_cached.cycles, ideal.cycles);
    println!("other reading over no wait states: {other:.3} %");
    assert!((9.0..12.0).contains(&other), "{other} %");
    let by_prefetch = change(not_cached.cycles, not_cached.cycles_without_prefetch);
    println!("other reading, by prefetch: {by_prefetch:.3} %");
    assert!((8.0..11.0).contains(&by_prefetch), "{by_prefetch} %");
    // Without prefetch both readings are the same.
    let expected = not_cached.cycles_without_prefetch;
    assert_eq!(cached.cycles_without_prefetch, expected);
}
