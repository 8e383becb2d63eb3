//! Over-current faults at any moment.

use crate::device_desk::*;
use crate::device_safety::{BOOT, running};
use crate::device_widths::stimuli;
use firmware::link::{Event, Request};
use firmware::lockstep::cost;
use firmware::pulse::{Levels, Shape, State as Line, TrainSpec};
use firmware::safety::{Fault, State};
use firmware::units::us;

/// Over-current at every microsecond of a pulse: the outputs are disconnected in that microsecond,
/// and the recorded residual charge equals that at the pins.
#[test]
fn over_current_truncates_and_records_the_charge_left() {
    let burst = TrainSpec {
        width_us: 95,
        gap_us: 0,
        period_us: 6_000,
        burst_count: 8,
        burst_interval_us: 200,
        ..PLAIN
    };
    let mono = TrainSpec {
        period_us: 6_000,
        shape: Shape::MonophasicAnodic,
        ..MONO
    };
    // The train plays at its largest width and not at its own.
    let slow = TrainSpec {
        width_us: 200,
        max_width_us: 300,
        gap_us: 137,
        period_us: 6_000,
        shape: Shape::BiphasicAnodicFirst,
        ..PLAIN
    };
    let mut seen = 0;
    for step in 0..1_700u32 {
        let mut desk = TestHost::open(BOOT + us(step * 991));
        desk.run(
            wearer(),
            &[channel(burst), channel(mono), channel(slow)],
            17_000,
        );
        desk.expect_ok(stimuli(&[(17_000, 95), (17_000, 200), (17_000, 300)]));
        desk.wait(13_000);
        let start = *driven_starts(&desk.record.levels, 1).last().unwrap() + 6_000;
        let until = start + u64::from(step) - desk.since_boot_us();
        desk.wait(until as u32);
        desk.sensors.over_current = true;
        let at = desk.since_boot_us();
        desk.wait(1);
        assert_eq!(
            desk.record.levels.last().map(|l| l.1),
            Some(Levels::ISOLATED)
        );
        desk.wait(30_000);
        assert!(desk.record.levels.last().unwrap().0 <= at, "replayed");
        let record = desk
            .take_messages()
            .into_iter()
            .find_map(|h| match h {
                OwnedResponse::Event(_, Event::Faulted(record)) => Some(record),
                _ => None,
            })
            .unwrap();
        assert_eq!(record.fault, Fault::OverCurrent);
        let trains = [(burst, 195), (mono, 1_200), (slow, 737)];
        for (c, (train, occupied)) in trains.iter().enumerate() {
            // The code in force at the fault, which then falls to zero.
            let written = |d: &&(u64, u8, u16)| d.1 == c as u8 && d.2 != 0;
            let code = i64::from(desk.record.dac.iter().rfind(written).unwrap().2);
            // First edge of the pulse that contains `at`.
            let intervals = line_intervals(&desk.record.levels, c, at);
            let first = intervals
                .iter()
                .enumerate()
                .filter(|(i, s)| {
                    let driven = matches!(s.1, Line::Anodic | Line::Cathodic);
                    let first_phase = (s.1 == Line::Cathodic) == train.shape.cathodic_first();
                    driven && first_phase && *i > 0
                })
                .map(|(_, s)| s.0)
                .next_back()
                .unwrap();
            let expected: i64 = if at - first >= *occupied {
                0
            } else {
                intervals
                    .iter()
                    .filter(|s| s.0 >= first)
                    .map(|s| {
                        let length = (s.2.min(at) - s.0.min(at)).cast_signed();
                        match s.1 {
                            Line::Anodic => length,
                            Line::Cathodic => -length,
                            _ => 0,
                        }
                    })
                    .sum()
            };
            assert_eq!(
                i64::from(record.residual[c]),
                expected * code,
                "step {step} channel {c}, {} µs into the pulse",
                at - first
            );
            seen += u32::from(expected != 0);
        }
        assert_eq!(desk.status().state, State::Fault);
        assert!(desk.answer(ARM).is_err());
    }
    println!("1700 instants, {seen} pulses truncated with charge left");
}

/// Over-current at every microsecond of the two windows before a pulse, one of which writes its
/// amplitude: the zeros come last, and nothing follows.
#[test]
fn amplitudes_are_zero_after_a_fault_at_any_moment_of_a_refill() {
    let mut cleared = 0;
    for step in 0..500u32 {
        let mut desk = running(0, wearer(), BOOT + us(step * 991));
        desk.wait(30_000);
        let pulse = *driven_starts(&desk.record.levels, 0).last().unwrap();
        let until = pulse + u64::from(2 * PLAIN.period_us - 500 + step) - desk.since_boot_us();
        desk.wait(until as u32);
        desk.sensors.over_current = true;
        let at = desk.since_boot_us();
        desk.wait(30_000);
        let dac = &desk.record.dac;
        assert!(dac.is_sorted_by_key(|d| d.0), "{step}: {dac:?}");
        let &(t, _, code) = dac.last().unwrap();
        assert_eq!(code, 0, "{step}");
        // A refill in progress writes first.
        let refill = u64::from(cost::REFILL_US);
        assert!(
            (at..at + refill).contains(&t),
            "{step}: at {at}, zero at {t}"
        );
        cleared += u32::from(t > at);
    }
    println!("500 instants, {cleared} of them during a refill");
    // Two windows, from 1 µs after the start of their refills to 1 µs before their end.
    assert_eq!(cleared, 2 * (cost::REFILL_US - 1));
}

#[test]
fn a_fault_while_grounding_is_latched_again() {
    let mut desk = running(0, wearer(), BOOT);
    desk.wait(10_000);
    desk.sensors.over_current = true;
    desk.wait(10);
    desk.sensors.over_current = false;
    desk.wait(1_000);
    desk.expect_ok(Request::Acknowledge);
    desk.wait(20_000);
    desk.sensors.over_current = true;
    desk.wait(200_000);
    assert_eq!(desk.state(), State::Fault);
    assert_eq!(desk.record.levels.last().unwrap().1, Levels::ISOLATED);
    desk.sensors.over_current = false;
    desk.expect_ok(Request::Acknowledge);
    desk.wait(110_000);
    assert_eq!(desk.state(), State::Idle);
    desk.expect_ok(ARM);
}
