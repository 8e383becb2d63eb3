//! What readings of the current say: the check before arming, and the watch after.

use super::{Guard, Mode, check_amplitude};
use crate::pulse::WINDOW_US;
use crate::safety::check::{Electrode, judge};
use crate::safety::{Denied, ElectrodeCheck, Fault, Notice, Reading, StopCause};
use crate::units::Micros;

/// Implausible readings in a row that make a fault.
const READINGS_TO_FAULT: u8 = 3;

impl Guard {
    pub(super) fn end_check(&mut self, check: ElectrodeCheck, now: Micros) -> Notice {
        if let Some(channel) = check.missing() {
            self.enter_idle(StopCause::Request);
            return Notice::Checked(Err(Denied::ElectrodeOff { channel }));
        }
        self.open_core();
        self.mode = Mode::Armed { since: now };
        Notice::Checked(Ok(()))
    }

    /// A reading during the check: ticks the channel off and is told, or ends the
    /// check. What was read before the check's first window has played is of an
    /// earlier stimulation.
    pub(super) fn check_reading(&mut self, reading: Reading, now: Micros) -> Option<Notice> {
        let Mode::Checking { check, until } = &mut self.mode else {
            return None;
        };
        if until.elapsed_since(now) > ElectrodeCheck::length_us() - 2 * WINDOW_US {
            return None; // the length is far above two windows
        }
        let channel = reading.channel;
        let config = *self.setup.as_ref()?.channel(channel)?;
        let applied = check_amplitude(&config);
        match judge(reading, &config.stage, applied) {
            Electrode::Fine => {
                check.passed(channel);
                self.open_core();
            }
            Electrode::Off => {}
            Electrode::Short => {
                self.enter_idle(StopCause::Request);
                return Some(Notice::Checked(Err(Denied::ElectrodeShort { channel })));
            }
        }
        Some(Notice::Electrode {
            channel,
            applied,
            current_ua: reading.current().get(),
        })
    }

    /// A reading while stimulating: too much once, or too little three times.
    pub(super) fn watch_reading(&mut self, reading: Reading) -> Result<(), Fault> {
        if !matches!(self.mode, Mode::Stimulating | Mode::Stopping { .. }) {
            return Ok(());
        }
        let index = usize::from(reading.channel);
        self.open(reading.channel);
        let config = self
            .setup
            .as_ref()
            .and_then(|s| s.channel(reading.channel).copied());
        let (Some(config), Some(&amplitude), Some(count)) = (
            config,
            self.in_force.get(index),
            self.implausible.get_mut(index),
        ) else {
            return Ok(());
        };
        match judge(reading, &config.stage, amplitude) {
            Electrode::Short => return Err(Fault::OverCurrent),
            Electrode::Off => *count = count.saturating_add(1),
            Electrode::Fine => *count = 0,
        }
        if *count >= READINGS_TO_FAULT {
            Err(Fault::ElectrodeOff)
        } else {
            Ok(())
        }
    }
}
