//! Plays a session natively in memory, and returns the pulses that left the device and the forces
//! that it reported.

use crate::link::Port;
use crate::record::Trial;
use crate::run::{DeviceName, OpenError, Outcome, RunError, SessionFile, run};
use crate::session::{Channel, Muscle, Session};
use firmware::muscle::{CalciumForceSpec, FatigueSpec};
use hal_sim::body::muscle::Parameters;
use hal_sim::body::muscle::tiring::{Fatigue, FatiguingMuscle};

/// Reason why a session could not be played.
#[derive(Debug, thiserror::Error)]
pub enum PlayError {
    /// The simulated wearer could not be created.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The session ended early.
    #[error(transparent)]
    Run(#[from] RunError),
}

/// One pulse that reaches a muscle: its time, µs since the start of the trains, and the share of
/// the muscle that it recruits, 0 to 1.
pub type Pulse = (u64, f64);

/// Pulses and reports of the device in a session that was played in memory.
pub struct PlayedSession {
    /// Pulses that reach the muscle of each channel, in the order of the session's channels; empty
    /// for a channel without a muscle.
    pub pulses: Vec<Vec<Pulse>>,
    /// Reports of the device. Each has its time, µs since the start of the trains, and the
    /// predicted force of each muscle, N.
    pub reports: Vec<(u64, Vec<Option<f64>>)>,
    /// Length of the session, µs.
    pub length_us: u64,
}

/// Plays `session` on a simulated wearer whose noise `seed` determines, and returns the recorded
/// trial.
pub(super) fn play_trial(session: &Session, seed: u64) -> Result<Trial, PlayError> {
    Ok(play_session(session, seed)?.0.trial)
}

/// Returns the force of muscle number `muscle` (from 0) in a report, N; 0 if none was reported.
pub(super) fn force_or_zero(forces_n: &[Option<f64>], muscle: usize) -> f64 {
    forces_n.get(muscle).copied().flatten().unwrap_or(0.0)
}

/// Plays `session` in memory to its end, on a simulated wearer whose noise `seed` determines.
fn play_session(
    session: &Session,
    seed: u64,
) -> Result<(Outcome, Option<Box<dyn Port>>), PlayError> {
    let file = SessionFile {
        name: String::new(),
        text: String::new(),
        session: session.clone(),
    };
    let port = DeviceName::Native.open(session, seed)?;
    let (mut outcome, port) = run(&file, port, None, |_: f64| ());
    match outcome.error.take() {
        Some(error) => Err(error.into()),
        None => Ok((outcome, port)),
    }
}

impl PlayedSession {
    /// Plays `session` on a simulated wearer whose noise `seed` determines, and keeps its pulses
    /// and reports.
    ///
    /// # Errors
    /// Returns [`PlayError`] if the session cannot be played.
    pub fn play(session: &Session, seed: u64) -> Result<Self, PlayError> {
        let (outcome, mut port) = play_session(session, seed)?;
        let world = port.as_mut().and_then(|port| port.world());
        let epoch = outcome.epoch_us.unwrap_or(0); // it ran to its end
        let end = epoch + session.duration_us;
        let trains = world.map(|world| world.recorder.trace.pulses(end));
        let trains = trains.unwrap_or_default();
        let felt = session.channels.iter().map(|channel| {
            let train = trains[usize::from(channel.index())].iter();
            let own = train.filter(|pulse| pulse.start_us >= epoch);
            let gains = own.filter_map(|pulse| {
                Some((
                    pulse.start_us - epoch,
                    recruited_share(channel, pulse.code)?,
                ))
            });
            gains.collect()
        });
        let reports = outcome.trial.samples.iter();
        let reports = reports.filter(|sample| sample.t_s >= 0.0);
        Ok(Self {
            pulses: felt.collect(),
            reports: reports
                .map(|sample| ((sample.t_s * 1e6).round() as u64, sample.forces_n))
                .filter(|(at_us, _)| *at_us <= session.duration_us)
                .collect(),
            length_us: session.duration_us,
        })
    }

    /// Returns the force that the reference model computes from the pulses of a channel, at the
    /// given times in ascending order, N.
    pub fn true_force(&self, muscle: &Muscle, channel: usize, times_us: &[u64]) -> Vec<f64> {
        muscle_forces(muscle, &self.pulses[channel], times_us.iter().copied())
    }
}

/// Returns the share of a channel's muscle that a pulse with this DAC code recruits; `None` below
/// the motor threshold. Amplitudes are rounded down to a code, so a pulse exactly at the threshold
/// has a code that lies slightly below it.
fn recruited_share(channel: &Channel, code: u16) -> Option<f64> {
    let recruits = channel.muscle.as_ref()?.recruitment;
    let step = f64::from(channel.spec.stage.full_scale().get()) / 65_535.0;
    let milli = f64::from(code) * step;
    let [threshold, reference] =
        [recruits.motor_threshold, recruits.reference].map(|amplitude| f64::from(amplitude.get()));
    let slope = f64::from(recruits.slope_micro) * 1e-9; // per thousandth
    (milli > threshold - step).then(|| libm::exp(slope * (milli - reference)).min(1.0))
}

/// Returns the force of a muscle under these pulses, at the given times in ascending order, N. It
/// uses equations (2) to (4) of Lee 2020 and those of Ding 2003, in f64, and shares no code with
/// the device.
pub fn muscle_forces(
    muscle: &Muscle,
    pulses: &[Pulse],
    times_us: impl Iterator<Item = u64>,
) -> Vec<f64> {
    let tires = muscle.fatigue.as_ref().map_or(Fatigue::NEVER, fatigue);
    let mut truth = FatiguingMuscle::new(parameters(muscle), tires);
    let mut due = pulses.iter().peekable();
    let mut now_us = 0;
    let mut pass = |truth: &mut FatiguingMuscle, to_us: u64| {
        truth.pass((to_us - now_us) as u32); // times are milliseconds apart
        now_us = to_us;
    };
    let forces = times_us.map(|at_us| {
        while let Some(&(pulse_us, gain)) = due.next_if(|pulse| pulse.0 <= at_us) {
            pass(&mut truth, pulse_us);
            truth.pulse(gain);
        }
        pass(&mut truth, at_us);
        truth.force()
    });
    forces.collect()
}

fn parameters(muscle: &Muscle) -> Parameters {
    let spec = &muscle.force;
    Parameters {
        a_n_per_s: f64::from(spec.a_mn_per_s) * 1e-3,
        k: f64::from(spec.k_micro) * 1e-6,
        tau_c_s: f64::from(spec.tau_c_us) * 1e-6,
        tau1_s: f64::from(spec.tau1_us) * 1e-6,
        tau2_s: f64::from(spec.tau2_us) * 1e-6,
    }
}

/// Converts the device's fatigue parameters for the reference model in f64. The upper bounds of K
/// and τ1 are those of the device.
#[must_use]
pub fn fatigue(spec: &FatigueSpec) -> Fatigue {
    Fatigue {
        alpha_a_per_s2: f64::from(spec.alpha_a_milli_per_s2) * 1e-3,
        alpha_k_per_n_s: f64::from(spec.alpha_k_nano_per_n_s) * 1e-9,
        alpha_tau1_per_n: f64::from(spec.alpha_tau1_nano_per_n) * 1e-9,
        tau_fat_s: f64::from(spec.tau_fat_ms) * 1e-3,
        k_max: f64::from(CalciumForceSpec::K_MICRO.max) * 1e-6,
        tau1_max_s: f64::from(CalciumForceSpec::TAU1_US.max) * 1e-6,
    }
}
