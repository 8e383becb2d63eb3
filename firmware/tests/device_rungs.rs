//! Muscle models on the device: each emitted pulse reaches its model at its own microsecond, and
//! the model level can change during stimulation.

use crate::device_desk::*;
use crate::muscle_ladder::twins::{self, FatigueMode, Muscle, Pulse};
use firmware::link::{Code, Request, Telemetry};
use firmware::muscle::{CalciumForceSpec, FatigueSpec, MuscleLevel, MuscleSpec, RecruitmentSpec};
use firmware::pulse::TrainSpec;
use firmware::units::{Amplitude, Micros};

/// Boot time; the clock wraps while the trains run.
const BOOT: Micros = Micros::new(u32::MAX - 700_000);

/// Subject K05 of Lee 2020, table 4, with the shortest time constant.
const K05: Muscle = Muscle {
    a: 130.8,
    k: 0.012,
    tau_c: 0.0115,
    tau1: 0.005,
    tau2: 0.1241,
};

pub const SPEC: MuscleSpec = MuscleSpec {
    force: CalciumForceSpec {
        a_mn_per_s: 130_800,
        k_micro: 12_000,
        tau_c_us: 11_500,
        tau1_us: 5_000,
        tau2_us: 124_100,
    },
    recruitment: RecruitmentSpec {
        motor_threshold: Amplitude::new(2_000),
        limit: Amplitude::new(20_000),
        reference: Amplitude::new(20_000),
        // The curve is so flat that a DAC code determines the gain within 0.002 %.
        slope_micro: 10_000,
    },
    fatigue: Some(FatigueSpec::QUADRICEPS),
    level: MuscleLevel::CalciumForce,
};

const AMPLITUDE: u32 = 15_000;

/// Returns three channels whose pulses never coincide with a tick: doublets to octuplets, and a
/// plain train at an odd rate.
fn trains() -> [TrainSpec; 3] {
    let burst = |count, interval, period, offset| TrainSpec {
        period_us: period,
        offset_us: offset,
        burst_count: count,
        burst_interval_us: interval,
        ..MONO
    };
    [
        burst(1, 0, 23_457, 313),
        burst(3, 5_003, 61_379, 717),
        TrainSpec {
            width_us: 50,
            ..burst(8, 1_301, 90_007, 1)
        },
    ]
}

fn armed(level: MuscleLevel) -> TestHost {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &trains().map(channel));
    for channel in 0..3 {
        let spec = MuscleSpec { level, ..SPEC };
        desk.expect_ok(Request::Muscle { channel, spec });
    }
    desk.expect_ok(ARM);
    desk
}

fn stimulate(level: MuscleLevel) -> TestHost {
    let mut desk = armed(level);
    desk.expect_ok(Request::Start);
    desk.expect_ok(equal_amplitudes(3, AMPLITUDE));
    desk
}

/// Returns the samples of the next `ms`, with keep-alives.
fn sample(desk: &mut TestHost, ms: u32) -> Vec<Telemetry> {
    desk.expect_ok(Request::Subscribe { period_ms: 1 });
    let mut samples = vec![];
    for _ in 0..ms / 10 {
        desk.send(Request::KeepAlive);
        desk.wait(10_000);
        samples.extend(desk.samples());
    }
    samples
}

/// Returns the gain of a pulse from its DAC code.
fn gain(desk: &TestHost, channel: usize, at: u64) -> f64 {
    let writes = desk.record.dac.iter();
    let mut before = writes.filter(|&&(t, c, _)| t <= at && usize::from(c) == channel);
    let code = before.next_back().map_or(0, |&(.., code)| code);
    let microampere = (f64::from(code) / 65_536.0 * 100_000.0).round();
    let (_, recruitment) = SPEC.validate().unwrap();
    let gain = recruitment.gain(Amplitude::new(microampere as u32));
    gain.get().to_num()
}

/// Compares the force in telemetry with a reference model driven by the pulses at the pins.
#[test]
fn every_pulse_counts_at_its_own_microsecond() {
    let mut desk = armed(MuscleLevel::CalciumForce);
    // The electrode check emits pulses of its own.
    let (checked, started) = (desk.status().counters.pulses, desk.since_boot_us());
    desk.expect_ok(Request::Start);
    desk.expect_ok(equal_amplitudes(3, AMPLITUDE));
    let samples = sample(&mut desk, 1_500);
    desk.expect_ok(Request::Stop);
    desk.wait(300_000);
    // Ticks differ by a few µs from whole milliseconds after boot.
    let times: Vec<u64> = samples
        .iter()
        .map(|s| desk.record.since_boot_us(s.at))
        .collect();
    let phase = times[0] % 1000;
    let mut emitted = 0;
    for channel in 0..3 {
        // Each pulse has one phase.
        let mut edges = driven_starts(&desk.record.levels, channel);
        edges.retain(|&at| at >= started);
        let pulses: Vec<Pulse> = edges
            .iter()
            .map(|&at| (at - phase, gain(&desk, channel, at)))
            .filter(|&(_, gain)| gain > 0.0)
            .collect();
        emitted += edges.len();
        let (truth, _) = twins::tiring(
            &K05,
            FatigueMode::Never,
            &pulses,
            times[times.len() - 1] / 1000,
        );
        let peak = truth.iter().copied().fold(0.0, f64::max);
        let off = samples.iter().zip(&times).map(|(sample, at)| {
            assert_eq!(at % 1000, phase);
            let model = f64::from(sample.forces_mn[channel].unwrap()) * 1e-3;
            (model - truth[(at / 1000) as usize]).abs()
        });
        let worst = off.fold(0.0, f64::max);
        println!(
            "channel {channel}: {} pulses, {:.4} % of {peak:.3} N",
            edges.len(),
            worst / peak * 100.0
        );
        // Telemetry itself has a resolution of half a mN.
        assert!(worst <= 2e-4 * peak + 5e-4, "{worst} of {peak}");
    }
    assert_eq!((desk.status().counters.pulses - checked) as usize, emitted);
}

fn force_mn(desk: &mut TestHost) -> Vec<Option<u32>> {
    let samples = sample(desk, 10);
    samples.last().unwrap().forces_mn.to_vec()
}

#[test]
fn every_rung_tells_the_force_that_it_predicts() {
    for level in MuscleLevel::ALL {
        let mut desk = stimulate(level);
        sample(&mut desk, 600);
        let forces = force_mn(&mut desk);
        println!("{level:?}: {forces:?} mN");
        assert_eq!(forces.len(), 3);
        let is_told = |mn: &Option<u32>| match level {
            MuscleLevel::None => mn.is_none(),
            _ => mn.is_some_and(|mn| mn > 1_000),
        };
        assert!(forces.iter().all(is_told), "{level:?}: {forces:?}");
    }
}

/// For every change between two model levels that predict, the next sample differs by no more than
/// a muscle moves in a tick. From a level without prediction, force begins at zero.
#[test]
fn a_rung_changes_without_a_step() {
    for from in MuscleLevel::ALL {
        for level in MuscleLevel::ALL {
            let mut desk = stimulate(from);
            sample(&mut desk, 400);
            desk.expect_ok(Request::Subscribe { period_ms: 1 });
            desk.take_messages();
            desk.wait(500);
            desk.send(Request::MuscleLevel { channel: 0, level });
            desk.wait(3_000);
            let samples = desk.samples().into_iter();
            let forces: Vec<Option<u32>> = samples.map(|s| s.forces_mn[0]).collect();
            println!("{from:?} to {level:?}: {forces:?}");
            let last = *forces.last().unwrap();
            assert_eq!(last.is_none(), level == MuscleLevel::None, "{forces:?}");
            let reported_mn: Vec<i64> = forces.iter().flatten().map(|&mn| mn.into()).collect();
            let step = reported_mn.windows(2).map(|w| (w[1] - w[0]).abs()).max();
            // K05 holds some 15 N; its rise and fall take 5 ms or more.
            assert!(step.unwrap_or(0) <= 750, "{forces:?}");
            if from == MuscleLevel::None && level != from {
                assert!(reported_mn[0] <= 750, "{forces:?}");
            }
        }
    }
}

#[test]
fn a_rung_is_refused_by_name() {
    let level = |channel, level| Request::MuscleLevel { channel, level };
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[channel(MONO), channel(MONO)]);
    let spec = MuscleSpec {
        fatigue: None,
        ..SPEC
    };
    desk.expect_ok(Request::Muscle { channel: 0, spec });
    let early = desk.expect_refusal(level(0, MuscleLevel::CalciumForce));
    assert_eq!(early, (Code::NotArmed, "state".into()));
    let spec = MuscleSpec {
        level: MuscleLevel::CalciumForceFatigue,
        ..spec
    };
    let tireless = desk.expect_refusal(Request::Muscle { channel: 0, spec });
    assert_eq!(tireless, (Code::NoFatigue, "fatigue".into()));
    desk.expect_ok(ARM);
    desk.expect_ok(level(0, MuscleLevel::None));
    let bare = desk.expect_refusal(level(1, MuscleLevel::CalciumForce));
    assert_eq!(bare, (Code::NoMuscle, "muscle".into()));
    let none = desk.expect_refusal(level(10, MuscleLevel::CalciumForce));
    assert_eq!(none, (Code::OutOfRange, "channel".into()));
    let tireless = desk.expect_refusal(level(0, MuscleLevel::CalciumForceFatigue));
    assert_eq!(tireless, (Code::NoFatigue, "fatigue".into()));
}
