//! The device and the simulated wearer of a protocol: new for each trial, or kept.

use super::error::LaboratoryError;
use super::protocol::{Place, Wearer};
use hal_sim::random::word;
use host_core::link::Port;
use host_core::run::{DeviceName, RunError, attach_electrodes, merge_sessions, rest_wearer};
use host_core::session::Session;

/// Of a trial's noise, beyond the first round.
const ROUNDS: u64 = 0x1AB3;

/// Opens the device for trial after trial.
pub(super) struct TrialDevice<'a> {
    device: &'a DeviceName,
    seed: u64,
    /// What a wearer who is kept needs for every trial.
    all: Option<Session>,
    /// The kept device, between two trials.
    kept: Option<Box<dyn Port>>,
}

impl<'a> TrialDevice<'a> {
    /// For trials of these sessions, one for each condition. A board is opened anew
    /// for each trial: it keeps its person.
    ///
    /// # Errors
    /// One wearer cannot wear all of them.
    pub(super) fn new(
        wearer: Wearer,
        sessions: &[Session],
        (device, seed): (&'a DeviceName, u64),
    ) -> Result<Self, LaboratoryError> {
        let all = match wearer {
            Wearer::Same if !device.is_port() => shared_session(sessions)?,
            _ => None,
        };
        Ok(Self {
            device,
            seed,
            all,
            kept: None,
        })
    }

    /// The device for a trial of `session` at `place`; `meet` meets it when it is new.
    ///
    /// # Errors
    /// No device.
    pub(super) fn open(
        &mut self,
        session: &Session,
        place: Place,
        meet: &mut dyn FnMut(&mut dyn Port),
    ) -> Result<Box<dyn Port>, LaboratoryError> {
        let mut port = match (self.kept.take(), &self.all) {
            (Some(mut port), _) => {
                if let Some(world) = port.world() {
                    world.begin_trial();
                }
                port
            }
            (None, all) => {
                let (worn, seed) = match all {
                    Some(all) => (all, self.seed),
                    None => (session, noise(self.seed, place)),
                };
                let mut port = self.device.open(worn, seed)?;
                meet(&mut port);
                port
            }
        };
        if let (Some(_), Some(world)) = (&self.all, port.world()) {
            attach_electrodes(world, session);
        }
        Ok(port)
    }

    /// The device after a trial.
    pub(super) fn give_back(&mut self, port: Option<Box<dyn Port>>) {
        self.kept = port.filter(|_| self.all.is_some());
    }

    /// Nothing is stimulated for `rest_s`: a wearer who is kept recovers. `go_on` is
    /// asked now and then.
    ///
    /// # Errors
    /// The device is lost.
    pub(super) fn rest(
        &mut self,
        rest_s: f64,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<(), LaboratoryError> {
        if let Some(world) = self.kept.as_mut().and_then(|port| port.world()) {
            let lost = |error| RunError::from(host_core::link::Error::from(error));
            rest_wearer(world, rest_s, go_on).map_err(lost)?;
        }
        Ok(())
    }
}

/// What one wearer needs for all of these.
///
/// # Errors
/// They differ in what one wearer has once.
pub(super) fn shared_session(sessions: &[Session]) -> Result<Option<Session>, LaboratoryError> {
    merge_sessions(sessions).map_err(|field| LaboratoryError::Unlike { field })
}

/// Of a trial's noise: the protocol's seed in the first round, so that a protocol of
/// one trial is that trial; alike for all conditions of a round.
fn noise(seed: u64, place: Place) -> u64 {
    match (place.block, place.repetition) {
        (0, 0) => seed,
        (block, repetition) => {
            let round = (block as u64) << 32 | repetition as u64;
            word(word(seed, ROUNDS), round)
        }
    }
}
