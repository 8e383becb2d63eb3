//! Trains that play while the trigger input is active give the same edges on every simulator.

use hal_sim::trace::{Edge, State};
use host_core::run::{DeviceName, SessionFile};
use tests::desk::{play, session_path};

/// Times at which the input becomes active, µs from the start. The second comes after the shortest
/// possible release, so that the last period is not over.
const HELD_AT_US: [u64; 4] = [100_100, 351_313, 800_000, 1_300_077];
/// Time for which the input stays active, µs.
const HELD_US: u64 = 250_200;

/// Returns the shipped session with gated trains: channel 1 endless, channel 2 with four pulses
/// each time.
fn file() -> SessionFile {
    let text = std::fs::read_to_string(session_path("trigger.toml")).unwrap();
    let times = HELD_AT_US.map(|us| (us as f64 / 1e6).to_string());
    let held = format!(
        "at_s = [{}]\nheld_s = {}",
        times.join(", "),
        HELD_US as f64 / 1e6
    );
    let text = text
        .replace("duration_s = 10.0", "duration_s = 2.0")
        .replace(
            "offset_us = 2000, repeats = 10",
            "offset_us = 2000, repeats = 4",
        )
        .replace("50.0, repeats = 10", "50.0")
        .replace("triggered = true }", "trigger = \"gated\" }")
        .replace("every_s = 1.0", &held);
    SessionFile::parse("gated.toml", &text).unwrap()
}

/// Returns the edges of the pins from the start on, with times relative to it.
fn edges(device: &DeviceName) -> Vec<Edge> {
    let played = play(&file(), device);
    assert_eq!(played.outcome.refused, 0, "{device}");
    played.edges().collect()
}

/// Returns the starts of a channel's first phases.
fn starts(edges: &[Edge], channel: u8) -> Vec<u64> {
    let first = |edge: &&Edge| edge.channel == channel && edge.state == State::Cathodic;
    edges.iter().filter(first).map(|edge| edge.t_us).collect()
}

#[test]
fn the_native_device_plays_while_it_is_held() {
    let edges = edges(&DeviceName::Native);
    let train = |from: u64, count: u64| (0..count).map(move |n| from + n * 20_000);
    // 250.2 ms contain 13 pulses. The second time begins in the window after the end of the first
    // one's last period, which began 340 100 µs from the start.
    let [first, _, third, fourth] = HELD_AT_US.map(|at| at + 1_000);
    let second = 361_250;
    let endless = [(first, 13), (second, 13), (third, 13), (fourth, 13)];
    let expected = endless.map(|(from, count)| train(from, count)).into_iter();
    assert_eq!(starts(&edges, 0), expected.flatten().collect::<Vec<_>>());
    let expected = HELD_AT_US.map(|at| train(at + 3_000, 4)).into_iter();
    assert_eq!(starts(&edges, 1), expected.flatten().collect::<Vec<_>>());
}

#[test]
fn the_flashed_image_plays_them_as_the_native_device_does() {
    let (native, chip) = (edges(&DeviceName::Native), edges(&DeviceName::Chip));
    assert_eq!(native, chip);
    println!("{} edges are the same", native.len());
}

#[test]
fn the_image_in_qemu_plays_them_as_the_native_device_does() {
    let (native, qemu) = (edges(&DeviceName::Native), edges(&DeviceName::Qemu));
    assert_eq!(native, qemu);
    println!("{} edges are the same", native.len());
}
