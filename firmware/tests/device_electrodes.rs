//! Readings of the current: loads at arming, and electrodes that change during stimulation. Loads
//! are simulated.

use crate::device_arming::assert_balanced;
use crate::device_desk::*;
use firmware::link::{Code, Request};
use firmware::pulse::{State as Line, TrainSpec};
use firmware::safety::{ChannelSpec, Fault, StageSpec, State};
use firmware::units::{Amplitude, Micros};

const BOOT: Micros = Micros::new(u32::MAX - 100_000);

fn volts(train: TrainSpec, limit_mv: u32) -> ChannelSpec {
    ChannelSpec {
        stage: StageSpec::Voltage {
            full_scale_mv: 60_000,
            load_ohm: 2_000,
        },
        limit: Amplitude::new(limit_mv),
        ..channel(train)
    }
}

/// Repeats a wave of `length_us` until `until_s` or a fault, each time with the load that `ohm`
/// gives for the elapsed time. Returns the time, s.
fn play(desk: &mut TestHost, length_us: u32, until_s: f64, ohm: impl Fn(f64) -> u32) -> f64 {
    let mut at_s = 0.0;
    let mut since_frame = 0;
    while at_s < until_s && desk.state() == State::Stimulating {
        desk.sensors.load_ohm[0] = ohm(at_s);
        desk.wait(length_us);
        at_s += f64::from(length_us) * 1e-6;
        since_frame += length_us;
        if since_frame > 40_000 {
            desk.send(Request::KeepAlive);
            since_frame = 0;
        }
    }
    at_s
}

/// Returns the load, Ω, at which a channel whose load rises from 1 to 25 kΩ in 10 s causes a fault.
fn fault_load_ohm(spec: ChannelSpec, amplitude: u32) -> Option<u32> {
    let peeled = |s: f64| 1_000 + (24_000.0 * s / 10.0) as u32;
    let mut desk = TestHost::open(BOOT);
    desk.sensors.load_ohm = [1_000; 10];
    desk.run(wearer(), &[spec], amplitude);
    let at_s = play(&mut desk, 1_000, 10.0, peeled);
    if desk.state() == State::Stimulating {
        play(&mut desk, 1_000, 0.2, |_| 25_000);
    }
    let fault = desk.fault()?;
    assert_eq!(fault, Fault::LoadUnstable);
    assert_eq!(desk.state(), State::Fault);
    let ohm = peeled(at_s.min(10.0));
    println!("{spec:?} at {amplitude}: {ohm} Ω");
    Some(ohm)
}

/// A voltage stage detects four times the load at arming, to within the sense's two counts. A
/// current stage detects the end of its compliance, here 100 V.
#[test]
fn a_peeling_electrode_is_found() {
    for (amplitude, most_ohm) in [
        (20_000, 4_400),
        (5_000, 4_800),
        (2_000, 6_000),
        (500, 25_000),
    ] {
        let ohm = fault_load_ohm(volts(PLAIN, 20_000), amplitude);
        let ohm = ohm.unwrap_or_else(|| panic!("{amplitude} mV"));
        assert!((3_900..=most_ohm).contains(&ohm), "{amplitude} mV: {ohm} Ω");
    }
    for (amplitude, least_ohm, most_ohm) in [(20_000, 6_000, 6_700), (5_000, 24_000, 25_000)] {
        let ohm = fault_load_ohm(channel(PLAIN), amplitude);
        let ohm = ohm.unwrap_or_else(|| panic!("{amplitude} µA"));
        let range = least_ohm..=most_ohm;
        assert!(range.contains(&ohm), "{amplitude} µA: {ohm} Ω");
    }
}

/// The reference board cannot detect this: 1 mA into 25 kΩ is 25 V, far within compliance, and
/// nothing senses voltage (docs/reference/hardware.md).
#[test]
fn a_current_stage_within_its_compliance_shows_no_load() {
    assert_eq!(fault_load_ohm(channel(PLAIN), 1_000), None);
}

/// Every other pulse meets an open circuit, which is detected; then one in ten, which is not.
#[test]
fn a_contact_that_comes_and_goes_is_found() {
    for (spec, amplitude) in [(channel(MONO), 10_000), (volts(MONO, 20_000), 10_000)] {
        for (every, is_found) in [(2, true), (10, false)] {
            let mut desk = TestHost::open(BOOT);
            desk.run(wearer(), &[spec], amplitude);
            let period = |s: f64| (s / 0.02).round() as u32;
            let ohm = |s: f64| {
                if period(s) % every == 0 {
                    u32::MAX
                } else {
                    2_000
                }
            };
            play(&mut desk, 20_000, 1.0, ohm);
            let expected = is_found.then_some(Fault::LoadUnstable);
            assert_eq!(desk.fault(), expected, "{amplitude}, every {every}");
        }
    }
}

/// Lowers the load of a voltage stage to `ohm` after 0.2 s. Returns the fault and the seconds until
/// it is reported.
fn fault_after_load_drop(from_ohm: u32, ohm: u32, amplitude: u32) -> Option<(Fault, f64)> {
    let mut desk = TestHost::open(BOOT);
    desk.sensors.load_ohm = [from_ohm; 10];
    desk.run(wearer(), &[volts(PLAIN, amplitude)], amplitude);
    let at_s = play(
        &mut desk,
        1_000,
        0.5,
        |s| {
            if s < 0.2 { from_ohm } else { ohm }
        },
    );
    desk.fault().map(|fault| (fault, at_s - 0.2))
}

/// The limiter keeps the current at 20 mA, which the wearer may have.
#[test]
fn a_shorted_voltage_stage_is_found() {
    for from_ohm in [1_000, 3_000] {
        for (ohm, amplitude) in [(50, 2_000), (50, 5_000), (20, 15_000), (80, 19_000)] {
            let found = fault_after_load_drop(from_ohm, ohm, amplitude);
            let (fault, after_s) = found.unwrap_or_else(|| panic!("{amplitude} mV"));
            let is_short = matches!(fault, Fault::LoadUnstable | Fault::OverCurrent);
            assert!(is_short, "{amplitude} mV: {fault:?}");
            assert!(after_s <= 0.08, "{amplitude} mV: {after_s} s");
        }
    }
}

/// Three readings in a row differ far from the earlier load, although no limit is near.
#[test]
fn a_load_that_falls_and_stays_is_found() {
    let (fault, after_s) = fault_after_load_drop(2_000, 600, 5_000).unwrap();
    assert_eq!(fault, Fault::LoadUnstable);
    assert!(after_s <= 0.08, "{after_s} s");
    assert_eq!(
        fault_after_load_drop(2_000, 1_100, 5_000),
        None,
        "less than half"
    );
}

/// The load at arming already draws the limiter's current, so nothing has fallen.
#[test]
fn a_voltage_stage_at_its_full_current_stimulates() {
    for (ohm, amplitude) in [(1_000, 20_000), (970, 19_400), (777, 15_500)] {
        assert_eq!(
            fault_after_load_drop(ohm, ohm, amplitude),
            None,
            "{amplitude} mV, {ohm} Ω"
        );
    }
}

/// Runs a train in which one phase of channel 0 meets an open circuit, as with a broken line.
fn without_phase(lost: Line, train: TrainSpec, wait_us: u32) -> TestHost {
    let mut desk = TestHost::open(BOOT);
    desk.run(wearer(), &[channel(train)], 10_000);
    desk.wait(wait_us);
    let mut sent = 0;
    for step in 0..60_000 {
        if step % 4_000 == 0 {
            desk.send(Request::KeepAlive);
        }
        // The load applies to the window in which a phase ends.
        let state = desk.record.levels.last().unwrap().1.state(0);
        sent = if state == Line::Isolated {
            sent
        } else {
            state as u32
        };
        desk.sensors.load_ohm[0] = if sent == lost as u32 { u32::MAX } else { 2_000 };
        desk.wait(10);
        if desk.state() != State::Stimulating {
            break;
        }
    }
    desk
}

#[test]
fn a_phase_that_carries_nothing_is_found() {
    // With phases of 500 µs, the window around a middle contains one phase only.
    let train = TrainSpec::biphasic(500, 200, 20_000);
    for lost in [Line::Cathodic, Line::Anodic] {
        let mut desk = without_phase(lost, train, 30_000);
        assert_eq!(desk.fault(), Some(Fault::PhaseLost), "{lost:?}");
        assert_eq!(desk.state(), State::Fault);
    }
}

/// The pulse with the third bad reading ends before the outputs are disconnected, because the
/// window that is painted, here the second of two, plays to its end.
#[test]
fn a_fault_that_readings_tell_cuts_no_pulse() {
    let train = TrainSpec::biphasic(200, 50, 20_000);
    for (ohm, fault) in [(50, Fault::LoadUnstable), (u32::MAX, Fault::ElectrodeOff)] {
        // One of two pulses is read in its second phase.
        for breaks_us in (0..40_000).step_by(1_000) {
            let mut desk = TestHost::open(BOOT);
            desk.sensors.load_ohm = [1_000; 10];
            desk.run(wearer(), &[volts(train, 5_000)], 5_000);
            desk.keep_alive(1, 60_000);
            desk.keep_alive(1, breaks_us);
            desk.sensors.load_ohm[0] = ohm;
            desk.keep_alive(4, 30_000);
            let record = desk.status().fault.unwrap();
            assert_eq!(record.fault, fault, "{breaks_us}");
            let (fault_us, levels) = (desk.record.since_boot_us(record.at), &desk.record.levels);
            assert_balanced(levels, 0, breaks_us);
            let second = driven_starts(levels, 0).into_iter().next_back().unwrap();
            // Two windows after the pulse began, or one more if its second phase was read.
            assert!(
                (250..=750).contains(&(fault_us - second)),
                "{breaks_us}: {fault_us}"
            );
            assert!(
                levels.last().is_some_and(|last| last.0 < fault_us),
                "{breaks_us}"
            );
        }
    }
}

/// 2 V into 500 Ω: at the limit of 30 V the current would be 60 mA, where 20 mA are allowed.
#[test]
fn a_load_below_the_declared_one_is_judged_at_arming() {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[volts(PLAIN, 30_000)]);
    desk.sensors.load_ohm[0] = 500;
    assert_eq!(
        desk.expect_refusal(ARM),
        refusal(Code::LoadTooLow, "load_ohm")
    );
    assert_eq!(desk.state(), State::Idle);
    desk.sensors.load_ohm[0] = 1_500;
    desk.expect_ok(ARM);
    desk.expect_ok(Request::Stop);
    desk.wait(2_000);
    desk.prepare(wearer(), &[volts(PLAIN, 10_000)]);
    desk.sensors.load_ohm[0] = 500;
    desk.expect_ok(ARM);
}

/// The codes of the check rise from 1, and none is above that of the limit.
#[test]
fn the_check_rises_from_code_1_to_the_wearers_limit() {
    for (limit, last) in [(20_000, 655), (500, 327), (5, 3), (2, 1)] {
        let spec = ChannelSpec {
            limit: Amplitude::new(limit),
            ..channel(PLAIN)
        };
        let mut desk = TestHost::open(BOOT);
        desk.prepare(wearer(), &[spec]);
        let armed = desk.since_boot_us();
        desk.expect_ok(ARM);
        let codes: Vec<u16> = desk.record.dac.iter().map(|d| d.2).collect();
        assert_eq!(codes.len(), 4);
        assert_eq!((codes[0], codes[3]), (1, last), "{limit} µA");
        assert!(codes.is_sorted(), "{codes:?}");
        let length_us = desk.since_boot_us() - armed;
        assert!(length_us < 24_000, "{length_us}");
    }
}

/// A short circuit ends the check before the next rise. This simulator rounds to millivolts, so
/// code 1 shows nothing. At code 17 of 60 V, 16 mV, 1 Ω carries 16 mA; the next code would draw all
/// that the limiter allows.
#[test]
fn a_short_is_found_before_the_check_has_risen() {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[volts(PLAIN, 20_000)]);
    desk.sensors.load_ohm[0] = 1;
    assert_eq!(desk.refusal_code(ARM), Some(Code::ElectrodeShort));
    let most = desk.record.dac.iter().map(|d| d.2).max();
    assert!(most <= Some(17), "{most:?}");
}
