//! Invalid session files and their error messages.

use std::collections::BTreeSet;
use std::fmt::Write;

use host_core::session::{Session, SessionError};
use miette::{GraphicalReportHandler, GraphicalTheme};

/// The valid session that the tests modify.
pub(super) const GOOD: &str = r#"title = "Good"
duration_s = 10.0

[wearer]
max_current_ma = 20.0
max_charge_uc = 5.0
rise_ms = 200

[[channel]]
number = 1
name = "flexor A"
stage = { kind = "voltage", full_scale_v = 60.0, load_ohm = 2000 }
limit = 28.0
train = { shape = "monophasic-cathodic", width_us = 200, ground_us = 1000, frequency_hz = 50.0 }
[channel.muscle]
a_n_per_s = 265.1
k = 0.2
tau_c_ms = 20
tau1_ms = 50.5
tau2_ms = 100
motor_threshold = 20.0
reference = 28.0
slope_per_unit = 0.3

[[channel]]
number = 2
name = "flexor B"
stage = { kind = "voltage", full_scale_v = 60.0, load_ohm = 2000 }
limit = 36.0
train = { shape = "monophasic-cathodic", width_us = 200, ground_us = 1000, period_us = 20_000, offset_us = 2000 }

[[channel]]
number = 3
name = "extensor"
stage = { kind = "current", full_scale_ma = 100.0 }
limit = 13.0
train = { shape = "biphasic-cathodic-first", width_us = 200, frequency_hz = 40, burst_count = 2, burst_interval_us = 5000 }

[[channel]]
number = 4
name = "spare"
stage = { kind = "current", full_scale_ma = 100.0 }
limit = 13.0
train = { shape = "biphasic-cathodic-first", width_us = 200, frequency_hz = 40, repeats = 7 }

[[group]]
channels = [1, 2]
partner = "isolated"

[[group]]
channels = [3, 4]
partner = "conducted"

[sync]
channel = 2

[joint]
law = "recommended"
flexors = [
    { channel = 1, threshold = 20.0, max = 28.0 },
    { channel = 2, threshold = 25.0, max = 36.0 },
]
extensor = { channel = 3, threshold = 7.0, max = 13.0 }
hold = "extrapolate"
sensor = "adc"
gains = { k1 = 0.08 }

[setpoints]
kind = "angle-sine"
offset_deg = 45.0
amplitude_deg = 40.0
frequency_hz = 0.2
rate_hz = 90

[measure]
from_s = 5.0
to_s = 10.0

[body]
kind = "finger"
participant = "P"
flexor_a = 1
flexor_b = 2
extensor = 3
"#;

/// Edits of [`GOOD`] as `text → replacement`: several are joined by `;`, and `⏎` is a line break.
const BAD: &[&str] = &[
    // The whole session.
    "rise_ms = 200 → max_session_s = 9",
    // Syntax, names and types.
    "limit = 28.0 → limit = = 28.0",
    "max_charge_uc → max_charge_mc",
    "width_us → widht_us",
    "[sync] → [sink]",
    "k1 = → kp =",
    "name = \"flexor B\" → name = 2",
    "duration_s = 10.0 → duration_s = \"10 s\"",
    "channels = [1, 2] → channels = 1",
    "repeats = 7 → triggered = 1",
    // Rises that are impossible.
    "limit = 28.0 → limit = 28.0 ⏎ start = 28.5",
    "frequency_hz = 40, burst_count → frequency_hz = 40, repeats = 3, burst_count",
    "offset_deg = 45.0 → offset_deg = 45.0 ⏎ values = [{ channel = 4, value = 9 }]",
    "title = → # title =",
    "limit = 36.0 → # no limit",
    "frequency_hz = 50.0 → offset_us = 0",
    "monophasic-cathodic → monophasic-catodic",
    "law = \"recommended\" → law = \"sliding\"",
    "ground_us = 1000, freq → period_us = 20_000, freq",
    // Numbers that cannot be converted.
    "limit = 28.0 → limit = 28.0005",
    "tau1_ms = 50.5 → tau1_ms = 50.5005",
    "limit = 28.0 → limit = nan",
    "frequency_hz = 50.0 → frequency_hz = inf",
    "repeats = 7 → repeats = 70_000",
    // Ranges of single fields.
    "duration_s = 10.0 → duration_s = 0",
    "max_current_ma = 20.0 → max_current_ma = 120",
    "rise_ms = 200 → rise_ms = -1",
    "number = 2 → number = 11",
    "load_ohm = 2000 → load_ohm = 20",
    "limit = 28.0 → limit = 61.0",
    "width_us = 200 → width_us = 70_000",
    "ground_us = 1000, freq → freq",
    "frequency_hz = 50.0 → frequency_hz = 201",
    "frequency_hz = 50.0 → frequency_hz = -50",
    "period_us = 20_000 → period_us = 4_999",
    "k = 0.2 → k = 0.0001",
    "k = 0.2 → k = 0",
    "k = 0.2 → k = nan",
    "tau_c_ms = 20 → tau_c_ms = -20",
    "duration_s = 10.0 → duration_s = 10.0 ⏎ fidelity = { tolerance_percent = 0 }",
    "duration_s = 10.0 → duration_s = 10.0 ⏎ fidelity = { tolerance_percent = nan }",
    "duration_s = 10.0 → duration_s = 10.0 ⏎ fidelity = { tolerance_percent = 10, telemetry_ms = 5 }",
    "frequency_hz = 50.0 → frequency_hz = 50.0, burst_count = 8, burst_interval_us = 1300; tau_c_ms = 20 → tau_c_ms = 60",
    "tau1_ms = 50.5 → tau1_ms = 0",
    "tau2_ms = 100 → tau2_ms = inf",
    "a_n_per_s = 265.1 → a_n_per_s = 0",
    "k = 0.2 → k = 0.2 ⏎ fatigue = { alpha_a_per_s2 = 10.001 }",
    "k = 0.2 → k = 0.2 ⏎ fatigue = { alpha_k_per_n_s = -0.1 }",
    "k = 0.2 → k = 0.2 ⏎ fatigue = { alpha_tau1_per_n = 0.2 }",
    "k = 0.2 → k = 0.2 ⏎ fatigue = { tau_fat_s = 0 }",
    "k = 0.2 → k = 0.2 ⏎ fatigue = { tau_fat_s = nan }",
    "k = 0.2 → k = 0.2 ⏎ fatigue = { tau_s = 127 }",
    // Model levels.
    "k = 0.2 → k = 0.2 ⏎ model = \"lags\"",
    "k = 0.2 → k = 0.2 ⏎ model = \"calcium-force-fatigue\"",
    "k = 0.2 → k = 0.2 ⏎ changes = [{ at_s = 2, model = \"calcium-force-fatigue\" }]",
    "k = 0.2 → k = 0.2 ⏎ changes = [{ at_s = 2, model = \"auto\" }]",
    "k = 0.2 → k = 0.2 ⏎ changes = [{ at_s = 11, model = \"calcium-force\" }]",
    "k = 0.2 → k = 0.2 ⏎ model = \"static\"",
    "k = 0.2 → k = 0.2 ⏎ changes = [{ at_s = 2, model = \"lag\" }]",
    "k = 0.2 → k = 0.2 ⏎ changes = [{ at_s = 2, model = \"calcium-force\" }, { at_s = 2, model = \"none\" }]",
    "motor_threshold = 20.0 → motor_threshold = 30.0",
    "slope_per_unit = 0.3 → slope_per_unit = 9",
    "k1 = 0.08 → k1 = 200",
    "threshold = 25.0 → threshold = 37.0",
    "max = 13.0 → max = -1.0",
    "sensor = \"adc\" → sensor = \"adc\" ⏎ code_at_100_deg = 850",
    "hold = \"extrapolate\" → hold = \"hold\" ⏎ max_extrapolation_ms = 50",
    "flexors = [ → flexors = [] ⏎ # [; { channel = 1, → #; { channel = 2, → #; ] ⏎ extensor → extensor",
    // Bounds of a live client that contradict each other, the channel or the session.
    "offset_deg = 45.0 → offset_deg = 45.0 ⏎ bounds = [{ channel = 4, least = 5, most = 5 }]",
    "offset_deg = 45.0 → offset_deg = 45.0 ⏎ bounds = [{ channel = 4, most = 14 }]",
    "offset_deg = 45.0 → offset_deg = 45.0 ⏎ bounds = [{ channel = 4, most = 13, per_s = 1.2 }]",
    "offset_deg = 45.0 → offset_deg = 45.0 ⏎ bounds = [{ channel = 4, most = 13, shortest_s = 11 }]",
    "offset_deg = 45.0 → offset_deg = 45.0 ⏎ bounds = [{ channel = 4, most = 13 }, { channel = 4, most = 12 }]",
    "offset_deg = 45.0 → offset_deg = 45.0 ⏎ bounds = [{ channel = 4, least = 6, most = 8 }] ⏎ values = [{ channel = 4, value = 9 }]",
    "offset_deg = 45.0 → offset_deg = 45.0 ⏎ bounds = [{ channel = 4, least = 6, most = 8 }] ⏎ values = [{ channel = 4, value = 5.5 }]",
    "offset_deg = 45.0 → offset_deg = 45.0 ⏎ bounds = [{ channel = 1, most = 25 }]",
    "offset_deg = 45.0 → offset_deg = 45.0 ⏎ bounds = [{ channel = 5, most = 25 }]",
    "amplitude_deg = 40.0 → amplitude_deg = 60.0",
    "from_s = 5.0 → from_s = 10.0",
    "kind = \"angle-sine\" → kind = \"angle-steps\" ⏎ steps = [{ at_s = 0, deg = 10 }, { at_s = 2, deg = 50 }, { at_s = 1.5, deg = 10 }]; offset_deg → #; amplitude_deg → #; frequency_hz = 0.2 → #",
    // Channels and groups.
    "number = 2 → number = 1",
    "{ channel = 3, → { channel = 1,",
    "flexor_b = 2 → flexor_b = 3",
    "[sync] ⏎ channel = 2 → [sync] ⏎ channel = 5",
    "channels = [3, 4] → channels = [3, 3]",
    "channels = [3, 4] → channels = [3, 7]",
    "channels = [3, 4] → channels = [3, 12]",
    "channels = [3, 4] → channels = [3]",
    "channels = [3, 4] → channels = [2, 3]",
    "offset_us = 2000 → offset_us = 100",
    "ground_us = 1000, freq → ground_us = 18_500, freq",
    "burst_interval_us = 5000 → burst_interval_us = 300",
    "burst_interval_us = 5000 → burst_interval_us = 30_000",
    // Limits of wearer and channel.
    "limit = 36.0 → limit = 41.0",
    "max_charge_uc = 5.0 → max_charge_uc = 3.5",
    "max_charge_uc = 5.0 → max_rms_ma = 1.5",
    "max = 36.0 → max = 37.0",
    "kind = \"angle-sine\" → kind = \"amplitudes\" ⏎ values = [{ channel = 4, value = 14.0 }]; offset_deg → #; amplitude_deg → #; frequency_hz = 0.2 → #",
    // A wearer whose joint moves too far or not far enough per unit of effort.
    "gains = { k1 = 0.08 } → wearer = { rest_deg = 20.0, stiffness_nm_per_rad = 0.02, flexion_nm = 0.484, extension_nm = 0.3 }",
    "gains = { k1 = 0.08 } → wearer = { rest_deg = 20.0, stiffness_nm_per_rad = 0.5, flexion_nm = 0.484, extension_nm = 0.3 }",
    // Setpoints that the device would refuse.
    "kind = \"angle-sine\" → kind = \"amplitudes\" ⏎ values = [{ channel = 1, value = 14.0 }]; offset_deg → #; amplitude_deg → #; frequency_hz = 0.2 → #",
    "rate_hz = 90 → rate_hz = 10",
    "[joint] → # no joint; law = → #; flexors = [ → #; { channel = 1, → #; { channel = 2, → #; ] ⏎ extensor = → #; hold = \"ex → #; sensor = → #; gains = → #",
];

/// A wall with all its fields.
const GOOD_WALL: &str = include_str!("../../sessions/harris_wall/3_pre_wall_co_contraction.toml");

/// Edits of [`GOOD_WALL`].
const BAD_WALL: &[&str] = &[
    "sensor = \"adc\" → sensor = \"adc\" ⏎ [joint]",
    "stiffness_per_deg → stiffness",
    "stops = \"flexion\" → stops = \"flexing\"",
    "at_deg = 90.0 → at_deg = 151.0",
    "stiffness_per_deg = 8.889 → stiffness_per_deg = 0",
    "stiffness_per_deg = 8.889 → stiffness_per_deg = 8.889 ⏎ damping_s_per_deg = 21",
    "stiffness_per_deg = 8.889 → stiffness_per_deg = 8.889 ⏎ cutoff_hz = 40",
    "depth_deg = 9.0 → depth_deg = 60",
    "depth_deg = 9.0 → depth_deg = 9.0, begin = 90.0",
    "depth_deg = 9.0 → depth_deg = 9.0, end = 80.1",
    "stiffness_per_deg → max = 80.001 ⏎ stiffness_per_deg",
    "stiffness_per_deg → max = -1 ⏎ stiffness_per_deg",
    "channel = 1 ⏎ stiff → channel = 3 ⏎ stiff",
    "{ channel = 2 } → { channel = 1, amplitude = 40.0 }",
    "{ channel = 2 } → { channel = 2, amplitude = 40.5 }",
    "{ channel = 2 } → { channel = 2, amplitude = 0 }",
    "angle_max_deg = 150.0 → angle_max_deg = 190.0",
    "sensor = \"adc\" → sensor = \"adc\" ⏎ stale_after_ms = 1",
    "rate_hz = 50 → rate_hz = 50 ⏎ values = [{ channel = 2, value = 5.0 }]",
    "kind = \"elbow\" → kind = \"knee\"",
    "biceps = 2 → biceps = 1",
    "push_nm = 1.5 → push_nm = -1",
    "speed_deg_per_s = 15.0 → speed_deg_per_s = 0",
    "at_s = 8.0 → at_s = 5.5",
];

/// Force control of one muscle.
const GOOD_FORCE: &str = include_str!("../../sessions/force_ramp.toml");

/// Edits of [`GOOD_FORCE`].
const BAD_FORCE: &[&str] = &[
    "n = 12.0 → n = 30.0",
    "n = 6.0 → n = -1.0",
    "at_s = 3.0 → at_s = 0.5",
    "points = [ → bounds = [{ channel = 1, most = 11.5 }] ⏎ points = [",
    "points = [ → point = [",
    "channel = 1 ⏎ points → channel = 2 ⏎ points",
    "force = { → # {",
    "muscle = { → # {",
    "max_frequency_hz = 60.0 → max_frequency_hz = 19.0",
    "max_frequency_hz = 60.0 → max_frequency_hz = 0",
    "max_frequency_hz = 60.0 → max_frequency_hz = 60.0, max_extrapolation_ms = 0",
    "max_frequency_hz = 60.0 → min_frequency_hz = 21.0",
    "max_frequency_hz = 60.0 → min_frequency_hz = 0.499",
    "max_frequency_hz = 60.0 → min_frequency_hz = 0",
    "frequency_hz = 20.0 → frequency_hz = 9.0",
    "frequency_hz = 20.0 → frequency_hz = 20.0, burst_count = 2, burst_interval_us = 5000",
    "frequency_hz = 20.0 → frequency_hz = 20.0, triggered = true",
    "max_rms_ma = 6.0 → max_rms_ma = 2.0",
    "rate_hz = 90 → rate_hz = 90 ⏎ values = [{ channel = 1, value = 5.0 }]",
    "[setpoints] → [[channel]] ⏎ number = 2 ⏎ name = \"other\" ⏎ stage = { kind = \"current\", full_scale_ma = 50.0 } ⏎ limit = 20.0 ⏎ train = { shape = \"biphasic-cathodic-first\", width_us = 200, frequency_hz = 20.0, offset_us = 25000 } ⏎ [[group]] ⏎ channels = [1, 2] ⏎ partner = \"isolated\" ⏎ [setpoints]",
];

/// Ten channels under force control.
const GOOD_FORCES: &str = include_str!("../../sessions/ten_forces.toml");

/// Edits of [`GOOD_FORCES`].
const BAD_FORCES: &[&str] = &[
    "channel = 2, points → channel = 1, points",
    "channel = 2, points → channel = 11, points",
    "offset_n = 3.0 → offset_n = 300.0",
    "offset_n = 3.0, → ",
    "channel = 2, points → channel = 2, offset_n = 1.0, points",
    "force = { → # {",
    "kind = \"keep-alive\" → kind = \"force-sine\" ⏎ channel = 10 ⏎ offset_n = 2.0 ⏎ amplitude_n = 1.0 ⏎ frequency_hz = 1.0",
];

/// Trains that wait for the trigger input.
const GOOD_TRIGGER: &str = include_str!("../../sessions/trigger.toml");

/// Edits of [`GOOD_TRIGGER`].
const BAD_TRIGGER: &[&str] = &[
    "every_s → each_s",
    "every_s = 1.0 → every_s = 0.0009",
    "every_s = 1.0 → every_s = 1.0000001",
    "every_s = 1.0 → every_s = 1.0 ⏎ from_s = 11.0",
    "every_s = 1.0 → from_s = 1.0",
    "every_s = 1.0 → every_s = 1.0 ⏎ at_s = [1.0]",
    "every_s = 1.0 → at_s = 1.0",
    "every_s = 1.0 → at_s = [1.0, \"two\"]",
    "every_s = 1.0 → at_s = [1.0, 10.5]",
    "every_s = 1.0 → at_s = [0.0099]",
    "every_s = 1.0 → at_s = [nan]",
    "every_s = 1.0 → at_s = [0.0000005]",
    "every_s = 1.0 → at_s = [1.0, 1.0005]",
    "triggered = true → triggered = false; triggered = true → triggered = false",
    "triggered = true → trigger = \"gate\"",
    "triggered = true → triggered = true, trigger = \"toggle\"",
    "triggered = true → trigger = \"gated\"",
    "triggered = true → trigger = \"gated\"; every_s = 1.0 → every_s = 1.0 ⏎ held_s = 0.999001",
    "every_s = 1.0 → at_s = [1.0, 1.002] ⏎ held_s = 0.0011",
    "every_s = 1.0 → every_s = 1.0 ⏎ held_s = 0.0009",
    "every_s = 1.0 → every_s = 1.0 ⏎ held_s = \"long\"",
];

/// A width that increases, and lists of pulses.
const GOOD_WIDTHS: &str = concat!(
    include_str!("../../sessions/width_ramp.toml"),
    r#"
[[setpoints.values]]
channel = 2
value = 1.0
[[setpoints.list]]
at_s = 1.0
channel = 2
pulses = [
    { after_us = 0, value = 5.0 },
    { after_us = 20000, value = 6.0, width_us = 35 },
]
"#
);

/// Edits of [`GOOD_WIDTHS`].
const BAD_WIDTHS: &[&str] = &[
    "max_width_us = 300 → max_width_us = 24",
    "max_width_us = 300 → max_width_us = 501",
    "max_width_us = 300 → max_width_us = 299",
    "max_width_us = 300, → ",
    "value = 35.0, width_us = 0 → value = 35.001, width_us = 0",
    "value = 35.0, width_us = 0 → value = 35.0, width_us = -1",
    "value = 35.0, width_us = 0 → value = 35.0, width_us = 0.5",
    "max_charge_uc = 10.5 → max_charge_uc = 10.499",
    // On the way from 35 mA · 100 µs to 15 mA · 300 µs, the charge is largest at 22.5 mA · 225 µs:
    // 5.06 µC.
    "max_charge_uc = 10.5 → max_charge_uc = 5.0; value = 35.0, width_us = 0 → value = 35.0, width_us = 100; value = 35.0, width_us = 300 → value = 15.0, width_us = 300; value = 35.0, width_us = 300 → value = 15.0, width_us = 300",
    "at_s = 0.0 → at_s = 0.1",
    "at_s = 12.0 → at_s = 9.0",
    "channel = 1 ⏎ points → channel = 3 ⏎ points",
    "max_width_us = 300 → width_max_us = 300",
    "channel = 2 ⏎ value = 1.0 → channel = 1 ⏎ value = 5.0",
    "channel = 2 ⏎ value = 1.0 → channel = 2 ⏎ value = 5.0 ⏎ width_us = 36",
    "channel = 2 ⏎ value = 1.0 → channel = 2 ⏎ value = 5.0 ⏎ width_us = 9",
    "[setpoints] → [channel.muscle] ⏎ a_n_per_s = 265.1 ⏎ k = 0.2 ⏎ tau_c_ms = 20 ⏎ tau1_ms = 50.5 ⏎ tau2_ms = 100 ⏎ motor_threshold = 2.0 ⏎ reference = 35.0 ⏎ slope_per_unit = 0.3 ⏎ [setpoints]; width_us = 35, lists → width_us = 35, max_width_us = 40, lists",
    // Lists of pulses.
    "[[setpoints.values]] ⏎ channel = 2 ⏎ value = 1.0 → ",
    "value = 1.0 → value = 0",
    "lists = true, → ",
    "lists = true, → lists = true, repeats = 3,",
    "lists = true, → lists = true, triggered = true,",
    "at_s = 1.0 → at_s = 13.0",
    "after_us = 20000 → after_us = 19999",
    "after_us = 20000 → after_us = 2000001",
    "value = 6.0 → value = 0",
    "value = 6.0 → value = 36",
    "value = 6.0, width_us = 35 → value = 6.0, width_us = 34",
    "channel = 2 ⏎ pulses → channel = 1 ⏎ pulses",
];

/// Applies edits to a valid file.
pub(super) fn spoil(good: &str, edits: &str) -> String {
    let mut text = good.to_owned();
    for edit in edits.split("; ") {
        let (find, replace) = edit.split_once(" → ").unwrap_or((edit, ""));
        let find = find.replace(" ⏎ ", "\n");
        assert!(text.contains(&find), "{find:?} is not in the file");
        text = text.replacen(&find, &replace.replace(" ⏎ ", "\n"), 1);
    }
    text
}

pub(super) fn render(e: &SessionError) -> String {
    let mut text = String::new();
    GraphicalReportHandler::new_themed(GraphicalTheme::unicode_nocolor())
        .with_width(100)
        .with_links(false)
        .render_report(&mut text, e)
        .unwrap();
    text
}

#[test]
fn every_mistake_is_named_with_its_line() {
    let mut report = String::new();
    let mut numbers = BTreeSet::new();
    let mut add = |case: &str, e: &SessionError| {
        numbers.insert(e.problem().number());
        writeln!(report, "# {case}\n\n{}", render(e)).unwrap();
    };
    let files = [
        (GOOD, BAD),
        (GOOD_WALL, BAD_WALL),
        (GOOD_FORCE, BAD_FORCE),
        (GOOD_FORCES, BAD_FORCES),
        (GOOD_TRIGGER, BAD_TRIGGER),
        (GOOD_WIDTHS, BAD_WIDTHS),
    ];
    for (good, bad) in files {
        for edits in bad {
            match Session::parse("bad.toml", &spoil(good, edits)) {
                Err(e) => add(edits, &e),
                Ok(_) => panic!("accepted: {edits}"),
            }
        }
    }
    let missing = Session::load("no/such/session.toml").unwrap_err();
    add("a file that is not there", &missing);
    insta::assert_snapshot!(report);
    let expected = [
        400, 401, 402, 403, 404, 405, 406, 407, 408, 409, 410, 420, 421, 430, 431, 432, 440, 441,
        450, 451, 452, 453, 460, 461, 462, 463, 465, 466, 467, 468, 470, 471, 472, 473, 474, 480,
        630, 631, 632, 633, 634, 635, 636, 637, 638,
    ];
    assert_eq!(numbers, expected.into_iter().collect());
}

/// The sum includes every channel that can be played, whatever else is wrong with it, and names the
/// channels if some are missing.
#[test]
fn a_sum_is_told_beside_other_mistakes() {
    let message = |edits: &str| {
        let e = Session::parse("sums.toml", &spoil(GOOD, edits)).unwrap_err();
        e.lines()
    };
    let little = "rise_ms = 200 → max_sum_rms_ma = 2.0";
    let alone = message(little);
    let sum = "at their limits, the common return carries 6.36 mA rms; allowed: at most 2 mA \
               (`wearer.max_sum_rms_ma`); lower the limits, pulse widths or frequencies";
    assert!(alone.contains(&format!("all channels {sum}")), "{alone}");
    assert!(alone.starts_with("E456") && !alone.contains("return_area"));
    let dense = format!("{little}; limit = 13.0 → limit = 13.0 ⏎ area_mm2 = 10");
    let dense = message(&dense);
    for wanted in [
        "E454 sums.toml:36:9: at `channel.limit` = 13 mA (13 mA) the train has 2.326 mA rms; \
         allowed: at most 0.2 mA (2 mA/cm² under `area_mm2` = 10)",
        &format!("all channels {sum}"),
    ] {
        assert!(dense.contains(wanted), "{wanted}\n{dense}");
    }
    let partly = message(&format!(
        "{little}; k = 0.2 → k = 0.2; limit = 36.0 → # no limit"
    ));
    assert!(
        partly.contains("channels 1, 3 and 4 at their limits, the common return carries 5.37 mA"),
        "{partly}"
    );
    let small = message("rise_ms = 200 → return_area_mm2 = 100");
    let wanted = "allowed: at most 2 mA (2 mA/cm² under `wearer.return_area_mm2` = 100); lower \
                  the limits, pulse widths or frequencies, or enter the \
                  `wearer.return_area_mm2` of a larger electrode";
    assert!(small.contains(wanted), "{small}");
}

#[test]
fn how_amplitudes_rise_is_noted() {
    let notes = |edits: &str| {
        let session = Session::parse("notes.toml", &spoil(GOOD, edits)).unwrap();
        session.rise_notes().join("\n")
    };
    let plain = notes("rise_ms = 200 → rise_ms = 200");
    // 28 V in 200 ms is 2.8 V every 20 ms, so 8 V take three bursts.
    let wanted = "channel 1: `max` is 8 V above `threshold`, and the amplitude rises by at most \
                  2.8 V per burst (`rise_ms`, `rise_bursts`), so a full rise takes 3 bursts, \
                  0.06 s";
    assert_eq!(plain.lines().next(), Some(wanted));
    assert_eq!(plain.lines().count(), 3);
    let at_once = notes("limit = 28.0 → limit = 28.0 ⏎ start = 28");
    assert!(!at_once.contains("channel 1"), "{at_once}");
    let steps = |start: &str| {
        let text = format!(
            "title = \"steps\"\nduration_s = 3.0\n[wearer]\nmax_current_ma = 20.0\nrise_ms = 100\n\
             [[channel]]\nnumber = 2\nname = \"a\"\nlimit = 15.0\n{start}\
             stage = {{ kind = \"current\", full_scale_ma = 100.0 }}\n\
             train = {{ shape = \"biphasic-cathodic-first\", width_us = 200, frequency_hz = 50.0 }}\n\
             [setpoints]\nkind = \"amplitude-steps\"\nchannel = 2\nrate_hz = 50\n\
             points = [{{ at_s = 0, value = 0 }}, {{ at_s = 1, value = 2 }}, {{ at_s = 2, value = 15 }}]\n"
        );
        Session::parse("steps.toml", &text).unwrap().rise_notes()
    };
    // 3 mA per burst: 13 mA take five bursts.
    let wanted = "channel 2: the step to 15 mA at 2 s takes 0.1 s (`rise_ms`, `rise_bursts`)";
    assert_eq!(steps(""), [wanted]);
    assert_eq!(steps("start = 15.0\n"), [""; 0]);
}

#[test]
fn what_a_wearer_s_limits_make_of_a_session_is_noted() {
    let notes = |edits: &str| {
        let session = Session::parse("notes.toml", &spoil(GOOD, edits)).unwrap();
        session.notes.join("\n")
    };
    let own = notes("rise_ms = 200 → rise_ms = 200");
    assert!(own.starts_with("channel 4: it is configured, but never") && own.lines().count() == 1);
    let rise = notes("rise_ms = 200 → rise_bursts = 500");
    let wanted = "channel 1: the rise of `wearer.rise_bursts` = 500 takes 10 s, but the session \
                  lasts only 10 s";
    assert!(rise.starts_with(wanted), "{rise}");
    // 14 mA · 200 µs is 2.8 µC per burst, and 357 bursts are less than 1 mC.
    let dose = notes("rise_ms = 200 → max_dose_mc = 1");
    let wanted = "channel 1: at its limit it reaches `wearer.max_dose_mc` = 1 mC after 7.14 s, \
                  and the device then ends stimulation";
    assert!(dose.starts_with(wanted), "{dose}");
    // Seven bursts cannot reach the limit of the dose.
    assert!(!dose.contains("channel 4: at its limit"), "{dose}");
}

/// Messages omit a line that is too long to read, and shorten a long value.
#[test]
fn what_is_wrong_in_a_very_long_line_is_told_in_few() {
    let long = "x".repeat(200_000);
    for text in [
        format!("title = \"{long}"),
        spoil(
            GOOD,
            &format!("duration_s = 10.0 → duration_s = \"{long}\""),
        ),
        spoil(
            GOOD,
            &format!("[wearer] → [wearer] ⏎ max_rms_ma = 1{}", "0".repeat(5_000)),
        ),
    ] {
        let e = Session::parse("long.toml", &text).unwrap_err();
        let (drawn, lines) = (render(&e), e.lines());
        assert!(
            drawn.len() < 4_000 && lines.len() < 4_000,
            "{}",
            &drawn[..1_000]
        );
        assert!(drawn.contains("line "), "{drawn}");
    }
}

/// A file without end is refused instead of read until the memory is full.
#[cfg(unix)]
#[test]
fn a_file_without_end_is_refused() {
    let long = std::env::temp_dir().join(format!("flexor-long-{}", std::process::id()));
    let file = std::fs::File::create(&long).unwrap();
    file.set_len(1 << 40).unwrap();
    let files = [
        ("/dev/zero", "not a regular file"),
        (long.to_str().unwrap(), "1 MiB"),
    ];
    for (file, why) in files {
        let e = Session::load(file).unwrap_err();
        let message = format!("{:?} {}", e.problem().number(), e.one_line());
        assert!(
            message.contains("400") && message.contains(why),
            "{message}"
        );
    }
    std::fs::remove_file(long).unwrap();
}

/// A field that is valid only beside others is accepted where these are present.
#[test]
fn fields_that_may_be_nothing_may_say_so() {
    for edit in [
        "frequency_hz = 40, repeats → frequency_hz = 40, ground_us = 0, burst_interval_us = 0, repeats",
        "rate_hz = 90 → rate_hz = 90 ⏎ values = [{ channel = 4, value = 0 }]",
    ] {
        Session::parse("good.toml", &spoil(GOOD, edit)).unwrap();
    }
    let none = "kind = \"angle-sine\" → kind = \"amplitudes\"; offset_deg → #; amplitude_deg → #; frequency_hz = 0.2 → #";
    let e = Session::parse("bad.toml", &spoil(GOOD, none)).unwrap_err();
    assert_eq!(
        e.one_line(),
        "E404 bad.toml:68:1: `setpoints.values` is missing"
    );
}
