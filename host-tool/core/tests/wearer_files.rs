//! Wearer files: writing and reading back, errors, and protection of existing files.

use firmware::units::Amplitude;
use host_core::session::SessionError;
use host_core::session::Unit;
use host_core::wearer::{DriftCheck, Evidence, History, StoreError, Wearer, append};
use std::path::PathBuf;

/// A file in which every field is set.
pub(crate) const FULL: &str = r#"
schema = 1
name = "K-05"
evidence = "measured"
source = "nobody: a test"
note = "left handed"

[limits]
max_current_ma = 30.5
rise_ms = 300
fall_ms = 40
host_timeout_ms = 40
max_session_s = 1200
max_dose_mc = 900
hand_stop_required = true

[[electrode]]
channel = 2
place = "wrist flexors"
stage = "voltage"
load_ohm = 2500
area_mm2 = 491
width_us = 200
frequency_hz = 50
motor_threshold = 14.5
limit = 26.001

[[electrode]]
channel = 1
place = "wrist extensors"
stage = "current"
area_mm2 = 2500
width_us = 400
frequency_hz = 30
from_hz = 20
to_hz = 40
motor_threshold = 10
limit = 15
minimum = 10.5
maximum = 14
moves = ["wrist extension", "index finger"]
strength_duration = { rheobase = 6.5, chronaxie_us = 215.385, upper = [{ width_us = 100, value = 25 }, { width_us = 400, value = 15 }] }
muscle = { a_n_per_s = 130.8, k = 0.012, tau_c_ms = 11.5, tau1_ms = 5, tau2_ms = 124.1, reference = 15, slope_per_unit = 0.24, fatigue = {} }
intervals = [{ of = "tau1_ms", low = 4.1, high = 6.2 }, { of = "motor_threshold", low = 9.5, high = 10.5 }]

[forearm]
reach_m = 0.42
around_m = 0.28
thresholds_v = [24, 28.5, 14]
pads_mm = [[60, 5], [120, 0], [190, 105]]

[elbow]
triceps = 1
biceps = 2
triceps_nm = 5.5

[[history]]
at = "2026-11-25T10:00:00Z"
by = "operator-1"
what = "calibrated"
device = "board"
firmware = "0.1.0"
seed = 7

[[check]]
at = "2026-11-26T10:00:00Z"
channel = 1
expected = 10
found = 10.5
unit = "mA"
accepted = true
"#;

pub(crate) fn read(text: &str) -> Result<Wearer, SessionError> {
    Wearer::parse("it.toml", text)
}

/// Returns an empty folder for one test.
fn folder(test: &str) -> PathBuf {
    let name = format!("flexor-wearer-{test}-{}", std::process::id());
    let dir = std::env::temp_dir().join(name);
    let _ = std::fs::remove_dir_all(&dir);
    std::fs::create_dir_all(&dir).unwrap();
    dir
}

#[test]
fn what_is_written_is_read_again_to_the_bit() {
    let full = read(FULL).unwrap_or_else(|e| panic!("{}", e.lines()));
    assert_eq!(full.electrodes[0].channel, 1, "by rising channel");
    let text = full.to_toml();
    let again = read(&text).unwrap_or_else(|e| panic!("{}\n{text}", e.lines()));
    assert_eq!(again, full);
    assert_eq!(again.to_toml(), text);
    let least = Wearer::new("P", Evidence::Assumed, "nobody");
    assert_eq!(read(&least.to_toml()).unwrap(), least);
    // Unusual texts and numbers.
    let mut odd = full;
    odd.note = Some("a \"quoted\" \\ line\nand 筋 'another' \"\"\" one".into());
    odd.electrodes[0].frequency_hz = 1e6 / 30_303.0;
    odd.electrodes[0].holds_hz = [1e6 / 50_001.0, 1e6 / 25_001.0];
    assert_eq!(read(&odd.to_toml()).unwrap(), odd);
}

#[test]
fn history_is_only_ever_appended() {
    let path = folder("history").join("K-05.toml");
    std::fs::write(&path, FULL).unwrap();
    let mut wearer = Wearer::read(&path).unwrap();
    let entry = History {
        at: "12.5 s".into(),
        by: "flexor".into(),
        what: "drift check".into(),
        device: None,
        firmware: None,
        seed: Some(3),
    };
    let check = DriftCheck {
        at: "12.5 s".into(),
        channel: 2,
        expected: Amplitude::new(14_500),
        found: None,
        unit: Unit::Volt,
        accepted: false,
        by: Some("flexor".into()),
        device: None,
        seed: Some(3),
    };
    // Appending keeps every existing byte, including comments.
    let (entries, checks) = (std::slice::from_ref(&entry), std::slice::from_ref(&check));
    let appended = append(&path, entries, checks).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.starts_with(FULL));
    assert_eq!(appended.history.len(), 2);
    assert_eq!(appended.checks[1], check);
    assert_eq!(Wearer::read(&path).unwrap(), appended);
    // Writing a wearer without the new entries, or another wearer, is refused.
    let refused = wearer.write(&path).unwrap_err();
    assert!(matches!(refused, StoreError::Forgets(_)), "{refused}");
    wearer = appended;
    wearer.name = "K-06".into();
    let refused = wearer.write(&path).unwrap_err().to_string();
    assert!(
        refused.starts_with("E654") && refused.contains("K-05"),
        "{refused}"
    );
    assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    wearer.name = "K-05".into();
    wearer.history.push(entry);
    wearer.write(&path).unwrap();
    assert_eq!(Wearer::read(&path).unwrap(), wearer);
}

#[test]
fn what_cannot_be_written_leaves_what_was() {
    let dir = folder("whole");
    let path = dir.join("K-05.toml");
    let wearer = read(FULL).unwrap();
    wearer.write(&path).unwrap();
    let before = std::fs::read(&path).unwrap();
    // The new file cannot be created because a folder has its name.
    std::fs::create_dir(dir.join("K-05.toml.partial")).unwrap();
    let mut more = wearer.clone();
    more.note = Some("more".into());
    let refused = more.write(&path).unwrap_err().to_string();
    assert!(refused.starts_with("E664"), "{refused}");
    assert_eq!(std::fs::read(&path).unwrap(), before);
    std::fs::remove_dir(dir.join("K-05.toml.partial")).unwrap();
    // A wearer that the parser would refuse is not written.
    more.electrodes[0].motor_threshold = more.electrodes[0].limit;
    let refused = more.write(&path).unwrap_err().to_string();
    assert!(
        refused.starts_with("E656") && refused.contains("E653"),
        "{refused}"
    );
    // A file that is no wearer file is never overwritten.
    std::fs::write(&path, "title = \"a session\"\n").unwrap();
    let refused = wearer.write(&path).unwrap_err().to_string();
    assert!(refused.contains("E665"), "{refused}");
    assert_eq!(
        std::fs::read_to_string(&path).unwrap(),
        "title = \"a session\"\n"
    );
}

/// Mistakes: text, replacement, and error number.
#[rustfmt::skip]
const WRONG: [(&str, &str, u16); 23] = [
    ("schema = 1", "schema = 2", 651),
    ("schema = 1\n", "", 404),
    ("schema = 1", "schema = \"1\"", 403),
    ("\"K-05\"", "\"Jane Doe\"", 652),
    ("evidence = \"measured\"", "evidence = \"sure\"", 408),
    ("motor_threshold = 10\n", "motor_threshold = 15\n", 653),
    ("minimum = 10.5", "minimum = 14.5", 653),
    ("maximum = 14", "maximum = 15.5", 653),
    ("maximum = 14", "maximum = 14\njoint_threshold = 14.5", 653),
    ("rheobase = 6.5", "rheobase = 11", 653),
    ("value = 25", "value = 16", 653),
    ("from_hz = 20", "from_hz = 31", 653),
    ("limit = 26.001", "limit = 76.3", 450),
    ("limit = 26.001", "limit = 26.0001", 405),
    ("\nlimit = 15\n", "\nlimit = 31\n", 450),
    ("area_mm2 = 2500", "area_mm2 = 100", 454),
    ("channel = 2\nplace", "channel = 1\nplace", 420),
    ("channel = 1\nexpected", "channel = 3\nexpected", 421),
    ("biceps = 2", "biceps = 3", 421),
    ("moves = [", "movez = [", 402),
    ("width_us = 400, value", "width_us = 100, value", 410),
    ("[120, 0]", "[61, 5]", 481),
    ("[24, 28.5, 14]", "[24, 28.5]", 407),
];

#[test]
fn what_is_wrong_is_told_by_field() {
    read(FULL).unwrap();
    for (find, replace, number) in WRONG {
        assert!(FULL.contains(find), "{find}");
        let bad = FULL.replacen(find, replace, 1);
        let Err(e) = read(&bad) else {
            panic!("{replace} is taken");
        };
        let numbers: Vec<u16> = e.errors().map(|e| e.problem().number()).collect();
        assert!(numbers.contains(&number), "{replace}: {}", e.lines());
        for line in e.lines().lines() {
            assert!(line.contains(" it.toml:"), "without a place: {line}");
        }
    }
}

/// Edits that would raise a limit above the device's own, or replace it by an invalid number: text,
/// replacement, and error number.
#[rustfmt::skip]
const LOOSENED: [(&str, &str, u16); 19] = [
    ("max_current_ma = 30.5", "max_current_ma = 100.001", 407),
    ("max_current_ma = 30.5", "max_current_ma = 30.5\nmax_charge_uc = 40.001", 407),
    ("max_current_ma = 30.5", "max_current_ma = 30.5\nmax_rms_ma = 50.001", 407),
    ("max_current_ma = 30.5", "max_current_ma = 30.5\nmax_sum_ma = 200.001", 407),
    ("max_current_ma = 30.5", "max_current_ma = 30.5\nmax_sum_rms_ma = 50.001", 407),
    ("max_current_ma = 30.5", "max_current_ma = 0", 407),
    ("max_current_ma = 30.5", "max_current_ma = -30.5", 407),
    ("max_current_ma = 30.5", "max_current_ma = nan", 406),
    ("max_current_ma = 30.5", "max_current_ma = inf", 406),
    ("max_current_ma = 30.5", "max_current_ma = \"30.5\"", 403),
    ("max_current_ma = 30.5", "max_current_ma = 30.5\nmax_current_ma = 100", 401),
    ("max_current_ma = 30.5", "max_curent_ma = 30.5", 402),
    ("rise_ms = 300", "rise_ms = 0", 407),
    ("fall_ms = 40", "fall_ms = 101", 407),
    ("host_timeout_ms = 40", "host_timeout_ms = 1001", 407),
    ("max_session_s = 1200", "max_session_s = 86401", 407),
    ("max_dose_mc = 900", "max_dose_mc = 4320001", 407),
    ("hand_stop_required = true", "hand_stop_required = 1", 403),
    ("[[electrode]]\nchannel = 2", "[limits]\nmax_current_ma = 100\n[[electrode]]\nchannel = 2", 401),
];

#[test]
fn no_edit_of_a_file_loosens_a_limit_beyond_the_devices_own() {
    for (find, replace, number) in LOOSENED {
        assert!(FULL.contains(find), "{find}");
        let Err(e) = read(&FULL.replacen(find, replace, 1)) else {
            panic!("{replace} is taken");
        };
        let numbers: Vec<u16> = e.errors().map(|e| e.problem().number()).collect();
        assert_eq!(numbers.first(), Some(&number), "{replace}: {}", e.lines());
    }
}

#[test]
fn another_schema_is_all_that_is_told_of_it() {
    let e = read("schema = 12\nwho = \"K01\"\n").unwrap_err();
    assert_eq!(e.errors().count(), 1);
    let message = e.one_line();
    assert!(
        message.starts_with("E651 it.toml:1:10: `schema` is 12"),
        "{message}"
    );
}

#[test]
fn every_mistake_of_a_file_is_told_at_once() {
    let mut bad = FULL.to_owned();
    for (find, replace) in [
        ("\"K-05\"", "\"Jane Doe\""),
        ("motor_threshold = 10\n", "motor_threshold = 15\n"),
        ("limit = 26.001", "limit = 76.3"),
        ("fall_ms = 40", "fall_ms = 400"),
        ("seed = 7", "sead = 7"),
    ] {
        assert!(bad.contains(find), "{find}");
        bad = bad.replacen(find, replace, 1);
    }
    let e = read(&bad).unwrap_err();
    let mut numbers: Vec<u16> = e.errors().map(|e| e.problem().number()).collect();
    numbers.sort_unstable();
    assert_eq!(numbers, [402, 407, 450, 652, 653], "{}", e.lines());
}

#[test]
fn what_is_no_text_of_a_file_is_refused() {
    let dir = folder("odd");
    let file = |name: &str, bytes: &[u8]| {
        let path = dir.join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let binary = file("binary.toml", &[0xff, 0xfe, 0, 1]);
    let large = file("large.toml", &vec![b'#'; (1 << 20) + 1]);
    for path in [dir.clone(), dir.join("absent.toml"), binary, large] {
        let e = Wearer::read(&path).unwrap_err();
        let message = e.one_line();
        assert!(message.starts_with("E650 "), "{message}");
        assert!(message.contains(&*path.to_string_lossy()), "{message}");
    }
    let e = read("schema = 1\n\u{0}not toml").unwrap_err();
    assert_eq!(e.problem().number(), 401, "{}", e.lines());
    // For a file that is no wearer file at all, the message contains nothing of its text.
    let e = read("root:x:0:0\u{0}").unwrap_err();
    assert_eq!(e.problem().number(), 665, "{}", e.lines());
    assert!(!e.lines().contains("root"), "{}", e.lines());
}
