//! Forces below that of threshold amplitude, on the whole device.
//!
//! `cargo test -p tests --test suite force_reach -- --nocapture` prints the requested forces and
//! those that the reference model computes from the device's pulses.

use firmware::control::{ForceControl, ForceSpec, HoldPolicy};
use firmware::muscle::{CalciumForceSpec, MuscleLevel, Recruitment, RecruitmentSpec};
use firmware::units::Amplitude;
use hal_sim::body::muscle::reference::integrate;
use hal_sim::body::muscle::{Muscle, Parameters, SUBJECTS, Step};
use hal_sim::trace::Trace;
use host_core::run::{DeviceName, SessionFile};
use host_core::session::Model;
use tests::desk::{load_session, play};

/// FNV-1a hash over words.
#[derive(Clone, Copy)]
struct Digest(u64);

impl Digest {
    const EMPTY: Self = Self(0xcbf2_9ce4_8422_2325);

    fn word(&mut self, word: u64) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

/// Hashes every edge from the epoch on.
fn edges(trace: &Trace, epoch_us: u64) -> Digest {
    let mut digest = Digest::EMPTY;
    for edge in trace.edges().filter(|edge| edge.t_us >= epoch_us) {
        digest.word(edge.t_us - epoch_us);
        digest.word(u64::from(edge.channel) << 32 | u64::from(edge.dac_code));
        digest.word(format!("{:?}", edge.state).len() as u64);
    }
    digest
}

/// Without a slowest rate and a steering model, every edge and order is the same as before these
/// settings existed, except for the rise: the digests are of commit e7c6abd, renewed when a rise's
/// first burst was no longer silent.
#[test]
fn without_a_slowest_rate_nothing_changes() {
    let sessions = [
        ("force_ramp.toml", 0xdaf5_8a6d_8eb3_80e9),
        ("ten_forces.toml", 0xc4db_0ea9_3a7d_7832),
    ];
    let found = sessions.map(|(name, _)| {
        let mut file = load_session(name);
        for channel in &mut file.session.channels {
            if let Some(muscle) = &mut channel.muscle {
                muscle.model = Model::Fixed(MuscleLevel::None);
            }
        }
        let played = play(&file, &DeviceName::Native);
        (name, edges(&played.trace, played.epoch_us).0)
    });
    println!("{found:#x?}");
    assert_eq!(found, sessions);
}

/// Returns force control of a subject's muscle from 20 Hz to 60 Hz, with 10 to 20 mA.
pub fn control(p: &Parameters, max_period_us: Option<u32>) -> ForceControl {
    let integer = |value: f64| value.round() as u32;
    let muscle = CalciumForceSpec {
        a_mn_per_s: integer(p.a_n_per_s * 1e3),
        k_micro: integer(p.k * 1e6),
        tau_c_us: integer(p.tau_c_s * 1e6),
        tau1_us: integer(p.tau1_s * 1e6),
        tau2_us: integer(p.tau2_s * 1e6),
    };
    let recruitment = Recruitment::new(RecruitmentSpec {
        motor_threshold: Amplitude::new(10_000),
        limit: Amplitude::new(20_000),
        reference: Amplitude::new(20_000),
        slope_micro: 300_000,
    });
    let spec = ForceSpec {
        min_period_us: 16_667,
        hold: HoldPolicy::Hold,
        max_period_us,
    };
    ForceControl::new(0, &spec, muscle, recruitment.unwrap(), 50_000).unwrap()
}

/// Returns the text of a channel under force control, with `extra` in its `force` table.
pub fn channel(number: usize, p: &Parameters, recruits: (f64, f64), extra: &str) -> String {
    let (threshold, slope) = recruits;
    format!(
        r#"
[[channel]]
number = {number}
name = "muscle {number}"
stage = {{ kind = "current", full_scale_ma = 50.0 }}
limit = 20.0
train = {{ shape = "biphasic-cathodic-first", width_us = 200, gap_us = 50, frequency_hz = 20.0, offset_us = {} }}
force = {{ max_frequency_hz = 60.0, {extra} }}
[channel.muscle]
a_n_per_s = {:.3}
k = {:.6}
tau_c_ms = {:.3}
tau1_ms = {:.3}
tau2_ms = {:.3}
motor_threshold = {threshold}
reference = 20.0
slope_per_unit = {slope}
"#,
        5_000 * (number - 1),
        p.a_n_per_s,
        p.k,
        p.tau_c_s * 1e3,
        p.tau1_s * 1e3,
        p.tau2_s * 1e3,
    )
}

pub fn session(duration_s: f64, channels: &str, setpoints: &str) -> SessionFile {
    let text = format!(
        "title = \"reach\"\nduration_s = {duration_s}\nwearer = {{ rise_ms = 1 }}\n{channels}\n\
         [setpoints]\nrate_hz = 90\n{setpoints}\n"
    );
    SessionFile::parse("reach.toml", &text).unwrap()
}

/// Pulse: time, µs, and activated share of the muscle.
pub type Pulse = (u64, f64);

/// Returns a channel's pulses from time 0 on that reach its muscle.
pub fn pulses(trace: &Trace, end_us: u64, channel: usize, recruits: (f64, f64)) -> Vec<Pulse> {
    let (threshold, slope) = recruits;
    let channels = trace.pulses(end_us);
    let amplitudes = channels[channel].iter().map(|pulse| {
        let amplitude_ma = f64::from(pulse.code) * 50.0 / 65_535.0;
        (pulse.start_us, amplitude_ma)
    });
    // A code is rounded down, so that of the threshold lies just below it.
    let felt = amplitudes.filter(|&(_, amplitude_ma)| amplitude_ma > threshold - 1e-3);
    felt.map(|(at, amplitude_ma)| (at, (slope * (amplitude_ma - 20.0)).exp()))
        .collect()
}

/// Returns the float model's mean force over the complete periods within `from_us..to_us`, N; 0
/// without pulses.
fn mean_force(p: &Parameters, pulses: &[Pulse], from_us: u64, to_us: u64) -> f64 {
    let mut muscle = Muscle::new(*p);
    let (mut area, mut judged_us) = (0.0, 0);
    for pair in pulses.windows(2) {
        let [(at, gain), (next, _)] = [pair[0], pair[1]];
        muscle.pulse(gain);
        let steps = (next - at).div_ceil(1_000);
        let step_s = (next - at) as f64 * 1e-6 / steps as f64;
        let step = Step::new(p, step_s);
        let is_judged = at >= from_us && next <= to_us;
        for _ in 0..steps {
            let before = muscle.force();
            muscle.step(&step);
            if is_judged {
                area += 0.5 * (before + muscle.force()) * step_s;
            }
        }
        if is_judged {
            judged_us += next - at;
        }
    }
    if judged_us == 0 {
        0.0
    } else {
        area / (judged_us as f64 * 1e-6)
    }
}

/// Returns the same for a train that is constant since the epoch, by the reference.
fn reference_force(p: &Parameters, pulses: &[Pulse], from_us: u64) -> f64 {
    let (first, gain) = pulses[0];
    let driven = Parameters {
        a_n_per_s: p.a_n_per_s * gain,
        ..*p
    };
    let times: Vec<f64> = pulses.iter().map(|p| (p.0 - first) as f64 * 1e-6).collect();
    let (end, dt) = (times[times.len() - 1], 1e-4);
    let samples = integrate(&driven, &times, end, dt);
    let from = times[pulses.partition_point(|p| p.0 < from_us)];
    let judged = &samples[(from / dt).round() as usize..];
    let sum: f64 = judged
        .windows(2)
        .map(|w| 0.5 * (w[0].force_n + w[1].force_n))
        .sum();
    sum / (judged.len() - 1) as f64
}

/// 4 N of K03, whose threshold gives 7.59 N at 20 Hz, are reported as out of reach, or reached at a
/// lower rate.
#[test]
fn four_newtons_of_k03() {
    let k03 = &SUBJECTS[2];
    let recruits = (17.0, 0.3213);
    let hold = "hold = \"hold\"";
    for (extra, given) in [("", 7.59), (", min_frequency_hz = 2.0", 4.0)] {
        let setpoints = "kind = \"force-ramp\"\nchannel = 1\npoints = [{ at_s = 0.0, n = 4.0 }]";
        let channel = channel(1, k03, recruits, &format!("{hold}{extra}"));
        let played = play(&session(9.0, &channel, setpoints), &DeviceName::Native);
        let (outcome, trace, epoch) = (played.outcome, played.trace, played.epoch_us);
        let pulses = pulses(&trace, epoch + 9_000_000, 0, recruits);
        let pulses: Vec<Pulse> = pulses.into_iter().filter(|p| p.0 >= epoch).collect();
        let force = reference_force(k03, &pulses, epoch + 4_000_000);
        let apart = (pulses[pulses.len() - 1].0 - pulses[pulses.len() - 2].0) as f64;
        let last = outcome.trial.samples.last().unwrap();
        println!(
            "K03, 4 N wanted{extra}: {force:.3} N at {:.2} Hz; limiting {}, {:?} N",
            1e6 / apart,
            last.limiting,
            outcome.trial.nearest_forces_n(last, 1)
        );
        assert!((force / given - 1.0).abs() < 0.01, "{force} N");
        let metrics = host_core::analysis::force_metrics(&outcome.trial);
        if extra.is_empty() {
            let (below, above) = outcome.trial.nearest_forces_n(last, 1).unwrap();
            let is_threshold = below == 0.0 && (above - 7.59).abs() < 0.01;
            assert!(last.limiting && is_threshold, "{above} N");
            let gap = metrics[0].gap.unwrap();
            assert!(gap.share > 0.99 && gap.above_n == above, "{gap:?}");
        } else {
            let samples = &outcome.trial.samples;
            // Except for the rise at the beginning.
            let risen = samples.iter().filter(|s| s.t_s > 2.0);
            assert!(risen.count() > 100 && samples.iter().all(|s| s.t_s < 2.0 || !s.limiting));
            assert_eq!(metrics[0].gap, None);
        }
    }
}

/// For ten subjects a staircase of held forces from zero to the largest: the device's pulses give
/// the requested force to 2 %, or it reported that they do not.
#[test]
fn ten_subjects_have_every_force_but_the_least() {
    const STEP_S: f64 = 5.0;
    const RECRUITS: (f64, f64) = (10.0, 0.3);
    let extra = "hold = \"hold\", min_frequency_hz = 1.0";
    let channels: String = (1..=10)
        .map(|n| channel(n, &SUBJECTS[n - 1], RECRUITS, extra))
        .collect();
    // Range of each subject: zero, and from … to … mN; and the force at threshold and 20 Hz.
    let reach = |slowest_us| SUBJECTS.map(|p| control(&p, slowest_us).force_range_mn());
    let (slow, fixed) = (reach(Some(1_000_000)), reach(None));
    let wanted: Vec<Vec<u32>> = (0..10)
        .map(|i| {
            let ((least, most), (at_threshold, _)) = (slow[i], fixed[i]);
            let below = [2, 4, 8, 16].map(|part| least.max(at_threshold * part / 20));
            let above = [1, 2, 4, 8].map(|part| at_threshold + (most - at_threshold) * part / 8);
            [[0, least / 3, least, 2 * least].as_slice(), &below, &above].concat()
        })
        .collect();
    let point = |(step, &mn): (usize, &u32)| {
        let (from, n) = (STEP_S * step as f64, f64::from(mn) * 1e-3);
        let to = from + STEP_S - 1e-6;
        format!("{{ at_s = {from:.6}, n = {n:.3} }}, {{ at_s = {to:.6}, n = {n:.3} }}")
    };
    let stair = |(channel, wanted): (u32, &Vec<u32>)| {
        let points: Vec<String> = wanted.iter().enumerate().map(point).collect();
        let points = points.join(", ");
        format!("{{ channel = {channel}, points = [{points}] }}")
    };
    let stairs: Vec<String> = (1..).zip(&wanted).map(stair).collect();
    let steps = wanted[0].len();
    let setpoints = format!("kind = \"keep-alive\"\nforces = [{}]", stairs.join(",\n"));
    let file = session(STEP_S * steps as f64, &channels, &setpoints);
    let played = play(&file, &DeviceName::Native);
    let (outcome, trace, epoch) = (played.outcome, played.trace, played.epoch_us);
    let mut worst = 0f64;
    for (i, p) in SUBJECTS.iter().enumerate() {
        let end_us = epoch + (STEP_S * steps as f64 * 1e6) as u64;
        let pulses = pulses(&trace, end_us, i, RECRUITS);
        for (step, &mn) in wanted[i].iter().enumerate() {
            let at_s = |part: f64| STEP_S * (step as f64 + part);
            let at_us = |part: f64| epoch + (at_s(part) * 1e6) as u64;
            let force = mean_force(p, &pulses, at_us(0.5), at_us(1.0));
            let n = f64::from(mn) * 1e-3;
            let samples = outcome.trial.samples.iter();
            let mut samples = samples.filter(|s| s.t_s > at_s(0.5) && s.t_s < at_s(1.0));
            let gap = samples.find_map(|s| outcome.trial.nearest_forces_n(&s, i as u8 + 1));
            let k = i + 1;
            println!("K{k:02}: {n:.3} N wanted, {force:.3} N given, {gap:?}");
            if mn == 0 || mn >= slow[i].0 {
                assert_eq!(gap, None, "K{k:02}, {n} N");
                let off = if mn == 0 { force } else { force / n - 1.0 };
                worst = worst.max(off.abs());
            } else {
                let least = f64::from(slow[i].0) / 1e3;
                assert_eq!(gap, Some((0.0, least)), "K{k:02}, {n} N");
                assert!((force - n).abs() <= 0.5 * least, "K{k:02}, {n} N");
            }
        }
    }
    println!("worst: {:.2} %", 1e2 * worst);
    assert!((2e-3..2e-2).contains(&worst), "{worst:e}");
}
