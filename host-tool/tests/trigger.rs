//! Tests of sessions with a trigger: edges from the session file start trains exactly 1000 µs
//! later; a session without pulses reports that first.

use crate::program::{run_flexor, test_folder, write_file};
use firmware::link::Request;
use hal_sim::trace::State;
use host_core::link::{Connection, Port};
use host_core::run::{DeviceName, Outcome, SessionFile, run};

const TRIGGER: &str = include_str!("../sessions/trigger.toml");

/// Runs `text` natively; returns the outcome, and when each channel's first phases began, µs from
/// the start.
fn play(text: &str) -> (Outcome, [Vec<u64>; 2]) {
    let file = SessionFile::parse("trigger.toml", text).unwrap();
    let port = DeviceName::Native.open(&file.session, 1).unwrap();
    let (outcome, port) = run(&file, port, None, |_| ());
    if let Some(error) = &outcome.error {
        panic!("{error}");
    }
    let epoch = outcome.epoch_us.unwrap();
    let mut port = port.unwrap();
    let trace = &port.world().unwrap().recorder.trace;
    let begins = [0, 1].map(|channel| {
        let edges = trace.channel_edges(channel);
        let first = edges.filter(|e| e.t_us >= epoch && e.state == State::Cathodic);
        first.map(|e| e.t_us - epoch).collect()
    });
    (outcome, begins)
}

/// Returns ten pulses at 50 Hz, `delay` µs after each of `edges`.
fn trains(edges: &[u64], delay: u64) -> Vec<u64> {
    let train = |&edge: &u64| (0..10).map(move |n| edge + delay + n * 20_000);
    edges.iter().flat_map(train).collect()
}

#[test]
fn each_edge_starts_its_trains_exactly_1000_us_later() {
    let odd = TRIGGER.replace("every_s = 1.0", "at_s = [0.01, 0.251013, 0.5, 7.654321]");
    for (text, edges) in [
        (TRIGGER, (1..10).map(|s| s * 1_000_000).collect::<Vec<_>>()),
        (&odd, vec![10_000, 251_013, 500_000, 7_654_321]),
    ] {
        let (outcome, begins) = play(text);
        assert_eq!(begins[0], trains(&edges, 1_000));
        assert_eq!(begins[1], trains(&edges, 3_000));
        let mut counters = outcome.trial.counters.iter();
        let idle = counters.find(|(name, _)| name.contains("without a train"));
        assert_eq!(idle.unwrap().1, 0);
        // The first slot of a ramp may have code 0.
        let pulses = outcome.trial.pulses.unwrap();
        let slots = begins.iter().map(|b| b.len() as u64).sum::<u64>();
        let edges = edges.len() as u64;
        println!("{pulses} pulses above 0 in {slots} slots, from {edges} edges");
        assert!(pulses <= slots && pulses + 2 * edges >= slots);
        assert_eq!(outcome.trial.silent, None);
    }
}

#[test]
fn a_session_without_a_pulse_says_so_first() {
    let without = TRIGGER.replace("[simulated_trigger]\nevery_s = 1.0\n", "");
    let untriggered = without.replace(", triggered = true", "");
    let zero = untriggered.replace("value = 10.0", "value = 0.0");
    let late = untriggered
        .replace("duration_s = 10.0", "duration_s = 0.5")
        .replace("50.0, offset_us = 2000", "50.0")
        .replace(
            "frequency_hz = 50.0",
            "period_us = 1000000, offset_us = 900000",
        );
    for (name, text, why) in [
        (
            "untriggered",
            &without,
            "every channel waits for a trigger, and none arrived",
        ),
        ("zero", &zero, "all amplitudes of the session are 0"),
        (
            "late",
            &late,
            "the session ended before the first pulse was due (offset_us of the first channel)",
        ),
    ] {
        let folder = test_folder(&format!("trigger/{name}"));
        write_file(&folder, "session.toml", text);
        let flexor = |arguments: &[&str]| {
            let (_, out, _) = run_flexor(&folder, &[&["run", "session.toml"], arguments].concat());
            out
        };
        let output = flexor(&["--out", "people"]);
        let first = output.lines().next().unwrap();
        println!("{name}: {first}");
        assert!(first.starts_with("no pulse was played: "), "{output}");
        assert!(first.contains(why), "{output}");
        let json: serde_json::Value =
            serde_json::from_str(&flexor(&["--json", "--out", "machines"])).unwrap();
        assert_eq!(json["pulses"], 0, "{json}");
        assert!(json["no_pulse_was_played"].as_str().unwrap().contains(why));
        let summary = std::fs::read(folder.join("people/summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
        let trial = &summary["trials"][0];
        assert_eq!(trial["pulses"], 0);
        assert!(trial["no_pulse_was_played"].as_str().unwrap().contains(why));
    }
}

/// A client of the simulator requests edges: each is acknowledged and starts ten pulses, and no
/// frame is lost.
#[test]
fn a_client_asks_for_an_edge() {
    let file = SessionFile::parse("trigger.toml", TRIGGER).unwrap();
    let port = DeviceName::Native.open(&file.session, 1).unwrap();
    let (mut client, _) = Connection::open(port).unwrap();
    for request in file.session.setup_requests() {
        client.request(request).unwrap();
    }
    client.arm().unwrap();
    let first = file.session.setpoints.at(0).to_request(None);
    client.request(first.clone()).unwrap();
    client.start().unwrap();
    let mut asked = Vec::new();
    for step in 0..60 {
        if step % 20 == 10 {
            asked.push(client.port().now_us());
            client.request(Request::SimulateTrigger).unwrap();
        }
        client.request(first.clone()).unwrap();
        let until = client.port().now_us() + 20_000;
        while client.next(until).unwrap().is_some() {}
    }
    let status = client.status().unwrap();
    assert_eq!(
        (status.counters.lost_frames, status.counters.refused),
        (0, 0)
    );
    assert_eq!(status.counters.idle_triggers, 0);
    let trace = &client.port().world().unwrap().recorder.trace;
    let edges = trace
        .channel_edges(0)
        .filter(|e| e.state == State::Cathodic);
    let begins: Vec<u64> = edges.map(|e| e.t_us).filter(|t| *t > asked[0]).collect();
    assert_eq!((asked.len(), begins.len()), (3, 30));
    for (asked, train) in asked.iter().zip(begins.chunks(10)) {
        let after_us = train[0] - asked;
        println!("train {after_us} µs after the request was sent");
        assert!((1_001..=2_100).contains(&after_us), "{after_us}");
        assert_eq!(train, trains(&[train[0]], 0));
    }
}
