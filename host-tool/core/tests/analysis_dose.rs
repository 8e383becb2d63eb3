//! What channels put out, by their records: held against every edge of the simulated pins.

use hal_sim::trace::{Edge, State, Trace};
use host_core::analysis::{ChannelDose, doses};
use host_core::record::Trial;
use host_core::run::{Outputs, SessionFile, run_taken, simulated};
use host_core::session::Session;

/// The pins of one channel, edge by edge.
#[derive(Clone, Default)]
struct Pins {
    /// mA for a code of the DAC.
    ma_per_code: f64,
    driven: Option<Edge>,
    cathodic_uc: f64,
    anodic_uc: f64,
    square: f64,
    most_ma: f64,
    most_uc: f64,
    widths_us: Vec<u64>,
    /// First phases.
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
                firmware::safety::StageSpec::Current { full_scale_ua } => full_scale_ua as f64 / 1e3,
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
    fn take(&mut self, piece: &Trace, epoch_us: u64) {
        for edge in piece.edges_from(epoch_us) {
            let own = &mut self.0[usize::from(edge.channel)];
            if let Some(begun) = own.driven.take().filter(|it| it.dac_code > 0) {
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

fn played(text: &str) -> (Trial, AllPins) {
    let file = SessionFile::parse("played.toml", text).unwrap();
    let boot = firmware::units::Micros::new(0);
    let device = Box::new(hal_sim::native::native(boot));
    let port = simulated(&file.session, 1, device, boot).unwrap();
    let mut pins = AllPins::of(&file.session);
    let (outcome, _) = run_taken(&file, port, None, |_| (), &mut pins);
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    (outcome.trial, pins)
}

#[test]
fn look() {
    for name in [
        "open_finger", "trigger", "width_ramp", "ten_channels", "force_ramp", "gentle_force",
        "hamana_exp4_two_point_finger", "ten_channels_and_finger", "full_load", "ten_forces", "lift", "endpoint_force",
    ] {
        let path = format!("{}/../sessions/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(path).unwrap();
        let (trial, pins) = played(&text);
        println!("{name} {} s, pulses {:?}", trial.duration_s, trial.pulses);
        for dose in doses(&trial) {
            let p = &pins.0[usize::from(dose.channel) - 1];
            println!("  {} peak {:.3}/{:.3} uc {:?}/{:.3} cath {:?}/{:.2} anod {:?}/{:.2} rms {:?}/{:.3} pulses {:?}/{} on {:?} n {:?} w {:?}/{:?}-{:?} f {:?}",
                dose.channel, dose.peak, p.most_ma, dose.charge_per_phase_uc, p.most_uc, dose.cathodic_uc, p.cathodic_uc, dose.anodic_uc, p.anodic_uc,
                dose.rms_ma, (p.square / trial.duration_s).sqrt(), dose.pulses, p.starts_us.len(), dose.on_time_s, dose.stretches, dose.width_us, p.widths_us.iter().min(), p.widths_us.iter().max(), dose.frequency_hz);
        }
    }
}
