//! Test vectors of the checksum over a setup: requests in the order in which they are sent, and the
//! checksum that `Arm` then carries.

use super::{hex, messages};
use firmware::link::{MAX_MESSAGE, Request, SetupSum};
use std::collections::BTreeMap;

/// Name of a vector, and names of the vectors of its requests.
const SETUPS: [(&str, &[&str]); 16] = [
    ("nothing", &[]),
    ("a channel", &[CHANNEL]),
    ("two channels", &[CHANNEL, OTHER]),
    ("two channels, the other one first", &[OTHER, CHANNEL]),
    (
        "a later request for the same channel replaces the earlier one",
        &[EARLIER, CHANNEL],
    ),
    ("Clear removes everything", &[CHANNEL, "groups", "clear"]),
    ("Hello removes everything", &[CHANNEL, "groups", "hello"]),
    (
        "a wearer with the defaults counts as none",
        &["wearer, defaults", CHANNEL],
    ),
    ("groups", &[CHANNEL, OTHER, "groups"]),
    (
        "no groups removes the groups",
        &[CHANNEL, OTHER, "groups", "no groups"],
    ),
    ("sync", &[CHANNEL, "sync"]),
    (
        "no sync removes the sync output",
        &[CHANNEL, "sync", "no sync"],
    ),
    (
        "modulated joints have a place each",
        &[CHANNEL, "modulated shoulder", "modulated elbow"],
    ),
    (
        "setpoints, Status and KeepAlive do not count",
        &[CHANNEL, "amplitudes", "status", "keep-alive"],
    ),
    ("muscle and joint", &["joint, PID", "muscle", CHANNEL]),
    (
        "an arm and its lines",
        &[
            CHANNEL,
            "line over the shoulder",
            "arm, held",
            "line over the elbow",
        ],
    ),
];

const CHANNEL: &str = "channel, biphasic, current stage";
const OTHER: &str = "channel, doublets, voltage stage";
const EARLIER: &str = "channel, live width and lists, in place of the first";

/// Returns the vectors as lines of JSON.
pub fn lines() -> Vec<String> {
    let known: BTreeMap<&str, Request> = messages::requests()
        .into_iter()
        .map(|(name, sent)| (name, sent.request))
        .collect();
    let line = |(name, requests): &(&str, &[&str])| {
        let mut sum = SetupSum::default();
        let mut sent = Vec::new();
        for name in *requests {
            let request = known
                .get(name)
                .unwrap_or_else(|| panic!("no vector {name}"));
            match request {
                // A device that opens a session begins with an empty setup.
                Request::Hello { .. } => sum.note(&Request::Clear),
                request => sum.note(request),
            }
            let mut buffer = [0; MAX_MESSAGE];
            let bytes = postcard::to_slice(request, &mut buffer).expect("plain data");
            let json = serde_json::to_string(request).expect("plain data");
            sent.push(format!(
                "    {{\"request\": {json}, \"postcard\": \"{}\"}}",
                hex(bytes, "")
            ));
        }
        let (name, total) = (serde_json::to_string(name).expect("text"), sum.total());
        format!(
            "{{\"name\": {name}, \"setup\": {total}, \"requests\": [\n{}\n  ]}}",
            sent.join(",\n")
        )
    };
    SETUPS.iter().map(line).collect()
}

/// Requests for one channel really replace each other, and every rule of the page has a vector that
/// another rule would fail.
#[test]
fn the_setups_show_each_rule() {
    let lines = lines();
    let value = |name: &str| {
        let all = lines
            .iter()
            .map(|line| serde_json::from_str::<serde_json::Value>(line));
        let mut all = all.map(|line| line.expect("JSON"));
        let found = all
            .find(|line| line["name"] == name)
            .unwrap_or_else(|| panic!("no {name}"));
        found["setup"].as_u64().expect("a number")
    };
    let channel = value("a channel");
    for (name, expected) in [
        ("nothing", 0),
        ("Clear removes everything", 0),
        ("Hello removes everything", 0),
        (
            "a later request for the same channel replaces the earlier one",
            channel,
        ),
        ("a wearer with the defaults counts as none", channel),
        ("no groups removes the groups", value("two channels")),
        ("no sync removes the sync output", channel),
        ("setpoints, Status and KeepAlive do not count", channel),
        ("two channels, the other one first", value("two channels")),
    ] {
        assert_eq!(value(name), expected, "{name}");
    }
    for name in [
        "two channels",
        "groups",
        "sync",
        "modulated joints have a place each",
    ] {
        assert_ne!(value(name), channel, "{name}");
    }
}
