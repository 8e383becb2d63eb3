//! The lock-step port: how a [`Lockstep`] is driven over a line of bytes.
//!
//! A device without a clock of its own is told what time it is. Commands and
//! outputs travel in the link's frames (COBS, CRC-32), one in each. The device
//! says [`Output::Done`] when it is ready and after every command, and the
//! host waits for that before it sends the next. No reset but [`Command::Boot`]
//! is needed: the line outlives it.

use super::{Lockstep, Sensors, Sink};
use crate::device::Identity;
use crate::link::message::ResetCause;
use crate::link::{Kind, MAX_MESSAGE, encode};
use crate::pulse::Levels;
use crate::safety::{FaultRecord, Stages};
use crate::units::{DacCode, Micros};
use serde::{Deserialize, Serialize};

/// Most bytes that one [`Command::Receive`] or [`Output::Bytes`] carries, so
/// that each fits one frame.
pub const MAX_PIECE: usize = 256;

// Tag 1, length 2, time 5, joint 4.
const _: () = assert!(MAX_PIECE + 12 <= MAX_MESSAGE);

/// What the host says on the port.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Command<'a> {
    /// The device resets, and boots at `at`.
    Boot {
        /// Device time from then on.
        at: Micros,
        /// Why it reset.
        reset: ResetCause,
        /// The fault that the reset finds recorded.
        last_fault: Option<FaultRecord>,
        /// Number of the first session.
        first_session: u16,
    },
    /// The world is like this from the next command on, but for the joint,
    /// which moves all the time and is told each time. A trigger edge is seen
    /// by the next command only.
    Sense(Sensors),
    /// [`Lockstep::receive`].
    Receive {
        /// When the last byte arrives.
        at: Micros,
        /// [`Sensors::joint`].
        joint: Option<u16>,
        /// At most [`MAX_PIECE`].
        bytes: &'a [u8],
    },
    /// [`Lockstep::advance`].
    Advance {
        /// How far time goes.
        to: Micros,
        /// [`Sensors::joint`].
        joint: Option<u16>,
    },
}

/// What the device says on the port.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Output<'a> {
    /// [`Sink::levels`].
    Levels {
        /// When.
        at: Micros,
        /// The bits of [`Levels`].
        levels: u32,
    },
    /// [`Sink::dac`].
    Dac {
        /// When.
        at: Micros,
        /// From 0.
        channel: u8,
        /// The code.
        code: DacCode,
    },
    /// [`Sink::trip`].
    Trip {
        /// When.
        at: Micros,
        /// From 0.
        bank: u8,
        /// The code.
        code: DacCode,
    },
    /// [`Sink::bytes`].
    Bytes {
        /// When.
        at: Micros,
        /// At most [`MAX_PIECE`].
        bytes: &'a [u8],
    },
    /// The command was carried out, and the device waits for the next.
    Done,
    /// The frame held no command; nothing happened.
    NoCommand,
}

/// A lock-step device and what it senses.
#[derive(Debug)]
pub struct Port {
    kind: Kind,
    board: Lockstep,
    sensors: Sensors,
}

impl Port {
    /// A device of this kind, booted at 0 after power came up.
    #[must_use]
    pub fn new(kind: Kind) -> Self {
        Self {
            kind,
            board: Lockstep::new(identity(kind, ResetCause::PowerOn, None, 1), Micros::new(0)),
            sensors: Sensors::default(),
        }
    }

    /// Carries out one command. Its effects go to `sink` in time order.
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

    /// Tells the host at the other end of `line` that commands are heard now.
    pub fn report_ready(line: &mut impl FnMut(&[u8])) {
        Frames(line).send(&Output::Done);
    }

    /// Carries out the command in a frame's `message`, and writes what comes
    /// of it, in frames, to `line`.
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

/// Every kind of simulator has the same chip: none.
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
        stages: Stages::AsDeclared,
        option_bytes: None,
    }
}

/// Writes outputs as frames.
struct Frames<'a, F: FnMut(&[u8])>(&'a mut F);

impl<F: FnMut(&[u8])> Frames<'_, F> {
    fn send(&mut self, output: &Output<'_>) {
        // Always fits: `bytes` below cuts pieces, all else is small.
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
