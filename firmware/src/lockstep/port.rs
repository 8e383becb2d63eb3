//! Lock-step port: controls a [`Lockstep`] over a line of bytes.
//!
//! The device has no clock of its own; the host tells it the time. Commands and outputs travel in
//! the link's frames (COBS, CRC-32), one in each. The device sends [`Output::Done`] when it is
//! ready and after every command, and the host waits for that before it sends the next command. The
//! line needs no reset other than [`Command::Boot`], which does not affect the line itself.

use super::{Lockstep, Sensors, Sink};
use crate::device::Identity;
use crate::link::message::ResetCause;
use crate::link::{Kind, MAX_MESSAGE, encode};
use crate::pulse::Levels;
use crate::safety::{FaultRecord, Stages};
use crate::units::{DacCode, Micros};
use serde::{Deserialize, Serialize};

/// Maximum number of bytes that one [`Command::Receive`] or [`Output::Bytes`] carries, so that each
/// fits one frame.
pub const MAX_PIECE: usize = 256;

// Tag 1, length 2, time 5, joint 4.
const _: () = assert!(MAX_PIECE + 12 <= MAX_MESSAGE);

/// A command from the host on the port.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Command<'a> {
    /// Resets the device, as power or its watchdog would.
    Boot {
        /// Device time from the reset on.
        at: Micros,
        /// Cause that the device reports for the reset.
        reset: ResetCause,
        /// Recorded fault that the reset finds.
        last_fault: Option<FaultRecord>,
        /// Number of the first session.
        first_session: u16,
    },
    /// Sets the inputs of the board from the next command on. The joint changes all the time, so
    /// later commands carry their own value. Only the next command sees a trigger edge.
    Sense(Sensors),
    /// Executes [`Lockstep::receive`].
    Receive {
        /// Time at which the last byte arrives.
        at: Micros,
        /// Conversion code of the joint sensor, as in [`Sensors::joint`].
        joint: Option<u16>,
        /// Received bytes, at most [`MAX_PIECE`].
        bytes: &'a [u8],
    },
    /// Executes [`Lockstep::advance`].
    Advance {
        /// Time to which the device advances.
        to: Micros,
        /// Conversion code of the joint sensor, as in [`Sensors::joint`].
        joint: Option<u16>,
    },
}

/// A message from the device on the port.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Output<'a> {
    /// Reports a call of [`Sink::write_levels`].
    Levels {
        /// Time of the change.
        at: Micros,
        /// Bits of [`Levels`].
        levels: u32,
    },
    /// Reports a call of [`Sink::write_dac`].
    Dac {
        /// Time of the write.
        at: Micros,
        /// Number of the channel, from 0.
        channel: u8,
        /// Value that was written.
        code: DacCode,
    },
    /// Reports a call of [`Sink::write_trip`].
    Trip {
        /// Time of the write.
        at: Micros,
        /// Number of the bank, from 0.
        bank: u8,
        /// Value that was written.
        code: DacCode,
    },
    /// Reports a call of [`Sink::write_bytes`].
    Bytes {
        /// Time at which the bytes leave.
        at: Micros,
        /// Transmitted bytes, at most [`MAX_PIECE`].
        bytes: &'a [u8],
    },
    /// The device carried out the command and waits for the next.
    Done,
    /// The frame contained no command, and nothing happened.
    NoCommand,
}

/// A lock-step device and its inputs.
#[derive(Debug)]
pub struct Port {
    kind: Kind,
    board: Lockstep,
    sensors: Sensors,
}

impl Port {
    /// Creates a device of this kind, booted at 0 after power-on.
    #[must_use]
    pub fn new(kind: Kind) -> Self {
        Self {
            kind,
            board: Lockstep::new(identity(kind, ResetCause::PowerOn, None, 1), Micros::new(0)),
            sensors: Sensors::default(),
        }
    }

    /// Carries out one command, and sends its effects to `sink` in the order of their times.
    pub fn execute(&mut self, command: &Command<'_>, sink: &mut impl Sink) {
        match *command {
            Command::Boot {
                at,
                reset,
                last_fault,
                first_session,
            } => {
                let identity = identity(self.kind, reset, last_fault, first_session);
                self.board.boot(identity, at);
                self.sensors = Sensors::default();
            }
            Command::Sense(sensors) => self.sensors = sensors,
            Command::Receive { at, joint, bytes } => {
                self.sensors.joint = joint;
                self.board.receive(at, bytes, &self.sensors, sink);
                self.sensors.trigger = None;
            }
            Command::Advance { to, joint } => {
                self.sensors.joint = joint;
                self.board.advance(to, &self.sensors, sink);
                self.sensors.trigger = None;
            }
        }
    }

    /// Reports to the host at the other end of `line` that the device accepts commands.
    pub fn report_ready(line: &mut impl FnMut(&[u8])) {
        Frames(line).send(&Output::Done);
    }

    /// Carries out the command in a frame's `message`, and writes the outputs to `line` in frames.
    pub fn serve(&mut self, message: &[u8], line: &mut impl FnMut(&[u8])) {
        let mut frames = Frames(line);
        match postcard::take_from_bytes(message) {
            Ok((command, [])) => {
                self.execute(&command, &mut frames);
                frames.send(&Output::Done);
            }
            _ => frames.send(&Output::NoCommand),
        }
    }
}

/// Returns the identity of a simulator; all kinds have the same, without a chip.
const fn identity(
    kind: Kind,
    reset: ResetCause,
    last_fault: Option<FaultRecord>,
    first_session: u16,
) -> Identity {
    Identity {
        kind,
        unique_id: [0; 3],
        reset,
        last_fault,
        first_session,
        stages: Stages::AsConfigured,
        option_bytes: None,
        board: "",
        crystal_hz: 0,
        has_boot_loader: false,
    }
}

/// Sink that writes outputs as frames.
struct Frames<'a, F: FnMut(&[u8])>(&'a mut F);

impl<F: FnMut(&[u8])> Frames<'_, F> {
    fn send(&mut self, output: &Output<'_>) {
        // Always fits: `write_bytes` splits its bytes, and all other outputs are small.
        if let Some(frame) = encode(output) {
            (self.0)(&frame);
        }
    }
}

impl<F: FnMut(&[u8])> Sink for Frames<'_, F> {
    fn write_levels(&mut self, at: Micros, levels: Levels) {
        let levels = levels.0;
        self.send(&Output::Levels { at, levels });
    }

    fn write_dac(&mut self, at: Micros, channel: u8, code: DacCode) {
        self.send(&Output::Dac { at, channel, code });
    }

    fn write_trip(&mut self, at: Micros, bank: u8, code: DacCode) {
        self.send(&Output::Trip { at, bank, code });
    }

    fn write_bytes(&mut self, at: Micros, bytes: &[u8]) {
        for bytes in bytes.chunks(MAX_PIECE) {
            self.send(&Output::Bytes { at, bytes });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;

    #[test]
    fn a_port_that_boots_again_is_as_new() {
        let mut port = Port::new(Kind::Native);
        let boot = Command::Boot {
            at: Micros::new(0),
            reset: ResetCause::PowerOn,
            last_fault: None,
            first_session: 1,
        };
        let new = format!("{port:?}");
        let (to, joint) = (Micros::new(50_000), Some(700));
        let mut frames = |_: &[u8]| {};
        let mut sink = Frames(&mut frames);
        port.execute(&Command::Advance { to, joint }, &mut sink);
        assert_ne!(format!("{port:?}"), new);
        port.execute(&boot, &mut sink);
        assert_eq!(format!("{port:?}"), new);
    }
}
