//! Reads a wearer file and reports all errors in it.

use std::path::Path;

use firmware::device::Draft;
use firmware::muscle::CalciumForceSpec;
use firmware::units::Amplitude;
use hal_sim::body::hand::HandSpec;
use hal_sim::body::hand::field::{Pad, Shape as PadShape};
use hal_sim::body::hand::spec::ROUND_M;
use toml::de::{DeTable, DeValue};

use super::fields::{EVIDENCE, FILE, INTERVALS_OF};
use super::judge::{check_limits, check_order};
use super::limits::read_limits;
use super::tiring::read_fatigue;
use super::unit::Unit;
use super::{
    DriftCheck, Elbow, Electrode, Evidence, Forearm, History, Interval, Muscle, SCHEMA,
    StrengthDuration, Wearer,
};
use crate::fields::error::{Place, Problem};
use crate::fields::table::Table;
use crate::fields::{SessionError, escape_control_chars, parse as parse_file, read_text};

/// Returns the text of the file at `path`, without checking it.
///
/// # Errors
/// E650 if the file cannot be read.
pub(super) fn text(path: &Path) -> Result<String, SessionError> {
    read_text(path)
        .map_err(|reason| SessionError::without_place(Problem::WearerUnreadable { reason }))
}

/// Returns whether a text is meant as a wearer file. Its top-level table then has a `schema` or an
/// `evidence`, which no session has.
#[must_use]
pub fn is_wearer_file(text: &str) -> bool {
    let (root, _) = DeTable::parse_recoverable(text);
    let root = root.get_ref();
    ["schema", "evidence"]
        .iter()
        .any(|text| root.contains_key(*text))
}

/// Returns the wearer that `text` describes. `name` is the file name in error messages.
///
/// # Errors
/// All errors of the text. For a wearer file of another schema, only E651. For any other kind of
/// file only E665, so that no content of an unrelated file is shown.
pub(super) fn parse(name: &str, text: &str) -> Result<Wearer, SessionError> {
    if !is_wearer_file(text) {
        let file = escape_control_chars(name);
        return Err(SessionError::without_place(Problem::NotAWearer { file }));
    }
    match other_schema(text) {
        Some(place) => {
            let problem = Problem::WearerSchema { known: SCHEMA };
            Err(SessionError::at(
                problem,
                &escape_control_chars(name),
                &text.into(),
                place,
            ))
        }
        None => parse_file(name, text, &FILE, |_, t| read(t)),
    }
}

/// Returns the place at which a file declares another schema than [`SCHEMA`]; `None` if it does
/// not.
fn other_schema(text: &str) -> Option<Place> {
    let (root, _) = DeTable::parse_recoverable(text);
    let found = root.get_ref().get("schema")?;
    let DeValue::Integer(number) = found.get_ref() else {
        return None; // told as a wrong type
    };
    let is_own = number.as_str() == SCHEMA.to_string();
    (!is_own).then(|| Place {
        field: "schema".into(),
        given: number.as_str().into(),
        span: found.span(),
    })
}

/// Reads the wearer and reports all errors in the table. After an error, the result is `None` or an
/// incomplete wearer, which must not be used.
fn read(t: &Table<'_>) -> Option<Wearer> {
    if let Some(name) = t.text("name")
        && !is_pseudonym(name)
    {
        t.report("name", Problem::WearerName {});
    }
    let limits = t.optional_table("limits", |l| Some(read_limits(l)));
    let limits = limits.map(Option::unwrap_or_default);
    let mut draft = Draft::default();
    if let (Some(limits), Some(l)) = (limits, t.table("limits"))
        && let Err(mistake) = draft.set_wearer(limits)
    {
        l.report_refusal(mistake);
    }
    let mut electrodes: Vec<Electrode> = Vec::new();
    let mut are_whole = true;
    for item in t.tables("electrode") {
        let channel = item.integer::<u8>("channel");
        if electrodes.iter().any(|known| known.channel == channel) {
            item.report("channel", Problem::ChannelTwice { channel });
        }
        match read_electrode(item, &mut draft) {
            Some(electrode) => electrodes.push(electrode),
            None => are_whole = false,
        }
    }
    electrodes.sort_by_key(|electrode| electrode.channel);
    let has = |channel| {
        !are_whole
            || electrodes
                .iter()
                .any(|electrode| electrode.channel == channel)
    };
    let find = |t: &Table<'_>, name: &str| {
        let channel = t.integer(name);
        if !has(channel) {
            t.report(name, Problem::NoSuchChannel { channel });
        }
        channel
    };
    let forearm = t.optional_table("forearm", read_forearm);
    let elbow = t.optional_table("elbow", |e| Some(read_elbow(e, find)));
    // The limb is read even if it has errors, because an error in one line must not hide those in
    // another.
    let limb = t.table("limb");
    let limb = limb.and_then(|l| super::limb::read(l, &electrodes, are_whole));
    let checks = t.tables("check").iter().filter(|item| item.is_valid());
    let checks = checks.map(|item| read_check(item, find)).collect();
    let history = t.tables("history").iter().filter(|item| item.is_valid());
    let history = history.map(read_history).collect();
    Some(Wearer {
        name: t.text("name")?.to_owned(),
        evidence: t.choice("evidence", &EVIDENCE).unwrap_or(Evidence::Assumed),
        source: t.text("source")?.to_owned(),
        note: t.text("note").map(str::to_owned),
        limits: limits?,
        electrodes,
        forearm: forearm?,
        elbow: elbow?,
        limb,
        history,
        checks,
    })
}

/// Returns whether a text consists of 1 to 64 letters, digits and hyphens.
pub(super) fn is_pseudonym(name: &str) -> bool {
    let is_plain = |c: char| c.is_alphanumeric() || c == '-';
    (1..=64).contains(&name.chars().count()) && name.chars().all(is_plain)
}

/// Returns the amplitude in the field `name`, or `None` if the field is left out.
fn optional_amplitude(t: &Table<'_>, name: &str) -> Option<Amplitude> {
    t.has(name).then(|| Amplitude::new(t.integer(name)))
}

/// Reads one `[[electrode]]`. Reports values that contradict each other or, through `draft`, the
/// wearer's limits.
fn read_electrode(t: &Table<'_>, draft: &mut Draft) -> Option<Electrode> {
    let strength_duration =
        t.optional_table("strength_duration", |s| Some(read_strength_duration(s)));
    let muscle = t.optional_table("muscle", |m| Some(read_muscle(m)));
    let intervals = t.tables("intervals").iter();
    let intervals: Option<Vec<Interval>> = intervals.map(read_interval).collect();
    if !t.is_valid() {
        return None;
    }
    let unit = match t.word("stage") {
        "voltage" => Unit::Volt,
        _ => Unit::Milliampere,
    };
    let frequency_hz = t.real("frequency_hz")?;
    let holds = |name| t.real(name).unwrap_or(frequency_hz);
    let electrode = Electrode {
        channel: t.integer("channel"),
        place: t.text("place")?.to_owned(),
        area_mm2: t.integer("area_mm2"),
        unit,
        load_ohm: t.integer("load_ohm"),
        width_us: t.integer("width_us"),
        frequency_hz,
        holds_hz: [holds("from_hz"), holds("to_hz")],
        motor_threshold: Amplitude::new(t.integer("motor_threshold")),
        limit: Amplitude::new(t.integer("limit")),
        start: optional_amplitude(t, "start").unwrap_or_default(),
        minimum: optional_amplitude(t, "minimum"),
        maximum: optional_amplitude(t, "maximum"),
        joint_threshold: optional_amplitude(t, "joint_threshold"),
        moves: t
            .texts("moves")
            .iter()
            .map(|text| (*text).to_owned())
            .collect(),
        strength_duration: strength_duration?,
        muscle: muscle?,
        intervals: intervals?,
    };
    check_order(t, &electrode);
    check_limits(t, &electrode, draft);
    Some(electrode)
}

fn read_strength_duration(t: &Table<'_>) -> StrengthDuration {
    let points = t.tables("upper").iter().filter(|table| table.is_valid());
    let points = points.map(|table| {
        (
            table.integer("width_us"),
            Amplitude::new(table.integer("value")),
        )
    });
    StrengthDuration {
        rheobase: Amplitude::new(t.integer("rheobase")),
        chronaxie_ns: t.integer("chronaxie_us"),
        upper: points.collect(),
    }
}

fn read_muscle(t: &Table<'_>) -> Muscle {
    let force = CalciumForceSpec {
        a_mn_per_s: t.integer("a_n_per_s"),
        k_micro: t.integer("k"),
        tau_c_us: t.integer("tau_c_ms"),
        tau1_us: t.integer("tau1_ms"),
        tau2_us: t.integer("tau2_ms"),
    };
    let fatigue = t.table("fatigue").filter(|f| f.is_valid());
    Muscle {
        force,
        reference: Amplitude::new(t.integer("reference")),
        slope_micro: t.integer("slope_per_unit"),
        fatigue: fatigue.map(|f| read_fatigue(f, force.a_mn_per_s)),
    }
}

fn read_interval(t: &Table<'_>) -> Option<Interval> {
    let of = INTERVALS_OF.iter().find(|of| **of == t.word("of"));
    let (low, high) = (t.real("low")?, t.real("high")?);
    if low > high {
        t.report_not_after("high", "`low`".into());
    }
    Some(Interval { of: of?, low, high })
}

fn read_forearm(t: &Table<'_>) -> Option<Forearm> {
    let (reach_m, around_m) = (t.real("reach_m")?, t.real("around_m")?);
    let volts: Vec<f64> = t
        .integers("thresholds_v")
        .iter()
        .map(|(mv, _)| *mv as f64 / 1e3)
        .collect();
    let thresholds_v = <[f64; 3]>::try_from(volts).ok();
    if t.has("thresholds_v") && thresholds_v.is_none() {
        let allowed = "three numbers: for A, B and the extensor's point".into();
        t.report_out_of_range("thresholds_v", allowed);
    }
    let pads_mm = <[[f64; 2]; 3]>::try_from(t.pairs("pads_mm", 0)).ok();
    if let Some(pads_mm) = pads_mm {
        let points = pads_mm.map(|[x_mm, y_mm]| Pad {
            x_m: 1e-3 * x_mm,
            y_m: 1e-3 * y_mm,
            shape: PadShape::Round {
                diameter_m: ROUND_M,
            },
        });
        for wrong in HandSpec::nominal(reach_m, around_m, 0).placement_errors(&points) {
            let why = wrong.to_string();
            t.report("pads_mm", Problem::Misplaced { why });
        }
    }
    Some(Forearm {
        reach_m,
        around_m,
        thresholds_v,
        pads_mm,
    })
}

fn read_elbow(t: &Table<'_>, find: impl Fn(&Table<'_>, &str) -> u8) -> Elbow {
    let (triceps, biceps) = (find(t, "triceps"), find(t, "biceps"));
    if triceps == biceps {
        t.report("biceps", Problem::ChannelTwice { channel: biceps });
    }
    Elbow {
        triceps,
        biceps,
        triceps_nm: t.real("triceps_nm"),
        biceps_nm: t.real("biceps_nm"),
    }
}

fn read_history(t: &Table<'_>) -> History {
    let text = |name| t.text(name).map(str::to_owned);
    let required_text = |name| text(name).unwrap_or_default(); // told if it is not there
    History {
        at: required_text("at"),
        by: required_text("by"),
        what: required_text("what"),
        device: text("device"),
        firmware: text("firmware"),
        seed: t.has("seed").then(|| t.integer("seed")),
    }
}

fn read_check(t: &Table<'_>, find: impl Fn(&Table<'_>, &str) -> u8) -> DriftCheck {
    DriftCheck {
        at: t.text("at").unwrap_or_default().to_owned(),
        channel: find(t, "channel"),
        expected: Amplitude::new(t.integer("expected")),
        found: optional_amplitude(t, "found"),
        unit: match t.word("unit") {
            "V" => Unit::Volt,
            _ => Unit::Milliampere,
        },
        accepted: t.flag("accepted"),
        by: t.text("by").map(str::to_owned),
        device: t.text("device").map(str::to_owned),
        seed: t.has("seed").then(|| t.integer("seed")),
    }
}
