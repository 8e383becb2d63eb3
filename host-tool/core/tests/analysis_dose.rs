//! Compares the dose that a record implies with every edge of the simulated pins.

use hal_sim::trace::{Edge, State, Trace};
use host_core::analysis::{ChannelDose, doses};
use host_core::record::Trial;
use host_core::run::{Outputs, SessionFile, run_with_outputs, simulated_port};
use host_core::session::Session;

/// Sums over the edges of one channel's pins.
#[derive(Clone, Default)]
struct Pins {
    /// Current of one DAC code.
    ma_per_code: f64,
    driven: Option<Edge>,
    cathodic_uc: f64,
    anodic_uc: f64,
    square: f64,
    most_ma: f64,
    most_uc: f64,
    widths_us: Vec<u64>,
    /// Times of the first phases.
    starts_us: Vec<u64>,
    first: Option<State>,
}

struct AllPins(Vec<Pins>);

impl AllPins {
    fn of(session: &Session) -> Self {
        let mut pins = vec![Pins::default(); 10];
        for channel in &session.channels {
            let spec = &channel.spec;
            let full_ma = match spec.stage {
                firmware::safety::StageSpec::Current { full_scale_ua } => {
                    full_scale_ua as f64 / 1e3
                }
                firmware::safety::StageSpec::Voltage {
                    full_scale_mv,
                    load_ohm,
                } => f64::from(full_scale_mv) / f64::from(load_ohm),
            };
            let own = &mut pins[usize::from(channel.index())];
            own.ma_per_code = full_ma / 65_535.0;
            own.first = Some(match spec.train.shape.cathodic_first() {
                true => State::Cathodic,
                false => State::Anodic,
            });
        }
        Self(pins)
    }
}

impl Outputs for AllPins {
    fn receive(&mut self, piece: &Trace, epoch_us: u64) {
        for edge in piece.edges_from(epoch_us) {
            let own = &mut self.0[usize::from(edge.channel)];
            if let Some(begun) = own.driven.take().filter(|edge| edge.dac_code > 0) {
                let width_us = edge.t_us - begun.t_us;
                let ma = f64::from(begun.dac_code) * own.ma_per_code;
                let uc = ma * width_us as f64 / 1e3;
                match begun.state {
                    State::Cathodic => own.cathodic_uc += uc,
                    _ => own.anodic_uc += uc,
                }
                own.square += ma * ma * width_us as f64 / 1e6;
                own.most_ma = own.most_ma.max(ma);
                own.most_uc = own.most_uc.max(uc);
                own.widths_us.push(width_us);
                if own.first == Some(begun.state) {
                    own.starts_us.push(begun.t_us - epoch_us);
                }
            }
            own.driven = edge.state.is_driven().then_some(edge);
        }
    }

    fn end(&mut self, _: u64) {}
}

fn shipped(name: &str) -> String {
    let path = format!("{}/../sessions/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

fn played(text: &str) -> (Trial, AllPins) {
    let file = SessionFile::parse("played.toml", text).unwrap();
    let boot = firmware::units::Micros::new(0);
    let device = Box::new(hal_sim::native::native(boot));
    let port = simulated_port(&file.session, 1, device, boot).unwrap();
    let mut pins = AllPins::of(&file.session);
    let (outcome, _) = run_with_outputs(&file, port, None, |_| (), &mut pins);
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    (outcome.trial, pins)
}

/// Checks that the dose from a record agrees with the pins, except for the last burst of a stretch.
fn judge(name: &str, dose: &ChannelDose, pins: &Pins, trial: &Trial) {
    let duration_s = trial.duration_s;
    let channels = trial.session().unwrap().channels;
    let own = channels
        .iter()
        .find(|channel| channel.number == dose.channel);
    let per_burst = u64::from(own.unwrap().spec.train.burst_count);
    let at = format!("{name}, channel {}", dose.channel);
    let near = |quantity: &str, estimate: Option<f64>, exact: f64, missed: f64| {
        let value = estimate.unwrap();
        let slack = missed + 5e-4 * exact;
        assert!(
            (value - exact).abs() <= slack,
            "{at}: {quantity} {value}, not {exact}"
        );
    };
    let (pulses, exact) = (dose.pulses.unwrap(), pins.starts_us.len() as u64);
    let most = per_burst * dose.stretches.unwrap();
    assert!(
        pulses <= exact && exact <= pulses + most,
        "{at}: {pulses} pulses, not {exact}"
    );
    near(
        "charge per phase",
        dose.charge_per_phase_uc,
        pins.most_uc,
        0.0,
    );
    let missed_uc = (exact - pulses) as f64 * pins.most_uc;
    near(
        "cathodic charge",
        dose.cathodic_uc,
        pins.cathodic_uc,
        missed_uc,
    );
    near("anodic charge", dose.anodic_uc, pins.anodic_uc, missed_uc);
    let exact_ma = (pins.square / duration_s).sqrt();
    let part = missed_uc / (pins.cathodic_uc + pins.anodic_uc).max(1e-9);
    near("rms", dose.rms_ma, exact_ma, exact_ma * part);
    let widths = dose.width_us.unwrap_or_default();
    let seen = pins.widths_us.iter().min().zip(pins.widths_us.iter().max());
    let seen = seen.map_or((0.0, 0.0), |(low, high)| (*low as f64, *high as f64));
    assert_eq!(widths, seen, "{at}: widths");
}

#[test]
fn doses_are_what_the_pins_did() {
    let sessions = [
        "open_finger",
        "trigger",
        "ten_channels",
        "full_load",
        "force_ramp",
        "gentle_force",
        "ten_forces",
        "lift",
        "endpoint_force",
    ];
    for name in sessions {
        let (trial, pins) = played(&shipped(name));
        let doses = doses(&trial);
        assert_eq!(doses.len(), trial.channels.len(), "{name}");
        for dose in doses {
            let own = &pins.0[usize::from(dose.channel) - 1];
            judge(name, &dose, own, &trial);
        }
    }
}

/// A channel still shows the last pulse of a burst when the next burst is overdue.
#[test]
fn bursts_of_several_pulses_are_counted_as_the_pins_have_them() {
    for (count, interval_us, hz) in [
        (3, 3000, 40.0),
        (3, 3000, 33.0),
        (2, 3000, 33.0),
        (8, 400, 50.0),
    ] {
        let text = format!(
            r#"
title = "bursts"
duration_s = 4.0
[wearer]
rise_ms = 400
max_rms_ma = 8.0
[[channel]]
number = 1
name = "one"
stage = {{ kind = "current", full_scale_ma = 50.0 }}
limit = 12.0
train = {{ shape = "biphasic-cathodic-first", width_us = 100, frequency_hz = {hz:?}, burst_count = {count}, burst_interval_us = {interval_us} }}
[[program]]
kind = "on-off"
channels = [1]
value = 5.0
on_s = 0.5
off_s = 0.2
ramp_down_s = 0.05
"#
        );
        let (trial, pins) = played(&text);
        let doses = doses(&trial);
        judge("bursts", &doses[0], &pins.0[0], &trial);
    }
}

/// The amplitude rises over 200 ms to 26 V, which is 13 mA through 2 kΩ.
#[test]
fn a_voltage_stage_is_told_in_volts_and_charged_through_its_load() {
    let (trial, _) = played(&shipped("open_finger"));
    let channel_doses = doses(&trial);
    let [one, silent] = channel_doses.as_slice() else {
        panic!("{channel_doses:?}");
    };
    assert_eq!((one.peak, one.unit.as_str()), (26.0, "V"));
    assert_eq!(one.charge_per_phase_uc, Some(26.0 / 2.0 * 200.0 / 1e3));
    assert_eq!(one.anodic_uc, Some(0.0));
    assert_eq!(one.stretches, Some(1));
    // Monophasic: one phase of 200 µs per pulse, 13 mA after the rise.
    assert_eq!(one.pulses, trial.pulses);
    let on_s = one.on_time_s.unwrap();
    assert!(
        (on_s - one.pulses.unwrap() as f64 / 20.0).abs() < 1e-9,
        "{on_s}"
    );
    assert_eq!((silent.peak, silent.pulses), (0.0, Some(0)));
    assert_eq!((silent.width_us, silent.rms_ma), (None, Some(0.0)));
}

/// Each edge of the trigger starts ten pulses at 50 Hz; there is one edge per second.
#[test]
fn on_time_has_a_stretch_for_each_trigger() {
    let (trial, _) = played(&shipped("trigger"));
    for dose in doses(&trial) {
        let stretches = dose.stretches.unwrap();
        assert_eq!(dose.pulses, Some(10 * stretches));
        let on_s = dose.on_time_s.unwrap();
        assert!((on_s - 0.2 * stretches as f64).abs() < 1e-9, "{on_s}");
    }
}

#[test]
fn a_live_width_and_a_list_are_told_as_far_as_rows_go() {
    let (trial, pins) = played(&shipped("width_ramp"));
    let channel_doses = doses(&trial);
    judge("width_ramp", &channel_doses[0], &pins.0[0], &trial);
    assert_eq!(channel_doses[0].width_us, Some((10.0, 300.0)));
    // The rows do not contain the times of pulses from a list.
    assert_eq!(
        (channel_doses[1].pulses, channel_doses[1].cathodic_uc),
        (None, None)
    );
}

/// Without its session file a record contains amplitudes, but nothing that requires the train.
#[test]
fn without_a_session_file_only_the_peak_is_known() {
    let (trial, _) = played(&shipped("open_finger"));
    let bare = Trial {
        session_text: String::new(),
        ..trial
    };
    let channel_doses = doses(&bare);
    assert_eq!(channel_doses[0].peak, 26.0);
    assert_eq!(channel_doses[0].on_time_s, None);
    assert_eq!(channel_doses[0].rms_ma, None);
}
