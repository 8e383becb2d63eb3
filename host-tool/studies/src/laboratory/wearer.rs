//! Opens the device and the simulated wearer for the trials of a protocol: new ones for each trial,
//! or the same for all.

use super::error::LaboratoryError;
use super::protocol::{Place, Wearer};
use hal_sim::random::word;
use host_core::link::Port;
use host_core::run::{DeviceName, RunError, attach_electrodes, merge_sessions, rest_wearer};
use host_core::session::Session;

/// Random stream of the noise in trials after the first round of all conditions.
const ROUNDS: u64 = 0x1AB3;

/// Opens the device for each trial of a protocol, or keeps the same device with its simulated
/// wearer.
pub(super) struct TrialDevice<'a> {
    device: &'a DeviceName,
    seed: u64,
    /// Session that combines those of all trials, if the simulated wearer stays the same; otherwise
    /// `None`.
    all: Option<Session>,
    /// The open device between two trials, if the simulated wearer stays the same.
    kept: Option<Box<dyn Port>>,
}

impl<'a> TrialDevice<'a> {
    /// Prepares for trials of these sessions, one for each condition. A board is opened again for
    /// each trial, because its wearer stays the same anyway.
    ///
    /// # Errors
    /// Fails if the wearer stays the same but cannot go through all sessions.
    pub(super) fn new(
        wearer: Wearer,
        sessions: &[Session],
        (device, seed): (&'a DeviceName, u64),
    ) -> Result<Self, LaboratoryError> {
        let shared = match wearer {
            Wearer::Same if !device.is_port() => shared_session(sessions)?,
            _ => None,
        };
        Ok(Self {
            device,
            seed,
            all: shared,
            kept: None,
        })
    }

    /// Returns the device for a trial of `session` at `place`; calls `meet` if the device was newly
    /// opened.
    ///
    /// # Errors
    /// Fails if the device cannot be opened.
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
                    Some(shared) => (shared, self.seed),
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

    /// Takes the device back after a trial, and keeps it if the simulated wearer stays the same.
    pub(super) fn give_back(&mut self, port: Option<Box<dyn Port>>) {
        self.kept = port.filter(|_| self.all.is_some());
    }

    /// Simulates a rest of `rest_s` without stimulation, in which a wearer who stays the same
    /// recovers. Calls `go_on` regularly; the rest ends when it returns `false`.
    ///
    /// # Errors
    /// Fails if the device is lost.
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

/// Combines the sessions to one that a single wearer on one board can go through.
///
/// # Errors
/// Returns the first property of wearer or board in which the sessions differ.
pub(super) fn shared_session(sessions: &[Session]) -> Result<Option<Session>, LaboratoryError> {
    merge_sessions(sessions).map_err(|field| LaboratoryError::Unlike { field })
}

/// Returns the seed of a trial's noise, which is the same for all conditions of a round. In the
/// first round it is the protocol's seed, so that a protocol of one trial equals that trial alone.
fn noise(seed: u64, place: Place) -> u64 {
    match (place.block, place.repetition) {
        (0, 0) => seed,
        (block, repetition) => {
            let round = (block as u64) << 32 | repetition as u64;
            word(word(seed, ROUNDS), round)
        }
    }
}
