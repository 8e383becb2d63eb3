//! The elbow on its test rig: torque from force and moment arm, a wire that can only pull, and
//! neighbouring muscles.

use hal_sim::body::bench::arms::{Muscle, Source, arm_m};
use hal_sim::body::bench::elbow::{fibre_length, force_length};
use hal_sim::body::bench::{
    CellSide, IsometricElbow, IsometricSpec, Pool, RigMuscle, SensorSpec, StrengthDuration,
};
use hal_sim::body::muscle::Parameters;
use hal_sim::body::{Body, Drive, Pulse};

/// Returns a muscle that is recruited from 20 mA at 35 µs, and completely at 60 mA.
fn muscle(muscle: Muscle, force_n: f64, reached: [f64; 2]) -> RigMuscle {
    RigMuscle {
        muscle,
        force_n,
        pool: Pool::new(20.0, 40.0, 5.0).unwrap(),
        strength: StrengthDuration {
            chronaxie_us: 200.0,
            reference_us: 35.0,
        },
        reached,
        length_at_90: 1.0,
        dynamics: Parameters::mean_subject_at_50_hz(),
    }
}

fn bench(muscles: Vec<RigMuscle>) -> IsometricSpec {
    IsometricSpec {
        included_deg: 90.0,
        source: Source::RankinNeptune,
        has_force_length: true,
        channels: [0, 1],
        muscles,
        contraction: 1.0,
        electromechanical_delay_us: 25_000,
        holds: CellSide::Extension,
        cell: SensorSpec {
            lever_m: 0.25,
            believed_lever_m: 0.25,
            noise_n: 0.0,
            offset_n: 0.0,
            drift_n_per_s: 0.0,
            ..SensorSpec::default()
        },
        load_ohm: 1_000.0,
    }
}

/// Stimulates for two seconds at 50 Hz, and returns the mean torque and load-cell reading of the
/// last period.
fn held(spec: &IsometricSpec, channel: usize, current_ma: f64, width_us: u32) -> [f64; 2] {
    let mut arm = IsometricElbow::new(spec.clone(), 1).unwrap();
    let mut sums = [0.0; 2];
    for at_ms in 0..2_000 {
        if at_ms % 20 == 0 {
            arm.pulse(&Pulse {
                t_us: at_ms * 1_000,
                channel,
                drive: Drive::Milliamps(current_ma),
                width_us,
                conducted: false,
            });
        }
        arm.advance((at_ms + 1) * 1_000);
        if at_ms >= 1_980 {
            sums[0] += arm.extension_nm() / 20.0;
            sums[1] += arm.instrument_n().unwrap() / 20.0;
        }
    }
    sums
}

#[test]
fn torque_is_force_times_arm_times_what_length_leaves() {
    let spec = bench(vec![muscle(Muscle::TricepsMedial, 100.0, [1.0, 0.0])]);
    let [nm, n] = held(&spec, 0, 80.0, 35);
    let arm = -arm_m(Source::RankinNeptune, Muscle::TricepsMedial, 90.0).unwrap();
    // Computed by hand: 188.8 mm of muscle minus 90.8 mm of tendon, relative to 113.8 mm.
    let length = fibre_length(Muscle::TricepsMedial, 1.0, 90.0).unwrap();
    assert!((length - 0.8612).abs() < 2e-4, "{length}");
    assert!((force_length(length) - 0.9622).abs() < 2e-4);
    let expected = 100.0 * arm * force_length(length);
    assert!((nm / expected - 1.0).abs() < 0.01, "{nm} for {expected}");
    // The load cell measures the torque divided by its lever arm.
    assert!((n * 0.25 / nm - 1.0).abs() < 1e-6);
}

/// By the strength–duration relation, 35 mA × 300 µs equals 141 mA × 35 µs, to the last digit of
/// the mean torque.
#[test]
fn width_trades_for_current() {
    let spec = bench(vec![muscle(Muscle::TricepsLong, 100.0, [0.3, 0.0])]);
    let [wide, _] = held(&spec, 0, 35.0, 300);
    // The stage's compliance ends at 120 mA into 1 kΩ; the rig's electrode pair has a lower
    // resistance here.
    let better = IsometricSpec {
        load_ohm: 500.0,
        ..spec
    };
    let [narrow, _] = held(&better, 0, 141.0, 35);
    assert!(
        wide > 0.5 && (wide / narrow - 1.0).abs() < 1e-6,
        "{wide} {narrow}"
    );
}

/// A muscle that opposes the triceps reduces the torque. Alone it leaves the wire slack, and on the
/// other side it is measured.
#[test]
fn flexors_take_from_it_and_a_wire_does_not_push() {
    let triceps = muscle(Muscle::TricepsMedial, 100.0, [1.0, 0.0]);
    let brachialis = muscle(Muscle::Brachialis, 100.0, [0.5, 1.0]);
    let pair = bench(vec![triceps, brachialis]);
    let alone = bench(vec![triceps]);
    let [less, more] = [&pair, &alone].map(|spec| held(spec, 0, 90.0, 35)[0]);
    assert!(less < 0.7 * more, "{less} of {more}");
    // At twice the distance, no fibre responds to half of its threshold.
    let [same, all] = [&pair, &alone].map(|spec| held(spec, 0, 39.0, 35)[0]);
    assert_eq!(same, all);
    let [nm, n] = held(&pair, 1, 60.0, 35);
    assert!(nm < -1.0 && n == 0.0, "{nm} N m, {n} N");
    let other = IsometricSpec {
        holds: CellSide::Flexion,
        ..pair
    };
    let [nm, n] = held(&other, 1, 60.0, 35);
    assert!((n * 0.25 + nm).abs() < 1e-6);
}

#[test]
fn how_often_it_is_advanced_changes_nothing() {
    let spec = bench(vec![muscle(Muscle::TricepsLateral, 100.0, [1.0, 0.0])]);
    let run = |step_us: u64| {
        let mut arm = IsometricElbow::new(spec.clone(), 3).unwrap();
        for at in 0..20 {
            arm.pulse(&Pulse {
                t_us: at * 19_973,
                channel: 0,
                drive: Drive::Milliamps(45.0),
                width_us: 35,
                conducted: false,
            });
            let mut now = at * 19_973;
            while now < (at + 1) * 19_973 {
                now = (now + step_us).min((at + 1) * 19_973);
                arm.advance(now);
            }
        }
        arm
    };
    assert_eq!(run(137), run(20_000));
}

#[test]
fn what_no_bench_has_is_named() {
    let mistake = |change: fn(&mut IsometricSpec)| {
        let mut spec = bench(vec![muscle(Muscle::TricepsLong, 100.0, [1.0, 0.0])]);
        change(&mut spec);
        IsometricElbow::new(spec, 1).unwrap_err().0
    };
    // 180° − 69.9° is a flexion of 110.1°, where the sources differ.
    assert_eq!(mistake(|spec| spec.included_deg = 69.9), "included_deg");
    assert_eq!(mistake(|spec| spec.channels = [2, 2]), "channels");
    assert_eq!(mistake(|spec| spec.muscles[0].reached[1] = 1.1), "reached");
    assert_eq!(mistake(|spec| spec.contraction = f64::NAN), "contraction");
    assert_eq!(mistake(|spec| spec.cell.lever_m = 0.0), "lever_m");
}
