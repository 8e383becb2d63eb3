//! Simulated trigger edges have the same effect on every simulator: the same trains, each exactly
//! 1000 µs after its edge.

use hal_sim::trace::{Edge, State};
use host_core::run::{DeviceName, SessionFile};
use tests::desk::{play, session_path};

/// Edges that coincide with no period: the window's 250 µs, or the 1000 µs of the tick and the
/// simulated world.
const EDGES_US: [u64; 4] = [100_000, 350_013, 600_999, 850_251];

/// Returns the edges of the pins from the start on, with times relative to it.
fn edges(device: &DeviceName) -> Vec<Edge> {
    let text = std::fs::read_to_string(session_path("trigger.toml")).unwrap();
    let list: Vec<_> = EDGES_US.iter().map(|us| format!("0.{us:06}")).collect();
    let listed = format!("at_s = [{}]", list.join(", "));
    let text = text
        .replace("every_s = 1.0", &listed)
        .replace("= 10.0\n\n[w", "= 1.2\n\n[w");
    let file = SessionFile::parse("trigger.toml", &text).unwrap();
    assert_eq!(file.session.duration_us, 1_200_000);
    play(&file, device).edges().collect()
}

fn assert_exact(device: &DeviceName, edges: &[Edge]) {
    for (channel, delay) in [(0, 1_000), (1, 3_000)] {
        let is_first = |e: &&Edge| e.channel == channel && e.state == State::Cathodic;
        let first = edges.iter().filter(is_first);
        let found: Vec<_> = first.map(|e| e.t_us).collect();
        let train = |edge: u64| (0..10).map(move |n| edge + delay + n * 20_000);
        let expected: Vec<_> = EDGES_US.into_iter().flat_map(train).collect();
        assert_eq!(found, expected, "{device}, channel {}", channel + 1);
    }
}

#[test]
fn the_flashed_image_answers_each_edge_as_the_native_device_does() {
    let native = edges(&DeviceName::Native);
    let chip = edges(&DeviceName::Chip);
    assert_exact(&DeviceName::Native, &native);
    assert_exact(&DeviceName::Chip, &chip);
    assert_eq!(native, chip);
    println!("{} edges are the same", native.len());
}

#[test]
fn the_image_in_qemu_answers_each_edge_as_the_native_device_does() {
    let native = edges(&DeviceName::Native);
    let qemu = edges(&DeviceName::Qemu);
    assert_exact(&DeviceName::Qemu, &qemu);
    assert_eq!(native, qemu);
}
