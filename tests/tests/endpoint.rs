//! A wanted force at the hand does the same on every simulator, edge by edge.

use hal_sim::trace::Edge;
use host_core::run::{DeviceName, SessionFile};
use std::collections::BTreeSet;
use tests::desk::{play, shipped};

/// The shipped session, three times as fast.
fn file(rate: &str) -> SessionFile {
    let mut text = std::fs::read_to_string(shipped("endpoint_force.toml")).unwrap();
    // Rising: none becomes one that is yet to come.
    let times = ["1.0", "2.0", "3.0", "4.0", "5.0", "6.0"];
    for time in times {
        let third = time.parse::<f64>().unwrap() / 3.0;
        text = text.replace(&format!("_s = {time}"), &format!("_s = {third:.3}"));
    }
    let text = text.replace("rate_hz = 200", rate);
    SessionFile::parse("endpoint_force.toml", &text).unwrap()
}

/// Edges of the pins from the start on, with times from there.
fn edges(rate: &str, device: &DeviceName) -> Vec<Edge> {
    let played = play(&file(rate), device);
    let events = &played.outcome.trial.events;
    assert_eq!(played.outcome.refused, 0, "{device}: {events:?}");
    // Up to the stop, which comes at a time of each device's own.
    let edges = played.edges();
    edges.take_while(|edge| edge.t_us < 1_990_000).collect()
}

/// Amplitude codes of a channel's bursts, one after the other.
fn codes(edges: &[Edge], channel: u8) -> Vec<u16> {
    let driven = edges
        .iter()
        .filter(|it| it.state.is_driven() && it.channel == channel);
    driven.step_by(2).map(|it| it.dac_code).collect() // two phases
}

#[test]
fn the_native_device_recruits_at_both_rates() {
    let counts = ["rate_hz = 200", "rate_hz = 20"].map(|rate| {
        let edges = edges(rate, &DeviceName::Native);
        let playing: BTreeSet<u8> = edges.iter().map(|it| it.channel).collect();
        assert!(playing.len() >= 3, "{playing:?}");
        // How many amplitudes each channel came to, one after the other.
        let changes = |channel: &u8| {
            let codes = codes(&edges, *channel);
            codes.windows(2).filter(|two| two[0] != two[1]).count()
        };
        playing.iter().map(changes).sum::<usize>()
    });
    println!("{counts:?} changes of amplitude at 200 and at 20 Hz");
    // Bursts come at 40 Hz: of two at least one keeps its amplitude.
    assert!(counts[0] > 3 * counts[1] / 2, "{counts:?}");
}

#[test]
fn the_flashed_image_plays_it_as_the_native_device_does() {
    for rate in ["rate_hz = 200", "rate_hz = 20"] {
        let (native, chip) = (
            edges(rate, &DeviceName::Native),
            edges(rate, &DeviceName::Chip),
        );
        let differ = native.iter().zip(&chip).filter(|(a, b)| a != b);
        for (native, chip) in differ.clone().take(5) {
            println!("native {native:?}\n  chip {chip:?}");
        }
        assert_eq!((differ.count(), chip.len()), (0, native.len()), "{rate}");
        println!("{rate}: {} edges are the same", native.len());
    }
}
