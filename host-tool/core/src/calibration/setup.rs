//! Builds the device's setup for one electrode: an ordinary session with one channel.

use super::{CalibrationError, Plan, PlannedElectrode};
use crate::run::merge_sessions;
use crate::session::{Session, Unit};
use toml::{Table, Value};

/// Returns a session for each electrode of the plan, in the plan's order, with which the device is
/// configured. The sessions are checked like any session, and all amplitudes are 0.
///
/// # Errors
/// Lists everything that the device would refuse, for all electrodes at once.
pub fn sessions(plan: &Plan) -> Result<Vec<Session>, CalibrationError> {
    let (mut sessions, mut mistakes) = (Vec::new(), Vec::new());
    for planned in &plan.electrodes {
        let text = session_text(plan, planned);
        match Session::parse("the plan", &text) {
            Ok(session) => sessions.push(session),
            Err(error) => mistakes.extend(
                (error.lines().lines()).map(|line| format!("channel {}: {line}", planned.channel)),
            ),
        }
    }
    match mistakes.is_empty() {
        true => Ok(sessions),
        false => Err(CalibrationError::Plan(
            plan.wearer.clone(),
            mistakes.join("\n  "),
        )),
    }
}

/// Returns one session with all electrodes of the plan, for which a simulated board can be built.
///
/// # Errors
/// The errors of [`sessions`], or two electrodes that need different boards.
pub fn board_session(plan: &Plan) -> Result<Session, CalibrationError> {
    let refused = |why: String| CalibrationError::Plan(plan.wearer.clone(), why);
    let worn = merge_sessions(&sessions(plan)?);
    let worn = worn.map_err(|field| {
        refused(format!(
            "two electrodes differ in {field}, which must be equal on one board"
        ))
    })?;
    worn.ok_or_else(|| refused("the plan has no [[electrode]]".to_owned()))
}

/// Returns the text of the session file with which the device is configured for an electrode.
fn session_text(plan: &Plan, planned: &PlannedElectrode) -> String {
    let (kind, full_scale) = match planned.stage {
        Unit::Milliampere => ("current", "full_scale_ma"),
        Unit::Volt => ("voltage", "full_scale_v"),
    };
    let mut stage = Table::from_iter([
        ("kind".to_owned(), Value::from(kind)),
        (full_scale.to_owned(), planned.full_scale.into()),
    ]);
    if planned.stage == Unit::Volt {
        stage.insert("load_ohm".to_owned(), 2000.into());
    }
    let train = Table::from_iter([
        ("shape".to_owned(), "biphasic-cathodic-first".into()),
        ("width_us".to_owned(), i64::from(planned.width_us).into()),
        ("frequency_hz".to_owned(), Value::from(planned.frequency_hz)),
    ]);
    let channel = Table::from_iter([
        ("number".to_owned(), Value::from(i64::from(planned.channel))),
        ("name".to_owned(), planned.place.clone().into()),
        ("stage".to_owned(), stage.into()),
        ("limit".to_owned(), planned.ceiling.units().into()),
        ("area_mm2".to_owned(), i64::from(planned.area_mm2).into()),
        ("train".to_owned(), train.into()),
    ]);
    let silent = Table::from_iter([
        (
            "channel".to_owned(),
            Value::from(i64::from(planned.channel)),
        ),
        ("value".to_owned(), 0.0.into()),
    ]);
    let setpoints = Table::from_iter([
        ("kind".to_owned(), Value::from("amplitudes")),
        ("values".to_owned(), vec![silent].into()),
        ("rate_hz".to_owned(), 100.0.into()),
    ]);
    let title = format!("Calibration of {}", plan.wearer);
    Table::from_iter([
        ("title".to_owned(), Value::from(title)),
        ("duration_s".to_owned(), 60.0.into()),
        ("wearer".to_owned(), plan.limits.clone().into()),
        ("channel".to_owned(), vec![channel].into()),
        ("setpoints".to_owned(), setpoints.into()),
    ])
    .to_string()
}
