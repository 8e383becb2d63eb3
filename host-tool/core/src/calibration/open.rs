//! The device of a calibration: its identity in the journal, and its opening.

use super::{CalibrationError, Head, Plan, SimulatedWearer, board_session};
#[cfg(feature = "realtime")]
use crate::link::PacedPort;
use crate::link::{Connection, Port};
use crate::run::{DeviceName, identity};

/// Device of a calibration or a check, with the operator and date that the files name.
#[derive(Clone, Debug)]
pub struct CalibrationDevice {
    /// Name of a simulator, or a port.
    pub device: DeviceName,
    /// Simulated wearer; unused for a device behind a port.
    pub wearer: SimulatedWearer,
    /// Seed of the simulated wearer; unused for a device behind a port.
    pub seed: u64,
    /// Whether a simulator in this process advances at the pace of the clock.
    #[cfg(feature = "realtime")]
    pub is_paced: bool,
    /// Pseudonym of the operator.
    pub operator: String,
    /// Date and time for the files; `None` for `now` on a board and "simulated" on simulators.
    pub at: Option<String>,
    /// Present date and time.
    pub now: String,
}

impl CalibrationDevice {
    /// Returns the head of the journal (wearer, plan, operator and device), with everything that is
    /// known before the device answers.
    #[must_use]
    pub fn head(&self, wearer: &str, text: &str) -> Head {
        let is_simulated = !self.device.is_port();
        Head {
            operator: self.operator.clone(),
            at: self.at.clone().unwrap_or_else(|| "simulated".to_owned()),
            device: self.device.to_string(),
            firmware: "0".to_owned(), // until it answers
            body: is_simulated.then(|| self.wearer.name().to_owned()),
            seed: is_simulated.then_some(self.seed),
            ..Head::new(wearer, text)
        }
    }

    /// Opens the device with its simulated wearer and enters the device's identity in the head.
    ///
    /// # Errors
    /// The plan is invalid, or the device does not open.
    pub fn open(&self, plan: &Plan, head: &mut Head) -> Result<Box<dyn Port>, CalibrationError> {
        let board = board_session(plan)?;
        let mut port = self.device.open(&board, self.seed)?;
        let in_process = port.world().is_some();
        if let Some(world) = port.world() {
            world.body = self.wearer.body(self.seed)?;
        }
        let (client, info) = Connection::open(port)?;
        let identity = identity(&info, in_process);
        head.simulated = identity.simulated;
        head.device = match identity.unique_id {
            Some(id) => format!("{:?} {id}", identity.kind).to_lowercase(),
            None => format!("{:?}", identity.kind).to_lowercase(),
        };
        head.firmware = identity.firmware;
        if self.at.is_none() && !head.simulated {
            head.at.clone_from(&self.now);
        }
        let port = client.into_port();
        #[cfg(feature = "realtime")]
        if in_process && self.is_paced {
            return Ok(Box::new(PacedPort::new(port)));
        }
        Ok(port)
    }
}
