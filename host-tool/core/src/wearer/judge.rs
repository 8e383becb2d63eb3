//! What of an electrode contradicts itself or the wearer's limits.

use firmware::device::Draft;
use firmware::muscle::{MuscleSpec, RecruitmentSpec, Rung};
use firmware::pulse::TrainSpec;
use firmware::safety::{ChannelSpec, StageSpec};

use super::Electrode;
use crate::session::Unit;
use crate::session::channel::Channel;
use crate::session::error::Problem;
use crate::session::table::Table;
use crate::session::verdict::{tell_channel, tell_muscle};

/// Tells which of an electrode's amplitudes and widths do not rise.
pub(super) fn tell_order(t: &Table<'_>, it: &Electrode) {
    let disordered = |name: &str, why: String| t.say(name, Problem::ThresholdsDisordered { why });
    let told = |name: &str| format!("and `{name}` is {}", t.at(name).given);
    if it.motor_threshold >= it.limit {
        disordered("motor_threshold", told("limit"));
    }
    let most = it.maximum.unwrap_or(it.limit);
    if it.maximum.is_some_and(|maximum| maximum > it.limit) {
        disordered("maximum", told("limit"));
    }
    if it.minimum.is_some_and(|minimum| minimum > most) {
        let than = ["maximum", "limit"][usize::from(it.maximum.is_none())];
        disordered("minimum", told(than));
    }
    let [from, to] = it.holds_hz;
    if from > it.frequency_hz {
        disordered("from_hz", told("frequency_hz"));
    }
    if to < it.frequency_hz {
        disordered("to_hz", told("frequency_hz"));
    }
    let Some((s, curve)) = t
        .table("strength_duration")
        .zip(it.strength_duration.as_ref())
    else {
        return;
    };
    if curve.rheobase > it.motor_threshold {
        let why = format!("and `motor_threshold` is {}", t.at("motor_threshold").given);
        s.say("rheobase", Problem::ThresholdsDisordered { why });
    }
    let mut before = 0;
    for (item, &(width_us, value)) in s.tables("upper").iter().zip(&curve.upper) {
        if width_us <= before {
            item.not_after("width_us", format!("{before} µs"));
        }
        before = width_us;
        let threshold = f64::from(it.motor_threshold.get()) * curve.factor(it.width_us, width_us);
        // Of a threshold that is wrong itself the curve is no matter.
        if f64::from(value.get()) <= threshold && it.motor_threshold < it.limit {
            let why = format!("and the threshold there is {:.3}", threshold * 1e-3);
            item.say("value", Problem::ThresholdsDisordered { why });
        }
    }
}

/// Tells what of an electrode at its limit is beyond the wearer's limits, and what of its
/// muscle no device takes.
pub(super) fn tell_limits(t: &Table<'_>, it: &Electrode, draft: &mut Draft) {
    let channel = it.channel_at(it.width_us, it.holds_hz[1]);
    let index = channel.index();
    if let Err(mistake) = draft.set_channel(index, channel.spec) {
        tell_channel(t, &channel, mistake);
    }
    if let (Some(m), Some(spec)) = (t.table("muscle"), it.muscle_spec())
        && m.is_sound()
        && it.motor_threshold < it.limit
        && let Err(mistake) = draft.set_muscle(index, spec)
    {
        tell_muscle(m, t, mistake);
    }
}

impl Electrode {
    /// A channel of biphasic pulses that may reach its limit.
    fn channel_at(&self, width_us: u16, hz: f64) -> Channel {
        let stage = match self.unit {
            Unit::Milliampere => StageSpec::Current {
                full_scale_ua: StageSpec::FULL_SCALE_UA.max.cast_unsigned(),
            },
            Unit::Volt => StageSpec::Voltage {
                full_scale_mv: StageSpec::FULL_SCALE_MV.max.cast_unsigned(),
                load_ohm: self.load_ohm,
            },
        };
        let period_us = (1e6 / hz).round() as u32; // saturates
        let train = TrainSpec::biphasic(width_us, 0, period_us);
        Channel {
            number: self.channel,
            name: self.place.clone(),
            spec: ChannelSpec {
                train,
                stage,
                limit: self.limit,
                area_mm2: self.area_mm2,
            },
            muscle: None,
            force: None,
        }
    }

    /// Its muscle as a device takes it.
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
            rung: match muscle.fatigue {
                Some(_) => Rung::CalciumForceFatigue,
                None => Rung::CalciumForce,
            },
        })
    }
}
