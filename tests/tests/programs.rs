//! A program of ten channels, judged at the pins by independent arithmetic: every on and off within
//! a period of its time, every burst of a ramp on its line, and the same edges from native, QEMU
//! and chip.

use hal_sim::trace::State;
use host_core::run::{DeviceName, SessionFile};
use std::fmt::Write as _;
use tests::desk::{PlayedSession, play};

const PERIOD_US: u64 = 20_000;
const ON_US: u64 = 2_000_000;
const OFF_US: u64 = 2_000_000;
const UP_US: u64 = 500_000;
const DOWN_US: u64 = 300_000;
const STAGGER_US: u64 = 370_001;
const DELAY_US: u64 = 100_000;
/// Full scale, µA, and its DAC code.
const FULL_SCALE_UA: f64 = 100_000.0;
const FULL_CODE: f64 = 65_535.0;

/// Returns ten channels at 50 Hz, 1.9 ms apart, each with its own amplitude: two seconds on and two
/// off, one after the other.
fn ten(seconds: u64) -> SessionFile {
    let mut text = format!(
        "title = \"Ten programs\"\nduration_s = {seconds}.0\n\n[wearer]\nrise_ms = 300\n\
         max_rms_ma = 10.0\nmax_charge_uc = 5.0\nmax_session_s = 3600\n"
    );
    for number in 1..=10 {
        let offset_us = (number - 1) * 1_900;
        let _ = write!(
            text,
            "\n[[channel]]\nnumber = {number}\nname = \"channel {number}\"\n\
             stage = {{ kind = \"current\", full_scale_ma = 100.0 }}\nlimit = 15.0\n\
             train = {{ shape = \"biphasic-cathodic-first\", width_us = 200, gap_us = 50, \
             frequency_hz = 50.0, offset_us = {offset_us} }}\n"
        );
    }
    for number in 1..=10 {
        let (value, delay_s) = (amplitude_ma(number), at_us(number, 0) as f64 / 1e6);
        let _ = write!(
            text,
            "\n[[program]]\nkind = \"on-off\"\nchannels = [{number}]\nvalue = {value:.1}\n\
             on_s = 2.0\noff_s = 2.0\nramp_up_s = 0.5\nramp_down_s = 0.3\ndelay_s = {delay_s:.6}\n"
        );
    }
    SessionFile::parse("ten_programs.toml", &text).unwrap_or_else(|why| panic!("{why:?}"))
}

fn amplitude_ma(number: u64) -> f64 {
    5.0 + 0.7 * number as f64
}

/// Returns the start of repetition `pass` of a channel, µs.
fn at_us(number: u64, pass: u64) -> u64 {
    DELAY_US + (number - 1) * STAGGER_US + pass * (ON_US + OFF_US)
}

/// Returns a channel's bursts until the session ends: time and code.
fn bursts(played: &PlayedSession, number: u64, end_us: u64) -> Vec<(u64, u16)> {
    let edges = played
        .edges()
        .filter(|edge| u64::from(edge.channel) + 1 == number);
    let begins = edges.filter(|edge| edge.state == State::Cathodic && edge.t_us < end_us);
    begins.map(|edge| (edge.t_us, edge.dac_code)).collect()
}

/// Compares every burst of a channel with the program. Returns the number of bursts and the largest
/// distance of a ramp's burst from its line, DAC steps.
fn judge(played: &PlayedSession, number: u64, end_us: u64) -> (usize, f64) {
    let full = amplitude_ma(number) * 1e3 / FULL_SCALE_UA * FULL_CODE;
    let (mut furthest, mut next) = (0.0_f64, 0);
    let bursts = bursts(played, number, end_us);
    for pass in 0.. {
        let on_us = at_us(number, pass);
        if on_us + PERIOD_US >= end_us {
            break;
        }
        let off_us = on_us + ON_US;
        let within: Vec<_> = bursts[next..]
            .iter()
            .take_while(|(t_us, _)| *t_us < off_us)
            .collect();
        next += within.len();
        let (first_us, last_us) = (within[0].0, within[within.len() - 1].0);
        // On at the first burst after its time, off at the first burst that is left out.
        assert!(
            (on_us..on_us + PERIOD_US).contains(&first_us),
            "{number}: on {first_us}"
        );
        let stop_us = off_us.min(end_us);
        assert!(last_us + PERIOD_US >= stop_us, "{number}: off {last_us}");
        for (place, (t_us, code)) in (0..).zip(&within) {
            assert_eq!(*t_us, first_us + place * PERIOD_US, "channel {number}");
            let since_us = (t_us - first_us) as f64;
            let period_us = PERIOD_US as f64;
            let up = (since_us + period_us) / (UP_US as f64 + period_us);
            let left_us = off_us.saturating_sub(*t_us) as f64;
            let down = left_us / DOWN_US as f64;
            let line = full * up.min(down).min(1.0);
            // In steps between the code and that of the line.
            furthest = furthest.max((f64::from(*code) - line.floor()).abs());
        }
    }
    assert_eq!(
        next,
        bursts.len(),
        "channel {number}: bursts outside its passes"
    );
    (next, furthest)
}

fn judge_all(played: &PlayedSession, seconds: u64) {
    assert!(played.outcome.error.is_none(), "{:?}", played.outcome.error);
    assert_eq!(played.outcome.refused, 0);
    let late = played.outcome.trial.counters.iter();
    let late = late.filter(|(name, _)| name == "setpoints that came late");
    assert_eq!(late.map(|(_, count)| *count).sum::<u64>(), 0);
    let (mut count, mut furthest) = (0, 0.0_f64);
    for number in 1..=10 {
        let (bursts, off) = judge(played, number, seconds * 1_000_000);
        count += bursts;
        furthest = furthest.max(off);
    }
    println!("{seconds} s: {count} bursts, at most {furthest:.2} DAC steps from their lines");
    assert!(furthest <= 1.0, "{furthest}");
}

#[test]
fn a_minute_of_ten_programs_is_as_it_is_written() {
    judge_all(&play(&ten(60), &DeviceName::Native), 60);
}

/// Run with `cargo test -p tests --test suite programs -- --ignored --nocapture`.
#[test]
#[ignore = "ten minutes of ten channels"]
fn ten_minutes_of_ten_programs_are_as_they_are_written() {
    judge_all(&play(&ten(600), &DeviceName::Native), 600);
}

fn edges(seconds: u64, device: &DeviceName) -> Vec<(u64, u8, State, u16)> {
    let played = play(&ten(seconds), device);
    judge_all(&played, seconds);
    let within = played
        .edges()
        .filter(|edge| edge.t_us < seconds * 1_000_000);
    let changes = within.map(|edge| (edge.t_us, edge.channel, edge.state, edge.dac_code));
    changes.collect()
}

fn same_edges(seconds: u64) {
    let native = edges(seconds, &DeviceName::Native);
    for device in [DeviceName::Qemu, DeviceName::Chip] {
        let other = edges(seconds, &device);
        let differs =
            (0..native.len().max(other.len())).find(|&index| native.get(index) != other.get(index));
        assert!(
            differs.is_none(),
            "{device}: {:?}",
            differs.map(|index| (native.get(index), other.get(index)))
        );
        println!("{} edges are the same on {device}", native.len());
    }
}

#[test]
fn programs_have_the_same_edges_on_native_qemu_and_chip() {
    same_edges(5);
}

/// Run with `cargo test --release -p tests --test suite programs -- --ignored --nocapture`.
#[test]
#[ignore = "half an hour: ten minutes of ten channels on the chip simulator and QEMU"]
fn ten_minutes_of_programs_have_the_same_edges_on_native_qemu_and_chip() {
    same_edges(600);
}

/// If the host dies, waiting orders of the program are not played.
#[test]
fn programs_end_with_their_host() {
    use host_core::link::Port;
    use host_core::run::{Attachments, StepLimit, Stepper};
    let file = ten(10);
    let port = DeviceName::Native.open(&file.session, 1).unwrap();
    let mut stepper = Stepper::open(&file, port, Attachments::default()).unwrap();
    stepper.configure().unwrap();
    stepper.arm().unwrap();
    stepper.start().unwrap();
    stepper.step(StepLimit::Time(3_000_000)).unwrap();
    let silent_us = stepper.port().now_us();
    let world = stepper.port().world().unwrap();
    world.run_until(silent_us + 1_000_000).unwrap();
    let edges = world.recorder.trace.edges_from(silent_us);
    let last = edges
        .filter(|edge| edge.state != State::Isolated && edge.dac_code > 0)
        .last();
    let last_us = last.unwrap().t_us - silent_us;
    let spec = &file.session.wearer;
    let allowed = (u64::from(spec.host_timeout_ms) + u64::from(spec.fall_ms)) * 1_000 + 2_000;
    println!("isolated {last_us} µs after the last word of the host, {allowed} allowed");
    assert!(last_us <= allowed, "{last_us}");
    assert!(
        last_us > 50_000,
        "it was not silence that ended it: {last_us}"
    );
}
