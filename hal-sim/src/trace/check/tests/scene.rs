//! A correct trace, and functions that modify it.

use super::super::*;
use crate::trace::{Levels, Polarity, State};

/// A trace under construction: (channel, start, end, state), isolated elsewhere.
pub(super) struct Scene {
    pub(super) stretches: Vec<(u8, u64, u64, State)>,
    pub(super) writes: Vec<(u64, u8, u16)>,
    pub(super) expected: Expectation,
}

use State::{Anodic, Cathodic, Grounded};

pub(super) fn train(channel: u8, shape: Shape, width_us: u64, offset_us: u64) -> TrainSpec {
    TrainSpec {
        channel,
        shape,
        width_us,
        widest_us: None,
        gap_us: 0,
        period_us: 20_000,
        offset_us,
        burst_count: 1,
        burst_interval_us: 0,
        ground_us: match shape {
            Shape::Biphasic(_) => 0,
            Shape::Monophasic(_) => 1_000,
        },
        epoch_us: 100_000,
        active_us: 100_000..140_000,
    }
}

/// Two periods. Channel 0: biphasic. 1: doublets, anodic first. 2 and 3: a conducted pair, 4 and 5:
/// an isolated pair, all four monophasic. 6 and 7: a conducted biphasic pair that overlaps.
pub(super) fn good() -> Scene {
    let biphasic = Shape::Biphasic(Polarity::Cathodic);
    let monophasic = Shape::Monophasic(Polarity::Cathodic);
    let mut trains = vec![
        train(0, biphasic, 200, 1_000),
        train(1, Shape::Biphasic(Polarity::Anodic), 100, 500),
        train(2, monophasic, 500, 2_000),
        train(3, monophasic, 500, 3_000),
        train(4, monophasic, 500, 6_000),
        train(5, monophasic, 500, 7_000),
        train(6, biphasic, 50, 9_000),
        train(7, biphasic, 50, 9_070),
    ];
    trains[0].gap_us = 30;
    (trains[1].burst_count, trains[1].burst_interval_us) = (2, 400);
    let one_period = [
        (0, 1_000, 1_200, Cathodic),
        (0, 1_230, 1_430, Anodic),
        (1, 500, 600, Anodic),
        (1, 605, 705, Cathodic),
        (1, 900, 1_000, Anodic),
        (1, 1_005, 1_105, Cathodic),
        (2, 2_000, 2_500, Cathodic),
        (2, 2_500, 3_500, Grounded),
        (3, 2_000, 2_500, Grounded),
        (3, 3_000, 3_500, Cathodic),
        (3, 3_500, 4_500, Grounded),
        (4, 6_000, 6_500, Cathodic),
        (4, 6_500, 7_000, Grounded),
        (4, 7_500, 8_500, Grounded),
        (5, 7_000, 7_500, Cathodic),
        (5, 7_500, 8_500, Grounded),
        (6, 9_000, 9_050, Cathodic),
        (6, 9_055, 9_105, Anodic),
        (6, 9_105, 9_175, Grounded),
        (7, 9_000, 9_070, Grounded),
        (7, 9_070, 9_120, Cathodic),
        (7, 9_125, 9_175, Anodic),
    ];
    let stretches = [100_000, 120_000]
        .into_iter()
        .flat_map(|t| one_period.map(|(ch, from, to, state)| (ch, t + from, t + to, state)))
        .collect();
    let writes = [100_000, 120_000]
        .into_iter()
        .flat_map(|t| (0..8).map(move |ch| (t + 480, ch, 1_000)))
        .collect();
    let group = |kind, members: &[u8]| Group {
        kind,
        members: members.to_vec(),
    };
    let expected = Expectation {
        trains,
        groups: vec![
            group(GroupKind::Conducted, &[2, 3]),
            group(GroupKind::Isolated, &[4, 5]),
            group(GroupKind::Conducted, &[6, 7]),
        ],
        dead_time_us: 5,
        max_code: [1_000; CHANNELS],
        max_code_us: [500_000; CHANNELS],
        limits: Limits::default(),
        complete: true,
        end_us: 140_000,
    };
    Scene {
        stretches,
        writes,
        expected,
    }
}

impl Scene {
    pub(super) fn trace(&self) -> Trace {
        let mut edges: Vec<(u64, bool, u8, State)> = Vec::new();
        for &(channel, start_us, end_us, state) in &self.stretches {
            edges.push((start_us, true, channel, state));
            edges.push((end_us, false, channel, State::Isolated));
        }
        edges.sort_by_key(|&(t_us, starts, ..)| (t_us, starts));
        let mut trace = Trace::default();
        let mut levels = Levels::ISOLATED;
        for (t_us, _, channel, state) in edges {
            levels = levels.with_channel(channel, state);
            trace.record_levels(t_us, levels);
        }
        for &(t_us, channel, code) in &self.writes {
            trace.record_dac(t_us, channel, code);
        }
        trace.dac.sort_by_key(|write| write.t_us);
        trace
    }

    /// Returns the interval of a channel that starts at `t_us`.
    pub(super) fn at(&mut self, channel: u8, t_us: u64) -> &mut (u8, u64, u64, State) {
        self.stretches
            .iter_mut()
            .find(|stretch| (stretch.0, stretch.1) == (channel, t_us))
            .expect("a stretch starts there")
    }

    pub(super) fn remove(&mut self, channel: u8, t_us: u64) {
        self.stretches
            .retain(|stretch| (stretch.0, stretch.1) != (channel, t_us));
    }
}

/// Returns the violations after one change to the correct trace, as (time, channel, rule).
pub(super) fn after(change: impl FnOnce(&mut Scene)) -> Vec<(u64, u8, Rule)> {
    let mut scene = good();
    change(&mut scene);
    check(&scene.trace(), &scene.expected)
        .into_iter()
        .map(|found| (found.t_us, found.channel, found.rule))
        .collect()
}
