//! Turns the results of a calibration into a wearer file.

use super::{CalibrationError, ElectrodeResult, Entry, Files, Head, Plan, PlannedElectrode, Step};
use crate::wearer::{Electrode, Evidence, History, Wearer};
use firmware::safety::WearerSpec;
use firmware::units::Amplitude;
use std::path::Path;

/// Returns, for each electrode of the plan, the head of the run in which its last step was
/// completed.
///
/// A journal has one head for each run, because a calibration can be resumed. An electrode whose
/// last step is not among the entries `before` has the head of the present run, `now`.
fn completion_heads<'a>(plan: &Plan, before: &'a [Entry], now: &'a Head) -> Vec<&'a Head> {
    let mut heads = vec![now; plan.electrodes.len()];
    let mut begun = now;
    for entry in before {
        match entry {
            Entry::Begun(head) => begun = head,
            Entry::Found {
                channel,
                step: Step::Points,
                ..
            } => {
                let electrodes = plan.electrodes.iter().zip(&mut heads);
                for (_, head) in electrodes.filter(|(planned, _)| planned.channel == *channel) {
                    *head = begun;
                }
            }
            _ => {}
        }
    }
    heads
}

/// Returns the wearer with every electrode whose calibration is complete, sorted by channel.
///
/// `before` are the journal entries of earlier runs, and `head` is the head of this run. `found`
/// has the results for each electrode of the plan.
pub fn compose_wearer(
    plan: &Plan,
    before: &[Entry],
    head: &Head,
    limits: WearerSpec,
    found: &[ElectrodeResult],
) -> Wearer {
    let evidence = match head.simulated {
        true => Evidence::Simulated,
        false => Evidence::Measured,
    };
    let source = match head.simulated {
        true => "flexor calibrate on a simulated body: no evidence about people",
        false => "flexor calibrate",
    };
    let mut wearer = Wearer {
        limits,
        ..Wearer::new(&plan.wearer, evidence, source)
    };
    let heads = completion_heads(plan, before, head);
    for ((planned, found), head) in plan.electrodes.iter().zip(found).zip(heads) {
        if let Some(electrode) = electrode(planned, found) {
            wearer.electrodes.push(electrode);
            wearer.history.push(history(planned, head));
        }
    }
    wearer.electrodes.sort_by_key(|electrode| electrode.channel);
    wearer
}

/// Amplitude at zero effort of a joint as a share of the motor threshold, thousandths.
///
/// A calibration finds the lowest level that moves the limb, so at this level the muscle already
/// pulls. A joint gives its inactive muscle the amplitude at zero effort all the time: it has to be
/// lower. Two points together even begin to act at 0.82 to 0.93 of their thresholds alone (Hamana
/// 2022, table 7). Chosen on simulated wearers (docs/evidence/control.md).
const JOINT_SHARE_MILLI: u64 = 850;

/// Returns the amplitude at zero effort of a joint for this motor threshold.
fn joint_threshold(motor_threshold: Amplitude) -> Amplitude {
    let milli = u64::from(motor_threshold.get()) * JOINT_SHARE_MILLI / 1000;
    Amplitude::new(milli as u32) // at most the threshold
}

/// Returns the electrode as the wearer file describes it; `None` if the electrode was left out or a
/// step has no result.
fn electrode(planned: &PlannedElectrode, found: &ElectrodeResult) -> Option<Electrode> {
    if !found.is_complete() {
        return None;
    }
    Some(Electrode {
        channel: planned.channel,
        place: planned.place.clone(),
        area_mm2: planned.area_mm2,
        unit: planned.stage,
        load_ohm: 2_000,
        width_us: planned.width_us,
        frequency_hz: planned.frequency_hz,
        holds_hz: [planned.frequency_hz; 2],
        motor_threshold: found.threshold?.amplitude(),
        limit: found.limit?.amplitude(),
        start: Amplitude::ZERO,
        minimum: Some(found.minimum?.amplitude()),
        maximum: Some(found.maximum?.amplitude()),
        joint_threshold: Some(joint_threshold(found.threshold?.amplitude())),
        moves: found.moves.clone()?,
        strength_duration: None,
        muscle: None,
        intervals: Vec::new(),
    })
}

/// Returns the entry of the wearer file's history that says how an electrode was calibrated. `head`
/// is the head of the run in which this was completed.
fn history(planned: &PlannedElectrode, head: &Head) -> History {
    History {
        at: head.at.clone(),
        by: head.operator.clone(),
        what: format!(
            "channel {}: placement, motor threshold in steps of {}, limit, minimum, maximum, points",
            planned.channel, planned.step
        ),
        device: Some(head.device.clone()),
        firmware: Some(head.firmware.clone()),
        seed: head.seed,
    }
}

/// Checks, before any stimulation, whether a calibration with this plan can end with a valid wearer
/// file.
///
/// To do so, it composes a wearer file in which the plan's lowest and highest levels are the
/// results, and parses it.
///
/// # Errors
/// [`CalibrationError::Plan`] with every reason for which the file would be refused.
pub fn check_planned_wearer(
    plan: &Plan,
    head: &Head,
    limits: WearerSpec,
) -> Result<(), CalibrationError> {
    let results = plan.electrodes.iter().map(|planned| ElectrodeResult {
        placement: Some(planned.start),
        threshold: Some(planned.start),
        limit: Some(planned.ceiling),
        minimum: Some(planned.start),
        maximum: Some(planned.ceiling),
        moves: Some(Vec::new()),
        is_skipped: false,
    });
    let found: Vec<ElectrodeResult> = results.collect();
    let text = compose_wearer(plan, &[], head, limits, &found).to_toml();
    let read = Wearer::parse("planned wearer file", &text);
    read.map(drop)
        .map_err(|error| CalibrationError::Plan(plan.wearer.clone(), error.lines()))
}

/// Replaces the wearer file at `out` as a whole, after checking that the new text can be read back
/// without a difference.
///
/// # Errors
/// [`CalibrationError::Wrong`] if the new text cannot be parsed or differs after reading back.
/// [`CalibrationError::Write`] if the file cannot be written. The old file stays in both cases.
pub fn write(files: &dyn Files, out: &Path, wearer: &Wearer) -> Result<(), CalibrationError> {
    let text = wearer.to_toml();
    let name = out.display().to_string();
    let wrong = |why: String| CalibrationError::Wrong(out.to_owned(), why);
    let parsed = Wearer::parse(&name, &text).map_err(|error| wrong(error.lines()))?;
    if parsed.to_toml() != text {
        return Err(wrong("it does not read back unchanged".to_owned()));
    }
    let written = files.replace(out, &text);
    written.map_err(|why| CalibrationError::Write(out.to_owned(), why))
}
