//! What a session's trace must look like, written down from its file for the
//! independent checker. Nothing of the device's scheduling is used.

use hal_sim::trace::Polarity;
use hal_sim::trace::check::{Expectation, Group, GroupKind, Limits, Shape, TrainSpec};
use host_tool::session::{Course, Session};
use std::ops::Range;

/// The expectation for stimulation from `epoch_us` to `end_us`, every pulse of
/// every channel that the session's constant amplitudes name.
///
/// # Panics
/// If the session streams angles, whose amplitudes nobody knows beforehand.
#[must_use]
pub fn expectation(session: &Session, epoch_us: u64, end_us: u64) -> Expectation {
    let Course::Amplitudes(values) = &session.setpoints.course else {
        panic!("constant amplitudes only");
    };
    let is_driven = |index: u8| values.iter().any(|(c, a)| *c == index && a.0 > 0);
    let driven = session.channels.iter().filter(|c| is_driven(c.index()));
    let groups = session.groups.iter().map(|group| Group {
        kind: match group.partner {
            firmware::pulse::Partner::Conducted => GroupKind::Conducted,
            firmware::pulse::Partner::Isolated => GroupKind::Isolated,
        },
        members: (0..10).filter(|c| group.members & 1 << c != 0).collect(),
    });
    Expectation {
        trains: driven
            .map(|c| train(c.index(), &c.spec.train, epoch_us..end_us + 1))
            .collect(),
        groups: groups.collect(),
        dead_time_us: 5,
        max_code: [u16::MAX; 10],
        limits: Limits::default(),
        complete: true,
        end_us,
    }
}

fn train(channel: u8, spec: &firmware::pulse::TrainSpec, active_us: Range<u64>) -> TrainSpec {
    use firmware::pulse::Shape as Wire;
    TrainSpec {
        channel,
        shape: match spec.shape {
            Wire::BiphasicCathodicFirst => Shape::Biphasic(Polarity::Cathodic),
            Wire::BiphasicAnodicFirst => Shape::Biphasic(Polarity::Anodic),
            Wire::MonophasicCathodic => Shape::Monophasic(Polarity::Cathodic),
            Wire::MonophasicAnodic => Shape::Monophasic(Polarity::Anodic),
        },
        width_us: spec.width_us.into(),
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
