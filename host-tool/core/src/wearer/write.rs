//! Writes a wearer file that the reader turns into the same wearer.

use super::limb::{JOINT_WORDS, RANGES, SEGMENTS, WAYS};
use super::unit::Unit;
use super::{
    DriftCheck, Elbow, Electrode, Forearm, History, Limb, Muscle, SCHEMA, StrengthDuration, Wearer,
};
use crate::fields::decimal::{format_scaled, format_toml_number};
use firmware::muscle::FatigueSpec;
use firmware::safety::WearerSpec;
use firmware::units::Amplitude;
use std::fmt::{Display, Write};

/// Returns the text of a complete wearer file.
pub(super) fn to_toml(wearer: &Wearer) -> String {
    let mut out = Lines::default();
    out.field("schema", SCHEMA);
    out.text("name", &wearer.name);
    out.text("evidence", wearer.evidence.word());
    out.text("source", &wearer.source);
    out.optional_text("note", wearer.note.as_deref());
    limits(&mut out, &wearer.limits);
    for electrode in &wearer.electrodes {
        out.head("[[electrode]]");
        write_electrode(&mut out, electrode);
    }
    if let Some(forearm) = &wearer.forearm {
        out.head("[forearm]");
        write_forearm(&mut out, forearm);
    }
    if let Some(elbow) = &wearer.elbow {
        out.head("[elbow]");
        write_elbow(&mut out, elbow);
    }
    if let Some(limb) = &wearer.limb {
        write_limb(&mut out, limb);
    }
    out.0 + &entries_to_toml(&wearer.history, &wearer.checks)
}

/// Returns the TOML text of these entries, which can be appended to a wearer file.
pub(super) fn entries_to_toml(history: &[History], checks: &[DriftCheck]) -> String {
    let mut out = Lines::default();
    for entry in history {
        out.head("[[history]]");
        out.text("at", &entry.at);
        out.text("by", &entry.by);
        out.text("what", &entry.what);
        out.optional_text("device", entry.device.as_deref());
        out.optional_text("firmware", entry.firmware.as_deref());
        out.optional_field("seed", entry.seed);
    }
    for check in checks {
        out.head("[[check]]");
        out.text("at", &check.at);
        out.field("channel", check.channel);
        out.field("expected", milli(check.expected));
        out.optional_field("found", check.found.map(milli));
        out.text("unit", check.unit.symbol());
        out.field("accepted", check.accepted);
        out.optional_text("by", check.by.as_deref());
        out.optional_text("device", check.device.as_deref());
        out.optional_field("seed", check.seed);
    }
    out.0
}

/// Text of a TOML file, to which lines are added at the end.
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

    fn optional_field(&mut self, name: &str, value: Option<impl Display>) {
        if let Some(value) = value {
            self.field(name, value);
        }
    }

    fn text(&mut self, name: &str, text: &str) {
        self.field(name, quoted(text));
    }

    fn optional_text(&mut self, name: &str, text: Option<&str>) {
        self.optional_field(name, text.map(quoted));
    }
}

/// Returns a text in quotation marks, with escapes, as TOML writes it.
fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// Formats an amplitude in thousandths as a number in whole units, for example "28.1".
fn milli(value: Amplitude) -> String {
    format_scaled(value.get().into(), 3)
}

/// Writes `[limits]` with the limits that differ from the device's own. The limits on host silence
/// and fall are always written.
fn limits(out: &mut Lines, wearer_spec: &WearerSpec) {
    let own = WearerSpec::default();
    out.head("[limits]");
    let numbers: [(&str, u32, u32, i32, bool); 14] = [
        (
            "max_current_ma",
            wearer_spec.max_current_ua,
            own.max_current_ua,
            3,
            false,
        ),
        (
            "max_charge_uc",
            wearer_spec.max_charge_nc,
            own.max_charge_nc,
            3,
            false,
        ),
        (
            "max_rms_ma",
            wearer_spec.max_rms_ua,
            own.max_rms_ua,
            3,
            false,
        ),
        (
            "rise_ms",
            wearer_spec.rise_ms.into(),
            own.rise_ms.into(),
            0,
            false,
        ),
        (
            "fall_ms",
            wearer_spec.fall_ms.into(),
            own.fall_ms.into(),
            0,
            true,
        ),
        (
            "host_timeout_ms",
            wearer_spec.host_timeout_ms.into(),
            own.host_timeout_ms.into(),
            0,
            true,
        ),
        (
            "max_sum_ma",
            wearer_spec.max_sum_ua,
            own.max_sum_ua,
            3,
            false,
        ),
        (
            "max_sum_rms_ma",
            wearer_spec.max_sum_rms_ua,
            own.max_sum_rms_ua,
            3,
            false,
        ),
        (
            "return_area_mm2",
            wearer_spec.return_area_mm2,
            own.return_area_mm2,
            0,
            false,
        ),
        (
            "rise_bursts",
            wearer_spec.rise_bursts.into(),
            own.rise_bursts.into(),
            0,
            false,
        ),
        (
            "max_session_s",
            wearer_spec.max_session_s,
            own.max_session_s,
            0,
            false,
        ),
        (
            "max_dose_mc",
            wearer_spec.max_dose_mc,
            own.max_dose_mc,
            0,
            false,
        ),
        (
            "max_step_ma",
            wearer_spec.max_step_ua,
            own.max_step_ua,
            3,
            false,
        ),
        (
            "max_step_ma_per_s",
            wearer_spec.max_step_ua_per_s,
            own.max_step_ua_per_s,
            3,
            false,
        ),
    ];
    for (name, value, default, places, always) in numbers {
        if always || value != default {
            out.field(name, format_scaled(value.into(), places));
        }
    }
    if wearer_spec.hand_stop_required {
        out.field("hand_stop_required", true);
    }
}

fn write_electrode(out: &mut Lines, electrode: &Electrode) {
    out.field("channel", electrode.channel);
    out.text("place", &electrode.place);
    match electrode.unit {
        Unit::Milliampere => out.text("stage", "current"),
        Unit::Volt => {
            out.text("stage", "voltage");
            out.field("load_ohm", electrode.load_ohm);
        }
    }
    out.field("area_mm2", electrode.area_mm2);
    out.field("width_us", electrode.width_us);
    out.field(
        "frequency_hz",
        format_toml_number(electrode.frequency_hz, 0),
    );
    let [from, to] = electrode.holds_hz;
    if electrode.holds_hz != [electrode.frequency_hz; 2] {
        out.field("from_hz", format_toml_number(from, 0));
        out.field("to_hz", format_toml_number(to, 0));
    }
    out.field("motor_threshold", milli(electrode.motor_threshold));
    out.field("limit", milli(electrode.limit));
    out.optional_field(
        "start",
        Some(electrode.start)
            .filter(|amplitude| amplitude.get() > 0)
            .map(milli),
    );
    out.optional_field("minimum", electrode.minimum.map(milli));
    out.optional_field("maximum", electrode.maximum.map(milli));
    out.optional_field("joint_threshold", electrode.joint_threshold.map(milli));
    if !electrode.moves.is_empty() {
        let moves: Vec<String> = electrode.moves.iter().map(|text| quoted(text)).collect();
        out.field("moves", format!("[{}]", moves.join(", ")));
    }
    out.optional_field(
        "strength_duration",
        electrode.strength_duration.as_ref().map(curve),
    );
    out.optional_field("muscle", electrode.muscle.as_ref().map(muscle));
    if !electrode.intervals.is_empty() {
        out.line("intervals = [");
        for interval in &electrode.intervals {
            let (low, high) = (
                format_toml_number(interval.low, 0),
                format_toml_number(interval.high, 0),
            );
            let quantity = interval.of;
            out.line(&format!(
                "    {{ of = \"{quantity}\", low = {low}, high = {high} }},"
            ));
        }
        out.line("]");
    }
}

fn curve(strength_duration: &StrengthDuration) -> String {
    let points = strength_duration.upper.iter();
    let points =
        points.map(|(us, value)| format!("{{ width_us = {us}, value = {} }}", milli(*value)));
    let points: Vec<String> = points.collect();
    let upper = match points.is_empty() {
        true => String::new(),
        false => format!(", upper = [{}]", points.join(", ")),
    };
    let chronaxie_us = format_scaled(strength_duration.chronaxie_ns.into(), 3);
    let rheobase = milli(strength_duration.rheobase);
    format!("{{ rheobase = {rheobase}, chronaxie_us = {chronaxie_us}{upper} }}")
}

fn muscle(item: &Muscle) -> String {
    let force = &item.force;
    let [a, tau_c, tau1, tau2] = [
        force.a_mn_per_s,
        force.tau_c_us,
        force.tau1_us,
        force.tau2_us,
    ]
    .map(|value| format_scaled(value.into(), 3));
    let [k, slope] = [force.k_micro, item.slope_micro].map(|value| format_scaled(value.into(), 6));
    let reference = milli(item.reference);
    let fatigue = item.fatigue.map(fatigue).unwrap_or_default();
    format!(
        "{{ a_n_per_s = {a}, k = {k}, tau_c_ms = {tau_c}, tau1_ms = {tau1}, tau2_ms = {tau2}, \
         reference = {reference}, slope_per_unit = {slope}{fatigue} }}"
    )
}

fn fatigue(fatigue_spec: FatigueSpec) -> String {
    let nano = |value: u32| format_scaled(value.into(), 9);
    let milli = |value: u32| format_scaled(value.into(), 3);
    format!(
        ", fatigue = {{ alpha_a_per_s2 = {}, alpha_k_per_n_s = {}, alpha_tau1_per_n = {}, \
         tau_fat_s = {} }}",
        milli(fatigue_spec.alpha_a_milli_per_s2),
        nano(fatigue_spec.alpha_k_nano_per_n_s),
        nano(fatigue_spec.alpha_tau1_nano_per_n),
        milli(fatigue_spec.tau_fat_ms)
    )
}

fn write_forearm(out: &mut Lines, forearm: &Forearm) {
    out.field("reach_m", format_toml_number(forearm.reach_m, 0));
    out.field("around_m", format_toml_number(forearm.around_m, 0));
    let volts = |thresholds: [f64; 3]| {
        let mv = thresholds.map(|v| format_scaled((v * 1e3).round() as i64, 3)); // 2–40 V
        format!("[{}]", mv.join(", "))
    };
    out.optional_field("thresholds_v", forearm.thresholds_v.map(volts));
    let pairs = |pads: [[f64; 2]; 3]| {
        let pairs = pads.map(|[along, around]| {
            format!(
                "[{}, {}]",
                format_toml_number(along, 0),
                format_toml_number(around, 0)
            )
        });
        format!("[{}]", pairs.join(", "))
    };
    out.optional_field("pads_mm", forearm.pads_mm.map(pairs));
}

fn write_elbow(out: &mut Lines, elbow: &Elbow) {
    out.field("triceps", elbow.triceps);
    out.field("biceps", elbow.biceps);
    out.optional_field(
        "triceps_nm",
        elbow.triceps_nm.map(|nm| format_toml_number(nm, 0)),
    );
    out.optional_field(
        "biceps_nm",
        elbow.biceps_nm.map(|nm| format_toml_number(nm, 0)),
    );
}

fn write_limb(out: &mut Lines, limb: &Limb) {
    out.head("[limb]");
    for (name, um) in WAYS.into_iter().zip(limb.offsets_um) {
        out.field(name, numbers(&um));
    }
    for (name, (low, high)) in RANGES.into_iter().zip(limb.ranges_mdeg) {
        out.field(name, numbers(&[low, high]));
    }
    for line in &limb.lines {
        out.head("[[limb.line]]");
        out.field("channel", line.channel);
        out.text("joint", word(&JOINT_WORDS, line.joint));
        out.line("points = [");
        for via in &line.vias {
            let (segment, at) = (word(&SEGMENTS, via.segment), numbers(&via.at_um));
            out.line(&format!("    {{ segment = \"{segment}\", at_mm = {at} }},"));
        }
        out.line("]");
        out.field(
            "gain_n_per_unit",
            format_scaled(line.gain_mn_per_unit.into(), 3),
        );
    }
}

/// Formats numbers in thousandths as a TOML array of whole units.
fn numbers(milli: &[i32]) -> String {
    let texts: Vec<String> = milli
        .iter()
        .map(|milli| format_scaled((*milli).into(), 3))
        .collect();
    format!("[{}]", texts.join(", "))
}

fn word<T: Copy + PartialEq>(words: &[(&'static str, T)], value: T) -> &'static str {
    let found = words.iter().find(|(_, known)| *known == value);
    found.map_or("", |(word, _)| word) // all are there
}
