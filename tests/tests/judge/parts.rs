//! A pulse that a fault splits counts as one pulse with one excuse.

use super::rules::NONE;
use super::scene::{Anodic, Cathodic, Scene};
use hal_sim::trace::judge::{Fault, Pump, Rule};

/// Replaces the pulse at 1.01 s by `first_us` cathodic and, after `gap_us`, `second_us` anodic.
fn stretched(first_us: u64, gap_us: u64, second_us: u64) -> Scene {
    let mut scene = Scene::biphasic(100, 200);
    let (at, second) = (1_010_000, 1_010_000 + first_us + gap_us);
    let parts = [
        (at, at + first_us, Cathodic),
        (second, second + second_us, Anodic),
    ];
    scene.stretches.splice(100..102, parts);
    scene.truth.channels[0].pulses_per_s = 51; // a late second phase counts as the begin of a pulse
    scene.truth.faults.push(Fault { t_us: 1_010_100 });
    scene
}

/// A clock that drops to a sixth during a pulse lengthens its gap too; a debugger that halts core
/// and timers can make it arbitrarily long.
#[test]
fn a_clock_that_falls_or_stands_within_a_pulse_leaves_one_pulse() {
    for (first_us, gap_us, second_us) in [
        (589, 120, 202),
        (540, 600, 300),
        (300, 4_900, 200),
        (300, 15_000, 154),
    ] {
        let mut scene = stretched(first_us, gap_us, second_us);
        let verdict = scene.verdict();
        for account in [&verdict.as_built, &verdict.bare] {
            assert_eq!(account.findings, [], "{first_us} {gap_us} {second_us}");
            let [cut] = account.truncated[..] else {
                panic!("{:?}", account.truncated)
            };
            let left_uc = 12e-3 * (second_us as f64 - first_us as f64);
            assert!((cut.charge_uc - left_uc).abs() < 1e-3, "{cut:?}");
        }
        // Without a fault nothing is excused.
        scene.truth.faults.clear();
        assert!(scene.rules()[1].contains(&Rule::DirectCurrent));
    }
    // If another pulse came in between, the late phase belongs to that pulse, which has no excuse:
    // 1.2 µC. The interlock lets neither pass.
    let mut late = stretched(300, 5_001, 100);
    late.stretches
        .splice(101..101, [(1_013_000, 1_013_200, Cathodic)]);
    late.truth.channels[0].pulses_per_s = 52;
    assert_eq!(late.rules(), [vec![], vec![Rule::DirectCurrent]]);
    // It counts as the begin of a pulse for the rate, excused or not (0.96 µC).
    for faults in [1, 0] {
        let mut scene = stretched(80, 1_000, 80);
        scene.truth.faults.truncate(faults);
        assert_eq!(scene.rules(), NONE, "{faults}");
        scene.truth.channels[0].pulses_per_s = 50;
        assert_eq!(scene.rules(), [[Rule::Rate]; 2], "{faults}");
    }
}

/// Holds the second phase of the pulse at 1.01 s for `held_us`. The supply fails 325 µs after the
/// phase begins, and returns 58 µs later.
fn held(held_us: u64) -> Scene {
    let mut scene = Scene::biphasic(51, 200); // the held pulse is the last
    scene.stretches[101].1 = 1_010_205 + held_us;
    scene.end_us = 2_020_000;
    scene.pump = Pump::Runs(vec![(0, 1_010_230), (1_010_588, 2_100_000)]);
    scene.truth.faults.push(Fault { t_us: 1_010_240 });
    scene
}

/// A debugger that halts core, timers and pump interrupts a phase.
#[test]
fn a_phase_that_the_supply_interrupts_is_one_phase() {
    let mut scene = held(533);
    assert_eq!(scene.rules(), NONE);
    let cut = scene.verdict().as_built.truncated[0];
    assert!((cut.charge_uc - 3.3).abs() < 0.01, "{cut:?}"); // 475 µs minus 200
    scene.truth.faults.clear();
    let rules = [Rule::CommandedPhase, Rule::DirectCurrent];
    assert_eq!(scene.rules(), [rules; 2]);
    // Its length is the whole, not that of its parts of 325 and 277 µs.
    let mut scene = held(660);
    scene.truth.hardware.one_shot_us = 700;
    assert_eq!(scene.rules(), [[Rule::AnyPhase]; 2]);
    assert_eq!(scene.verdict().as_built.findings[0].amount, 660.0);
    // If the lines are disconnected for as long, there are two phases, and the later one, 150 µs,
    // has no excuse: the interlock's balance stops it.
    let mut scene = held(533);
    scene.pump = Pump::Throughout;
    scene.stretches[101].1 = 1_010_530;
    scene.stretches.insert(102, (1_010_588, 1_010_738, Anodic));
    scene.truth.channels[0].pulses_per_s = 51;
    assert_eq!(scene.rules(), [vec![], vec![Rule::DirectCurrent]]);
}
