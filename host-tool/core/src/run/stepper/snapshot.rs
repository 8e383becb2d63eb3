//! Copies a running session, so that it can be continued more than once.

use super::{Attachments, Stepper};
use crate::link::{Port, SimulatedPort};
use std::borrow::Cow;

impl<P: Port> Stepper<'_, P> {
    /// Returns a copy of the session together with a copy of the simulated device in its present
    /// state. The copies continue independently of the originals, and have no recorder, receiver of
    /// outputs or observer. Returns `None` if the device or its wearer cannot be copied. The native
    /// simulator can be copied, and the chip simulator without a debugger or log; QEMU and boards
    /// cannot. Every wearer that a session file describes can be copied; a caller's own wearer can
    /// be copied if it implements [`Body::fork`](hal_sim::body::Body::fork).
    #[must_use]
    pub fn snapshot(&self) -> Option<Stepper<'static, SimulatedPort>> {
        self.snapshot_with(|port| port)
    }

    /// Returns a copy as [`Self::snapshot`] does, with the port of the copied device as `convert`
    /// returns it.
    #[must_use]
    pub fn snapshot_with<Q: Port>(
        &self,
        convert: impl FnOnce(SimulatedPort) -> Q,
    ) -> Option<Stepper<'static, Q>> {
        Some(Stepper {
            session: Cow::Owned(self.session.clone().into_owned()),
            connection: self.connection.snapshot_with(convert)?,
            info: self.info.clone(),
            trial: self.trial.clone(),
            attached: Attachments::default(),
            taken: self.taken,
            epoch: self.epoch,
            started_us: self.started_us,
            index: self.index,
            triggered_us: self.triggered_us,
            checked: self.checked,
            begun: self.begun,
            refused: self.refused,
            last_refused: self.last_refused.clone(),
            ended: None,
            event: self.event,
            left_out: self.left_out,
            is_finished: self.is_finished,
            wishes: self.wishes.clone(),
            programmed: self.programmed.clone(),
            intensity: self.intensity,
            paused: self.paused,
            is_stopped: self.is_stopped,
            controlled_us: self.controlled_us,
            keep_alive_us: self.keep_alive_us,
            heard_us: self.heard_us,
            heard_stalled_us: self.heard_stalled_us,
        })
    }
}
