//! Effect of each operator key on the outputs, and repetition of a run from the keys in its record.

use hal_sim::random::{unit, word};
use hal_sim::trace::{State, Trace};
use host_core::record::{Marker, MarkerKind, Recorder, Run, load, write_run};
use host_core::run::{
    Control, DeviceName, INTENSITY_STEP, Keys, Observation, Observer, SessionFile, begin_trial,
    replay_keys, run,
};
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};

const FALL_US: u64 = 40_000;
/// Duration of a pulse of the session, µs: two phases and the gap.
const PULSE_US: u64 = 450;
/// Interval of setpoints plus the device's delay, and the time by which programs are sent ahead,
/// µs.
const SETPOINT_US: u64 = 22_000;
const AHEAD_US: u64 = 100_000;
/// Full scale of a channel at code 65,535.
const FULL_SCALE_UA: u64 = 100_000;
const DURATION_US: u64 = 2_500_000;

/// Two channels with constant amplitudes, one channel with pulses that ramp, and one with the sync
/// output.
const SESSION: &str = r#"
title = "Hands"
duration_s = 2.5

[wearer]
rise_ms = 100
fall_ms = 40

[[channel]]
number = 2
name = "flexor"
stage = { kind = "current", full_scale_ma = 100.0 }
limit = 15.0
train = { shape = "biphasic-cathodic-first", width_us = 200, gap_us = 50, frequency_hz = 50.0 }

[[channel]]
number = 5
name = "extensor"
stage = { kind = "current", full_scale_ma = 100.0 }
limit = 9.0
train = { shape = "biphasic-cathodic-first", width_us = 200, gap_us = 50, frequency_hz = 40.0, offset_us = 5000 }

[sync]
channel = 2

[setpoints]
kind = "amplitudes"
values = [{ channel = 2, value = 8.0 }, { channel = 5, value = 6.0 }]
rate_hz = 50
"#;

/// For each channel: number, amplitude in the session, and limit, µA.
const ASKED: [(u8, u64, u64); 2] = [(2, 8_000, 15_000), (5, 6_000, 9_000)];

fn session() -> SessionFile {
    SessionFile::parse("session.toml", SESSION).unwrap()
}

/// Returns a session with the same channels, switched on and off by programs with the same peaks.
fn programs() -> SessionFile {
    let (setup, _) = SESSION.split_once("[setpoints]").unwrap();
    let program = |channel: u8, value: f64| {
        format!(
            "[[program]]\nkind = \"on-off\"\nchannels = [{channel}]\nvalue = {value}\n\
             on_s = 0.6\noff_s = 0.3\nramp_up_s = 0.2\nramp_down_s = 0.1\n"
        )
    };
    let text = format!("{setup}{}{}", program(2, 8.0), program(5, 6.0));
    SessionFile::parse("programs.toml", &text).unwrap()
}

/// Returns the random keys of `seed` with their times, µs after the start.
fn sequence(seed: u64) -> Vec<(u64, Control)> {
    let count = word(seed, 0) % 24;
    let mut keys: Vec<_> = (1..=count)
        .map(|index| {
            let at_us = (unit(seed, index) * DURATION_US as f64) as u64;
            let channel = [2, 5, 7][word(seed, index + 100) as usize % 3];
            let key = match word(seed, index + 200) % 16 {
                0..=2 => Control::Pause,
                3..=6 => Control::Resume,
                7..=10 => Control::Raise(channel),
                11..=13 => Control::Lower(channel),
                14 => Control::Mark(format!("note, \"{index}\"\nµ; =1+1")),
                _ if index == count => Control::Stop,
                _ => Control::Raise(2),
            };
            (at_us, key)
        })
        .collect();
    keys.sort_by_key(|(at_us, _)| *at_us);
    keys
}

/// An operator who presses keys at their times.
struct Person(VecDeque<(u64, Control)>);

impl Observer for Person {
    fn observe(&mut self, _: Observation<'_>) {}

    fn next_control(&mut self, now_us: u64) -> Option<Control> {
        let (_, key) = self.0.pop_front_if(|(at_us, _)| *at_us <= now_us)?;
        Some(key)
    }
}

/// Plays the session into a record in `dir`. Returns the markers, the output, and the time of the
/// start in it, µs.
fn play_recorded(
    file: &SessionFile,
    dir: &Path,
    hands: impl Observer + Send,
) -> (Vec<Marker>, Trace, u64) {
    let _ = std::fs::remove_dir_all(dir);
    let mut run_of = Run {
        title: "hands".to_owned(),
        ..Run::default()
    };
    write_run(dir, &run_of).unwrap();
    let mut recorder = Recorder::create(dir, 0, &begin_trial(file)).unwrap();
    let port = DeviceName::Native.open(&file.session, 1).unwrap();
    let (outcome, port) = run(file, port, Some(&mut recorder), hands);
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    let trial = outcome.trial;
    recorder.finish(&trial.counters, trial.duration_s).unwrap();
    run_of.trials.push(trial);
    let mut port = port.unwrap();
    let trace = port.world().unwrap().recorder.trace.clone();
    let epoch_us = outcome.epoch_us.unwrap();
    (run_of.trials.remove(0).markers, trace, epoch_us)
}

/// Returns every file below `dir`, by its relative path.
fn files(dir: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        let name = PathBuf::from(path.file_name().unwrap());
        match path.is_dir() {
            true => {
                let inside = files(&path).into_iter();
                found.extend(inside.map(|(inner, bytes)| (name.join(inner), bytes)));
            }
            false => {
                found.insert(name, std::fs::read(&path).unwrap());
            }
        }
    }
    found
}

/// Returns the intensities that a channel may have at `t_us`: all since the previous setpoint.
fn intensities(markers: &[Marker], channel: u8, t_us: u64, late_us: u64) -> Vec<u64> {
    let mut known = vec![100];
    for marker in markers
        .iter()
        .filter(|marker| marker.channel == Some(channel))
    {
        if marker.host_us > t_us {
            break;
        }
        if marker.host_us + late_us < t_us {
            known.clear();
        }
        known.extend(marker.intensity_percent.map(u64::from));
    }
    known
}

/// Checks the output against the pressed keys. Returns the longest time from a pause to the end of
/// the last pulse, µs.
fn judge(markers: &[Marker], (trace, epoch_us): (&Trace, u64), late_us: u64) -> Option<u64> {
    let mut intensity = BTreeMap::from([(2, 100), (5, 100)]);
    for marker in markers {
        let Some((channel, percent)) = marker.channel.zip(marker.intensity_percent) else {
            continue;
        };
        let Some(before) = intensity.insert(channel, percent) else {
            assert_eq!((channel, percent), (7, 100), "not in use");
            assert!(!marker.text.is_empty());
            intensity.remove(&7);
            continue;
        };
        let has_effect = marker.text.is_empty();
        let expected = match marker.kind {
            MarkerKind::Raise if has_effect => before + INTENSITY_STEP,
            MarkerKind::Lower if has_effect => before.saturating_sub(INTENSITY_STEP),
            _ => before,
        };
        assert_eq!(percent, expected, "{marker:?}");
    }
    // Times of the last pause and the last resumption, µs.
    let edges: Vec<_> = trace.edges_from(epoch_us).collect();
    for edge in edges.iter().filter(|edge| edge.state == State::Cathodic) {
        let (channel, t_us) = (edge.channel + 1, edge.t_us - epoch_us);
        let (_, asked, limit) = ASKED.into_iter().find(|pair| pair.0 == channel).unwrap();
        let most = intensities(markers, channel, t_us, late_us)
            .into_iter()
            .max()
            .unwrap();
        let most = (asked * most / 100).min(limit);
        let highest = most * 65_535 / FULL_SCALE_UA + 1;
        let code = u64::from(edge.dac_code);
        assert!(
            code <= highest,
            "channel {channel} at {t_us} µs: code {code} above {highest}"
        );
    }
    let mut longest = None;
    let mut paused_us = None;
    let by_hand = markers.iter().filter(|marker| marker.text.is_empty());
    let ends =
        by_hand.filter(|marker| matches!(marker.kind, MarkerKind::Pause | MarkerKind::Resume));
    let mut ends: Vec<_> = ends.collect();
    let last = Marker {
        host_us: u64::MAX,
        kind: MarkerKind::Resume,
        ..markers.first().cloned()?
    };
    ends.push(&last);
    for end in ends {
        match (end.kind, paused_us) {
            (MarkerKind::Pause, _) => paused_us = Some(end.host_us),
            (_, Some(from_us)) => {
                let is_within = |t_us: u64| (from_us..end.host_us).contains(&(t_us - epoch_us));
                let within = edges.iter().filter(|edge| is_within(edge.t_us));
                let pulses =
                    within.filter(|edge| edge.state != State::Isolated && edge.dac_code > 0);
                let over = pulses.map(|edge| edge.t_us - epoch_us - from_us).max();
                longest = longest.max(over);
                paused_us = None;
            }
            _ => {}
        }
    }
    longest
}

/// Presses `sequences` random sequences of keys from seed `first` on, repeats each from its record,
/// and checks that both runs are equal byte for byte.
fn check_random_keys(file: &SessionFile, late_us: u64, first: u64, sequences: u64) {
    let dir = std::env::temp_dir().join(format!("flexor-hands-{}-{first}", std::process::id()));
    let (first_dir, other) = (dir.join("one"), dir.join("other"));
    let (mut pressed, mut paused, mut longest_us) = (0, 0, 0);
    for seed in first..first + sequences {
        let keys = sequence(seed);
        let (markers, trace, epoch_us) = play_recorded(file, &first_dir, Person(keys.into()));
        pressed += markers.len();
        if let Some(over_us) = judge(&markers, (&trace, epoch_us), late_us) {
            paused += 1;
            longest_us = longest_us.max(over_us);
        }
        let record = load(&first_dir).unwrap();
        let again = Keys::from_markers(&record.trials[0].markers);
        play_recorded(file, &other, replay_keys(again, |_: f64| ()));
        let (was, is) = (files(&first_dir), files(&other));
        let differs = was
            .iter()
            .find(|(name, bytes)| is.get(*name) != Some(bytes));
        assert!(
            differs.is_none(),
            "seed {seed}: {:?}",
            differs.map(|difference| difference.0)
        );
        assert_eq!(was.len(), is.len());
    }
    std::fs::remove_dir_all(dir).unwrap();
    println!(
        "{sequences} sequences of keys from seed {first}: {pressed} keys, {paused} with a pulse \
         after a pause, the last one up to {longest_us} µs after it"
    );
    assert!(pressed as u64 > 4 * sequences, "{pressed}");
    assert!(paused > sequences / 10, "{paused}");
    assert!(longest_us <= FALL_US + PULSE_US + 2_000, "{longest_us} µs");
}

#[test]
fn keys_do_what_they_say_and_are_repeated_to_the_byte() {
    check_random_keys(&session(), SETPOINT_US, 43_000, 24);
    check_random_keys(&programs(), SETPOINT_US + AHEAD_US, 43_500, 24);
}

/// Run with `cargo test -p host-core --test suite controls -- --ignored --nocapture`.
#[test]
#[ignore = "a minute"]
fn a_thousand_sequences_of_keys_are_repeated_to_the_byte() {
    check_random_keys(&session(), SETPOINT_US, 43_001_000, 1_000);
    check_random_keys(&programs(), SETPOINT_US + AHEAD_US, 43_003_000, 1_000);
}

/// The channel follows the session's amplitude of 6 mA and has a limit of 9 mA, which is ten steps
/// above it.
#[test]
fn a_key_never_raises_above_the_limit() {
    let dir = std::env::temp_dir().join(format!("flexor-limit-{}", std::process::id()));
    let keys = (1..60).map(|index| (index * 30_000, Control::Raise(5)));
    let (markers, trace, epoch_us) = play_recorded(&session(), &dir, Person(keys.collect()));
    judge(&markers, (&trace, epoch_us), SETPOINT_US);
    let refused = markers.iter().filter(|marker| !marker.text.is_empty());
    let texts: Vec<_> = refused.map(|marker| marker.text.as_str()).collect();
    assert_eq!(texts.len(), 59 - 10, "9 mA are 150 % of 6 mA");
    assert!(texts[0].contains("would exceed its limit"), "{}", texts[0]);
    let codes = trace.edges_from(epoch_us).filter(|edge| edge.channel == 4);
    assert_eq!(codes.map(|code| code.dac_code).max(), Some(5_898)); // 9 mA of 100 mA
    std::fs::remove_dir_all(dir).unwrap();
}

/// Such trains cannot be resumed, so the pause ends the session.
#[test]
fn a_pause_ends_trains_of_a_fixed_number_of_pulses() {
    let dir = std::env::temp_dir().join(format!("flexor-counted-{}", std::process::id()));
    let mut file = session();
    for channel in &mut file.session.channels {
        channel.spec.train.repeats = 40;
        channel.spec.start = channel.spec.limit;
    }
    let keys = [(300_000, Control::Pause), (600_000, Control::Resume)];
    let (markers, trace, epoch_us) = play_recorded(&file, &dir, Person(keys.into()));
    assert_eq!(markers.len(), 1);
    assert!(markers[0].text.contains("the session ends"));
    let last = trace.edges_from(epoch_us).last().unwrap();
    assert!(last.t_us - epoch_us < 345_000, "{last:?}");
    std::fs::remove_dir_all(dir).unwrap();
}
