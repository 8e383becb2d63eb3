//! Lock-step device at the other end of a byte stream: commands and outputs travel as frames.

use super::Device;
use firmware::link::message::ResetCause;
use firmware::link::{Decoder, encode};
use firmware::lockstep::port::{Command, MAX_PIECE, Output};
use firmware::lockstep::{Sensors, Sink};
use firmware::pulse::Levels;
use firmware::safety::FaultRecord;
use firmware::units::{DacCode, Micros};
use std::io::{self, BufReader, Read, Write};

/// Device that speaks the lock-step protocol over `R` and `W`.
pub struct Remote<R, W> {
    reader: BufReader<R>,
    writer: W,
    decoder: Decoder,
    /// Sensor values, except the joint, that the device last received.
    sensors: Option<Sensors>,
    /// Number of commands executed since the start.
    commands: u64,
    first_session: u16,
}

impl<R: Read, W: Write> Remote<R, W> {
    /// Opens a new connection and waits until the device reports that it is ready.
    ///
    /// # Errors
    /// Fails if the device does not report that it is ready.
    pub fn open(reader: R, writer: W) -> io::Result<Self> {
        let mut remote = Self {
            reader: BufReader::new(reader),
            writer,
            decoder: Decoder::default(),
            sensors: None,
            commands: 0,
            first_session: 1,
        };
        remote.read_until_done(&mut NullSink)?;
        Ok(remote)
    }

    /// Sets the number of the first session after the next [`Self::boot`].
    pub const fn number_sessions(&mut self, first_session: u16) {
        self.first_session = first_session;
    }

    /// Returns the number of commands executed so far.
    #[must_use]
    pub const fn commands(&self) -> u64 {
        self.commands
    }

    /// Resets the device and boots it at `at`.
    ///
    /// # Errors
    /// Fails if the device cannot be reached any more.
    pub fn boot(
        &mut self,
        at: Micros,
        reset: ResetCause,
        last_fault: Option<FaultRecord>,
    ) -> io::Result<()> {
        self.sensors = None;
        let command = Command::Boot {
            at,
            reset,
            last_fault,
            first_session: self.first_session,
        };
        self.execute(&command, &mut NullSink)
    }

    /// Sends a command and passes its outputs to `sink` until the command is done.
    fn execute(&mut self, command: &Command<'_>, sink: &mut dyn Sink) -> io::Result<()> {
        let frame = encode(command).ok_or(io::ErrorKind::InvalidInput)?;
        self.writer.write_all(&frame)?;
        self.writer.flush()?;
        self.read_until_done(sink)?;
        self.commands += 1;
        Ok(())
    }

    fn read_until_done(&mut self, sink: &mut dyn Sink) -> io::Result<()> {
        loop {
            let mut byte = [0];
            self.reader.read_exact(&mut byte)?;
            let Some(message) = self.decoder.push(byte[0]) else {
                continue;
            };
            let message = message
                .map_err(|e| corrupt_data(&format!("the device sent an invalid frame: {e:?}")))?;
            let output = postcard::from_bytes(message).map_err(|e| {
                corrupt_data(&format!(
                    "the device sent a frame that is not an output: {e}"
                ))
            })?;
            let is_done = emit(&output, sink)?;
            self.decoder.clear();
            if is_done {
                return Ok(());
            }
        }
    }

    /// Sends the sensor values to the device, if any except the joint have changed.
    fn sense(&mut self, sensors: &Sensors) -> io::Result<()> {
        let joint = None; // travels with each command
        let news = Sensors { joint, ..*sensors };
        if self.sensors == Some(news) {
            return Ok(());
        }
        // A trigger edge is reported once, so that the stored values have none.
        let trigger = None;
        self.sensors = Some(Sensors { trigger, ..news });
        self.execute(&Command::Sense(news), &mut NullSink)
    }
}

impl<R: Read + Send, W: Write + Send> Device for Remote<R, W> {
    /// Sends the bytes in pieces of at most [`MAX_PIECE`], each of which the device receives at
    /// `at`.
    fn receive(
        &mut self,
        at: Micros,
        bytes: &[u8],
        sensors: &Sensors,
        sink: &mut dyn Sink,
    ) -> io::Result<()> {
        self.sense(sensors)?;
        let joint = sensors.joint;
        for bytes in bytes.chunks(MAX_PIECE) {
            self.execute(&Command::Receive { at, joint, bytes }, sink)?;
        }
        Ok(())
    }

    fn advance(&mut self, to: Micros, sensors: &Sensors, sink: &mut dyn Sink) -> io::Result<()> {
        self.sense(sensors)?;
        let joint = sensors.joint;
        self.execute(&Command::Advance { to, joint }, sink)
    }
}

/// Passes `output` to `sink`, and returns whether it ends a command.
fn emit(output: &Output<'_>, sink: &mut dyn Sink) -> io::Result<bool> {
    match *output {
        Output::Levels { at, levels } => sink.write_levels(at, Levels(levels)),
        Output::Dac { at, channel, code } => sink.write_dac(at, channel, code),
        Output::Trip { at, bank, code } => sink.write_trip(at, bank, code),
        Output::Bytes { at, bytes } => sink.write_bytes(at, bytes),
        Output::Done => return Ok(true),
        Output::NoCommand => return Err(corrupt_data("the device did not understand a command")),
    }
    Ok(false)
}

fn corrupt_data(message: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message)
}

/// Sink for boot and sensor commands, which have no output.
struct NullSink;

impl Sink for NullSink {
    fn write_levels(&mut self, _: Micros, _: Levels) {}
    fn write_dac(&mut self, _: Micros, _: u8, _: DacCode) {}
    fn write_bytes(&mut self, _: Micros, _: &[u8]) {}
}
