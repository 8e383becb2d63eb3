//! Real-time ports: a serial port and a TCP socket.

use super::elapsed::Elapsed;
use super::{Error, Port};
use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// Longest wait of one read, so that `until_us` is kept.
const POLL: Duration = Duration::from_millis(2);

/// A device at the other end of a stream of bytes, in real time.
pub struct Stream<S> {
    stream: S,
    elapsed: Elapsed,
}

/// A board on a serial port.
pub type SerialPort = Stream<Box<dyn serialport::SerialPort>>;

/// A simulated board behind a TCP socket.
pub type TcpPort = Stream<TcpStream>;

impl SerialPort {
    /// Opens `path`. The speed means nothing over USB.
    ///
    /// # Errors
    /// [`Error::Open`]: absent, busy, or not permitted.
    pub fn open(path: &str) -> Result<Self, Error> {
        let opened = serialport::new(path, 115_200).timeout(POLL).open();
        let stream = opened.map_err(|e| Error::Open {
            port: path.to_owned(),
            reason: e.to_string(),
            advice: match e.kind() {
                // How the library says that another program locked it.
                serialport::ErrorKind::NoDevice => {
                    "another program uses it (a serial monitor, another flexor): close that one"
                }
                serialport::ErrorKind::Io(ErrorKind::NotFound) => {
                    "plug the board in and look for its port, on Linux /dev/ttyACM0 or similar; \
                     without --device the native simulator runs"
                }
                serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => {
                    "on Linux add yourself to the group `dialout` and log in again"
                }
                _ => "give the port of a board, on Linux /dev/ttyACM0 or similar",
            },
        })?;
        Ok(Self::begin(stream))
    }
}

impl TcpPort {
    /// Connects to `address` (HOST:PORT).
    ///
    /// # Errors
    /// [`Error::Open`]: nobody listens there.
    pub fn connect(address: &str) -> Result<Self, Error> {
        let connect = || -> io::Result<TcpStream> {
            let stream = TcpStream::connect(address)?;
            stream.set_nodelay(true)?;
            stream.set_read_timeout(Some(POLL))?;
            Ok(stream)
        };
        let stream = connect().map_err(|e| Error::Open {
            port: format!("tcp:{address}"),
            reason: e.to_string(),
            advice: "start a simulated board there with `flexor serve --tcp ADDR`",
        })?;
        Ok(Self::begin(stream))
    }
}

impl<S> Stream<S> {
    /// Its time counts from now.
    fn begin(stream: S) -> Self {
        let elapsed = Elapsed::begin();
        Self { stream, elapsed }
    }
}

/// A stream that can be written to from two threads.
trait Forked: Read + Write + Send {
    /// A second end to write to.
    fn forked(&self) -> io::Result<Box<dyn Write + Send>>;
}

impl Forked for TcpStream {
    fn forked(&self) -> io::Result<Box<dyn Write + Send>> {
        Ok(Box::new(self.try_clone()?))
    }
}

impl Forked for Box<dyn serialport::SerialPort> {
    fn forked(&self) -> io::Result<Box<dyn Write + Send>> {
        Ok(Box::new(self.try_clone()?))
    }
}

impl<S: Forked> Port for Stream<S> {
    fn now_us(&mut self) -> u64 {
        self.elapsed.us()
    }

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        self.stream.write_all(frame)
    }

    fn outlet(&mut self) -> io::Result<Option<Box<dyn Write + Send>>> {
        self.stream.forked().map(Some)
    }

    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>> {
        let mut buffer = [0; 4096];
        loop {
            match self.stream.read(&mut buffer) {
                Ok(0) => {
                    let closed = "the device closed the connection";
                    return Err(io::Error::new(ErrorKind::UnexpectedEof, closed));
                }
                Ok(count) => return Ok(buffer[..count].to_vec()),
                Err(e) => match e.kind() {
                    ErrorKind::TimedOut | ErrorKind::WouldBlock => {
                        if self.elapsed.us() >= until_us {
                            return Ok(Vec::new());
                        }
                    }
                    // A signal: whoever waits may want to end.
                    ErrorKind::Interrupted => return Ok(Vec::new()),
                    _ => return Err(e),
                },
            }
        }
    }
}
