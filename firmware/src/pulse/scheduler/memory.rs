//! Checksums over the scheduler's own memory between windows, so that a bit flip becomes a fault
//! before it becomes an edge.

use super::{Lane, RenderError, Scheduler};
use crate::pulse::{Partner, WINDOW_US};
use crate::seal::Checksum;
use core::hash::Hash;

impl Scheduler {
    /// Verifies the checksum over the memory that all lanes share, and that of one lane in turn.
    #[inline]
    pub(super) fn verify_next_checksums(&mut self) -> Result<(), RenderError> {
        let lane = self.turn.next().and_then(|turn| self.lanes.get(turn));
        let lane = lane.and_then(Option::as_ref);
        if self.seal.matches(&self.shared_memory()) && lane.is_none_or(Lane::is_intact) {
            Ok(())
        } else {
            Err(RenderError::Memory)
        }
    }

    pub(super) fn shared_memory(&self) -> impl Hash {
        (self.picture, self.levels, self.next, self.gate)
    }

    pub(super) fn renew_checksum(&mut self) {
        let seal = Checksum::of(&self.shared_memory());
        self.seal = seal;
    }

    /// Returns the lanes that this window needs, bit i for channel i: those with an edge in it,
    /// and those in an isolated group. Their checksums must match.
    pub(super) fn verify_due_lanes(&self) -> Result<u16, RenderError> {
        if !self.groups_seal.matches(&self.groups) {
            return Err(RenderError::Memory);
        }
        let mut open = 0;
        for group in self
            .groups
            .iter()
            .filter(|g| g.partner() == Partner::Isolated)
        {
            open |= group.members();
        }
        for (channel, lane) in self.lanes.iter().enumerate() {
            let Some(lane) = lane else { continue };
            let has_edge = self.agenda.offset_us(lane.due) < WINDOW_US;
            open |= u16::from(has_edge) << channel; // below 10
            if open & 1 << channel != 0 && !lane.is_state_intact() {
                return Err(RenderError::Memory);
            }
        }
        Ok(open)
    }
}
