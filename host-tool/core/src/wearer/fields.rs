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

/// Section that declares all fields of a wearer file, with the sections of its tables nested
/// inside.
pub(super) static FILE: LazyLock<Section> = LazyLock::new(file);

/// Sources of a wearer's numbers, and the words for them in wearer files.
pub(super) const EVIDENCE: [(&str, Evidence); 4] = [
    ("printed", Evidence::Printed),
    ("simulated", Evidence::Simulated),
    ("measured", Evidence::Measured),
    ("assumed", Evidence::Assumed),
];

/// Names of the numbers of an electrode for which a file may give an interval of 95 % confidence.
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

/// Returns the JSON schema (draft 7) of a wearer file, for editors of TOML.
#[must_use]
pub fn schema() -> Value {
    json_schema("Flexor wearer", &FILE)
}

/// Returns the fields of the table at `path` of a wearer file as a Markdown table. The syntax of
/// `path` is that of [`crate::session::manual`].
#[must_use]
pub fn manual(path: &str) -> Option<String> {
    fields_as_markdown(&FILE, path)
}

/// Returns the kind of a field that holds a pulse rate, Hz.
fn rate() -> Kind {
    Kind::Real(Number::rate_from_period("", TrainSpec::PERIOD_US))
}

/// Returns the kind of a field that holds an amplitude in the electrode's unit. `bound` describes
/// how other fields restrict it.
fn amplitude(bound: &'static str) -> Kind {
    bounded_number(UNIT, 3, ChannelSpec::LIMIT, bound)
}

/// Kind of a short text, of 1 to [`LONGEST`] characters.
const TEXT: Kind = Kind::Text(Some(LONGEST));

#[rustfmt::skip]
fn file() -> Section {
    vec![
        field("schema", Kind::Whole(Number::within("", 0, 1, 1)), Required, "version of this format; any other is refused (E651)"),
        field("name", Kind::Text(Some(64)), Required, "pseudonym: letters, digits and hyphens; never a name"),
        field("evidence", one_of(&EVIDENCE), Required, "source of the numbers: printed in a paper, simulated, measured on a person with a board, or assumed"),
        field("source", TEXT, Required, "the paper and table, the procedure, or the assumption"),
        field("note", Kind::Text(Some(LONGEST_NOTES)), Optional, "further remarks"),
        field("limits", Kind::Table(limits()), Optional, "limits of the stimulation: fields and ranges of a session's `[wearer]`; without it, the device's own"),
        field("electrode", list(electrode(), 0, Some(CHANNELS), "electrodes of the wearer"), Optional, "electrodes of the wearer"),
        field("forearm", Kind::Table(forearm()), Optional, "dimensions of the forearm, for simulated forearms"),
        field("elbow", Kind::Table(elbow()), Optional, "electrodes that move the elbow"),
        field("limb", Kind::Table(super::limb::fields()), Optional, "model of the right arm, for a force at the hand ([endpoint_session.md](../guides/endpoint_session.md)); the origin of the thorax is arbitrary"),
        field("history", list(history(), 0, None, "entries"), Optional, "changes of this file, oldest first; entries are only appended"),
        field("check", list(check(), 0, None, "checks"), Optional, "drift checks, oldest first; entries are only appended"),
    ]
}

#[rustfmt::skip]
fn electrode() -> Section {
    let upper = vec![
        field("width_us", number_in("µs", 0, TrainSpec::WIDTH_US), Required, "pulse width; widths must rise"),
        field("value", amplitude("above the threshold at this width"), Required, "largest amplitude that the wearer accepts at this width"),
    ];
    let strength_duration = vec![
        field("rheobase", amplitude("at most `motor_threshold`"), Required, "threshold of an endless pulse"),
        field("chronaxie_us", Kind::Whole(Number::within("µs", 3, 1_000, 5_000_000)), Required, "pulse width at which the threshold is twice the rheobase"),
        field("upper", list(upper, 0, None, "points"), Optional, "largest accepted amplitudes at other widths, linear between the points"),
    ];
    let intervals = vec![
        field("of", Kind::Choice(INTERVALS_OF.into()), Required, "name of the number of this electrode"),
        field("low", Kind::Real(Number::any("", 0, "in that number's unit")), Required, "lower end of the interval"),
        field("high", Kind::Real(Number::any("", 0, "at least `low`")), Required, "upper end of the interval"),
    ];
    vec![
        field("channel", channel_number(), Required, "channel of the electrode on the board"),
        field("place", TEXT, Required, "position of the electrode, in words"),
        field("stage", Kind::Choice(vec!["current", "voltage"]), Required, "quantity that its stage controls, which makes the unit mA or V"),
        field("load_ohm", number_in("Ω", 0, StageSpec::LOAD_OHM), Or(2_000), "load for which its voltages are converted to currents and checked against the current limits").when("stage", &["voltage"]),
        field("area_mm2", number_in("mm²", 0, ChannelSpec::AREA_MM2), Or(ChannelSpec::ASSUMED_AREA_MM2.into()), "area of the electrode; the default is a disc of 32 mm"),
        field("width_us", number_in("µs", 0, TrainSpec::WIDTH_US), Required, "pulse width for which its amplitudes hold"),
        field("frequency_hz", rate(), Required, "pulse rate at which the amplitudes were found"),
        field("from_hz", rate(), OrTold("`frequency_hz`".into()), "lowest rate for which the amplitudes are assumed to hold"),
        field("to_hz", rate(), OrTold("`frequency_hz`".into()), "highest rate for which the amplitudes are assumed to hold"),
        field("motor_threshold", amplitude("below `limit`"), Required, "smallest amplitude that causes a movement, I_MT"),
        field("limit", amplitude("within `[limits]`"), Required, "largest amplitude that the wearer accepts, I_PT"),
        field("start", amplitude("at most `limit`"), OrTold("0".into()), "largest amplitude that the wearer accepts at once, without a rise (`rise_ms`)"),
        field("minimum", amplitude("at most `maximum`"), Optional, "smallest amplitude to be used, as an operator set it"),
        field("maximum", amplitude("at most `limit`"), Optional, "largest amplitude to be used, as an operator set it"),
        field("joint_threshold", amplitude("at most `maximum`"), OrTold("`minimum`, else `motor_threshold`".into()), "amplitude at zero effort of a joint, at which the muscle does not yet move it"),
        field("moves", Kind::Texts(LONGEST), Optional, "movements that the electrode causes, in words"),
        field("strength_duration", Kind::Table(strength_duration), Optional, "thresholds at other pulse widths: rheobase · (1 + chronaxie / width)"),
        field("muscle", Kind::Table(muscle()), Optional, "muscle under the electrode; it has the electrode's `motor_threshold` and `limit`"),
        field("intervals", list(intervals, 0, None, "intervals"), Optional, "95 % intervals of numbers of this electrode"),
    ]
}

#[rustfmt::skip]
fn muscle() -> Section {
    type M = CalciumForceSpec;
    type R = RecruitmentSpec;
    vec![
        field("a_n_per_s", number_in("N/s", 3, M::A_MN_PER_S), Required, "A, the scale of the force"),
        field("k", number_in("", 6, M::K_MICRO), Required, "K, the sensitivity of the cross-bridges to calcium"),
        field("tau_c_ms", bounded_number("ms", 3, M::TAU_C_US, "as in a session"), Required, "τc, the time constant of calcium"),
        field("tau1_ms", number_in("ms", 3, M::TAU1_US), Required, "τ1, the time constant of the force decay without cross-bridges"),
        field("tau2_ms", number_in("ms", 3, M::TAU2_US), Required, "τ2, the additional time constant due to cross-bridges"),
        field("reference", bounded_number(UNIT, 3, R::REFERENCE, "at least `limit`"), Required, "amplitude at which A was measured"),
        field("slope_per_unit", bounded_number("per unit", 6, R::SLOPE_MICRO, "at most 16 octaves from threshold to reference"), Required, "b, the slope of the recruitment"),
        field("fatigue", Kind::Table(fatigue()), Optional, "fatigue of the muscle, as in a session"),
    ]
}

#[rustfmt::skip]
fn forearm() -> Section {
    vec![
        field("reach_m", Kind::Real(Number::within("m", 3, 300, 600)), Required, "length from the elbow to the tip of the hand"),
        field("around_m", Kind::Real(Number::within("m", 3, 150, 450)), Required, "circumference of the forearm"),
        field("thresholds_v", Kind::Wholes(Number::within("V", 3, 2_000, 40_000), "a list of three numbers"), OrTold("`motor_threshold` of channels 1 to 3".into()), "thresholds of the points A, B and extensor"),
        field("pads_mm", Kind::Pairs(Number::within("mm", 0, -300, 600), 3, "a list of three pairs of numbers"), Optional, "centres of the electrodes of A, B and the extensor: distance along the forearm from the elbow, and around it from the palmar midline, positive towards the thumb; without it they are searched"),
    ]
}

#[rustfmt::skip]
fn elbow() -> Section {
    let strength = || Kind::Real(Number::within("N·m", 0, 0, 100));
    vec![
        field("triceps", channel_number(), Required, "channel of the electrode on the triceps"),
        field("biceps", channel_number(), Required, "channel of the electrode on the biceps"),
        field("triceps_nm", strength(), Optional, "torque of the fully recruited triceps at 50 Hz"),
        field("biceps_nm", strength(), Optional, "torque of the fully recruited biceps at 50 Hz"),
    ]
}

/// Returns the field `at`, which holds the time of an entry of `history` or `check`.
fn time_field() -> Field {
    field(
        "at",
        TEXT,
        Required,
        "time: RFC 3339, or the time of a simulated device",
    )
}

#[rustfmt::skip]
fn history() -> Section {
    vec![
        time_field(),
        field("by", TEXT, Required, "person or program that made the change; a pseudonym for a person"),
        field("what", TEXT, Required, "description of the change"),
        field("device", TEXT, Optional, "device that was used"),
        field("firmware", TEXT, Optional, "firmware version of the device"),
        field("seed", Kind::Whole(Number::within("", 0, 0, i64::MAX)), Optional, "seed of a simulated device"),
    ]
}

#[rustfmt::skip]
fn check() -> Section {
    vec![
        time_field(),
        field("channel", channel_number(), Required, "an electrode of the file"),
        field("expected", amplitude(""), Required, "threshold in the file"),
        field("found", amplitude(""), Optional, "threshold that was found; left out if nothing moved"),
        field("unit", Kind::Choice(vec!["mA", "V"]), Required, "unit of both thresholds"),
        field("accepted", Kind::Flag, Required, "whether the two thresholds were close enough"),
        field("by", TEXT, Optional, "person or program that checked; a pseudonym for a person"),
        field("device", TEXT, Optional, "device that was used"),
        field("seed", Kind::Whole(Number::within("", 0, 0, i64::MAX)), Optional, "seed of a simulated device"),
    ]
}
