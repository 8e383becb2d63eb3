//! The fields of a wearer file, each declared once, as those of a session are.

use std::sync::LazyLock;

use firmware::muscle::{CalciumForceSpec, RecruitmentSpec};
use firmware::pulse::{CHANNELS, TrainSpec};
use firmware::safety::{ChannelSpec, StageSpec};
use serde_json::Value;

use super::Evidence;
use super::limits::limits;
use super::tiring::fatigue;
use crate::fields::field::Need::{Optional, Or, OrTold, Required};
use crate::fields::field::{
    Field, Kind, Number, Section, UNIT, bounded_number, channel_number, field, list, number_in,
    one_of,
};
use crate::fields::field::{LONGEST, LONGEST_NOTES};
use crate::fields::{fields_as_markdown, json_schema};

/// Section of all top-level fields of a wearer file.
pub(super) static FILE: LazyLock<Section> = LazyLock::new(file);

/// Sources of a wearer's numbers, and their words in files.
pub(super) const EVIDENCE: [(&str, Evidence); 4] = [
    ("printed", Evidence::Printed),
    ("simulated", Evidence::Simulated),
    ("measured", Evidence::Measured),
    ("assumed", Evidence::Assumed),
];

/// Numbers of an electrode that may have an interval.
pub const INTERVALS_OF: [&str; 10] = [
    "motor_threshold",
    "limit",
    "rheobase",
    "chronaxie_us",
    "a_n_per_s",
    "k",
    "tau_c_ms",
    "tau1_ms",
    "tau2_ms",
    "slope_per_unit",
];

/// Returns the JSON schema of a wearer file, draft 7.
#[must_use]
pub fn schema() -> Value {
    json_schema("Flexor wearer", &FILE)
}

/// Returns the fields of a table of a wearer file as a Markdown table; see
/// [`crate::session::manual`].
#[must_use]
pub fn manual(path: &str) -> Option<String> {
    fields_as_markdown(&FILE, path)
}

/// Returns the kind of a pulse rate.
fn rate() -> Kind {
    Kind::Real(Number::rate_from_period("", TrainSpec::PERIOD_US))
}

/// Returns the kind of an amplitude in the electrode's unit.
fn amplitude(bound: &'static str) -> Kind {
    bounded_number(UNIT, 3, ChannelSpec::LIMIT, bound)
}

/// Kind of a short text, of 1 to [`LONGEST`] characters.
const TEXT: Kind = Kind::Text(Some(LONGEST));

#[rustfmt::skip]
fn file() -> Section {
    vec![
        field("schema", Kind::Whole(Number::within("", 0, 1, 1)), Required, "of this format; another one is refused by name (E651)"),
        field("name", Kind::Text(Some(64)), Required, "pseudonym: letters, digits and hyphens; never a name"),
        field("evidence", one_of(&EVIDENCE), Required, "where the numbers are from: a paper, a simulated body, a person on a board, or nobody found them"),
        field("source", TEXT, Required, "the paper and table, the procedure, or what is assumed"),
        field("note", Kind::Text(Some(LONGEST_NOTES)), Optional, "anything worth knowing"),
        field("limits", Kind::Table(limits()), Optional, "what the device may do to them: fields and ranges of a session's `[wearer]`, the device's own without it"),
        field("electrode", list(electrode(), 0, Some(CHANNELS), "electrodes"), Optional, "electrodes"),
        field("forearm", Kind::Table(forearm()), Optional, "for simulated forearms of this size"),
        field("elbow", Kind::Table(elbow()), Optional, "which electrodes are the elbow's"),
        field("limb", Kind::Table(super::limb::fields()), Optional, "the right arm, for a wanted force at the hand ([endpoint_session.md](endpoint_session.md)); origin of the thorax wherever convenient"),
        field("history", list(history(), 0, None, "entries"), Optional, "what was done to this file, oldest first; only ever appended"),
        field("check", list(check(), 0, None, "checks"), Optional, "drift checks, oldest first; only ever appended"),
    ]
}

#[rustfmt::skip]
fn electrode() -> Section {
    let upper = vec![
        field("width_us", number_in("µs", 0, TrainSpec::WIDTH_US), Required, "pulse width, rising"),
        field("value", amplitude("from the threshold there"), Required, "largest accepted there"),
    ];
    let strength_duration = vec![
        field("rheobase", amplitude("to `motor_threshold`"), Required, "threshold of an endless pulse"),
        field("chronaxie_us", Kind::Whole(Number::within("µs", 3, 1_000, 5_000_000)), Required, "width at which the threshold is twice that"),
        field("upper", list(upper, 0, None, "points"), Optional, "largest amplitude accepted at other widths, straight between them"),
    ];
    let intervals = vec![
        field("of", Kind::Choice(INTERVALS_OF.into()), Required, "which number of this electrode"),
        field("low", Kind::Real(Number::any("", 0, "in that number's unit")), Required, "lower end"),
        field("high", Kind::Real(Number::any("", 0, "from `low`")), Required, "upper end"),
    ];
    vec![
        field("channel", channel_number(), Required, "its channel on the board"),
        field("place", TEXT, Required, "where it is, in words"),
        field("stage", Kind::Choice(vec!["current", "voltage"]), Required, "what its stage controls: the unit is mA, or V"),
        field("load_ohm", number_in("Ω", 0, StageSpec::LOAD_OHM), Or(2_000), "load through which its volts are judged against current limits").when("stage", &["voltage"]),
        field("area_mm2", number_in("mm²", 0, ChannelSpec::AREA_MM2), Or(ChannelSpec::ASSUMED_AREA_MM2.into()), "its area; a disc of 32 mm is assumed"),
        field("width_us", number_in("µs", 0, TrainSpec::WIDTH_US), Required, "pulse width at which its amplitudes hold"),
        field("frequency_hz", rate(), Required, "pulse rate at which they were found"),
        field("from_hz", rate(), OrTold("`frequency_hz`".into()), "least rate at which they are taken to hold"),
        field("to_hz", rate(), OrTold("`frequency_hz`".into()), "greatest rate at which they are taken to hold"),
        field("motor_threshold", amplitude("below `limit`"), Required, "smallest amplitude that moves: I_MT"),
        field("limit", amplitude("within `[limits]`"), Required, "largest that the wearer accepts: I_PT"),
        field("start", amplitude("to `limit`"), OrTold("0".into()), "largest that the wearer accepts at once, without a rise (`rise_ms`)"),
        field("minimum", amplitude("to `maximum`"), Optional, "least that is used, as an operator set it"),
        field("maximum", amplitude("to `limit`"), Optional, "most that is used, as an operator set it"),
        field("moves", Kind::Texts(LONGEST), Optional, "what it moves, in words"),
        field("strength_duration", Kind::Table(strength_duration), Optional, "thresholds at other pulse widths: rheobase · (1 + chronaxie / width)"),
        field("muscle", Kind::Table(muscle()), Optional, "the muscle under it; `motor_threshold` and `limit` are the electrode's"),
        field("intervals", list(intervals, 0, None, "intervals"), Optional, "95 % intervals"),
    ]
}

#[rustfmt::skip]
fn muscle() -> Section {
    type M = CalciumForceSpec;
    type R = RecruitmentSpec;
    vec![
        field("a_n_per_s", number_in("N/s", 3, M::A_MN_PER_S), Required, "A"),
        field("k", number_in("", 6, M::K_MICRO), Required, "K"),
        field("tau_c_ms", bounded_number("ms", 3, M::TAU_C_US, "as in a session"), Required, "τc"),
        field("tau1_ms", number_in("ms", 3, M::TAU1_US), Required, "τ1"),
        field("tau2_ms", number_in("ms", 3, M::TAU2_US), Required, "τ2"),
        field("reference", bounded_number(UNIT, 3, R::REFERENCE, "from `limit`"), Required, "amplitude at which A was measured"),
        field("slope_per_unit", bounded_number("per unit", 6, R::SLOPE_MICRO, "at most 16 octaves from threshold to reference"), Required, "b"),
        field("fatigue", Kind::Table(fatigue()), Optional, "how it tires: as in a session"),
    ]
}

#[rustfmt::skip]
fn forearm() -> Section {
    vec![
        field("reach_m", Kind::Real(Number::within("m", 3, 300, 600)), Required, "elbow to tip of the hand"),
        field("around_m", Kind::Real(Number::within("m", 3, 150, 450)), Required, "around the forearm"),
        field("thresholds_v", Kind::Wholes(Number::within("V", 3, 2_000, 40_000), "a list of three numbers"), OrTold("`motor_threshold` of channels 1 to 3".into()), "thresholds of A, B and the extensor's point"),
        field("pads_mm", Kind::Pairs(Number::within("mm", 0, -300, 600), 3, "a list of three pairs of numbers"), Optional, "where the middles of their electrodes lie: along from the elbow, around from the palmar midline, positive to the thumb; searched without it"),
    ]
}

#[rustfmt::skip]
fn elbow() -> Section {
    let strength = || Kind::Real(Number::within("N·m", 0, 0, 100));
    vec![
        field("triceps", channel_number(), Required, "an electrode of the file"),
        field("biceps", channel_number(), Required, "another one"),
        field("triceps_nm", strength(), Optional, "torque of all of the triceps at 50 Hz"),
        field("biceps_nm", strength(), Optional, "torque of all of the biceps at 50 Hz"),
    ]
}

/// Returns the field for the time of an entry.
fn time_field() -> Field {
    field(
        "at",
        TEXT,
        Required,
        "when: RFC 3339, or the device's time of a simulated one",
    )
}

#[rustfmt::skip]
fn history() -> Section {
    vec![
        time_field(),
        field("by", TEXT, Required, "who did it: a pseudonym, or a program"),
        field("what", TEXT, Required, "what was done"),
        field("device", TEXT, Optional, "on which device"),
        field("firmware", TEXT, Optional, "its firmware's version"),
        field("seed", Kind::Whole(Number::within("", 0, 0, i64::MAX)), Optional, "of a simulated one"),
    ]
}

#[rustfmt::skip]
fn check() -> Section {
    vec![
        time_field(),
        field("channel", channel_number(), Required, "an electrode of the file"),
        field("expected", amplitude(""), Required, "the threshold that the file had"),
        field("found", amplitude(""), Optional, "the threshold found; left out where nothing moved"),
        field("unit", Kind::Choice(vec!["mA", "V"]), Required, "of both"),
        field("accepted", Kind::Flag, Required, "whether that was near enough"),
        field("by", TEXT, Optional, "who looked: a pseudonym, or a program"),
        field("device", TEXT, Optional, "on which device"),
        field("seed", Kind::Whole(Number::within("", 0, 0, i64::MAX)), Optional, "of a simulated one"),
    ]
}
