//! A width ramp and a list of pulses give the same edges on every simulator.

use hal_sim::trace::{Edge, State};
use host_core::run::{DeviceName, SessionFile};
use tests::desk::{play, session_path};

/// Returns the shipped ramp within 1.5 s, with a list on a second channel.
fn file() -> SessionFile {
    let text = std::fs::read_to_string(session_path("width_ramp.toml")).unwrap();
    let text = text
        .replace("duration_s = 12.0", "duration_s = 2.0")
        .replace("at_s = 10.0", "at_s = 1.5")
        .replace("at_s = 12.0", "at_s = 2.0")
        .replace(
            "rate_hz = 50",
            "rate_hz = 50\nvalues = [{ channel = 2, value = 5.0 }]",
        );
    let list = "[[setpoints.list]]\nat_s = 1.0\nchannel = 2\npulses = [\
                { after_us = 1234, value = 8.0 }, { after_us = 20001, value = 3.0 }, \
                { after_us = 33333, value = 12.0 }]\n";
    SessionFile::parse("width_ramp.toml", &format!("{text}\n{list}")).unwrap()
}

/// Returns the edges of the pins from the start on, with times relative to it.
fn edges(device: &DeviceName) -> Vec<Edge> {
    let played = play(&file(), device);
    assert_eq!(played.outcome.refused, 0, "{device}");
    // Up to the stop, whose time differs between devices.
    let edges = played.edges();
    edges.take_while(|edge| edge.t_us < 1_990_000).collect()
}

/// Returns the first phases of a channel: start, width, code.
fn pulses(edges: &[Edge], channel: u8) -> Vec<(u64, u64, u16)> {
    let own: Vec<_> = edges
        .iter()
        .filter(|edge| edge.channel == channel)
        .collect();
    let pairs = own
        .windows(2)
        .filter(|window| window[0].state == State::Cathodic);
    pairs
        .map(|pair| (pair[0].t_us, pair[1].t_us - pair[0].t_us, pair[0].dac_code))
        .collect()
}

#[test]
fn the_native_device_plays_the_ramp_and_the_list() {
    let edges = edges(&DeviceName::Native);
    let ramp = pulses(&edges, 0);
    let widths: Vec<_> = ramp.iter().map(|ramp| ramp.1).collect();
    assert!(widths.is_sorted() && widths.len() > 90, "{widths:?}");
    assert!(
        widths[0] >= 10 && *widths.last().unwrap() == 300,
        "{widths:?}"
    );
    // 20 ms of 1.5 s are 4 µs.
    let steps: Vec<_> = widths
        .windows(2)
        .map(|window| window[1] - window[0])
        .collect();
    assert!(steps.iter().all(|step| *step <= 8), "{steps:?}");
    // The first is 20 of 120 ms; 35 mA are reached 500 ms later. While the width grows too, the
    // charge rises no faster than the slope.
    let code = (35_000_u64 * 65_535 / 100_000) as u16;
    assert_eq!(ramp[0].2, (35_000_u64 / 6 * 65_535 / 100_000) as u16);
    let full = ramp.iter().filter(|pair| pair.0 >= ramp[0].0 + 500_000);
    assert!(full.clone().all(|edge| edge.2 == code));
    // The list plays to the microsecond between the train's own pulses.
    let listed = pulses(&edges, 1);
    let code = |ma: u64| (ma * 1_000 * 65_535 / 100_000) as u16;
    let place = listed.iter().position(|pair| pair.2 == code(8)).unwrap();
    let from_us = listed[place].0;
    let seen: Vec<_> = listed[place - 1..place + 4]
        .iter()
        .map(|pair| (pair.0 as i64 - from_us as i64, pair.2))
        .collect();
    let own = code(5);
    let wanted = [
        (-21_234, own),
        (0, code(8)),
        (20_001, code(3)),
        (53_334, code(12)),
        (73_334, own),
    ];
    assert_eq!(seen, wanted);
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
