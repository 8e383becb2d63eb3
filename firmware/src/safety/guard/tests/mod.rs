//! Tests of the table in the module's documentation, cell by cell.

mod states;

use super::*;
use crate::pulse::{Burst, BurstTime, Supply, TrainSpec, Trigger};
use crate::safety::{
    ChannelSpec, ListedPulse, PulseList, Reading, StageSpec, Stimuli, Sums, Timed, WearerSpec,
};
use crate::units::{Amplitude, MicroAmps, us};
use core::num::NonZeroU32;
use std::format;
use std::vec::Vec;

const NOW: Micros = Micros::new(u32::MAX - 1_000_000); // the clock wraps on the way

/// Returns a setup with one channel that waits for a trigger, so that its train never ends by
/// itself.
fn setup() -> Setup {
    let wearer = WearerSpec::default().validate().unwrap();
    let train = TrainSpec {
        repeats: 1,
        trigger: Some(Trigger::Start),
        ..TrainSpec::biphasic(200, 100, 20_000)
    };
    let stage = StageSpec::Current {
        full_scale_ua: 100_000,
    };
    let limit = Amplitude::new(20_000);
    let spec = ChannelSpec {
        train,
        stage,
        limit,
        start: limit,
        area_mm2: ChannelSpec::ASSUMED_AREA_MM2,
    };
    let mut channels = [None; CHANNELS];
    channels[0] = Some(spec.validate(&wearer).unwrap());
    Setup {
        wearer,
        channels,
        sums: Sums::of(&channels),
        groups: heapless::Vec::new(),
        sync: None,
        controlled: 0,
    }
}

/// Returns the time of a burst of that channel at `at`.
const fn begins(at: Micros) -> BurstTime {
    BurstTime {
        at,
        period_us: 20_000,
        opens: false,
    }
}

/// Returns a stimulus of `ua` for `width_us`; width 0 stands for the train's own.
const fn stimulus(ua: u32, width_us: u16) -> Stimulus {
    Stimulus {
        amplitude: Amplitude::new(ua),
        width_us,
    }
}

const CLOSED: Inputs = Inputs {
    arm: true,
    hand_stop: true,
    over_current: false,
    trigger: None,
    held: false,
    reading: None,
};

/// Returns a guard in the state of this name, and the scheduler that belongs to it.
fn guard_in(state: &str) -> (Guard, Scheduler) {
    let mut guard = Guard::new(None, UsageAtBoot::default());
    let mut scheduler = Scheduler::new();
    let tick = |guard: &mut Guard, now, inputs: &Inputs, scheduler: &Scheduler| {
        guard.tick(now, inputs, scheduler).unwrap();
    };
    let steps = match state {
        "Boot" => 0,
        "Idle" => 1,
        "Checking" => 2,
        "Armed" => 3,
        "Stimulating" => 4,
        "Stopping" => 5,
        _ => 1,
    };
    if steps > 0 {
        tick(&mut guard, NOW, &CLOSED, &scheduler);
    }
    if steps > 1 {
        guard.arm(&setup(), &CLOSED, NOW).unwrap();
        // The last of the check's four amplitudes begins 15 ms after its start; it is sampled.
        let pulse = NOW + us(15_000);
        guard.burst(0, begins(pulse)).code.unwrap();
        for (second, window) in [(false, 2), (true, 3)] {
            let reading = Some(Reading::from_current(0, second, MicroAmps::new(1_000)));
            let inputs = Inputs { reading, ..CLOSED };
            tick(
                &mut guard,
                pulse + us(window * WINDOW_US),
                &inputs,
                &scheduler,
            );
        }
    }
    if steps > 2 {
        let end = NOW + us(ElectrodeCheck::length_us());
        tick(&mut guard, end, &CLOSED, &scheduler);
    }
    if steps > 3 {
        guard.start(NOW).unwrap();
        scheduler.start(&setup().trains(), &[], None, NOW);
    }
    if steps > 4 {
        guard.stop(NOW).unwrap();
    }
    if matches!(state, "Fault" | "Grounding") {
        guard.fault(&FaultRecord::new(Fault::BrownOut, NOW), [0; CHANNELS]);
    }
    if state == "Grounding" {
        guard.acknowledge(NOW).unwrap();
    }
    (guard, scheduler)
}

fn name(guard: &Guard) -> &'static str {
    match guard.mode {
        Mode::Boot => "Boot",
        Mode::Idle => "Idle",
        Mode::Checking { .. } => "Checking",
        Mode::Armed { .. } => "Armed",
        Mode::Stimulating => "Stimulating",
        Mode::Stopping { .. } => "Stopping",
        Mode::Fault(_) => "Fault",
        Mode::Grounding { .. } => "Grounding",
    }
}

/// Returns the state after `event` in `state`, in the table's words; `let_go` opens the stop, the
/// key or both.
fn outcome(state: &str, event: &str, let_go: u8) -> &'static str {
    let (mut guard, scheduler) = guard_in(state);
    assert_eq!(name(&guard), state);
    let before = format!("{:?}", guard.mode);
    let tick = |guard: &mut Guard, now: Micros, inputs: &Inputs| {
        guard.tick(now, inputs, &scheduler).unwrap();
        true
    };
    let let_go = Inputs {
        hand_stop: let_go & Inputs::STOP == 0,
        arm: let_go & Inputs::KEY == 0,
        ..CLOSED
    };
    let is_accepted = match event {
        "`arm`" => guard.arm(&setup(), &CLOSED, NOW).is_ok(),
        "`start`" => guard.start(NOW).is_ok(),
        "`acknowledge`" => guard.acknowledge(NOW).is_ok(),
        "`stop`" => guard.stop(NOW).is_some() || name(&guard) == state,
        "`fault`" => {
            guard.fault(&FaultRecord::new(Fault::Panic, NOW), [0; CHANNELS]);
            true
        }
        "let go" => tick(&mut guard, NOW + us(2 * WINDOW_US), &let_go),
        "time is up" => tick(&mut guard, NOW + us(11_000_000), &CLOSED),
        other => panic!("{other}"),
    };
    let is_changed = format!("{:?}", guard.mode) != before;
    match (is_accepted, is_changed) {
        (false, is_changed) => {
            assert!(!is_changed, "{state} × {event}: refused, but changed");
            "refused"
        }
        (true, false) => "–",
        (true, true) => name(&guard),
    }
}

#[test]
fn the_chart_is_what_the_guard_does() {
    let rows: Vec<Vec<&str>> = include_str!("../mod.rs")
        .lines()
        .filter_map(|line| line.strip_prefix("//! | "))
        .map(|row| row.trim_end_matches(" |").split(" | ").collect())
        .collect();
    let (header, states) = rows.split_first().unwrap();
    assert_eq!((states.len(), header.len()), (8, 8));
    for row in states {
        for (event, expected) in header.iter().zip(row).skip(1) {
            for let_go in 1..=3 {
                let got = outcome(row[0], event, let_go);
                assert_eq!(got, *expected, "{} × {event} {let_go}", row[0]);
            }
        }
    }
}

/// The check ends with one phase read, with none, and with both.
#[test]
fn a_phase_that_owes_its_reading_is_told() {
    let denied = |phases: &[bool]| {
        let mut guard = Guard::new(None, UsageAtBoot::default());
        let scheduler = Scheduler::new();
        guard.tick(NOW, &CLOSED, &scheduler).unwrap();
        guard.arm(&setup(), &CLOSED, NOW).unwrap();
        let pulse = NOW + us(15_000);
        guard.burst(0, begins(pulse)).code.unwrap();
        for &second in phases {
            let reading = Some(Reading::from_current(0, second, MicroAmps::new(1_000)));
            let inputs = Inputs { reading, ..CLOSED };
            let now = pulse + us(2 * WINDOW_US);
            guard.tick(now, &inputs, &scheduler).unwrap();
        }
        let end = NOW + us(ElectrodeCheck::length_us());
        guard.tick(end, &CLOSED, &scheduler).unwrap()
    };
    let lost = Denial::PhaseLost { channel: 0 };
    let off = Denial::ElectrodeOff { channel: 0 };
    assert_eq!(denied(&[false]), Some(Notice::Checked(Err(lost))));
    assert_eq!(denied(&[true]), Some(Notice::Checked(Err(lost))));
    assert_eq!(denied(&[]), Some(Notice::Checked(Err(off))));
    assert_eq!(denied(&[false, true]), Some(Notice::Checked(Ok(()))));
}

/// The check's last amplitude begins 15 ms after its start; a reading that comes less than two
/// windows later belongs to the previous amplitude.
#[test]
fn a_reading_of_an_earlier_amplitude_passes_no_phase() {
    let off = Denial::ElectrodeOff { channel: 0 };
    for (after_us, verdict) in [(15_250, Err(off)), (15_500, Ok(()))] {
        let mut guard = Guard::new(None, UsageAtBoot::default());
        let scheduler = Scheduler::new();
        guard.tick(NOW, &CLOSED, &scheduler).unwrap();
        guard.arm(&setup(), &CLOSED, NOW).unwrap();
        guard.burst(0, begins(NOW + us(10_000))).code.unwrap();
        let applied = MicroAmps::new(guard.in_force[0].amplitude.get());
        for second in [false, true] {
            let reading = Some(Reading::from_current(0, second, applied));
            let inputs = Inputs { reading, ..CLOSED };
            guard.tick(NOW + us(after_us), &inputs, &scheduler).unwrap();
        }
        let end = NOW + us(ElectrodeCheck::length_us());
        let notice = guard.tick(end, &CLOSED, &scheduler);
        assert_eq!(notice, Ok(Some(Notice::Checked(verdict))), "{after_us}");
    }
}

/// Flips one bit of each value in the guard that decides whether and how much is output: the flip
/// is found at the start of the next refill, or when the channel's turn comes.
#[test]
fn a_bit_that_changes_by_itself_is_a_fault() {
    type Flip = fn(&mut Guard);
    let flips: [(&str, Flip); 17] = [
        ("state", |g| g.mode = Mode::Armed { since: NOW }),
        ("time of the last host frame", |g| g.heard += us(1 << 20)),
        ("hand-held stop", |g| g.held ^= Inputs::STOP),
        ("arm key", |g| g.held ^= Inputs::KEY),
        ("wanted amplitude", |g| {
            g.wanted[0].amplitude = Amplitude::new(1 << 10)
        }),
        ("amplitude in force", |g| {
            g.in_force[0].amplitude = Amplitude::new(1 << 10)
        }),
        ("wanted width", |g| g.wanted[0].width_us ^= 1 << 7),
        ("width in force", |g| g.in_force[0].width_us ^= 1),
        ("largest width", |g| {
            let channel = g.setup.as_mut().unwrap().channels[0].as_mut().unwrap();
            let spec = TrainSpec {
                max_width_us: 500,
                ..*channel.train.spec()
            };
            channel.train = spec.validate().unwrap();
        }),
        ("rise", |g| {
            let _ = g.rises[0].note_burst(begins(NOW), (1, 1));
        }),
        ("wanted amplitude of an unused channel", |g| {
            g.wanted[9].amplitude = Amplitude::new(1)
        }),
        ("what readings showed", |g| {
            let reading = Reading::from_current(0, false, MicroAmps::new(7_000));
            g.watches[0].record_check_load(reading, Amplitude::new(1 << 10));
        }),
        ("load at arming", |g| g.loads[0].raw ^= 1),
        ("limit", |g| {
            let channel = g.setup.as_mut().unwrap().channels[0].as_mut().unwrap();
            channel.limit = Amplitude::new(20_000 ^ 1 << 14);
        }),
        ("highest rate", |g| {
            let channel = g.setup.as_mut().unwrap().channels[0].as_mut().unwrap();
            channel.min_period_us ^= 1 << 13;
        }),
        ("controlled channels", |g| {
            g.setup.as_mut().unwrap().controlled ^= 1
        }),
        ("timeouts and fall", |g| {
            let spec = WearerSpec {
                host_timeout_ms: 1000,
                ..WearerSpec::default()
            };
            g.setup.as_mut().unwrap().wearer = spec.validate().unwrap();
        }),
    ];
    for (name, flip) in flips {
        let (mut guard, _) = guard_in("Stimulating");
        guard.renew_checksums();
        for _ in 0..8 * (CHANNELS + 1) {
            assert_eq!(guard.check_memory(), Ok(()), "{name}");
            guard.renew_checksums();
        }
        flip(&mut guard);
        let mut found = Ok(());
        for _ in 0..8 * (CHANNELS + 1) {
            found = found.and(guard.check_memory());
            guard.renew_checksums();
        }
        assert_eq!(found, Err(Fault::Memory), "{name}");
    }
}

/// A list that changes by itself is a fault at its next pulse.
#[test]
fn a_changed_list_is_left_out() {
    let (mut guard, _) = guard_in("Stimulating");
    let pulses = [(0, 5_000), (20_000, 6_000)].map(|(after_us, ua)| ListedPulse {
        after_us,
        amplitude: Amplitude::new(ua),
        width_us: 200,
    });
    let list = PulseList {
        channel: 0,
        pulses: pulses.into_iter().collect(),
    };
    assert_eq!(
        guard.play_list(&list, NOW),
        Err(Denial::NoLists { channel: 0 })
    );
    for spoil in [false, true] {
        let mut list = list.clone();
        guard.list = Playing::new(&list);
        guard.list_seal = Checksum::of(&guard.list);
        if spoil {
            list.pulses[1].width_us ^= 1 << 6;
            guard.list = Playing::new(&list);
        }
        let burst = guard.burst(0, begins(NOW));
        assert_eq!(burst.code.is_none(), spoil);
        let next_us = guard.burst_interval_us(0).map(NonZeroU32::get);
        assert_eq!(next_us, (!spoil).then_some(20_000));
        let found = if spoil { Err(Fault::Memory) } else { Ok(()) };
        assert_eq!(guard.check_no_mismatch(), found);
    }
}

/// A queued order is taken in the window of its time, but not if it has changed or its window has
/// passed; its checksum is verified while it waits.
#[test]
fn a_changed_order_that_waits_is_left_out() {
    let order = |at| Timed {
        seq: 1,
        at,
        stimuli: Stimuli {
            mask: 1,
            values: [Amplitude::new(5_000); CHANNELS],
            widths: [0; CHANNELS],
        },
    };
    let due = NOW + us(1_000);
    for (spoil, start, is_taken) in [
        (false, due, true),
        (false, due - us(WINDOW_US - 1), true),
        (false, due + us(1), false),
        (true, due, false),
    ] {
        let (mut guard, _) = guard_in("Stimulating");
        guard.queue_timed_order(&order(due), NOW).unwrap();
        guard.renew_checksums();
        if spoil {
            guard.waiting.clear();
            guard.waiting.push_spoiled(&order(due));
        }
        assert!(!guard.is_order_due(due) && guard.is_order_due(due + us(1)));
        let taken = guard.take_due_order(start + us(WINDOW_US - 1), start);
        assert_eq!(taken.map(|order| order.at), is_taken.then_some(due));
        assert_eq!(guard.check_no_mismatch().is_ok(), is_taken);
        assert_eq!(guard.waiting.first_due_time(), None);
    }
    let (mut guard, _) = guard_in("Stimulating");
    guard.queue_timed_order(&order(due), NOW).unwrap();
    guard.renew_checksums();
    let looks = 8 * (CHANNELS as u32 + 1);
    assert!((0..looks).all(|_| guard.check_memory().is_ok()));
    guard.waiting.clear();
    guard.waiting.push_spoiled(&order(due));
    assert!((0..looks).any(|_| guard.check_memory().is_err()));
}

#[test]
fn a_burst_of_a_changed_channel_is_left_out() {
    let (mut guard, _) = guard_in("Stimulating");
    guard
        .set_amplitudes([(0, stimulus(5_000, 0))].into_iter(), NOW)
        .unwrap();
    guard.renew_checksums();
    assert!(guard.burst(0, begins(NOW)).code.is_some());
    guard.renew_checksums();
    guard.wanted[0].amplitude = Amplitude::new(5_000 ^ 1 << 12);
    assert_eq!(guard.burst(0, begins(NOW)), Burst::SILENT);
    assert_eq!(guard.check_no_mismatch(), Err(Fault::Memory));
}

/// A setup whose memory changed is not started, even before the channel's turn for verification.
#[test]
fn a_setup_that_changed_by_itself_is_not_started() {
    let (mut guard, _) = guard_in("Armed");
    guard.renew_checksums();
    let channel = guard.setup.as_mut().unwrap().channels[0].as_mut().unwrap();
    channel.limit = Amplitude::new(20_000 ^ 1 << 14);
    let refused = Err(Denial::WrongState(State::Armed));
    assert_eq!(guard.start(NOW), refused);
    assert_eq!(guard.state(), State::Armed);
}

/// The fall begins in the microsecond in which the silence becomes too long, and has its full
/// length.
#[test]
fn a_silent_hosts_fall_begins_when_its_time_is_up() {
    let (mut guard, scheduler) = guard_in("Stimulating");
    let wearer = setup().wearer;
    let silent = NOW + us(wearer.host_timeout_us());
    let before = Micros::new(silent.get().wrapping_sub(WINDOW_US));
    assert_eq!(guard.tick(before, &CLOSED, &scheduler), Ok(None));
    let notice = Notice::Stopping(StopCause::HostSilent);
    assert_eq!(guard.tick(silent, &CLOSED, &scheduler), Ok(Some(notice)));
    let Mode::Stopping { fall, .. } = guard.mode else {
        panic!("{:?}", guard.mode);
    };
    assert_eq!(fall.end(), silent + us(wearer.fall_us()));
}

/// A channel has no burst before its first order and after an order of amplitude 0.
#[test]
fn a_channel_without_an_amplitude_has_no_burst() {
    let (mut guard, _) = guard_in("Stimulating");
    assert_eq!(guard.burst(0, begins(NOW)), Burst::SILENT);
    for (ua, is_burst) in [(5_000, true), (0, false)] {
        let order = [(0, stimulus(ua, 0))];
        guard.set_amplitudes(order.into_iter(), NOW).unwrap();
        guard.renew_checksums();
        let burst = guard.burst(0, begins(NOW));
        assert_eq!(burst.code.is_some(), is_burst, "{ua}");
        guard.renew_checksums();
    }
}

/// A control law that asks for the limit gets it; if it asks for more, it gets the limit. Neither
/// counts as slowed.
#[test]
fn a_law_that_asks_for_its_limit_is_not_slowed() {
    let (mut guard, _) = guard_in("Stimulating");
    for ua in [19_999, 20_000, 20_001] {
        assert!(
            !guard.set_control_amplitude(0, Amplitude::new(ua), NOW),
            "{ua}"
        );
        assert_eq!(guard.wanted[0].amplitude.get(), ua.min(20_000));
    }
}

/// A control law's period is kept within the bounds for which the limits were checked.
#[test]
fn a_laws_period_stays_within_what_was_checked() {
    let (mut guard, _) = guard_in("Stimulating");
    let channel = guard.setup.as_mut().unwrap().channels[0].as_mut().unwrap();
    (channel.min_period_us, channel.max_period_us) = (10_000, 40_000);
    let clamped = [9_999, 10_000, 20_000, 40_001].map(|us| guard.clamp_period(0, us));
    assert_eq!(clamped, [10_000, 10_000, 20_000, 40_000].map(Some));
    assert_eq!(guard.clamp_period(1, 20_000), None);
    assert_eq!(guard_in("Idle").0.clamp_period(0, 20_000), None);
}

#[test]
fn the_first_fault_is_kept_and_one_that_lasts_is_not_acknowledged() {
    let (mut guard, _) = guard_in("Stimulating");
    let fault_record = |notice| match notice {
        Notice::Faulted(record) => record,
        other => panic!("{other:?}"),
    };
    let first =
        fault_record(guard.fault(&FaultRecord::new(Fault::OverCurrent, NOW), [3; CHANNELS]));
    assert_eq!((first.fault, first.later_faults), (Fault::OverCurrent, 0));
    let later = NOW + us(500);
    for fault in [Fault::TapeSlip, Fault::OverCurrent, Fault::Memory] {
        let kept = fault_record(guard.fault(&FaultRecord::new(fault, later), [9; CHANNELS]));
        assert_eq!(
            (kept.fault, kept.at, kept.residual),
            (first.fault, NOW, [3; CHANNELS])
        );
    }
    let fault_bits = Fault::TapeSlip.bit() | Fault::Memory.bit();
    assert_eq!(
        fault_record(guard.fault(&FaultRecord::new(Fault::TapeSlip, later), [0; CHANNELS]))
            .later_faults,
        fault_bits
    );
    // After an acknowledgement, the next fault can latch.
    guard.acknowledge(later).unwrap();
    let next = fault_record(guard.fault(&FaultRecord::new(Fault::TimeBase, later), [0; CHANNELS]));
    assert_eq!((next.fault, next.later_faults), (Fault::TimeBase, 0));

    let lasting = FaultRecord {
        found_at_boot: true,
        ..FaultRecord::new(Fault::Flash, NOW)
    };
    let mut guard = Guard::new(Some(lasting), UsageAtBoot::default());
    let latched = Err(Denial::FaultLatched(Fault::Flash));
    assert_eq!(guard.acknowledge(NOW), latched);
    assert_eq!(guard.start(NOW), latched);
    assert!(guard.arm(&setup(), &CLOSED, NOW).is_err());
    assert_eq!(guard.state(), State::Fault);
}
