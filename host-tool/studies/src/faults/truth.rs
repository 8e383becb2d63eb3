//! Builds the true properties of hardware and wearer for the judge, from the settings of a session.

use firmware::safety::StageSpec;
use hal_sim::body::{CHANNELS, Load};
use hal_sim::trace::judge::{Channel, Stage, Truth};
use host_core::session::Session;

/// Pulses that an electrode check emits on each channel, far below any threshold. They count as
/// pulses of the following second.
const CHECK_PULSES: usize = 8;

/// Raises the allowed pulses per second to those of `checks` electrode checks within a second; one
/// check is already allowed.
pub(super) fn allow_checks(truth: &mut Truth, checks: usize) {
    for channel in &mut truth.channels {
        channel.pulses_per_s += CHECK_PULSES * checks.saturating_sub(1);
    }
}

/// Returns the stages, limits and pulse rates of `session` as the true ones by which output is
/// judged, with these electrode loads.
#[must_use]
pub fn declared_truth(session: &Session, loads: &[Load; CHANNELS]) -> Truth {
    let mut truth = Truth::default();
    for channel in &session.channels {
        let index = usize::from(channel.index());
        let spec = &channel.spec;
        let limit = f64::from(spec.limit.get()) * 1e-3;
        let (stage, limit_ma) = match spec.stage {
            StageSpec::Current { full_scale_ua } => {
                let full_scale_ma = f64::from(full_scale_ua) * 1e-3;
                (Stage::Current { full_scale_ma }, limit)
            }
            StageSpec::Voltage {
                full_scale_mv,
                load_ohm,
            } => {
                let full_scale_v = f64::from(full_scale_mv) * 1e-3;
                let limit_ma = 1e3 * limit / f64::from(load_ohm);
                (Stage::Voltage { full_scale_v }, limit_ma)
            }
        };
        let Load::Ohms(ohm) = loads[index] else {
            continue;
        };
        // With force control the device varies the rate, at most to the one that the file allows.
        let period_us = channel
            .force
            .map_or(spec.train.period_us, |f| f.min_period_us);
        let bursts = 1_000_000_u32.div_ceil(period_us);
        let pulses = bursts as usize * usize::from(spec.train.burst_count);
        truth.channels[index] = Channel::steady(stage, ohm, limit_ma, pulses + CHECK_PULSES);
    }
    truth
}
