//! One line that breaks at any moment: the stage logic of hardware.md ends in disconnection; a
//! logic of four states of two lines does not.

use super::scene::{Anodic, Cathodic, Grounded, Scene, StateInterval, biphasic, monophasic};
use hal_sim::trace::judge::{Cause, Line, Pump, StageLogic, StuckLine};

/// Returns the intervals of a channel within each 20 ms, by name.
fn trains() -> [(&'static str, Vec<StateInterval>); 7] {
    let swapped = |pulse: &[StateInterval]| {
        let swap = |state| match state {
            Cathodic => Anodic,
            Anodic => Cathodic,
            other => other,
        };
        let pulse = pulse.iter().map(|&(a, b, state)| (a, b, swap(state)));
        pulse.collect::<Vec<_>>()
    };
    let doublet = [(0, 200), (205, 405), (410, 610), (615, 815)];
    let states = [Cathodic, Anodic, Cathodic, Anodic];
    let doublet = doublet.into_iter().zip(states);
    [
        ("biphasic", biphasic(200).to_vec()),
        ("wide gap", vec![(0, 500, Cathodic), (700, 1_200, Anodic)]),
        ("anodic first", swapped(&biphasic(200))),
        ("doublet", doublet.map(|((a, b), s)| (a, b, s)).collect()),
        ("monophasic", monophasic(200, 1_000).to_vec()),
        ("anodic", swapped(&monophasic(200, 1_000))),
        // A silent member of a conducted group, whose DAC nevertheless has a code.
        ("bystander", vec![(0, 405, Grounded)]),
    ]
}

fn scene(pulse: &[StateInterval], stuck: StuckLine, logic: StageLogic) -> Scene {
    let mut scene = Scene::with_pulses(100, pulse);
    let channel = &mut scene.truth.channels[0];
    // One more than the doublets have, because a stuck line may begin a pulse early.
    channel.pulses_per_s = 101;
    (scene.truth.hardware.logic, scene.truth.stuck) = (logic, vec![stuck]);
    scene
}

/// Returns every line, level and moment of a period of `pulse`, with larger steps where nothing
/// changes.
fn faults() -> impl Iterator<Item = StuckLine> {
    let moments = (0..1_300).step_by(7).chain((1_300..20_000).step_by(1_900));
    let lines = [Line::Cathodic, Line::Anodic].into_iter();
    let kinds = lines.flat_map(|line| [true, false].map(|high| (line, high)));
    kinds.flat_map(move |(line, high)| {
        moments.clone().map(move |after| StuckLine {
            channel: 0,
            line,
            high,
            from_us: 1_010_000 + after,
        })
    })
}

#[test]
fn one_broken_line_is_never_severe_with_the_interlock() {
    for (name, pulse) in trains() {
        for stuck in faults() {
            let verdict = scene(&pulse, stuck, StageLogic::Interlocked).judged_once();
            let account = verdict.as_built;
            assert_eq!(account.findings, [], "{name}, {stuck:?}");
            assert!(account.truncated.len() <= 1, "{name}, {stuck:?}");
            // Any drive after the fault ended in disconnection.
            if !account.truncated.is_empty() {
                assert_eq!(account.latched.len(), 1, "{name}, {stuck:?}");
                let latched = account.latched[0].t_us;
                assert!(
                    latched <= stuck.from_us + 42_000,
                    "{name}, {stuck:?}: {latched}"
                );
            }
        }
    }
}

#[test]
fn one_broken_line_is_severe_without_it() {
    let mut severe = Vec::new();
    for (name, pulse) in trains() {
        for (line, high) in [
            (Line::Cathodic, true),
            (Line::Cathodic, false),
            (Line::Anodic, true),
            (Line::Anodic, false),
        ] {
            let of_it = faults().filter(|stuck| (stuck.line, stuck.high) == (line, high));
            let mut rules: Vec<_> = of_it
                .flat_map(|stuck| {
                    let verdict = scene(&pulse, stuck, StageLogic::TwoBit).judged_once();
                    verdict.as_built.findings.into_iter().map(|f| f.rule.name())
                })
                .collect();
            rules.sort_unstable();
            rules.dedup();
            if !rules.is_empty() {
                let level = if high { "high" } else { "low" };
                severe.push(format!("{name}, {line:?} {level}: {}", rules.join(", ")));
            }
        }
    }
    println!("{}", severe.join("\n"));
    // A line stuck low turns each grounding into a drive, whatever the train.
    for low in ["monophasic, Cathodic low", "bystander, Cathodic low"] {
        assert!(
            severe.iter().any(|finding| finding.starts_with(low)),
            "{low}: {severe:?}"
        );
    }
}

/// Returns causes and times of latching; the pump stops at 1.4 s for 5 ms and at 1.695 s for 25 ms.
fn latched(scene: &mut Scene) -> Vec<(u64, Cause)> {
    scene.pump = Pump::Runs(vec![
        (0, 1_400_000),
        (1_405_000, 1_695_000),
        (1_720_000, 2_100_000),
    ]);
    let account = scene.verdict().as_built;
    account.latched.iter().map(|l| (l.t_us, l.cause)).collect()
}

#[test]
fn a_latched_stage_begins_anew_when_the_pump_was_off() {
    let mut scene = Scene::biphasic(100, 200);
    // Held at 1.01, 1.21, 1.51 and 1.91 s: 5 ms without the pump clear nothing, 25 ms do.
    for pulse in [95, 75, 60, 50] {
        let at = 10_000 + pulse as u64 * 20_000;
        let held = [(at, at + 700, Cathodic)];
        scene.stretches.splice(2 * pulse..2 * pulse + 2, held);
    }
    let held = |at| (at, Cause::Held);
    assert_eq!(latched(&mut scene), [1_010_600, 1_910_600].map(held));
}

/// The latch also stays if a wire keeps the line high, if the chip was held and continues, or if it
/// continues so late in a phase that the line is at rest before the pump's first edge.
#[test]
fn a_line_that_is_high_keeps_the_latch() {
    let stuck = StuckLine {
        channel: 0,
        line: Line::Anodic,
        high: true,
        from_us: 1_000_000,
    };
    let mut wired = scene(&biphasic(200), stuck, StageLogic::Interlocked);
    assert_eq!(latched(&mut wired), [(1_000_600, Cause::Held)]);
    let mut halted = Scene::biphasic(100, 200);
    halted
        .stretches
        .splice(168..172, [(1_694_900, 1_720_100, Cathodic)]);
    halted.stretches.insert(169, (1_720_200, 1_720_400, Anodic));
    assert_eq!(latched(&mut halted), [(1_695_500, Cause::Held)]);
    // The time at rest decides: after 10 ms with both lines at rest, the stage starts again.
    for (rests_us, anew) in [(9, false), (9_999, false), (10_000, true)] {
        let phases = [
            (1_694_900, 1_720_000 - rests_us, Cathodic),
            (1_720_050, 1_720_700, Anodic),
        ];
        halted.stretches.splice(168..170, phases);
        let expected: &[u64] = if anew {
            &[1_695_500, 1_720_650]
        } else {
            &[1_695_500]
        };
        let expected = expected.iter().map(|&at| (at, Cause::Held));
        assert_eq!(latched(&mut halted), expected.collect::<Vec<_>>());
    }
}
