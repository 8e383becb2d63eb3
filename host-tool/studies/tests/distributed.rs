//! Tests of one muscle under several electrodes: declaration, verdicts and report.

use studies::distributed::{
    Condition, DistributedDeclaration, DistributedWearer, Drive, Endurance, Phase, RunInfo, Series,
    Study, Window, exceeds, holds, play,
};

fn declared() -> DistributedDeclaration {
    DistributedDeclaration::load_embedded().unwrap()
}

#[test]
fn everything_declared_is_used() {
    let study = Study::new(Some(5), Some(1)).unwrap();
    let declared = study.declaration();
    let found = study.compute_person(0).unwrap();
    assert_eq!(found.measured.len(), declared.conditions.len());
    for claim in &declared.claims {
        holds(&found, &claim.id).unwrap();
    }
    assert!(
        holds(&found, "no-such")
            .unwrap_err()
            .to_string()
            .starts_with("E722")
    );
    let person = DistributedWearer::random(declared, 5, 0);
    for range in &declared.ranges {
        let value = person.value(&range.field).unwrap();
        assert!((range.low..=range.high).contains(&value), "{}", range.field);
    }
    // Without axis points the outcome still has all shares and sheets.
    let told = RunInfo {
        command: "experiment distributed --draws 1".to_owned(),
        cut_short: None,
    };
    let outcome = study.outcome(&[found], &[], told).unwrap();
    assert_eq!(outcome.shares.len(), declared.claims.len());
    assert_eq!(outcome.sheets.len(), 7);
}

fn lasts(seconds: f64) -> Endurance {
    Endurance {
        seconds,
        is_longer: false,
    }
}

#[test]
fn an_end_that_nobody_saw_decides_nothing() {
    let beyond = |seconds| Endurance {
        seconds,
        is_longer: true,
    };
    assert_eq!(exceeds(lasts(90.0), lasts(80.0), 1.0), Some(true));
    assert_eq!(exceeds(lasts(90.0), lasts(80.0), 1.2), Some(false));
    assert_eq!(exceeds(lasts(0.0), lasts(0.0), 1.0), None);
    assert_eq!(exceeds(lasts(1.0), lasts(0.0), 2.0), Some(true));
    assert_eq!(exceeds(beyond(600.0), lasts(80.0), 2.0), Some(true));
    assert_eq!(exceeds(beyond(600.0), lasts(500.0), 2.0), None);
    assert_eq!(exceeds(lasts(80.0), beyond(600.0), 1.0), Some(false));
    assert_eq!(exceeds(lasts(599.9), beyond(590.0), 1.0), None);
    assert_eq!(exceeds(beyond(600.0), beyond(590.0), 1.0), None);
}

/// Makes a series of windows: number, force as a part of the reference, and whether the amplitude
/// is at its maximum.
fn series(id: &str, parts: &[(usize, f64, bool)]) -> Series {
    let declared = declared();
    let mut series = Series::new(&declared, declared.condition(id).unwrap(), 10.0);
    for &(count, part, is_most) in parts {
        let window = Window {
            mean_n: 10.0 * part,
            deviation_n: 0.1,
            is_most,
            amplitude_ma: 12.0,
        };
        series.windows.extend(std::iter::repeat_n(window, count));
    }
    series
}

#[test]
fn endurance_ends_when_the_most_is_not_enough() {
    let seconds = |parts: &[(usize, f64, bool)]| {
        let endurance = series("one", parts).endurance();
        (
            (endurance.seconds / 0.16).round() as usize,
            endurance.is_longer,
        )
    };
    // Weak, but not at the maximum: it continues.
    assert_eq!(
        seconds(&[(10, 0.5, false), (100, 1.0, false), (50, 0.8, false)]),
        (150, true)
    );
    // Weak at the maximum: twelve windows of 0.8 bring the mean below 0.9.
    assert_eq!(
        seconds(&[(10, 0.5, false), (100, 1.0, false), (50, 0.8, true)]),
        (112, false)
    );
    // At the maximum and strong enough.
    assert_eq!(seconds(&[(1, 1.0, true), (200, 0.95, true)]), (201, true));
    // The reference is not reached in time.
    assert_eq!(seconds(&[(200, 0.99, true), (100, 1.0, true)]), (0, false));
    let mut refused = series("one-fresh", &[]);
    refused.is_refused = true;
    assert_eq!(refused.endurance(), lasts(0.0));
    // Ten seconds, starting five seconds after the force is reached.
    let ripple = series("one", &[(200, 1.0, false)]).ripple().unwrap();
    assert!((ripple - 0.01).abs() < 1e-9);
}

#[test]
fn what_is_left_is_last_by_first() {
    let open = series(
        "four-open",
        &[(15, 1.0, false), (250, 0.9, true), (200, 0.45, true)],
    );
    assert!(open.is_found());
    assert!((open.initial_force().unwrap() - 0.9).abs() < 1e-12);
    assert!((open.remaining_force().unwrap() - 0.5).abs() < 1e-12);
    assert!(!series("four-open", &[(13, 1.0, false), (2, 0.94, true)]).is_found());
    assert_eq!(
        series("four-open", &[(100, 1.0, true)]).remaining_force(),
        None
    );
}

/// A nominal wearer without crosstalk holds a force as long with four electrodes at once as
/// interleaved, but with more ripple.
#[test]
fn without_crosstalk_phase_is_ripple_alone() {
    let declared = declared();
    let person = DistributedWearer::nominal(&declared).with_value("crosstalk", 0.0);
    let even = declared.condition("four-half").unwrap();
    let at_once = Condition {
        phase: Phase::Together,
        ..even.clone()
    };
    let [even, at_once] =
        [even, &at_once].map(|condition| play(&declared, condition, &person).unwrap());
    let [smooth, rough] = [&even, &at_once].map(|series| series.ripple().unwrap());
    assert!(smooth < 0.2 * rough, "{smooth} {rough}");
    let [long, alike] = [even, at_once].map(|series| series.endurance());
    assert!(long.seconds > 30.0 && !long.is_longer, "{long:?}");
    assert!(
        (alike.seconds / long.seconds - 1.0).abs() < 0.05,
        "{long:?} {alike:?}"
    );
}

/// Feedback uses the smallest amplitude that a force needs: it rises while the muscle fatigues, up
/// to the limit.
#[test]
fn feedback_raises_the_amplitude_of_a_tiring_muscle() {
    let declared = declared();
    let one = declared.condition("one").unwrap();
    assert_eq!(one.drive, Drive::Feedback);
    let held = play(&declared, one, &DistributedWearer::nominal(&declared)).unwrap();
    let reached = held
        .windows
        .iter()
        .position(|window| window.mean_n >= 30.0)
        .unwrap(); // 20 % of 150 N
    let at = |nth: usize| held.windows[nth].amplitude_ma;
    let most = held.windows.last().unwrap();
    assert!(
        most.is_most && at(reached) < at(reached + 100) && at(reached + 100) < most.amplitude_ma
    );
}
