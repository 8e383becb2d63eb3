//! Expected trace of a session, derived from its file for the independent checker, without any of
//! the device's scheduling code.

use firmware::pulse::{GroupSpec, Partner, Shape as WireShape, TrainSpec as Wire};
use hal_sim::trace::check::{Expectation, Group, GroupKind, Limits, Shape, TrainSpec};
use hal_sim::trace::{Polarity, Trace};
use host_core::session::{Course, Session};
use std::ops::Range;

/// Returns the expectation for stimulation from `epoch_us` to `end_us`: every pulse of every
/// channel that the session's constant amplitudes drive.
///
/// # Panics
/// Panics if the session streams angles, whose amplitudes are not known beforehand.
#[must_use]
pub fn session_expectation(session: &Session, epoch_us: u64, end_us: u64) -> Expectation {
    let Course::Amplitudes(values) = &session.setpoints.course else {
        panic!("constant amplitudes only");
    };
    let is_driven = |index: u8| {
        values
            .iter()
            .any(|(c, stimulus)| *c == index && stimulus.amplitude.get() > 0)
    };
    let driven = session.channels.iter().filter(|c| is_driven(c.index()));
    let trains = driven.map(|c| train(c.index(), &c.spec.train, epoch_us..end_us + 1));
    expectation(trains.collect(), &session.groups, end_us)
}

/// Returns the expectation for trains of channels 0, 1, …, all of them driven.
#[must_use]
pub fn setup_expectation(
    trains: &[Wire],
    groups: &[GroupSpec],
    epoch_us: u64,
    end_us: u64,
) -> Expectation {
    let trains = (0u8..)
        .zip(trains)
        .map(|(c, spec)| train(c, spec, epoch_us..end_us + 1));
    expectation(trains.collect(), groups, end_us)
}

/// Returns the trace from `epoch_us` on, with the DAC writes for its first pulses, but without the
/// preceding electrode check.
#[must_use]
pub fn trace_since(trace: &Trace, epoch_us: u64) -> Trace {
    Trace {
        levels: trace
            .levels
            .iter()
            .copied()
            .filter(|(t, _)| *t >= epoch_us)
            .collect(),
        dac: trace
            .dac
            .iter()
            .copied()
            .filter(|write| write.t_us + 500 >= epoch_us)
            .collect(),
        trips: trace.trips.clone(),
        ..Trace::default()
    }
}

fn expectation(trains: Vec<TrainSpec>, groups: &[GroupSpec], end_us: u64) -> Expectation {
    let groups = groups.iter().map(|group| Group {
        kind: match group.partner {
            Partner::Conducted => GroupKind::Conducted,
            Partner::Isolated => GroupKind::Isolated,
        },
        members: (0..10).filter(|c| group.members & 1 << c != 0).collect(),
    });
    Expectation {
        trains,
        groups: groups.collect(),
        dead_time_us: 5,
        max_code: [u16::MAX; 10],
        max_code_us: [u64::MAX; 10],
        limits: Limits::default(),
        complete: true,
        end_us,
    }
}

fn train(channel: u8, spec: &Wire, active_us: Range<u64>) -> TrainSpec {
    TrainSpec {
        channel,
        shape: match spec.shape {
            WireShape::BiphasicCathodicFirst => Shape::Biphasic(Polarity::Cathodic),
            WireShape::BiphasicAnodicFirst => Shape::Biphasic(Polarity::Anodic),
            WireShape::MonophasicCathodic => Shape::Monophasic(Polarity::Cathodic),
            WireShape::MonophasicAnodic => Shape::Monophasic(Polarity::Anodic),
        },
        width_us: spec.width_us.into(),
        widest_us: (spec.max_width_us > spec.width_us).then_some(spec.max_width_us.into()),
        gap_us: spec.gap_us.into(),
        period_us: spec.period_us.into(),
        offset_us: spec.offset_us.into(),
        burst_count: spec.burst_count.into(),
        burst_interval_us: spec.burst_interval_us.into(),
        ground_us: spec.ground_us.into(),
        epoch_us: active_us.start,
        active_us,
    }
}
