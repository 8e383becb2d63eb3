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
use crate::fields::field::{Field, Kind, Number, Section, UNIT, channel, f, list, n, nb, one_of};
use crate::fields::field::{LONGEST, LONGEST_NOTES};
use crate::fields::{manual_of, schema_of};

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
    schema_of("Flexor wearer", &FILE)
}

/// Returns the fields of a table of a wearer file as a Markdown table; see
/// [`crate::session::manual`].
#[must_use]
pub fn manual(path: &str) -> Option<String> {
    manual_of(&FILE, path)
}

/// Returns the kind of a pulse rate.
fn rate() -> Kind {
    Kind::Real(Number::rate_of("", TrainSpec::PERIOD_US))
}

/// Returns the kind of an amplitude in the electrode's unit.
fn amplitude(bound: &'static str) -> Kind {
    nb(UNIT, 3, ChannelSpec::LIMIT, bound)
}

/// Kind of a short text, of 1 to [`LONGEST`] characters.
const TEXT: Kind = Kind::Text(Some(LONGEST));

#[rustfmt::skip]
fn file() -> Section {
    vec![
        f("schema", Kind::Whole(Number::within("", 0, 1, 1)), Required, "of this format; another one is refused by name (E651)"),
        f("name", Kind::Text(Some(64)), Required, "pseudonym: letters, digits and hyphens; never a name"),
        f("evidence", one_of(&EVIDENCE), Required, "where the numbers are from: a paper, a simulated body, a person on a board, or nobody found them"),
        f("source", TEXT, Required, "the paper and table, the procedure, or what is assumed"),
        f("note", Kind::Text(Some(LONGEST_NOTES)), Optional, "anything worth knowing"),
        f("limits", Kind::Table(limits()), Optional, "what the device may do to them: fields and ranges of a session's `[wearer]`, the device's own without it"),
        f("electrode", list(electrode(), 0, Some(CHANNELS), "electrodes"), Optional, "electrodes"),
        f("forearm", Kind::Table(forearm()), Optional, "for simulated forearms of this size"),
        f("elbow", Kind::Table(elbow()), Optional, "which electrodes are the elbow's"),
        f("limb", Kind::Table(super::limb::fields()), Optional, "the right arm, for a wanted force at the hand ([endpoint_session.md](endpoint_session.md)); origin of the thorax wherever convenient"),
        f("history", list(history(), 0, None, "entries"), Optional, "what was done to this file, oldest first; only ever appended"),
        f("check", list(check(), 0, None, "checks"), Optional, "drift checks, oldest first; only ever appended"),
    ]
}

#[rustfmt::skip]
fn electrode() -> Section {
    let upper = vec![
        f("width_us", n("µs", 0, TrainSpec::WIDTH_US), Required, "pulse width, rising"),
        f("value", amplitude("from the threshold there"), Required, "largest accepted there"),
    ];
    let strength_duration = vec![
        f("rheobase", amplitude("to `motor_threshold`"), Required, "threshold of an endless pulse"),
        f("chronaxie_us", Kind::Whole(Number::within("µs", 3, 1_000, 5_000_000)), Required, "width at which the threshold is twice that"),
        f("upper", list(upper, 0, None, "points"), Optional, "largest amplitude accepted at other widths, straight between them"),
    ];
    let intervals = vec![
        f("of", Kind::Choice(INTERVALS_OF.into()), Required, "which number of this electrode"),
        f("low", Kind::Real(Number::any("", 0, "in that number's unit")), Required, "lower end"),
        f("high", Kind::Real(Number::any("", 0, "from `low`")), Required, "upper end"),
    ];
    vec![
        f("channel", channel(), Required, "its channel on the board"),
        f("place", TEXT, Required, "where it is, in words"),
        f("stage", Kind::Choice(vec!["current", "voltage"]), Required, "what its stage controls: the unit is mA, or V"),
        f("load_ohm", n("Ω", 0, StageSpec::LOAD_OHM), Or(2_000), "load through which its volts are judged against current limits").when("stage", &["voltage"]),
        f("area_mm2", n("mm²", 0, ChannelSpec::AREA_MM2), Or(ChannelSpec::ASSUMED_AREA_MM2.into()), "its area; a disc of 32 mm is assumed"),
        f("width_us", n("µs", 0, TrainSpec::WIDTH_US), Required, "pulse width at which its amplitudes hold"),
        f("frequency_hz", rate(), Required, "pulse rate at which they were found"),
        f("from_hz", rate(), OrTold("`frequency_hz`".into()), "least rate at which they are taken to hold"),
        f("to_hz", rate(), OrTold("`frequency_hz`".into()), "greatest rate at which they are taken to hold"),
        f("motor_threshold", amplitude("below `limit`"), Required, "smallest amplitude that moves: I_MT"),
        f("limit", amplitude("within `[limits]`"), Required, "largest that the wearer accepts: I_PT"),
        f("start", amplitude("to `limit`"), OrTold("0".into()), "largest that the wearer accepts at once, without a rise (`rise_ms`)"),
        f("minimum", amplitude("to `maximum`"), Optional, "least that is used, as an operator set it"),
        f("maximum", amplitude("to `limit`"), Optional, "most that is used, as an operator set it"),
        f("moves", Kind::Texts(LONGEST), Optional, "what it moves, in words"),
        f("strength_duration", Kind::Table(strength_duration), Optional, "thresholds at other pulse widths: rheobase · (1 + chronaxie / width)"),
        f("muscle", Kind::Table(muscle()), Optional, "the muscle under it; `motor_threshold` and `limit` are the electrode's"),
        f("intervals", list(intervals, 0, None, "intervals"), Optional, "95 % intervals"),
    ]
}

#[rustfmt::skip]
fn muscle() -> Section {
    type M = CalciumForceSpec;
    type R = RecruitmentSpec;
    vec![
        f("a_n_per_s", n("N/s", 3, M::A_MN_PER_S), Required, "A"),
        f("k", n("", 6, M::K_MICRO), Required, "K"),
        f("tau_c_ms", nb("ms", 3, M::TAU_C_US, "as in a session"), Required, "τc"),
        f("tau1_ms", n("ms", 3, M::TAU1_US), Required, "τ1"),
        f("tau2_ms", n("ms", 3, M::TAU2_US), Required, "τ2"),
        f("reference", nb(UNIT, 3, R::REFERENCE, "from `limit`"), Required, "amplitude at which A was measured"),
        f("slope_per_unit", nb("per unit", 6, R::SLOPE_MICRO, "at most 16 octaves from threshold to reference"), Required, "b"),
        f("fatigue", Kind::Table(fatigue()), Optional, "how it tires: as in a session"),
    ]
}

#[rustfmt::skip]
fn forearm() -> Section {
    vec![
        f("reach_m", Kind::Real(Number::within("m", 3, 300, 600)), Required, "elbow to tip of the hand"),
        f("around_m", Kind::Real(Number::within("m", 3, 150, 450)), Required, "around the forearm"),
        f("thresholds_v", Kind::Wholes(Number::within("V", 3, 2_000, 40_000), "a list of three numbers"), OrTold("`motor_threshold` of channels 1 to 3".into()), "thresholds of A, B and the extensor's point"),
        f("pads_mm", Kind::Pairs(Number::within("mm", 0, -300, 600), 3, "a list of three pairs of numbers"), Optional, "where the middles of their electrodes lie: along from the elbow, around from the palmar midline, positive to the thumb; searched without it"),
    ]
}

#[rustfmt::skip]
fn elbow() -> Section {
    let strength = || Kind::Real(Number::within("N·m", 0, 0, 100));
    vec![
        f("triceps", channel(), Required, "an electrode of the file"),
        f("biceps", channel(), Required, "another one"),
        f("triceps_nm", strength(), Optional, "torque of all of the triceps at 50 Hz"),
        f("biceps_nm", strength(), Optional, "torque of all of the biceps at 50 Hz"),
    ]
}

/// Returns the field for the time of an entry.
fn at() -> Field {
    f(
        "at",
        TEXT,
        Required,
        "when: RFC 3339, or the device's time of a simulated one",
    )
}

#[rustfmt::skip]
fn history() -> Section {
    vec![
        at(),
        f("by", TEXT, Required, "who did it: a pseudonym, or a program"),
        f("what", TEXT, Required, "what was done"),
        f("device", TEXT, Optional, "on which device"),
        f("firmware", TEXT, Optional, "its firmware's version"),
        f("seed", Kind::Whole(Number::within("", 0, 0, i64::MAX)), Optional, "of a simulated one"),
    ]
}

#[rustfmt::skip]
fn check() -> Section {
    vec![
        at(),
        f("channel", channel(), Required, "an electrode of the file"),
        f("expected", amplitude(""), Required, "the threshold that the file had"),
        f("found", amplitude(""), Optional, "the threshold found; left out where nothing moved"),
        f("unit", Kind::Choice(vec!["mA", "V"]), Required, "of both"),
        f("accepted", Kind::Flag, Required, "whether that was near enough"),
        f("by", TEXT, Optional, "who looked: a pseudonym, or a program"),
        f("device", TEXT, Optional, "on which device"),
        f("seed", Kind::Whole(Number::within("", 0, 0, i64::MAX)), Optional, "of a simulated one"),
    ]
}
