//! A wearer's allowance of time and charge since power-on, for every end of stimulation and every
//! reset, and the pause between electrode checks.

use crate::device_desk::*;
use firmware::link::message::ResetCause;
use firmware::link::{Code, Event, Request};
use firmware::pulse::{TrainSpec, Trigger};
use firmware::safety::{Fault, OPEN_US, RemainingAllowance, State, StopCause, WearerSpec};
use firmware::units::{Amplitude, Micros};

const BOOT: Micros = Micros::new(u32::MAX - 700_000);

/// End of a piece of stimulation.
#[derive(Clone, Copy, Debug)]
enum Exit {
    Stop,
    Silence,
    HandStop,
    Fault,
    Finish,
}

const EXITS: [Exit; 5] = [
    Exit::Stop,
    Exit::Silence,
    Exit::HandStop,
    Exit::Fault,
    Exit::Finish,
];

/// Returns a wearer whose host may be silent for a second, between `Start` and the end.
fn silent_host_wearer(max_session_s: u32) -> WearerSpec {
    WearerSpec {
        host_timeout_ms: 1_000,
        max_session_s,
        ..wearer()
    }
}

/// Returns the time from the first driven phase since `from` to the last, µs. Phases of the
/// electrode check lie before `from`.
fn driven_for(desk: &TestHost, from: u64) -> u64 {
    let driven = driven_starts(&desk.record.levels, 0);
    let mut since = driven.into_iter().filter(|t| *t >= from);
    let first = since.next();
    first.map_or(0, |first| since.next_back().unwrap_or(first) - first)
}

/// Plays about 0.6 s that end by `exit`, without a message of the host, and returns how long pulses
/// came, µs; `None` if the allowance was used up before.
fn play_piece(desk: &mut TestHost, exit: Exit, amplitude: u32) -> Option<u64> {
    if let Err(refused) = desk.answer(ARM) {
        assert_eq!(refused, refusal(Code::TimeOver, "max_session_s"));
        return None;
    }
    desk.expect_ok(Request::Start);
    let from = desk.since_boot_us();
    desk.expect_ok(equal_amplitudes(1, amplitude));
    match exit {
        Exit::Silence => desk.wait(1_100_000),
        Exit::Finish => desk.wait(700_000),
        _ => desk.wait(600_000),
    }
    match exit {
        Exit::Stop => desk.expect_ok(Request::Stop),
        Exit::HandStop => desk.sensors.hand_stop = false,
        Exit::Fault => desk.sensors.over_current = true,
        Exit::Silence | Exit::Finish => {}
    }
    desk.wait(60_000);
    desk.sensors = firmware::lockstep::Sensors::default();
    if desk.state() == State::Fault {
        assert_eq!(desk.fault(), Some(Fault::OverCurrent));
        desk.expect_ok(Request::Acknowledge);
        desk.wait(110_000);
    }
    assert_eq!(desk.state(), State::Idle, "{exit:?}");
    Some(driven_for(desk, from))
}

fn train(exit: Exit) -> TrainSpec {
    TrainSpec {
        repeats: if matches!(exit, Exit::Finish) { 31 } else { 0 },
        ..PLAIN
    }
}

/// Time is counted at every exit, although no frame comes between `Start` and the end of a piece.
#[test]
fn pieces_without_a_word_of_the_host_add_up_at_every_exit() {
    for exit in EXITS {
        let mut desk = TestHost::open(BOOT);
        desk.prepare(silent_host_wearer(2), &[without_rise(train(exit))]);
        let (mut pieces, mut sum) = (0, 0);
        while let Some(length) = play_piece(&mut desk, exit, 5_000) {
            (pieces, sum) = (pieces + 1, sum + length);
            assert!(pieces < 12, "{exit:?}: twelve pieces of 0.6 s in 2 s");
        }
        println!("{exit:?}: {pieces} pieces, {} ms", sum / 1_000);
        // The last fall ends when the allowance does; each piece may lack one period.
        assert!(sum <= 2_000_000, "{exit:?}: {sum} µs");
        assert!(sum > 1_700_000, "{exit:?}: {sum} µs is too little");
    }
}

/// Adds a reset after each piece, and one during each.
#[test]
fn no_reset_but_powers_gives_time_back() {
    for reset in [
        ResetCause::Software,
        ResetCause::Watchdog,
        ResetCause::Pin,
        ResetCause::BrownOut,
    ] {
        let mut desk = TestHost::open(BOOT);
        let (mut pieces, mut sum) = (0, 0);
        loop {
            desk.prepare(silent_host_wearer(2), &[channel(PLAIN)]);
            let Some(length) = play_piece(&mut desk, Exit::Stop, 5_000) else {
                break;
            };
            (pieces, sum) = (pieces + 1, sum + length);
            desk.reset(reset);
            assert!(pieces < 12, "{reset:?}");
        }
        // The copy of a piece that ended before the reset adds nothing.
        assert!(
            (1_800_000..=2_000_000).contains(&sum),
            "{reset:?}: {sum} µs"
        );
        desk.reset(ResetCause::PowerOn);
        desk.prepare(silent_host_wearer(2), &[channel(PLAIN)]);
        assert!(play_piece(&mut desk, Exit::Stop, 5_000).is_some());
    }
}

#[test]
fn a_reset_amid_stimulation_adds_a_quarter_second_at_most() {
    let mut desk = TestHost::open(BOOT);
    let (mut resets, mut sum) = (0, 0);
    loop {
        desk.prepare(silent_host_wearer(3), &[channel(PLAIN)]);
        if desk.answer(ARM).is_err() {
            break;
        }
        desk.expect_ok(Request::Start);
        let from = desk.since_boot_us();
        desk.expect_ok(equal_amplitudes(1, 5_000));
        desk.wait(317_000);
        sum += driven_for(&desk, from);
        desk.reset(ResetCause::Software);
        resets += 1;
        assert!(resets < 20);
    }
    println!(
        "{resets} resets amid pieces of 0.32 s, {} ms of 3 s",
        sum / 1_000
    );
    assert!(sum <= 3_000_000 + resets * u64::from(OPEN_US));
    // The reset came when 0.2 s had been written, and 0.25 s are added.
    assert_eq!(resets, 7);
}

#[test]
fn a_channels_charge_outlives_a_reset() {
    let limited = WearerSpec {
        max_dose_mc: 1,
        ..silent_host_wearer(100)
    };
    let mut desk = TestHost::open(BOOT);
    for _ in 0..20 {
        desk.prepare(limited, &[channel(PLAIN)]);
        if let Err(refused) = desk.answer(ARM) {
            assert_eq!(refused, refusal(Code::DoseReached, "max_dose_mc"));
            break;
        }
        desk.expect_ok(Request::Start);
        desk.expect_ok(equal_amplitudes(1, 20_000));
        desk.wait(600_000);
        desk.expect_ok(Request::Stop);
        desk.wait(60_000);
        desk.reset(ResetCause::Watchdog);
    }
    desk.prepare(limited, &[channel(PLAIN)]);
    assert_eq!(desk.refusal_code(ARM), Some(Code::DoseReached));
    let sum_nc = written_nc(&desk, 200);
    println!("{sum_nc} nC of 1 mC");
    assert!((980_000..=1_010_000).contains(&sum_nc), "{sum_nc}");
}

/// Returns the charge of one phase for every code written, as if each phase had `width_us`: more
/// than the electrode checks deliver, nC.
fn written_nc(desk: &TestHost, width_us: u64) -> u64 {
    let codes = desk.record.dac.iter().map(|&(_, _, code)| u64::from(code));
    codes
        .map(|code| code * 100_000 / 65_535 * width_us / 1_000)
        .sum()
}

/// Ten channels whose bursts coincide: none exceeds its own charge allowance by even one burst.
#[test]
fn no_burst_passes_the_dose() {
    let limited = WearerSpec {
        max_dose_mc: 1,
        fall_ms: 100,
        ..wearer()
    };
    let doublet = TrainSpec {
        burst_count: 2,
        burst_interval_us: 1_000,
        ..PLAIN
    };
    let mut desk = TestHost::open(BOOT);
    desk.run(limited, &[channel(doublet)], 0);
    desk.expect_ok(equal_amplitudes(1, 19_000));
    let (_, heard) = wait_until_stopped(&mut desk, 10);
    assert!(has_event(&heard, Event::Stopping(StopCause::DoseReached)));
    let pulses = desk.status().counters.pulses;
    let sum_nc = written_nc(&desk, 2 * 200);
    println!("{pulses} pulses, {sum_nc} nC of 1 mC");
    assert!((980_000..=1_005_000).contains(&sum_nc), "{sum_nc}");
}

#[test]
fn without_a_whole_copy_nothing_is_armed_until_power_comes_up() {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(silent_host_wearer(2), &[channel(PLAIN)]);
    play_piece(&mut desk, Exit::Stop, 5_000).unwrap();
    // One corrupt copy, either of them, does no harm.
    for copy in 0..2 {
        desk.board.allowance_copies_mut()[copy][7] ^= 1;
        desk.reset(ResetCause::Software);
        desk.prepare(silent_host_wearer(9), &[channel(PLAIN)]);
        desk.expect_ok(ARM);
        let left = desk.status().remaining.unwrap();
        assert!((8_200..8_500).contains(&left.time_ms), "{left:?}");
        desk.expect_ok(Request::Stop);
        desk.wait(2_000);
    }
    for words in desk.board.allowance_copies_mut() {
        words[7] ^= 1;
    }
    for reset in [ResetCause::Software, ResetCause::Pin, ResetCause::Watchdog] {
        desk.reset(reset);
        desk.prepare(silent_host_wearer(9), &[channel(PLAIN)]);
        let lost = refusal(Code::AllowanceLost, "max_session_s");
        assert_eq!(desk.expect_refusal(ARM), lost, "{reset:?}");
    }
    desk.reset(ResetCause::PowerOn);
    desk.prepare(silent_host_wearer(9), &[channel(PLAIN)]);
    desk.expect_ok(ARM);
    assert_eq!(desk.status().remaining.unwrap().time_ms, 9_000);
}

#[test]
fn status_tells_what_is_left() {
    let limited = WearerSpec {
        max_dose_mc: 2,
        ..silent_host_wearer(10)
    };
    let mut desk = TestHost::open(BOOT);
    assert_eq!(desk.status().remaining, None);
    desk.prepare(limited, &[channel(PLAIN), channel(PLAIN)]);
    desk.start();
    let full_allowance = RemainingAllowance {
        time_ms: 9_999,
        channel: 0,
        dose_uc: 2_000,
    };
    let left = desk.status().remaining.unwrap();
    assert!((9_990..10_000).contains(&left.time_ms), "{left:?}");
    assert_eq!(
        (left.channel, left.dose_uc),
        (full_allowance.channel, full_allowance.dose_uc)
    );
    // Only channel 2 emits pulses.
    desk.expect_ok(Request::Amplitudes {
        at: None,
        mask: 2,
        values: [Amplitude::new(20_000)].into_iter().collect(),
        widths: heapless::Vec::new(),
    });
    desk.keep_alive(25, 20_000);
    let left = desk.status().remaining.unwrap();
    println!("{left:?}");
    assert!((9_400..9_500).contains(&left.time_ms), "{left:?}");
    assert_eq!(left.channel, 1);
    assert!((1_885..1_915).contains(&left.dose_uc), "{left:?}");
}

/// A host that stops and arms repeatedly gets only a few check pulses.
#[test]
fn electrode_checks_keep_a_pause() {
    let slow = TrainSpec {
        period_us: 2_000_000,
        trigger: Some(Trigger::Start),
        ..PLAIN
    };
    for cut_us in [1_000, 6_000, 15_000, 30_000] {
        let mut desk = TestHost::open(BOOT);
        desk.prepare(wearer(), &[channel(slow)]);
        let end = desk.since_boot_us() + 5_000_000;
        while desk.since_boot_us() < end {
            desk.send(ARM);
            desk.wait(cut_us);
            desk.send(Request::Stop);
            desk.wait(1_000);
        }
        // A biphasic pulse has two driven phases.
        let starts: Vec<u64> = driven_starts(&desk.record.levels, 0);
        let within = |from: u64| {
            let second = from..from + 1_000_000;
            starts.iter().filter(|t| second.contains(*t)).count()
        };
        let most = starts.iter().map(|&t| within(t)).max().unwrap_or(0) / 2;
        println!("cut after {cut_us} µs: {most} check pulses in a second at most");
        assert!(most <= 24, "{most}");
    }
    // A host that has waited is not delayed, and a host that arms at once gets its answer within
    // half a second.
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[channel(slow)]);
    for (pause_us, at_most_us) in [(0, 26_000), (500_000, 26_000), (0, 426_000)] {
        desk.wait(pause_us);
        let from = desk.since_boot_us();
        desk.expect_ok(ARM);
        assert!(desk.since_boot_us() - from <= at_most_us, "{pause_us}");
        desk.expect_ok(Request::Stop);
    }
}
