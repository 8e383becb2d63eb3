//! Writes a wearer file that the reader turns into the same wearer.

use super::limb::{JOINT_WORDS, RANGES, SEGMENTS, WAYS};
use super::unit::Unit;
use super::{
    DriftCheck, Elbow, Electrode, Forearm, History, Limb, Muscle, SCHEMA, StrengthDuration, Wearer,
};
use crate::fields::decimal::{in_units, written};
use firmware::muscle::FatigueSpec;
use firmware::safety::WearerSpec;
use firmware::units::Amplitude;
use std::fmt::{Display, Write};

/// Returns the text of the whole file.
pub(super) fn to_toml(it: &Wearer) -> String {
    let mut out = Lines::default();
    out.field("schema", SCHEMA);
    out.text("name", &it.name);
    out.text("evidence", it.evidence.word());
    out.text("source", &it.source);
    out.texts("note", it.note.as_deref());
    limits(&mut out, &it.limits);
    for electrode in &it.electrodes {
        out.head("[[electrode]]");
        write_electrode(&mut out, electrode);
    }
    if let Some(forearm) = &it.forearm {
        out.head("[forearm]");
        write_forearm(&mut out, forearm);
    }
    if let Some(elbow) = &it.elbow {
        out.head("[elbow]");
        write_elbow(&mut out, elbow);
    }
    if let Some(limb) = &it.limb {
        write_limb(&mut out, limb);
    }
    out.0 + &appendix(&it.history, &it.checks)
}

/// Returns the text that is appended to a file for these entries.
pub(super) fn appendix(history: &[History], checks: &[DriftCheck]) -> String {
    let mut out = Lines::default();
    for entry in history {
        out.head("[[history]]");
        out.text("at", &entry.at);
        out.text("by", &entry.by);
        out.text("what", &entry.what);
        out.texts("device", entry.device.as_deref());
        out.texts("firmware", entry.firmware.as_deref());
        out.given("seed", entry.seed);
    }
    for check in checks {
        out.head("[[check]]");
        out.text("at", &check.at);
        out.field("channel", check.channel);
        out.field("expected", milli(check.expected));
        out.given("found", check.found.map(milli));
        out.text("unit", check.unit.symbol());
        out.field("accepted", check.accepted);
        out.texts("by", check.by.as_deref());
        out.texts("device", check.device.as_deref());
        out.given("seed", check.seed);
    }
    out.0
}

/// The lines of a file, joined in a text.
#[derive(Default)]
struct Lines(String);

impl Lines {
    fn line(&mut self, line: &str) {
        self.0.push_str(line);
        self.0.push('\n');
    }

    fn head(&mut self, head: &str) {
        self.line("");
        self.line(head);
    }

    fn field(&mut self, name: &str, value: impl Display) {
        let _ = writeln!(self.0, "{name} = {value}"); // a String takes all
    }

    fn given(&mut self, name: &str, value: Option<impl Display>) {
        if let Some(value) = value {
            self.field(name, value);
        }
    }

    fn text(&mut self, name: &str, text: &str) {
        self.field(name, quoted(text));
    }

    fn texts(&mut self, name: &str, text: Option<&str>) {
        self.given(name, text.map(quoted));
    }
}

/// Returns a text as a TOML string.
fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// Formats an amplitude in thousandths for people.
fn milli(value: Amplitude) -> String {
    in_units(value.get().into(), 3)
}

/// Writes the limits that differ from the device's own; host silence and fall are always written.
fn limits(out: &mut Lines, it: &WearerSpec) {
    let own = WearerSpec::default();
    out.head("[limits]");
    let numbers: [(&str, u32, u32, i32, bool); 14] = [
        (
            "max_current_ma",
            it.max_current_ua,
            own.max_current_ua,
            3,
            false,
        ),
        (
            "max_charge_uc",
            it.max_charge_nc,
            own.max_charge_nc,
            3,
            false,
        ),
        ("max_rms_ma", it.max_rms_ua, own.max_rms_ua, 3, false),
        ("rise_ms", it.rise_ms.into(), own.rise_ms.into(), 0, false),
        ("fall_ms", it.fall_ms.into(), own.fall_ms.into(), 0, true),
        (
            "host_timeout_ms",
            it.host_timeout_ms.into(),
            own.host_timeout_ms.into(),
            0,
            true,
        ),
        ("max_sum_ma", it.max_sum_ua, own.max_sum_ua, 3, false),
        (
            "max_sum_rms_ma",
            it.max_sum_rms_ua,
            own.max_sum_rms_ua,
            3,
            false,
        ),
        (
            "return_area_mm2",
            it.return_area_mm2,
            own.return_area_mm2,
            0,
            false,
        ),
        (
            "rise_bursts",
            it.rise_bursts.into(),
            own.rise_bursts.into(),
            0,
            false,
        ),
        (
            "max_session_s",
            it.max_session_s,
            own.max_session_s,
            0,
            false,
        ),
        ("max_dose_mc", it.max_dose_mc, own.max_dose_mc, 0, false),
        ("max_step_ma", it.max_step_ua, own.max_step_ua, 3, false),
        (
            "max_step_ma_per_s",
            it.max_step_ua_per_s,
            own.max_step_ua_per_s,
            3,
            false,
        ),
    ];
    for (name, value, default, places, always) in numbers {
        if always || value != default {
            out.field(name, in_units(value.into(), places));
        }
    }
    if it.hand_stop_required {
        out.field("hand_stop_required", true);
    }
}

fn write_electrode(out: &mut Lines, it: &Electrode) {
    out.field("channel", it.channel);
    out.text("place", &it.place);
    match it.unit {
        Unit::Milliampere => out.text("stage", "current"),
        Unit::Volt => {
            out.text("stage", "voltage");
            out.field("load_ohm", it.load_ohm);
        }
    }
    out.field("area_mm2", it.area_mm2);
    out.field("width_us", it.width_us);
    out.field("frequency_hz", written(it.frequency_hz, 0));
    let [from, to] = it.holds_hz;
    if it.holds_hz != [it.frequency_hz; 2] {
        out.field("from_hz", written(from, 0));
        out.field("to_hz", written(to, 0));
    }
    out.field("motor_threshold", milli(it.motor_threshold));
    out.field("limit", milli(it.limit));
    out.given(
        "start",
        Some(it.start)
            .filter(|amplitude| amplitude.get() > 0)
            .map(milli),
    );
    out.given("minimum", it.minimum.map(milli));
    out.given("maximum", it.maximum.map(milli));
    if !it.moves.is_empty() {
        let moves: Vec<String> = it.moves.iter().map(|text| quoted(text)).collect();
        out.field("moves", format!("[{}]", moves.join(", ")));
    }
    out.given(
        "strength_duration",
        it.strength_duration.as_ref().map(curve),
    );
    out.given("muscle", it.muscle.as_ref().map(muscle));
    if !it.intervals.is_empty() {
        out.line("intervals = [");
        for interval in &it.intervals {
            let (low, high) = (written(interval.low, 0), written(interval.high, 0));
            let of = interval.of;
            out.line(&format!(
                "    {{ of = \"{of}\", low = {low}, high = {high} }},"
            ));
        }
        out.line("]");
    }
}

fn curve(it: &StrengthDuration) -> String {
    let points = it.upper.iter();
    let points =
        points.map(|(us, value)| format!("{{ width_us = {us}, value = {} }}", milli(*value)));
    let points: Vec<String> = points.collect();
    let upper = match points.is_empty() {
        true => String::new(),
        false => format!(", upper = [{}]", points.join(", ")),
    };
    let chronaxie_us = in_units(it.chronaxie_ns.into(), 3);
    let rheobase = milli(it.rheobase);
    format!("{{ rheobase = {rheobase}, chronaxie_us = {chronaxie_us}{upper} }}")
}

fn muscle(it: &Muscle) -> String {
    let force = &it.force;
    let [a, tau_c, tau1, tau2] = [
        force.a_mn_per_s,
        force.tau_c_us,
        force.tau1_us,
        force.tau2_us,
    ]
    .map(|value| in_units(value.into(), 3));
    let [k, slope] = [force.k_micro, it.slope_micro].map(|value| in_units(value.into(), 6));
    let reference = milli(it.reference);
    let fatigue = it.fatigue.map(fatigue).unwrap_or_default();
    format!(
        "{{ a_n_per_s = {a}, k = {k}, tau_c_ms = {tau_c}, tau1_ms = {tau1}, tau2_ms = {tau2}, \
         reference = {reference}, slope_per_unit = {slope}{fatigue} }}"
    )
}

fn fatigue(it: FatigueSpec) -> String {
    let nano = |value: u32| in_units(value.into(), 9);
    let milli = |value: u32| in_units(value.into(), 3);
    format!(
        ", fatigue = {{ alpha_a_per_s2 = {}, alpha_k_per_n_s = {}, alpha_tau1_per_n = {}, \
         tau_fat_s = {} }}",
        milli(it.alpha_a_milli_per_s2),
        nano(it.alpha_k_nano_per_n_s),
        nano(it.alpha_tau1_nano_per_n),
        milli(it.tau_fat_ms)
    )
}

fn write_forearm(out: &mut Lines, it: &Forearm) {
    out.field("reach_m", written(it.reach_m, 0));
    out.field("around_m", written(it.around_m, 0));
    let volts = |all: [f64; 3]| {
        let mv = all.map(|v| in_units((v * 1e3).round() as i64, 3)); // 2–40 V
        format!("[{}]", mv.join(", "))
    };
    out.given("thresholds_v", it.thresholds_v.map(volts));
    let pairs = |all: [[f64; 2]; 3]| {
        let pairs =
            all.map(|[along, around]| format!("[{}, {}]", written(along, 0), written(around, 0)));
        format!("[{}]", pairs.join(", "))
    };
    out.given("pads_mm", it.pads_mm.map(pairs));
}

fn write_elbow(out: &mut Lines, it: &Elbow) {
    out.field("triceps", it.triceps);
    out.field("biceps", it.biceps);
    out.given("triceps_nm", it.triceps_nm.map(|nm| written(nm, 0)));
    out.given("biceps_nm", it.biceps_nm.map(|nm| written(nm, 0)));
}

fn write_limb(out: &mut Lines, it: &Limb) {
    out.head("[limb]");
    for (name, um) in WAYS.into_iter().zip(it.ways_um) {
        out.field(name, numbers(&um));
    }
    for (name, (low, high)) in RANGES.into_iter().zip(it.ranges_mdeg) {
        out.field(name, numbers(&[low, high]));
    }
    for line in &it.lines {
        out.head("[[limb.line]]");
        out.field("channel", line.channel);
        out.text("joint", word(&JOINT_WORDS, line.joint));
        out.line("points = [");
        for via in &line.vias {
            let (segment, at) = (word(&SEGMENTS, via.segment), numbers(&via.at_um));
            out.line(&format!("    {{ segment = \"{segment}\", at_mm = {at} }},"));
        }
        out.line("]");
        out.field("gain_n_per_unit", in_units(line.gain_mn_per_unit.into(), 3));
    }
}

/// Formats a list of thousandths as a TOML array.
fn numbers(milli: &[i32]) -> String {
    let each: Vec<String> = milli
        .iter()
        .map(|milli| in_units((*milli).into(), 3))
        .collect();
    format!("[{}]", each.join(", "))
}

fn word<T: Copy + PartialEq>(words: &[(&'static str, T)], it: T) -> &'static str {
    let found = words.iter().find(|(_, known)| *known == it);
    found.map_or("", |(word, _)| word) // all are there
}
