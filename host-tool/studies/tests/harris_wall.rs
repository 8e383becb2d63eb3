//! Harris' virtual wall, from the session files through the whole device and
//! back: what is put out, what is felt, that it repeats.

use host_core::record::{Sample, Trial};
use host_core::run::{DeviceName, SessionFile, TrialPlace, record};
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use studies::experiments::harris_wall::{SPEEDS_DEG_PER_S, hit_at, sessions};

fn trials(seed: u64) -> Vec<Trial> {
    let sessions = sessions().unwrap();
    static CALLS: AtomicU32 = AtomicU32::new(0);
    let call = CALLS.fetch_add(1, Ordering::Relaxed).to_string();
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("harris_wall")
        .join(call);
    let run = |(position, (name, file)): (usize, &(&'static str, SessionFile))| {
        let place = TrialPlace {
            dir: &dir,
            position,
            name,
        };
        let half_us = file.session.duration_us / 2;
        let recorded = record(place, file, (&DeviceName::Native, seed), half_us, |_| ()).unwrap();
        assert!(recorded.error.is_none(), "{:?}", recorded.error);
        recorded.trial
    };
    sessions.iter().enumerate().map(run).collect()
}

/// The samples within the wall, and those in front of everything rendered.
fn parted(trial: &Trial) -> (Vec<&Sample>, Vec<&Sample>) {
    let wall = trial.wall.unwrap();
    // A burst takes its amplitude up to 20 ms after the angle was read.
    let (slack, front) = (2.0, wall.at_deg - wall.pre_wall_deg);
    let inside = |s: &&Sample| s.measured_deg > Some(wall.at_deg + slack);
    let before = |s: &&Sample| s.measured_deg.is_some_and(|deg| deg < front - slack);
    let all = || trial.samples.iter();
    (
        all().filter(inside).collect(),
        all().filter(before).collect(),
    )
}

#[test]
fn the_four_scenarios_hit_the_wall_at_both_speeds_and_render_what_they_say() {
    let all = trials(1);
    assert_eq!(all, trials(1));
    for trial in &all {
        for speed in SPEEDS_DEG_PER_S {
            let hit = hit_at(trial, speed).unwrap();
            let error = (hit.speed_deg_per_s - speed).abs();
            assert!(error < 0.1 * speed, "{}: {hit:?}", trial.name);
        }
        let (inside, before) = parted(trial);
        assert!(before.len() > 200, "{}", trial.name);
        assert!(before.iter().all(|s| s.amplitudes == [None, None]));
        assert!(trial.samples.iter().all(|s| s.amplitudes[0] <= Some(80.0)));
        assert!(trial.samples.iter().all(|s| s.target_deg == Some(90.0)));
        let has_antagonist = trial.name.contains("co-contraction");
        for s in inside {
            let [triceps, biceps] = s.amplitudes[..] else {
                panic!("{s:?}")
            };
            // 8.889 mA/° from 0 on, or 80 mA at the wall already.
            let least = if trial.wall.unwrap().pre_wall_deg > 0.0 {
                79.9
            } else {
                8.0
            };
            assert!(triceps >= Some(least), "{}: {s:?}", trial.name);
            assert_eq!(biceps, has_antagonist.then_some(40.0));
            let penetration = s.measured_deg.unwrap() - 90.0;
            assert!((s.effort.unwrap() - penetration).abs() < 0.02);
        }
    }
    // Follows from the pre-wall's form: the same ramp, 9° further out.
    let deepest = |n: usize, speed| hit_at(&all[n], speed).unwrap().deepest_deg;
    for speed in SPEEDS_DEG_PER_S {
        assert!(deepest(0, speed) < deepest(1, speed));
        assert!(deepest(2, speed) < deepest(3, speed));
    }
}
