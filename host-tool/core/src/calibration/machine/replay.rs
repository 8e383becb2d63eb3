//! Restores the state of the procedure from a journal.

use super::Machine;
use crate::calibration::Entry;

impl Machine {
    /// Restores the effect of a journal entry on the results and on the highest levels, without
    /// actions for the device.
    pub(super) fn replay(&mut self, entry: &Entry) {
        let electrode_index = |channel: u8| {
            let mut electrodes = self.plan.electrodes.iter();
            electrodes.position(|plan| plan.channel == channel)
        };
        match entry {
            Entry::Found {
                channel,
                step,
                value,
            } => {
                if let Some(at) = electrode_index(*channel) {
                    // The journal holds only results that were accepted before, in this order.
                    let _ = self.found[at].store(*step, value);
                }
            }
            Entry::TooMuch { channel, level } => {
                if let Some(at) = electrode_index(*channel) {
                    self.cap(at, *level);
                }
            }
            Entry::Skipped { channel } => {
                if let Some(at) = electrode_index(*channel) {
                    self.found[at].is_skipped = true;
                }
            }
            _ => {}
        }
    }
}
