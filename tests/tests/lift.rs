//! Stimulation that follows the joints of two arms: the same edges on every simulator, with the
//! amplitude of the quartic at every angle.

use firmware::haptics::{Form, ModulatedSpec, ModulationSpec, QuarticSpec};
use hal_sim::trace::Edge;
use host_core::run::{DeviceName, SessionFile};
use host_core::session::{Session, SessionJoint};
use std::collections::BTreeSet;
use tests::desk::{play, session_path};

/// Returns the edges of the pins from the start up to `until_us`, with times relative to the start.
fn edges(file: &SessionFile, device: &DeviceName, until_us: u64) -> Vec<Edge> {
    let played = play(file, device);
    let events = &played.outcome.trial.events;
    assert_eq!(played.outcome.refused, 0, "{device}: {events:?}");
    let edges = played.edges();
    edges.take_while(|edge| edge.t_us < until_us).collect()
}

/// Just before the stop, whose time differs between devices.
const END_US: u64 = 8_990_000;

#[test]
fn the_flashed_image_lifts_as_the_native_device_does() {
    for name in ["lift.toml", "lift_resist.toml"] {
        let file = SessionFile::load(&session_path(name)).unwrap();
        let [native, chip] =
            [DeviceName::Native, DeviceName::Chip].map(|device| edges(&file, &device, END_US));
        let differ = native.iter().zip(&chip).filter(|(a, b)| a != b);
        for (native, chip) in differ.clone().take(5) {
            println!("native {native:?}\n  chip {chip:?}");
        }
        assert_eq!((differ.count(), chip.len()), (0, native.len()), "{name}");
        let playing: BTreeSet<u8> = native.iter().map(|edge| edge.channel).collect();
        assert_eq!(playing.len(), 8);
        println!("{name}: {} edges are the same", native.len());
    }
}

/// Runs the shipped session with 100 host messages per second, which arrive at any time between
/// bursts. Over USB they arrive later than on the native device, and a burst in between has the
/// previous angle. All edges have the same times; amplitudes differ by at most the effect of one
/// message.
#[test]
fn a_burst_between_arrivals_has_the_word_before() {
    let text = std::fs::read_to_string(session_path("lift.toml")).unwrap();
    assert!(text.contains("rate_hz = 60"));
    let text = text.replace("rate_hz = 60", "rate_hz = 100");
    let file = SessionFile::parse("words.toml", &text).unwrap();
    let [native, chip] =
        [DeviceName::Native, DeviceName::Chip].map(|device| edges(&file, &device, END_US));
    let place = |edge: &Edge| (edge.t_us, edge.channel, edge.state);
    assert!(native.iter().map(place).eq(chip.iter().map(place)));
    let bursts = native.iter().zip(&chip);
    let bursts = bursts.filter(|(a, _)| a.state.is_driven());
    let (mut count, mut differ, mut latest_us, mut most) = (0, 0, 0, 0);
    for (native, chip) in bursts {
        count += 1;
        if native.dac_code == chip.dac_code {
            continue;
        }
        differ += 1;
        latest_us = latest_us.max(native.t_us % WORD_US);
        let by = native.dac_code.abs_diff(chip.dac_code);
        most = most.max(by);
        let word = by_one_word(&file.session, native);
        // Each is rounded to 1 µA, then down to a code.
        let rounded = CODES_PER_UA + 1.0;
        assert!(
            f64::from(by) <= word + rounded,
            "{native:?} {chip:?} {word}"
        );
    }
    let most_ua = f64::from(most) / CODES_PER_UA;
    println!(
        "of {count} phases {differ} differ, by {most} codes ({most_ua:.0} µA) at the most, \
         none later than {latest_us} µs after the host's word"
    );
    assert!(differ > 0, "nothing was between");
    assert!(latest_us < 5_000, "{latest_us}");
}

/// DAC codes per µA of a stage of 40 mA.
const CODES_PER_UA: f64 = 65_535.0 / 40_000.0;
/// Interval of the host's messages, µs.
const WORD_US: u64 = 10_000;

/// Returns the change of the DAC code by the latest message before a burst.
fn by_one_word(session: &Session, burst: &Edge) -> f64 {
    let last = burst.t_us / WORD_US;
    let mut joints = session.modulations.iter();
    let found = joints.find_map(|joint| {
        let mut muscles = joint.spec.muscles();
        let muscle = muscles.find(|modulated_spec| modulated_spec.channel == burst.channel)?;
        let quartic = muscle.lift.as_ref().or(muscle.drop.as_ref())?;
        let code = |word: u64| {
            let deg = f64::from(joint.angle_at(word * WORD_US)) / 100.0;
            wanted(&joint.spec, muscle, quartic, deg)
        };
        Some((code(last) - code(last.saturating_sub(1))).abs())
    });
    found.unwrap_or_else(|| panic!("{burst:?}"))
}

/// Returns a sweep over the whole range of every joint and back, `way_s` each, at 200 Hz of pulses
/// and of angles. `way_s` must be at most 8 s, because an elbow slower than its dead band has no
/// phase.
fn sweep(way_s: u32) -> SessionFile {
    let (up, down) = (f64::from(way_s) + 0.5, f64::from(2 * way_s) + 0.5);
    let mut text = std::fs::read_to_string(session_path("lift.toml")).unwrap();
    for (find, replace) in [
        ("duration_s = 9.0", format!("duration_s = {:.1}", down)),
        ("period_us = 16667", "frequency_hz = 200.0".into()),
        ("width_us = 350", "width_us = 100".into()),
        ("longest_hold_s = 10", "longest_hold_s = 60".into()),
        ("rate_hz = 60", "rate_hz = 200".into()),
        ("at_s = 5.8, held = false", "at_s = 0.4, held = true".into()),
        ("{ at_s = 6.6, held = true },", String::new()),
        ("{ at_s = 7.2, held = false },", String::new()),
    ] {
        assert!(text.contains(find), "{find}");
        text = text.replace(find, &replace);
    }
    for (nth, offset_us) in (0..8).zip((0..8).map(|n| n * 600)) {
        let own = format!("offset_us = {} }}", 5_000 + nth * 1_250);
        assert!(text.contains(&own), "{own}");
        text = text.replacen(&own, &format!("offset_us = {offset_us} }}"), 1);
    }
    let mut from = 0;
    while let Some(begin) = text[from..].find("angles = [") {
        let begin = from + begin;
        let end = begin + text[begin..].find("\n]").unwrap();
        // The joint's own range precedes its angles.
        let setting = |name: &str| {
            let at = text[..begin].rfind(name).unwrap() + name.len();
            text[at..].lines().next().unwrap().trim().to_owned()
        };
        let (low, high) = (setting("angle_min_deg ="), setting("angle_max_deg ="));
        let angles = format!(
            "angles = [{{ at_s = 0, deg = {low} }}, {{ at_s = 0.5, deg = {low} }}, \
             {{ at_s = {up}, deg = {high} }}, {{ at_s = {down}, deg = {low} }}\n]"
        );
        text.replace_range(begin..end + 2, &angles);
        from = begin + 10;
    }
    SessionFile::parse("sweep.toml", &text).unwrap()
}

/// Computes the code of the formula in floating point: a share of the amplitude above the
/// threshold.
fn wanted(spec: &ModulationSpec, muscle: &ModulatedSpec, quartic: &QuarticSpec, deg: f64) -> f64 {
    let (low, high) = (spec.angle_min_mdeg, spec.angle_max_mdeg);
    let u = (deg * 1e3 - f64::from(low)) / f64::from(high - low);
    let terms = quartic.0.iter().zip([1.0, 4.0, 6.0, 4.0, 1.0]).zip(0..);
    let terms = terms.map(|((&b, over), k)| {
        f64::from(b) / 1e6 * over * f64::powi(u, k) * f64::powi(1.0 - u, 4 - k)
    });
    let Form::AboveThreshold { threshold } = muscle.form else {
        panic!("{muscle:?}");
    };
    let (base, threshold) = (f64::from(muscle.base.get()), f64::from(threshold.get()));
    (threshold + terms.sum::<f64>() * (base - threshold)) * CODES_PER_UA
}

/// Compares every burst of the sweep with its quartic at the angles measured in the preceding 15 ms
/// (three, and one in transit). Returns the number of different angles.
fn check(session: &Session, edges: &[Edge], way_s: u32) -> usize {
    let way_us = u64::from(way_s) * 1_000_000;
    // From the time when the phase is reported and amplitudes have risen.
    let spans = [
        (1_000_000, 500_000 + way_us),
        (1_000_000 + way_us, 500_000 + 2 * way_us),
    ];
    let mut angles = BTreeSet::new();
    for SessionJoint { spec, .. } in &session.modulations {
        let joint = session
            .modulations
            .iter()
            .find(|session_joint| session_joint.spec.joint == spec.joint);
        let joint = joint.unwrap();
        for muscle in spec.muscles() {
            let phases = [(&muscle.lift, spans[0]), (&muscle.drop, spans[1])];
            for (quartic, (from, to)) in phases {
                let own = edges.iter().filter(|edge| edge.channel == muscle.channel);
                let driven =
                    own.filter(|edge| edge.state.is_driven() && (from..to).contains(&edge.t_us));
                let Some(quartic) = quartic else {
                    assert_eq!(driven.count(), 0, "{muscle:?}");
                    continue;
                };
                let bursts: Vec<&Edge> = driven.step_by(2).collect(); // two phases
                let expected = (to - from) / 5_000;
                assert!(
                    bursts.len() as u64 + 2 >= expected,
                    "{} {expected}",
                    bursts.len()
                );
                for burst in bursts {
                    let last = burst.t_us / 5_000;
                    let measured =
                        (last.saturating_sub(3)..=last).map(|n| joint.angle_at(n * 5_000));
                    let code = f64::from(burst.dac_code);
                    let found = measured.into_iter().find(|&centideg| {
                        let deg = f64::from(centideg) / 100.0;
                        (code - wanted(spec, muscle, quartic, deg).floor()).abs() <= 1.0
                    });
                    let centideg = found.unwrap_or_else(|| panic!("{burst:?} {spec:?}"));
                    angles.insert((muscle.channel, centideg));
                }
            }
        }
    }
    angles.len()
}

#[test]
fn at_every_angle_of_a_sweep_the_current_is_its_quartic_s() {
    for (device, way_s) in [(DeviceName::Native, 7), (DeviceName::Chip, 4)] {
        let file = sweep(way_s);
        let begin = std::time::Instant::now();
        let edges = edges(&file, &device, u64::from(way_s) * 2_000_000 + 500_000);
        let angles = check(&file.session, &edges, way_s);
        let (count, took_s) = (edges.len(), begin.elapsed().as_secs_f64());
        println!("{device}: {angles} angles of eight muscles, {count} edges, {took_s:.1} s");
        assert!(angles > 3_000, "{angles}");
    }
}
