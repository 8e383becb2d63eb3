//! Resources of the chip that the flashed image uses under full load, on the chip simulator in both
//! readings of its flash documentation, compared with `tests/budgets.toml`.

use hal_sim::chip::profile::{Owner, exception};
use hal_sim::chip::soc::flash::Prefetched;
use host_core::clock::ProcessorClock;
use host_core::run::{Profiled, SessionFile, profile};
use host_core::wearer::builtin_wearer;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::OnceLock;
use tests::desk::{flashed_image, load_session};

/// Session with ten channels at 100 Hz, ten calcium–force muscles and one finger controller.
const SESSION: &str = "full_load.toml";
/// Session with the same ten muscles, and an arm in place of the finger.
const WITH_ARM: &str = include_str!("full_load_arm.toml");
/// Measured length, s of device time.
const SECONDS: f64 = 4.0;

#[derive(Deserialize)]
struct Budgets {
    chip: Chip,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Chip {
    load_percent: f64,
    refill_margin_cycles: i64,
    refill_margin_together_cycles: i64,
    stack_bytes: u32,
    edge_span_cycles: u64,
    interrupt_latency_cycles: BTreeMap<String, u64>,
    with_arm: WithArm,
}

/// Budgets that differ while an arm is driven.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WithArm {
    load_percent: f64,
    stack_bytes: u32,
    interrupt_latency_cycles: BTreeMap<String, u64>,
}

impl Chip {
    fn with_arm(mut self) -> Self {
        self.load_percent = self.with_arm.load_percent;
        self.stack_bytes = self.with_arm.stack_bytes;
        let latencies = self.with_arm.interrupt_latency_cycles.clone();
        self.interrupt_latency_cycles.extend(latencies);
        self
    }
}

fn budgets() -> Chip {
    let text = include_str!("../budgets.toml");
    toml::from_str::<Budgets>(text).unwrap().chip
}

/// Returns the profile in the default reading of the flash documentation.
fn default_profile() -> &'static Profiled {
    static FOUND: OnceLock<Profiled> = OnceLock::new();
    FOUND.get_or_init(|| measure(Prefetched::default()))
}

fn measure(prefetched: Prefetched) -> Profiled {
    measure_session(load_session(SESSION), prefetched)
}

fn measure_session(mut file: SessionFile, prefetched: Prefetched) -> Profiled {
    file.session.duration_us = (SECONDS * 1e6) as u64;
    profile(
        &file,
        &flashed_image(),
        prefetched,
        1,
        &ProcessorClock::start(),
        |_| (),
    )
    .unwrap()
}

#[test]
fn the_flashed_image_keeps_its_budgets_at_full_load() {
    assert_within_budgets(default_profile(), &budgets());
}

/// Returns the session with the wearer of the shipped one, changed to electrodes for 100 Hz and a
/// tenth electrode without a line.
fn with_arm() -> SessionFile {
    let text = builtin_wearer("arm-1")
        .unwrap()
        .replace("to_hz = 50", "to_hz = 100");
    let (begin, end) = (
        text.find("[[electrode]]\nchannel = 9").unwrap(),
        text.find("[limb]").unwrap(),
    );
    let tenth = text[begin..end].replacen("channel = 9", "channel = 10", 1);
    let wearer = format!("{}{tenth}{}", &text[..end], &text[end..]);
    let file =
        SessionFile::parse_with_wearers("full_load_arm.toml", WITH_ARM, &|_| Ok(wearer.clone()));
    file.unwrap_or_else(|e| panic!("{}", e.lines()))
}

/// An arm recruits 200 times per second from nine angles measured 50 times per second, beside ten
/// muscle models; both Jacobians are computed anew each time.
#[test]
fn it_keeps_them_while_an_arm_is_driven() {
    for prefetched in [Prefetched::default(), Prefetched::NotCached] {
        println!("with an arm, {prefetched:?}");
        let found = measure_session(with_arm(), prefetched);
        assert_within_budgets(&found, &budgets().with_arm());
        let functions = found.profile.functions();
        let own = [
            "firmware::limb",
            "control::endpoint",
            "controller::endpoint",
        ];
        let named = functions
            .iter()
            .filter(|(name, _)| own.iter().any(|part| name.contains(part)));
        for (name, cost) in named.clone() {
            println!("{:6.2} % {name}", found.percent(cost.cycles));
        }
        let cycles: u64 = named.map(|(_, cost)| cost.cycles).sum();
        println!(
            "of it the arm's own functions: {:.2} %",
            found.percent(cycles)
        );
        assert!(cycles > 0, "no arm was driven");
    }
}

/// No board has shown which reading is right, so both must stay within the budgets.
#[test]
fn it_keeps_them_if_prefetched_lines_are_not_cached() {
    let other = measure(Prefetched::NotCached);
    assert_within_budgets(&other, &budgets());
    let loads = [default_profile(), &other].map(|found| found.summary.load_percent());
    assert!(loads[0] < loads[1], "{loads:?} %");
}

#[track_caller]
fn assert_within_budgets(found: &Profiled, budget: &Chip) {
    let summary = &found.summary;
    let margin = summary.margins.worst.unwrap();
    println!("{:<28} {:>10} {:>10}", "at full load", "found", "budget");
    let row = |quantity: &str, found: f64, budget: f64| {
        println!("{quantity:<28} {found:>10.2} {budget:>10.2}")
    };
    let load = summary.load_percent();
    row("load, %", load, budget.load_percent);
    let worst = margin as f64;
    row(
        "refill margin, cycles",
        worst,
        budget.refill_margin_cycles as f64,
    );
    let stack = summary.stack.used();
    row("stack, bytes", stack.into(), budget.stack_bytes.into());
    let span = summary.edge_span() as f64;
    row("edge span, cycles", span, budget.edge_span_cycles as f64);
    let mut late = Vec::new();
    for line in &summary.lines {
        let name = exception::name(line.number);
        let allowed = budget.interrupt_latency_cycles.get(&name);
        let allowed = *allowed.unwrap_or_else(|| panic!("{name} has no budget"));
        let (quantity, worst) = (format!("latency of {name}, cycles"), line.latency.worst);
        row(&quantity, worst as f64, allowed as f64);
        if worst > allowed {
            late.push(line);
        }
    }
    let (mips, times) = (found.mips(), found.real_time_factor());
    println!("{mips:.1} million instructions per second, {times:.1} x real time");
    assert!(late.is_empty(), "{late:?}");
    assert!(load <= budget.load_percent);
    assert!(margin >= budget.refill_margin_cycles);
    assert!(summary.stack.used() <= budget.stack_bytes);
    assert!(summary.stack.free().unwrap() > 0);
    assert!(summary.edge_span() <= budget.edge_span_cycles);
}

/// All channels begin a burst in one window, 20 µs apart.
#[test]
fn ten_bursts_in_one_window_leave_time() {
    let mut file = load_session(SESSION);
    file.session.duration_us = 1_000_000;
    for (place, channel) in (0..).zip(&mut file.session.channels) {
        channel.spec.train.offset_us = 20 * place;
    }
    for prefetched in [Prefetched::default(), Prefetched::NotCached] {
        let found = profile(
            &file,
            &flashed_image(),
            prefetched,
            1,
            &ProcessorClock::start(),
            |_| (),
        )
        .unwrap();
        let margin = found.summary.margins.worst.unwrap();
        println!("ten bursts in one window, {prefetched:?}: {margin} cycles");
        assert!(margin >= budgets().refill_margin_together_cycles);
    }
}

/// Checks the profile's sums, and that it covers the intended session.
#[test]
fn every_cycle_and_edge_of_it_is_accounted_for() {
    let found = default_profile();
    let summary = &found.summary;
    let functions = found.profile.functions();
    let by_function: u64 = functions.iter().map(|(_, c)| c.cycles).sum();
    let cycles = |owner| found.profile.owner(owner).cycles;
    let by_owner: u64 = Owner::ALL.map(cycles).iter().sum();
    assert_eq!(by_function, by_owner);
    assert_eq!(by_owner + summary.idle, summary.total);
    assert_eq!(cycles(Owner::Other), 0, "no fault handler ran");
    let seconds = found.seconds();
    assert!((seconds - SECONDS).abs() < 0.02, "{seconds}");
    let windows = 4000.0 * seconds;
    assert!((summary.margins.windows as f64 - windows).abs() <= 2.0);
    let mut lines = summary.lines.iter();
    let ticks = lines.find(|line| line.number == exception::TIM7);
    assert!((ticks.unwrap().count as f64 - 1000.0 * seconds).abs() <= 2.0);
    // The pump toggles every 25 µs on port B.
    let edges: u64 = summary.phases.iter().map(|p| p.b).sum();
    assert!(edges as f64 >= 40_000.0 * seconds - 100.0, "{edges}");
    let has_c = summary.phases.iter().any(|p| p.c > 0);
    assert!(has_c, "channels 1 to 5 pulse");
}
