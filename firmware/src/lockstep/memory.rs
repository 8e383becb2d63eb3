//! Model of a board's backup SRAM, which resets leave unchanged.

use crate::device::Mailboxes;
use crate::link::message::ResetCause;
use crate::safety::{AllowanceWords, Entry, Ledger, UsageAtBoot};

/// Two copies of the part of the wearer's allowance that was spent, and the ledger that writes
/// them.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    pub copies: [AllowanceWords; 2],
    ledger: Ledger,
}

impl Default for Memory {
    /// Returns the memory after power-on.
    fn default() -> Self {
        let mut ledger = Ledger::default();
        let (_, words) = ledger.write(&Entry::default());
        Self {
            copies: [words; 2],
            ledger,
        }
    }
}

impl Memory {
    /// Returns the time and charge spent that a boot after `reset` finds. Power-on clears the
    /// memory.
    pub fn boot(&mut self, reset: ResetCause) -> UsageAtBoot {
        let is_power_on = reset == ResetCause::PowerOn;
        let (ledger, found) = Ledger::open(self.copies.each_ref(), is_power_on);
        self.ledger = ledger;
        if is_power_on {
            self.write(&Entry::default());
        }
        found
    }

    /// Writes the entries that the pulser has posted.
    pub fn write_entries(&mut self, mail: &mut Mailboxes) {
        while let Some(entry) = mail.split().2.take_entry() {
            self.write(&entry);
        }
    }

    /// Writes `entry` to both copies, one after the other.
    fn write(&mut self, entry: &Entry) {
        let (order, words) = self.ledger.write(entry);
        for copy in order {
            if let Some(slot) = self.copies.get_mut(copy) {
                *slot = words;
            }
        }
    }
}
