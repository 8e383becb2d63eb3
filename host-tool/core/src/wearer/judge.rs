//! Checks whether an electrode contradicts itself or the wearer's limits.

use firmware::device::{Draft, Rule};
use firmware::muscle::{MuscleLevel, MuscleSpec, RecruitmentSpec};
use firmware::pulse::TrainSpec;
use firmware::safety::{ChannelSpec, StageSpec, WearerSpec};

use super::electrode::Electrode;
use super::limits::channel_limit_problem;
use super::unit::Unit;
use crate::fields::decimal::format_scaled;
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// Reports amplitudes, rates and widths of an electrode that contradict each other's order, for
/// example a motor threshold that is not below the limit.
pub(super) fn check_order(t: &Table<'_>, electrode: &Electrode) {
    let disordered =
        |name: &str, why: String| t.report(name, Problem::ThresholdsDisordered { why });
    let reason = |name: &str| format!("but `{name}` is {}", t.field_place(name).given);
    if electrode.motor_threshold >= electrode.limit {
        disordered("motor_threshold", reason("limit"));
    }
    if electrode.start > electrode.limit {
        disordered("start", reason("limit"));
    }
    let most = electrode.maximum.unwrap_or(electrode.limit);
    if electrode
        .maximum
        .is_some_and(|maximum| maximum > electrode.limit)
    {
        disordered("maximum", reason("limit"));
    }
    if electrode.minimum.is_some_and(|minimum| minimum > most) {
        let than = ["maximum", "limit"][usize::from(electrode.maximum.is_none())];
        disordered("minimum", reason(than));
    }
    if electrode.joint_threshold.is_some_and(|zero| zero > most) {
        let than = ["maximum", "limit"][usize::from(electrode.maximum.is_none())];
        disordered("joint_threshold", reason(than));
    }
    let [from, to] = electrode.holds_hz;
    if from > electrode.frequency_hz {
        disordered("from_hz", reason("frequency_hz"));
    }
    if to < electrode.frequency_hz {
        disordered("to_hz", reason("frequency_hz"));
    }
    let Some((s, curve)) = t
        .table("strength_duration")
        .zip(electrode.strength_duration.as_ref())
    else {
        return;
    };
    if curve.rheobase > electrode.motor_threshold {
        let why = format!(
            "but `motor_threshold` is {}",
            t.field_place("motor_threshold").given
        );
        s.report("rheobase", Problem::ThresholdsDisordered { why });
    }
    let mut before = 0;
    for (item, &(width_us, value)) in s.tables("upper").iter().zip(&curve.upper) {
        if width_us <= before {
            item.report_not_after("width_us", format!("{before} µs"));
        }
        before = width_us;
        let threshold =
            f64::from(electrode.motor_threshold.get()) * curve.factor(electrode.width_us, width_us);
        // If the threshold itself has an error, the curve is not checked.
        if f64::from(value.get()) <= threshold && electrode.motor_threshold < electrode.limit {
            let why = format!("but the threshold there is {:.3}", threshold * 1e-3);
            item.report("value", Problem::ThresholdsDisordered { why });
        }
    }
}

/// Reports an electrode that, at its limit, exceeds the wearer's limits. Reports also values of its
/// muscle that the device would refuse.
pub(super) fn check_limits(t: &Table<'_>, electrode: &Electrode, draft: &mut Draft) {
    let spec = electrode.channel_spec();
    let index = electrode.channel.saturating_sub(1); // 1–10
    match draft.set_channel(index, spec).map_err(|e| (e, e.rule)) {
        Ok(()) => {}
        Err((mistake, Rule::Setup(e))) => {
            match channel_limit_problem(&spec, electrode.unit, || rms_ma(&spec), e) {
                Some(problem) => t.report("limit", problem),
                None => t.report_refusal(mistake),
            }
        }
        Err((mistake, _)) => t.report_refusal(mistake),
    }
    if let (Some(m), Some(spec)) = (t.table("muscle"), electrode.muscle_spec())
        && m.is_valid()
        && electrode.motor_threshold < electrode.limit
        && let Err(mistake) = draft.set_muscle(index, spec)
    {
        m.report_refusal(mistake);
    }
}

/// Returns, as text, the rms current of a channel at its amplitude limit, mA. The wearer's limits
/// do not matter.
fn rms_ma(spec: &ChannelSpec) -> String {
    let widest = ChannelSpec {
        area_mm2: ChannelSpec::AREA_MM2.max.cast_unsigned(),
        ..*spec
    };
    let anyone = WearerSpec::default().validate().ok();
    let channel = anyone.and_then(|anyone| widest.validate(&anyone).ok());
    let milli = |ua: u32| format_scaled(ua.into(), 3);
    channel.map_or_else(
        || "more than 50".into(),
        |channel| milli(channel.rms().get()),
    )
}

impl Electrode {
    /// Returns a channel with which the electrode can be checked against the wearer's limits:
    /// biphasic pulses at the highest rate for which the thresholds hold, up to the electrode's
    /// limit.
    fn channel_spec(&self) -> ChannelSpec {
        let stage = match self.unit {
            Unit::Milliampere => StageSpec::Current {
                full_scale_ua: StageSpec::FULL_SCALE_UA.max.cast_unsigned(),
            },
            Unit::Volt => StageSpec::Voltage {
                full_scale_mv: StageSpec::FULL_SCALE_MV.max.cast_unsigned(),
                load_ohm: self.load_ohm,
            },
        };
        let [_, fastest_hz] = self.holds_hz;
        let period_us = (1e6 / fastest_hz).round() as u32; // saturates
        let train = TrainSpec::biphasic(self.width_us, 0, period_us);
        ChannelSpec {
            train,
            stage,
            limit: self.limit,
            start: self.start.min(self.limit),
            area_mm2: self.area_mm2,
        }
    }

    /// Returns the muscle under the electrode as the device receives it, or `None` if the file has
    /// none.
    fn muscle_spec(&self) -> Option<MuscleSpec> {
        let muscle = self.muscle?;
        Some(MuscleSpec {
            force: muscle.force,
            recruitment: RecruitmentSpec {
                motor_threshold: self.motor_threshold,
                limit: self.limit,
                reference: muscle.reference,
                slope_micro: muscle.slope_micro,
            },
            fatigue: muscle.fatigue,
            level: match muscle.fatigue {
                Some(_) => MuscleLevel::CalciumForceFatigue,
                None => MuscleLevel::CalciumForce,
            },
        })
    }
}
