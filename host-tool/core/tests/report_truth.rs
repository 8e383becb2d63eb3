//! The page describes only what the run contains: whether trials were played, and whether they had
//! a reference. A truncated record is compared as far as it goes.

use host_core::record::{Ending, Run, Sample, Trial, compare_rows};
use host_core::report::{self, Report};

fn trial(name: &str, rows: u32) -> Trial {
    let sample = |row| Sample {
        t_s: f64::from(row) * 0.01,
        target_deg: Some(45.0),
        measured_deg: Some(44.0),
        ..Sample::default()
    };
    Trial {
        name: name.to_owned(),
        samples: (0..rows).map(sample).collect(),
        duration_s: f64::from(rows) * 0.01,
        ..Trial::default()
    }
}

fn page(trials: Vec<Trial>) -> String {
    let run = Run {
        trials,
        ending: Ending::complete(),
        ..Run::default()
    };
    let report = Report::from_run(&run);
    let thread = format!("{:?}", std::thread::current().id());
    let dir = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("truth-{thread}"));
    let path = report::write(&dir, &report).unwrap();
    std::fs::read_to_string(path).unwrap()
}

#[test]
fn a_silent_run_says_so_first() {
    let silent = Trial {
        silent: Some("all amplitudes of the session are 0".to_owned()),
        ..trial("still", 200)
    };
    let sentence = "Still: no pulses were output: all amplitudes of the session are 0.";
    let alone = page(vec![silent.clone()]);
    assert!(
        alone.contains(sentence) && !alone.contains("followed"),
        "{alone}"
    );
    let with_another = page(vec![silent, trial("moved", 200)]);
    assert!(
        with_another.contains(&format!("{sentence} Open loop")),
        "{with_another}"
    );
}

#[test]
fn open_loop_is_said_only_of_open_loops() {
    let cut = Trial {
        joint: true,
        measure: Some((10.0, 30.0)),
        ..trial("cut before it is judged", 200)
    };
    assert!(page(vec![cut.clone()]).contains("not evaluated"));
    assert!(!page(vec![cut]).to_lowercase().contains("Open loop"));
    assert!(page(vec![trial("open", 200)]).contains("Open loop"));
}

#[test]
fn trials_cut_side_by_side_are_compared_as_far_as_they_go() {
    let full_trials = || vec![trial("one", 300), trial("two", 300), trial("three", 300)];
    let again = Run {
        trials: full_trials(),
        ..Run::default()
    };
    let mut cut = Run {
        ending: Ending::cut_short("E580 SIGINT came".to_owned(), 130),
        trials: full_trials(),
        ..again.clone()
    };
    cut.trials[0].samples.truncate(120);
    // Rows recorded while the device stops are not part of the session.
    cut.trials[0]
        .events
        .push((1.0, "E580 SIGINT came".to_owned()));
    let mut nth = 0..;
    cut.trials[0].samples.modify_each(|sample| {
        if nth.next() >= Some(105) {
            sample.measured_deg = Some(0.0);
        }
    });
    cut.trials[1].samples.truncate(40);
    assert_eq!(compare_rows(&cut, &again), None);
    let mut samples = cut.trials[1].samples.to_vec();
    samples[39].measured_deg = Some(0.0);
    cut.trials[1].samples = samples.into();
    let differs = compare_rows(&cut, &again).unwrap();
    assert_eq!((differs.trial.as_deref(), differs.line), (Some("two"), 41));
    // In a complete record no rows may be missing.
    cut.ending = Ending::complete();
    assert_eq!(
        compare_rows(&cut, &again).unwrap().trial.as_deref(),
        Some("one")
    );
}
