//! Invalid programs and their error messages.

use std::collections::BTreeSet;
use std::fmt::Write;

use host_core::session::Session;

use crate::session_errors::{render, spoil};

/// Two channels in alternation, a third in a cycle, and one without a program.
const GOOD_PROGRAMS: &str = concat!(
    include_str!("../../sessions/reciprocal.toml"),
    r#"
[[channel]]
number = 3
name = "third"
stage = { kind = "current", full_scale_ma = 50.0 }
limit = 12.0
train = { shape = "biphasic-cathodic-first", width_us = 200, max_width_us = 300, frequency_hz = 20.0 }
[[channel]]
number = 4
name = "fourth"
stage = { kind = "current", full_scale_ma = 50.0 }
limit = 12.0
train = { shape = "biphasic-cathodic-first", width_us = 200, frequency_hz = 20.0 }
[[program]]
kind = "ramp"
channels = [3]
points = [
    { at_s = 0.0, value = 0 },
    { at_s = 1.0, value = 5.0 },
    { at_s = 2.0, value = 9.0 },
    { at_s = 3.0, value = 0 },
]
every_s = 4.0
[[program]]
kind = "cycle"
cadence_rpm = 40
phases = [{ channel = 4, value = 6.0, from_deg = 10, to_deg = 200 }]
"#
);

/// Edits of [`GOOD_PROGRAMS`].
const BAD_PROGRAMS: &[&str] = &[
    "channels = [1, 2] → channels = [1, 1]",
    "channels = [1, 2] → channels = [1, 3]",
    "channels = [1, 2] → channels = [1, 7]",
    "channels = [1, 2] → channels = [1, 11]",
    "channels = [1, 2] → channels = []",
    "channels = [1, 2] → channels = [\"1\", true, 11, 1.5]",
    "channels = [3] → channels = [2, 3]",
    "channel = 4, value → channel = 3, value",
    "kind = \"on-off\" → kind = \"on off\"",
    "on_s = 2.0 → # no on_s",
    "value = 8.0 → value = 12.001",
    "value = 8.0 → value = 8.0 ⏎ width_us = 251",
    "value = 8.0 → value = 8.0 ⏎ cadence_rpm = 50",
    "stagger_s = 2.0 → stagger_s = 30.0",
    "stagger_s = 2.0 → delay_s = 30.0",
    // Before the end of the session, but after the last burst of channel 1 at 29.975 s.
    "stagger_s = 2.0 → delay_s = 29.98",
    "stagger_s = 2.0 → repeats = 8 ⏎ stagger_s = 2.0",
    "off_s = 2.0 → repeats = 2",
    "on_s = 2.0 → on_s = 31.0",
    // Ramps and pauses that a rise, a silence or a period makes impossible.
    "ramp_up_s = 0.5 → ramp_up_s = 0.399",
    "ramp_up_s = 0.5 → ramp_up_s = 1.6",
    "off_s = 2.0 → off_s = 0.02",
    "rise_ms = 400 → rise_ms = 400 ⏎ rise_bursts = 30",
    "at_s = 1.0 → at_s = 0.4",
    "at_s = 2.0 → at_s = 1.1",
    "every_s = 4.0 → every_s = 3.02",
    "every_s = 4.0 → every_s = 2.9",
    "at_s = 3.0, value = 0 → at_s = 3.0, value = 1.0",
    "at_s = 0.0, value = 0 → at_s = 0.0, value = 1.0",
    "at_s = 2.0, value = 9.0 → at_s = 1.05, value = 5.0, width_us = 300",
    "rise_ms = 400 → rise_ms = 5000; width_us = 200, max_width_us = 300 → width_us = 10, max_width_us = 300; value = 9.0 → value = 5.0, width_us = 300",
    // A wearer whose steps are limited.
    "rise_ms = 400 → rise_ms = 400 ⏎ max_step_ma = 0.1",
    "rise_ms = 400 → rise_ms = 400 ⏎ max_step_ma_per_s = 3",
    "rise_ms = 400 → rise_ms = 400 ⏎ max_step_ma = 2.0; kind = \"ramp\" → kind = \"steps\"",
    "at_s = 3.0, value = 0 → at_s = 33.0, value = 0",
    "kind = \"ramp\" → kind = \"steps\"; at_s = 2.0 → at_s = 1.049; every_s = 4.0 → every_s = 3.01",
    "to_deg = 200 → to_deg = 10",
    "to_deg = 200 → to_deg = 9",
    "to_deg = 200 → to_deg = 50",
    "to_deg = 200 → to_deg = 361",
    "cadence_rpm = 40 → cadence_rpm = 120",
    // Channels that a program cannot drive: only endless trains that nothing else drives are
    // allowed.
    "frequency_hz = 40.0 } → frequency_hz = 40.0, repeats = 7 }",
    "frequency_hz = 40.0 } → frequency_hz = 40.0, triggered = true }",
    "frequency_hz = 40.0 } → frequency_hz = 40.0, lists = true }",
    "[body] → [setpoints] ⏎ kind = \"amplitudes\" ⏎ rate_hz = 50 ⏎ values = [{ channel = 1, value = 2.0 }] ⏎ [body]",
    "[body] → [setpoints] ⏎ kind = \"keep-alive\" ⏎ rate_hz = 35 ⏎ [body]",
    "[[program]] ⏎ kind = \"on-off\" → [wall] ⏎ at_deg = 90 ⏎ channel = 1 ⏎ max = 8 ⏎ stiffness_per_deg = 1 ⏎ sensor = \"adc\" ⏎ [[program]] ⏎ kind = \"on-off\"",
];

#[test]
fn every_mistake_of_a_program_is_named_with_its_line() {
    Session::parse("good.toml", GOOD_PROGRAMS).unwrap_or_else(|e| panic!("{}", e.lines()));
    let (mut report, mut numbers) = (String::new(), BTreeSet::new());
    for edits in BAD_PROGRAMS {
        match Session::parse("bad.toml", &spoil(GOOD_PROGRAMS, edits)) {
            Err(e) => {
                numbers.extend(e.errors().map(|e| e.problem().number()));
                writeln!(report, "# {edits}\n\n{}", render(&e)).unwrap();
            }
            Ok(_) => panic!("accepted: {edits}"),
        }
    }
    insta::assert_snapshot!(report);
    let expected: Vec<u16> = (483..=492).collect();
    let missing: Vec<_> = expected
        .iter()
        .filter(|value| !numbers.contains(value))
        .collect();
    assert_eq!(missing, [&0; 0], "told are {numbers:?}");
}

/// Several mistakes of one file are reported at once.
#[test]
fn mistakes_of_several_programs_are_told_in_one_run() {
    let edits = "ramp_up_s = 0.5 → ramp_up_s = 0.1; channels = [3] → channels = [1, 3]; \
                 at_s = 1.0 → at_s = 0.3; to_deg = 200 → to_deg = 20";
    let e = Session::parse("bad.toml", &spoil(GOOD_PROGRAMS, edits)).unwrap_err();
    let numbers: Vec<u16> = e.errors().map(|e| e.problem().number()).collect();
    for number in [483, 485, 489] {
        assert!(numbers.contains(&number), "{}", e.lines());
    }
}

/// A program with 10,000 points is refused with the allowed number of points.
#[test]
fn ten_thousand_points_are_refused() {
    let rows =
        (0..10_000).map(|n| format!("{{ at_s = {}.{:02}, value = 0 }},\n", n / 100, n % 100));
    let rows: String = rows.collect();
    let text = GOOD_PROGRAMS.replace("    { at_s = 0.0, value = 0 },\n", &format!("{rows}#"));
    let e = Session::parse("long.toml", &text).unwrap_err();
    assert!(e.lines().contains("1 to 1000 points"), "{}", e.lines());
}
