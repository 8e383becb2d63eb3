//! Every rule detects a trace that breaks it.

use super::super::*;
use super::scene::{Scene, after, train};
use crate::trace::{Polarity, State};

use State::{Anodic, Cathodic, Grounded};

#[test]
fn a_shifted_pulse_is_off_schedule() {
    let found = after(|scene| {
        for t_us in [101_000, 101_230] {
            let stretch = scene.at(0, t_us);
            (stretch.1, stretch.2) = (stretch.1 + 1, stretch.2 + 1);
        }
    });
    let nearest_us = Some(101_000);
    let off = (101_001, 0, Rule::OffSchedule { nearest_us });
    assert_eq!(found, [(101_000, 0, Rule::Missing { count: 1 }), off]);
}

#[test]
fn a_pulse_outside_the_active_stretch_or_without_a_train_is_off_schedule() {
    let found = after(|scene| scene.expected.trains[0].active_us.end = 121_000);
    let nearest_us = Some(101_000);
    assert_eq!(found, [(121_000, 0, Rule::OffSchedule { nearest_us })]);
    let found = after(|scene| scene.expected.trains.retain(|train| train.channel != 0));
    let alone = Rule::OffSchedule { nearest_us: None };
    assert_eq!(found, [(101_000, 0, alone), (121_000, 0, alone)]);
}

#[test]
fn a_third_pulse_in_a_doublet_is_off_schedule() {
    let found = after(|scene| {
        scene.stretches.push((1, 101_300, 101_400, Anodic));
        scene.stretches.push((1, 101_405, 101_505, Cathodic));
    });
    let nearest_us = Some(100_900);
    assert_eq!(found[0], (101_300, 1, Rule::OffSchedule { nearest_us }));
}

#[test]
fn a_longer_gap_moves_two_edges() {
    let found = after(|scene| {
        let stretch = scene.at(0, 101_230);
        (stretch.1, stretch.2) = (101_231, 101_431);
    });
    let due = |expected_us| Rule::EdgeTime { expected_us };
    let edges = [(101_231, 0, due(101_230)), (101_431, 0, due(101_430))];
    assert_eq!(found, edges);
}

/// Doublets whose width may change: a burst may have its own width, but not two different widths, a
/// width above the maximum, or too much charge.
#[test]
fn a_live_width_holds_for_a_burst_within_its_bounds() {
    let widen = |scene: &mut Scene, pulses: &[u64], by_us: u64| {
        for &t_us in pulses {
            let first = scene.at(1, t_us);
            first.2 += by_us;
            let second = scene.at(1, t_us + 105);
            (second.1, second.2) = (second.1 + by_us, second.2 + 2 * by_us);
        }
    };
    let burst = [120_500, 120_900];
    let live = |change: &dyn Fn(&mut Scene)| {
        after(|scene| {
            scene.expected.trains[1].widest_us = Some(150);
            change(scene);
        })
    };
    assert_eq!(live(&|scene| widen(scene, &burst, 50)), []);
    let rule = |t_us, rule| (t_us, 1, rule);
    let (width_us, first_us) = (130, 100);
    let found = live(&|scene| widen(scene, &burst[1..], 30));
    assert_eq!(
        found,
        [rule(120_900, Rule::WidthInBurst { width_us, first_us })]
    );
    let found = live(&|scene| widen(scene, &burst, 51));
    assert_eq!(found, burst.map(|t| rule(t, Rule::Width { width_us: 151 })));
    let found = live(&|scene| {
        scene.expected.max_code_us[1] = 149_999;
        widen(scene, &burst, 50);
    });
    let (code_us, max) = (150_000, 149_999);
    assert_eq!(
        found,
        burst.map(|t| rule(t, Rule::PhaseCharge { code_us, max }))
    );
    // With a fixed width, the edges are late.
    let found = after(|scene| widen(scene, &burst, 50));
    assert!(
        found
            .iter()
            .all(|finding| matches!(finding.2, Rule::EdgeTime { .. })),
        "{found:?}"
    );
    assert_eq!(found.len(), 6);
}

#[test]
fn unequal_phases_leave_charge() {
    let found = after(|scene| scene.at(0, 101_230).2 -= 1);
    assert!(found.contains(&(101_000, 0, Rule::Charge { net: -1_000 })));
    let expected_us = 101_430;
    assert!(found.contains(&(101_429, 0, Rule::EdgeTime { expected_us })));
}

#[test]
fn the_wrong_polarity_or_number_of_phases_is_a_wrong_shape() {
    let found = after(|scene| {
        scene.at(0, 101_000).3 = Anodic;
        scene.at(0, 101_230).3 = Cathodic;
    });
    assert_eq!(found, [(101_000, 0, Rule::Shape)]);
    let found = after(|scene| scene.remove(0, 101_230));
    assert!(found.contains(&(101_000, 0, Rule::Shape)));
    assert!(found.contains(&(101_200, 0, Rule::Discharge)));
}

#[test]
fn missing_pulses_are_reported_only_if_all_must_come() {
    let remove = |scene: &mut Scene| {
        for t_us in [100_900, 101_005, 120_500, 120_605] {
            scene.remove(1, t_us);
        }
    };
    assert_eq!(after(remove), [(100_900, 1, Rule::Missing { count: 2 })]);
    let found = after(|scene| {
        remove(scene);
        scene.expected.complete = false;
    });
    assert_eq!(found, []);
    let found = after(|scene| scene.stretches.retain(|stretch| stretch.0 != 0));
    assert_eq!(found, [(101_000, 0, Rule::Missing { count: 2 })]);
}

#[test]
fn a_dac_write_inside_a_burst_is_caught() {
    // Between the pulses of the doublet: changes no pulse's charge.
    let found = after(|scene| scene.writes.push((100_800, 1, 900)));
    assert_eq!(found, [(100_800, 1, Rule::DacDuringBurst)]);
    // Inside a phase.
    let found = after(|scene| scene.writes.push((101_100, 0, 900)));
    assert!(found.contains(&(101_100, 0, Rule::DacDuringBurst)));
    assert!(found.contains(&(101_000, 0, Rule::Charge { net: -10_000 })));
    // The burst is over at its last edge.
    assert_eq!(after(|scene| scene.writes.push((101_105, 1, 900))), []);
}

#[test]
fn a_late_dac_write_is_caught() {
    let found = after(|scene| scene.writes.push((100_981, 0, 900)));
    assert_eq!(found, [(100_981, 0, Rule::DacLate { lead_us: 19 })]);
    assert_eq!(after(|scene| scene.writes.push((100_980, 0, 900))), []);
}

#[test]
fn the_greatest_code_is_per_channel() {
    let found = after(|scene| scene.expected.max_code[3] = 999);
    let (code, max) = (1_000, 999);
    let rule = Rule::Code { code, max };
    assert_eq!(found, [(103_000, 3, rule), (123_000, 3, rule)]);
}

#[test]
fn widths_are_limited_also_of_a_pulse_that_never_ends() {
    let found = after(|scene| scene.at(0, 101_230).2 = 101_231 + 500);
    assert!(found.contains(&(101_000, 0, Rule::Width { width_us: 501 })));
    let found = after(|scene| scene.at(0, 101_230).2 = 101_239);
    assert!(found.contains(&(101_000, 0, Rule::Width { width_us: 9 })));
    let stuck = after(|scene| scene.stretches.push((9, 139_000, 140_000, Anodic)));
    assert!(stuck.contains(&(139_000, 9, Rule::Width { width_us: 1_000 })));
}

#[test]
fn polarity_may_not_reverse_within_the_dead_time() {
    let found = after(|scene| scene.at(1, 100_500).2 = 100_601);
    assert!(found.contains(&(100_601, 1, Rule::DeadTime { gap_us: 4 })));
    let found = after(|scene| scene.at(1, 100_500).2 = 100_605);
    assert!(found.contains(&(100_605, 1, Rule::DeadTime { gap_us: 0 })));
    // Grounding does not replace the dead time.
    let found = after(|scene| {
        scene.at(1, 100_500).2 = 100_601;
        scene.stretches.push((1, 100_601, 100_605, Grounded));
    });
    assert!(found.contains(&(100_601, 1, Rule::DeadTime { gap_us: 4 })));
}

#[test]
fn bursts_may_not_follow_too_fast_also_across_trains() {
    let found = after(|scene| {
        scene.expected.trains[0].active_us.end = 121_001;
        let mut second = train(0, Shape::Biphasic(Polarity::Cathodic), 200, 0);
        (second.gap_us, second.epoch_us, second.active_us) = (30, 125_999, 125_999..126_000);
        scene.expected.trains.push(second);
        scene.stretches.push((0, 125_999, 126_199, Cathodic));
        scene.stretches.push((0, 126_229, 126_429, Anodic));
    });
    assert_eq!(found, [(125_999, 0, Rule::Repetition { since_us: 4_999 })]);
}

#[test]
fn monophasic_pulses_are_discharged_in_time() {
    // Late, short and absent grounding.
    let found = after(|scene| scene.at(3, 103_500).1 = 103_501);
    let late = (103_500, 3, Rule::GroundingMissing { for_us: 1 });
    assert_eq!(found, [(103_500, 3, Rule::Discharge), late]);
    let found = after(|scene| scene.at(3, 103_500).2 = 104_499);
    let short = (104_499, 3, Rule::GroundingMissing { for_us: 1 });
    assert_eq!(found, [(103_500, 3, Rule::Discharge), short]);
    let found = after(|scene| scene.remove(3, 123_500));
    let absent = Rule::GroundingMissing { for_us: 1_000 };
    assert_eq!(
        found,
        [(123_500, 3, absent)],
        "no later pulse, but too short"
    );
    let found = after(|scene| scene.at(3, 103_500).2 = 104_501);
    let long = Rule::GroundingUnexpected { for_us: 1 };
    assert_eq!(found, [(104_500, 3, long)]);
}

#[test]
fn interrupted_discharge_starts_again_in_full() {
    let found = after(|scene| scene.at(4, 107_500).2 = 108_000);
    let half = (108_000, 4, Rule::GroundingMissing { for_us: 500 });
    assert_eq!(
        found,
        [(106_500, 4, Rule::Discharge), half],
        "two halves are no whole"
    );
}

#[test]
fn conducted_members_are_grounded_while_another_pulses() {
    let found = after(|scene| scene.at(3, 102_000).1 = 102_001);
    assert_eq!(found, [(102_000, 3, Rule::NotConducted { for_us: 1 })]);
    // The gap between the phases counts, and so does the rest after an overlap.
    let found = after(|scene| scene.at(7, 109_000).2 = 109_052);
    assert_eq!(found, [(109_052, 7, Rule::NotConducted { for_us: 18 })]);
    let found = after(|scene| scene.remove(6, 109_105));
    assert_eq!(found, [(109_105, 6, Rule::NotConducted { for_us: 70 })]);
}

#[test]
fn isolated_members_are_isolated_while_another_pulses() {
    let found = after(|scene| scene.at(4, 106_500).2 = 107_001);
    assert_eq!(found, [(107_000, 4, Rule::NotIsolated { for_us: 1 })]);
    let found = after(|scene| scene.expected.groups[2].kind = GroupKind::Isolated);
    assert!(found.contains(&(109_070, 6, Rule::Overlap)));
    assert!(found.contains(&(109_070, 7, Rule::Overlap)));
    assert!(found.contains(&(109_000, 7, Rule::NotIsolated { for_us: 70 })));
}

#[test]
fn grounding_without_reason_is_caught() {
    let found = after(|scene| scene.stretches.push((8, 110_000, 110_001, Grounded)));
    let rule = Rule::GroundingUnexpected { for_us: 1 };
    assert_eq!(found, [(110_000, 8, rule)]);
}
