//! Whatever ends a calibration at any step: the outputs are isolated in time, the record is
//! complete, and the calibration can be resumed to the same file.

use super::scene::*;
use hal_sim::body::bench::SensorSpec;
use host_core::calibration::{Auto, Entry, OnDisk, Phase, Step};
use std::path::Path;
use std::sync::{Arc, Mutex};

/// Longest time until all outputs are isolated after an abort or a lost electrode, µs.
const SILENT_US: u64 = 100_000;

/// Longest time after the host's last message, µs: its silence of 100 ms, the fall of 50 ms, and
/// two windows of the device.
const UNHEARD_US: u64 = 150_500;

/// Returns every step of two electrodes in every phase.
fn moments() -> Vec<Moment> {
    let mut sequence = Vec::new();
    for electrode in 1..=2 {
        for step in Step::ALL {
            for phase in [Phase::Ready, Phase::On, Phase::Rest] {
                sequence.push(Moment {
                    electrode,
                    step,
                    phase,
                    left_s: 0.5,
                });
            }
        }
    }
    sequence
}

/// Ends a calibration in this way; returns the time until the outputs were silent.
fn end_at_moment(way: Disturbance, moment: Moment, out: &Path) -> u64 {
    let order = plan_with_electrodes(2);
    let come = Arc::new(Mutex::new(DisturbanceState::default()));
    let mut operator = DisturbedOperator {
        moment,
        way,
        come: Arc::clone(&come),
    };
    let port = DisturbedPort {
        port: array_port(&order.0, SEED, SensorSpec::default()),
        way,
        come: Arc::clone(&come),
    };
    let (result, _, port) = run_calibration(port, &order, out, &OnDisk, &mut operator);
    let message = result.unwrap_err().to_string();
    let expected = match way {
        Disturbance::Abort => "E683 ",
        Disturbance::Cut => "E502 ",
        Disturbance::Freeze => "E501 ",
        Disturbance::Off => "E677 ",
    };
    assert!(
        message.starts_with(expected),
        "{way:?} {moment:?}: {message}"
    );
    let mut port = port.unwrap();
    let at_us = come.lock().unwrap().at_us.unwrap();
    let world = &mut port.port.world;
    // The loss of an electrode cannot be detected while no pulse is given: the time counts from the
    // next pulse, or at once if a pulse is being given.
    let since_us = match (way, moment.phase) {
        (Disturbance::Off, Phase::Ready | Phase::Rest) => {
            driven_after(world, at_us).unwrap_or(at_us)
        }
        _ => at_us,
    };
    silent_after(world, since_us)
}

fn at_every_step(way: Disturbance) {
    let order = plan_with_electrodes(2);
    let folder = folder(&format!("{way:?}"));
    let (_, _, reference) = run_whole_calibration(&order, &folder.join("reference.toml"));
    let (mut longest, mut tried) = (0, 0);
    for (place, moment) in moments().into_iter().enumerate() {
        let out = folder.join(format!("{place}.toml"));
        let silent_us = end_at_moment(way, moment, &out);
        longest = longest.max(silent_us);
        let most_us = match way {
            Disturbance::Cut | Disturbance::Freeze => UNHEARD_US,
            Disturbance::Abort | Disturbance::Off => SILENT_US,
        };
        assert!(silent_us <= most_us, "{way:?} {moment:?}: {silent_us} µs");
        let kept = entries(&out);
        assert!(
            matches!(kept.last(), Some(Entry::Ended { .. })),
            "{moment:?}"
        );
        // The electrode is attached again, and the cable repaired.
        let port = array_port(&order.0, SEED, SensorSpec::default());
        let (result, _, _) = run_calibration(port, &order, &out, &OnDisk, &mut Auto);
        result.unwrap();
        let resumed = std::fs::read_to_string(&out).unwrap();
        assert_eq!(resumed, reference, "{way:?} {moment:?}");
        let found = |step: Step| {
            let is = |entry: &&Entry| matches!(entry, Entry::Found { step: found_at, .. } if *found_at == step);
            entries(&out).iter().filter(is).count()
        };
        // No result that was found is searched for again.
        assert!(Step::ALL.iter().all(|step| found(*step) == 2), "{moment:?}");
        tried += 1;
    }
    println!(
        "{way:?}: {tried} moments, silent within {:.1} ms",
        longest as f64 * 1e-3
    );
}

#[test]
fn an_abort_at_every_step_is_silent_at_once() {
    at_every_step(Disturbance::Abort);
}

#[test]
fn a_cable_cut_at_every_step_is_silent_soon() {
    at_every_step(Disturbance::Cut);
}

#[test]
fn a_link_that_goes_silent_at_every_step_is_silent_soon() {
    at_every_step(Disturbance::Freeze);
}

#[test]
fn an_electrode_that_falls_off_at_every_step_is_found() {
    at_every_step(Disturbance::Off);
}

/// A pulse comes every 31 ms and three of them reveal a lost electrode, whenever between two pulses
/// it falls off.
#[test]
fn an_electrode_that_falls_off_at_any_moment_of_a_second_is_silent_in_time() {
    let folder = folder("any_moment");
    let mut longest = 0;
    // Covers more than one period at every step, and five periods at one of them.
    let cases = Step::ALL.into_iter().flat_map(|step| {
        let count = if step == Step::Comfort { 32 } else { 7 };
        (0..count).map(move |place| (step, place))
    });
    for (nth, (step, place)) in cases.enumerate() {
        let moment = Moment {
            electrode: 1,
            step,
            phase: Phase::On,
            left_s: 0.3 + 0.005 * f64::from(place),
        };
        let silent_us = end_at_moment(
            Disturbance::Off,
            moment,
            &folder.join(format!("{nth}.toml")),
        );
        longest = longest.max(silent_us);
    }
    println!("silent within {:.1} ms", longest as f64 * 1e-3);
    assert!(longest <= SILENT_US, "{longest}");
}
