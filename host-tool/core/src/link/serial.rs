//! Connects to a board on a serial port.

use super::Error;
use super::stream::{POLL, SplitStream, Stream};
use std::io::{self, ErrorKind, Write};

/// Port of a board on a serial port.
pub type SerialPort = Stream<Box<dyn serialport::SerialPort>>;

impl SerialPort {
    /// Opens the serial port at `path`. Over USB, the configured bit rate has no effect.
    ///
    /// # Errors
    /// [`Error::Open`]: the port is absent, busy, or not permitted.
    pub fn open(path: &str) -> Result<Self, Error> {
        let opened = serialport::new(path, 115_200).timeout(POLL).open();
        let stream = opened.map_err(|e| Error::Open {
            port: path.to_owned(),
            reason: e.to_string(),
            advice: match e.kind() {
                // The library reports this kind when another program has locked the port.
                serialport::ErrorKind::NoDevice => {
                    "another program uses this port (a serial monitor, another flexor): close it"
                }
                serialport::ErrorKind::Io(ErrorKind::NotFound) => {
                    "plug the board in and check its port (on Linux /dev/ttyACM0 or similar); \
                     without --device, flexor uses the native simulator"
                }
                serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => {
                    "on Linux, add yourself to the group `dialout` and log in again"
                }
                _ => "give the port of a board (on Linux /dev/ttyACM0 or similar)",
            },
        })?;
        Ok(Self::begin(stream))
    }
}

impl SplitStream for Box<dyn serialport::SerialPort> {
    fn clone_writer(&self) -> io::Result<Box<dyn Write + Send>> {
        Ok(Box::new(self.try_clone()?))
    }
}
