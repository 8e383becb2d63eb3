//! Channels that are configured but never receive an amplitude are noted, and no others.

use crate::session_errors::{GOOD, spoil};
use host_core::session::Session;

/// Returns a session with two open-loop channels; `setpoints` drives them.
fn two(setpoints: &str) -> String {
    let channel = |number: u8| {
        format!(
            "[[channel]]\nnumber = {number}\nname = \"it\"\n\
             stage = {{ kind = \"current\", full_scale_ma = 50.0 }}\nlimit = 15.0\n\
             train = {{ shape = \"biphasic-cathodic-first\", width_us = 200, \
             frequency_hz = 50.0 }}\n"
        )
    };
    let (first, other) = (channel(1), channel(2));
    format!("title = \"Two\"\nduration_s = 1.0\n{first}{other}[setpoints]\n{setpoints}\n")
}

/// Returns the channels that are noted as silent.
fn silent(text: &str) -> Vec<u8> {
    let session = Session::parse("two.toml", text).unwrap_or_else(|e| panic!("{}", e.lines()));
    let notes = session.notes.iter();
    let silent = notes.filter(|note| note.contains("never receives an amplitude"));
    let number = |note: &String| {
        let (number, _) = note.strip_prefix("channel ")?.split_once(':')?;
        number.parse().ok()
    };
    silent.filter_map(number).collect()
}

#[test]
fn a_channel_without_an_amplitude_is_noted() {
    let values = |values: &str| {
        two(&format!(
            "kind = \"amplitudes\"\nrate_hz = 50\nvalues = [{values}]"
        ))
    };
    let entry = "{ channel = 1, value = 5.0 }";
    assert_eq!(silent(&values(entry)), [2]);
    assert_eq!(
        silent(&values(&format!("{entry}, {{ channel = 2, value = 0 }}"))),
        [2]
    );
    assert_eq!(
        silent(&values(&format!("{entry}, {{ channel = 2, value = 5.0 }}"))),
        [0; 0]
    );
    let session = Session::parse("two.toml", &values(entry)).unwrap();
    let wanted = "channel 2: it is configured, but never receives an amplitude, so it stays at";
    assert!(session.notes[0].starts_with(wanted), "{:?}", session.notes);
    // A live client raises the channel within its bounds.
    let bounds = "bounds = [{ channel = 2, least = 0, most = 5.0 }]";
    assert_eq!(silent(&format!("{}\n{bounds}\n", values(entry))), [0; 0]);
}

/// Beside a joint the fourth channel is unused, unless a value of 0 says that it is the third one's
/// partner.
#[test]
fn a_channel_that_a_joint_drives_is_not_noted() {
    assert_eq!(silent(GOOD), [4]);
    let endless = spoil(GOOD, "repeats = 7 → repeats = 0");
    let beside = "rate_hz = 90 → rate_hz = 90 ⏎ values = [{ channel = 4, value = VALUE }]";
    for value in ["0", "5.0"] {
        let text = spoil(&endless, &beside.replace("VALUE", value));
        assert_eq!(silent(&text), [0; 0], "{value}");
    }
}

/// Setpoints that are always 0, and an object that is never held.
#[test]
fn a_course_of_nothing_is_noted() {
    let shipped = |file: &str| {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let path = path.join("../sessions").join(file);
        std::fs::read_to_string(path).unwrap()
    };
    let zero = |text: &str, replacements: &[(&str, &str)]| {
        replacements
            .iter()
            .fold(text.to_owned(), |text, (from, to)| {
                assert!(text.contains(from), "{from}");
                text.replace(from, to)
            })
    };
    for (file, edits, channels) in [
        ("lift.toml", &[("held = true", "held = false")][..], 8),
        (
            "force_ramp.toml",
            &[
                (", n = 1.0", ", n = 0"),
                (", n = 6.0", ", n = 0"),
                (", n = 12.0", ", n = 0"),
            ],
            1,
        ),
        (
            "width_ramp.toml",
            &[("width_us = 300 }", "width_us = 0 }")],
            1, // the other channel is for lists
        ),
        (
            "endpoint_force.toml",
            &[
                ("[-2.0, 3.0, 2.5]", "[0, 0, 0]"),
                ("[2.0, -2.0, 1.0]", "[0, 0, 0]"),
            ],
            9,
        ),
    ] {
        let text = shipped(file);
        assert_eq!(silent(&text), [0; 0], "{file}");
        assert_eq!(silent(&zero(&text, edits)).len(), channels, "{file}");
    }
}
