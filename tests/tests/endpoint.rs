//! Endpoint force control gives the same edges on every simulator.

use hal_sim::body::{Body, CHANNELS, Load, Pulse};
use hal_sim::trace::Edge;
use host_core::run::{DeviceName, SessionFile, run};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use tests::desk::{play, session_path};

/// Returns a shipped session at three times its speed.
fn quick(name: &str, rate: &str) -> SessionFile {
    let mut text = std::fs::read_to_string(session_path(name)).unwrap();
    // In ascending order, so that no replaced time is replaced again.
    let times = ["1.0", "2.0", "3.0", "4.0", "5.0", "6.0"];
    for time in times {
        let third = time.parse::<f64>().unwrap() / 3.0;
        text = text.replace(&format!("_s = {time}"), &format!("_s = {third:.3}"));
    }
    let text = text.replace("rate_hz = 200", rate);
    SessionFile::parse(name, &text).unwrap()
}

/// Returns the edges of the pins from the start on, with times relative to it.
fn edges(rate: &str, device: &DeviceName) -> Vec<Edge> {
    let played = play(&quick("endpoint_force.toml", rate), device);
    let events = &played.outcome.trial.events;
    assert_eq!(played.outcome.refused, 0, "{device}: {events:?}");
    // Up to the stop, whose time differs between devices.
    let edges = played.edges();
    edges.take_while(|edge| edge.t_us < 1_990_000).collect()
}

/// Returns the amplitude codes of a channel's successive bursts.
fn codes(edges: &[Edge], channel: u8) -> Vec<u16> {
    let driven = edges
        .iter()
        .filter(|edge| edge.state.is_driven() && edge.channel == channel);
    driven.step_by(2).map(|edge| edge.dac_code).collect() // two phases
}

#[test]
fn the_native_device_recruits_at_both_rates() {
    let counts = ["rate_hz = 200", "rate_hz = 20"].map(|rate| {
        let edges = edges(rate, &DeviceName::Native);
        let playing: BTreeSet<u8> = edges.iter().map(|edge| edge.channel).collect();
        assert!(playing.len() >= 3, "{playing:?}");
        // Number of amplitude changes of each channel.
        let changes = |channel: &u8| {
            let codes = codes(&edges, *channel);
            codes.windows(2).filter(|two| two[0] != two[1]).count()
        };
        playing.iter().map(changes).sum::<usize>()
    });
    println!("{counts:?} changes of amplitude at 200 and at 20 Hz");
    // Bursts come at 40 Hz, so at least one of two keeps its amplitude.
    assert!(counts[0] > 3 * counts[1] / 2, "{counts:?}");
}

#[test]
fn the_flashed_image_plays_it_as_the_native_device_does() {
    for rate in ["rate_hz = 200", "rate_hz = 20"] {
        plays_as_native(rate, &DeviceName::Chip);
    }
}

#[test]
fn the_thumb_build_under_qemu_plays_it_as_the_native_device_does() {
    plays_as_native("rate_hz = 200", &DeviceName::Qemu);
}

fn plays_as_native(rate: &str, device: &DeviceName) {
    let (native, other) = (edges(rate, &DeviceName::Native), edges(rate, device));
    let differ = native.iter().zip(&other).filter(|(a, b)| a != b);
    for (native, other) in differ.clone().take(5) {
        println!("native {native:?}\n  {device} {other:?}");
    }
    assert_eq!((differ.count(), other.len()), (0, native.len()), "{rate}");
    println!("{rate}, {device}: {} edges are the same", native.len());
}

/// Arm whose angles are lost at some time.
struct AngleLossArm {
    arm: Box<dyn Body>,
    now_us: u64,
    lost_us: u64,
    /// Time of the last measurement.
    told_us: Arc<AtomicU64>,
}

impl Body for AngleLossArm {
    fn pulse(&mut self, pulse: &Pulse) {
        self.arm.pulse(pulse);
    }
    fn advance(&mut self, to_us: u64) -> bool {
        self.now_us = self.now_us.max(to_us);
        self.arm.advance(to_us)
    }
    fn angle_deg(&self) -> f64 {
        self.arm.angle_deg()
    }
    fn sensed_deg(&self) -> f64 {
        self.arm.sensed_deg()
    }
    fn posture_deg(&self) -> Option<[f64; 9]> {
        if self.now_us >= self.lost_us {
            return None;
        }
        self.told_us.store(self.now_us, Ordering::Relaxed);
        self.arm.posture_deg()
    }
    fn loads(&self) -> &[Load; CHANNELS] {
        self.arm.loads()
    }
    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        self.arm.loads_mut()
    }
}

/// Oldest measurement that the session file allows, ms.
const STALE_AFTER_MS: u64 = 100;

/// Returns the time from the last measurement to the fault, and from there to the last driven edge,
/// µs of device time; `device` measures a simulated arm that loses its sensors.
fn stale_after(device: &DeviceName) -> (i64, i64) {
    let file = quick("endpoint_arm.toml", "rate_hz = 200");
    let mut port = device.open(&file.session, 1).unwrap();
    let told_us = Arc::new(AtomicU64::new(0));
    let world = port.world().unwrap();
    let arm = std::mem::replace(
        &mut world.body,
        Box::new(hal_sim::body::FixedLoad::new(0.0)),
    );
    world.body = Box::new(AngleLossArm {
        arm,
        now_us: world.now_us(),
        lost_us: world.now_us() + 1_000_000,
        told_us: Arc::clone(&told_us),
    });
    let (outcome, port) = run(&file, port, None, |_| ());
    let error = outcome.error.unwrap().to_string();
    assert!(error.contains("fault 5: SensorStale"), "{error}");
    let events = &outcome.trial.events;
    let faulted = events.iter().find(|(_, text)| text.starts_with("fault 5"));
    let epoch_us = outcome.epoch_us.unwrap();
    let fault_us = epoch_us + (faulted.unwrap().0 * 1e6).round() as u64;
    let mut port = port.unwrap();
    let trace = &port.world().unwrap().recorder.trace;
    let driven = || {
        trace
            .edges_from(epoch_us)
            .filter(|edge| edge.state.is_driven())
    };
    assert!(driven().any(|edge| edge.dac_code > 0 && edge.t_us + 30_000 > fault_us));
    let last_us = driven().map(|edge| edge.t_us).max().unwrap();
    // All channels, not only those that played.
    let mut states = std::collections::BTreeMap::new();
    states.extend(trace.edges_from(0).map(|edge| (edge.channel, edge.state)));
    let isolated = states
        .values()
        .filter(|state| **state == hal_sim::trace::State::Isolated);
    assert_eq!(isolated.count(), states.len(), "{states:?}");
    let told_us = told_us.load(Ordering::Relaxed);
    let after = |at: u64, since: u64| at as i64 - since as i64;
    (after(fault_us, told_us), after(last_us, fault_us))
}

/// An arm that is no longer measured is not driven: fault 5, and no output.
#[test]
fn a_posture_that_is_stale_isolates_the_outputs() {
    for device in [DeviceName::Native, DeviceName::Chip] {
        let (fault_us, last_us) = stale_after(&device);
        println!(
            "{device}: stale {fault_us} µs after the last measurement; last edge {last_us} µs after that"
        );
        let late = fault_us - 1_000 * STALE_AFTER_MS as i64;
        // Covers the host's estimate of device time, and a control tick.
        assert!((-1_000..=2_000).contains(&late), "{device}: {late} µs");
        // Rendered windows are cut off and not played.
        assert!(last_us <= 500, "{device}: {last_us} µs");
    }
}
