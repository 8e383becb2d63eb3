//! The wall experiments for one wearer: thresholds, limits and strengths from their file
//! instead of the declaration's.

use super::{of_program, text_of};
use crate::laboratory::{Experiment, LaboratoryError};
use host_core::session::Unit;
use host_core::wearer::{Electrode, Unfit, Wearer};
use toml::{Table, Value};

/// Pulse widths of the triceps and of the biceps, µs (Harris 2017, sections 3.4).
const WIDTHS_US: [u16; 2] = [35, 25];
/// Where the ramp of the wall ends, ° (section 3.4: the pre-wall's).
const RAMP_DEG: f64 = 9.0;
/// Most of the biceps, mA (section 3.4).
const BICEPS_MA: f64 = 40.0;
/// What all wall experiments are called from.
const WALL: &str = "harris-wall";

/// Where sessions of the program name their wearers' files.
const WEARERS: &str = "../wearers/";

/// Why a wearer cannot hit the wall.
#[derive(Debug, thiserror::Error)]
pub enum WornError {
    /// It is no wall experiment of the program.
    #[error("E693 {0} takes no wearer's file; harris-wall and its sequels do")]
    NoWall(String),
    /// The file says no elbow.
    #[error("E694 {0}: it has no [elbow] with electrodes of current stages; {1}")]
    NoElbow(String, &'static str),
    /// A channel cannot be used at the experiment's width.
    #[error("E695 {name}: channel {channel} cannot be used at {width_us} µs: {why}")]
    Unfit {
        /// The wearer.
        name: String,
        /// From 1.
        channel: u8,
        /// The experiment's.
        width_us: u16,
        /// What is missing, and what to do.
        why: String,
    },
    /// What comes of it is no experiment.
    #[error(transparent)]
    Laboratory(#[from] LaboratoryError),
}

/// What a wearer's file says for the wall, mA.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Points {
    threshold_ma: f64,
    most_ma: f64,
}

/// The wall experiment `name` of the program, hit by this wearer.
///
/// # Errors
/// It is none; the file has no elbow, or nothing at the widths of the experiment; a session
/// that no device would arm.
pub fn worn(name: &str, wearer: &Wearer) -> Result<Experiment, WornError> {
    let is_wall = name == WALL
        || name
            .strip_prefix(WALL)
            .is_some_and(|it| it.starts_with('-'));
    let (file, text) = match text_of(name) {
        Some(found) if is_wall => found,
        _ => return Err(WornError::NoWall(name.to_owned())),
    };
    let [triceps, biceps] = points(wearer)?;
    let declared = declaration(text, wearer, [triceps, biceps]);
    let session = |name: &str| match name.starts_with(WEARERS) {
        true => Ok(wearer.to_toml()),
        false => Ok(dressed(&of_program(name)?, wearer, [triceps, biceps])),
    };
    Ok(Experiment::new(file, &declared, &session)?.called(name))
}

/// Thresholds and most of both muscles at the experiment's widths.
fn points(wearer: &Wearer) -> Result<[Points; 2], WornError> {
    let none = |what| WornError::NoElbow(wearer.name.clone(), what);
    let elbow = wearer
        .elbow
        .ok_or_else(|| none("add it, with `triceps` and `biceps`"))?;
    let point = |channel: u8, width_us: u16| -> Result<Points, WornError> {
        let electrode = wearer
            .electrode(channel)
            .filter(|it| it.unit == Unit::Milliampere);
        let electrode = electrode.ok_or_else(|| none("name channels of current stages"))?;
        let own = electrode.at_width(width_us);
        let own = own.map_err(|why| unfit(wearer, electrode, width_us, why))?;
        let ma = |it: firmware::units::Amplitude| f64::from(it.get()) * 1e-3;
        Ok(Points {
            threshold_ma: ma(own.minimum.unwrap_or(own.motor_threshold)),
            most_ma: ma(own.maximum.unwrap_or(own.limit)),
        })
    };
    let [triceps_us, biceps_us] = WIDTHS_US;
    Ok([
        point(elbow.triceps, triceps_us)?,
        point(elbow.biceps, biceps_us)?,
    ])
}

fn unfit(wearer: &Wearer, electrode: &Electrode, width_us: u16, why: Unfit) -> WornError {
    let why = match why {
        Unfit::NoCurve => format!(
            "its thresholds hold at {} µs and it has no strength_duration; measure them there, or \
             add the curve",
            electrode.width_us
        ),
        Unfit::AboveLimit(threshold) => format!(
            "the threshold there, {:.1} mA, is not below its limit",
            f64::from(threshold.get()) * 1e-3
        ),
    };
    WornError::Unfit {
        name: wearer.name.clone(),
        channel: electrode.channel,
        width_us,
        why,
    }
}

/// The declaration, whose draws of what the file says are left out.
fn declaration(text: &str, wearer: &Wearer, points: [Points; 2]) -> String {
    let mut table: Table = text.parse().unwrap_or_default(); // the program's own
    let known = known(wearer, points);
    if let Some(Value::Array(draws)) = table.get_mut("draw") {
        let is_known = |draw: &Value| {
            let field = draw.get("field").and_then(Value::as_str);
            known
                .iter()
                .any(|(own, _)| field == Some(&format!("body.{own}")))
        };
        draws.retain(|draw| !is_known(draw));
    }
    if let Some(Value::String(title)) = table.get_mut("title") {
        *title = format!("{title} (wearer {})", wearer.name);
    }
    let [triceps, biceps] = points;
    let told = format!(
        "The wearer's file {} ({}, {}) says: triceps {:.1} to {:.1} mA at 35 µs, biceps {:.1} to \
         {:.1} mA at 25 µs. The pre-wall begins at the threshold, the wall ends at the most, \
         co-contraction is 40 mA or the most.",
        wearer.name,
        wearer.evidence.word(),
        wearer.source,
        triceps.threshold_ma,
        triceps.most_ma,
        biceps.threshold_ma,
        biceps.most_ma,
    );
    if let Some(Value::Array(assumed)) = table.get_mut("assumed") {
        assumed.push(Value::String(told));
    }
    table.to_string()
}

/// Fields of the body that a file says.
fn known(wearer: &Wearer, [triceps, biceps]: [Points; 2]) -> Vec<(&'static str, f64)> {
    let mut known = vec![
        ("triceps_threshold_ma", triceps.threshold_ma),
        ("biceps_threshold_ma", biceps.threshold_ma),
    ];
    let strengths = wearer.elbow.map(|it| [it.triceps_nm, it.biceps_nm]);
    let [triceps_nm, biceps_nm] = strengths.unwrap_or_default();
    // A strength is what the most gives.
    let of = |nm: Option<f64>, names: [&'static str; 2], most_ma| {
        let known = nm.map(|nm| [(names[0], nm), (names[1], most_ma)]);
        known.into_iter().flatten()
    };
    known.extend(of(
        triceps_nm,
        ["triceps_nm", "triceps_max_ma"],
        triceps.most_ma,
    ));
    known.extend(of(
        biceps_nm,
        ["biceps_nm", "biceps_max_ma"],
        biceps.most_ma,
    ));
    known
}

/// A session of the program with this wearer's amplitudes and body; its limits are those of
/// the wearer's file, which it names.
fn dressed(text: &str, wearer: &Wearer, points: [Points; 2]) -> String {
    let mut table: Table = text.parse().unwrap_or_default(); // the program's own
    let [triceps, biceps] = points;
    let mut set = |path: &[&str], value: f64| {
        if let Some(place) = at(&mut table, path) {
            *place = Value::Float(milli(value));
        }
    };
    set(&["wall", "max"], triceps.most_ma);
    set(&["wall", "stiffness_per_deg"], triceps.most_ma / RAMP_DEG);
    set(&["wall", "pre_wall", "begin"], triceps.threshold_ma);
    set(&["wall", "pre_wall", "end"], triceps.most_ma);
    set(
        &["wall", "co_contraction", "amplitude"],
        BICEPS_MA.min(biceps.most_ma),
    );
    if let Some(Value::Table(body)) = table.get_mut("body") {
        for (name, value) in known(wearer, points) {
            body.insert(name.to_owned(), Value::Float(milli(value)));
        }
    }
    table.to_string()
}

/// What stands at this path, where something does.
fn at<'t>(table: &'t mut Table, path: &[&str]) -> Option<&'t mut Value> {
    let (first, rest) = path.split_first()?;
    let mut place = table.get_mut(*first)?;
    for part in rest {
        place = match place {
            Value::Table(inner) => inner.get_mut(*part)?,
            Value::Array(list) => list.get_mut(part.parse::<usize>().ok()?)?,
            _ => return None,
        };
    }
    Some(place)
}

/// To a thousandth, a session's step.
fn milli(value: f64) -> f64 {
    (1e3 * value).round() * 1e-3
}
