//! Ports in real time: a stream of bytes in general, and a stream over TCP.

use super::elapsed::Elapsed;
use super::port::Outlet;
use super::{Error, Port};
use crate::clock::SystemClock;
use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// Longest duration of one read from the stream, so that a wait ends close to its time limit.
pub(super) const POLL: Duration = Duration::from_millis(2);

/// Port of a device that is reached through a stream of bytes, such as a serial port or a TCP
/// socket, in real time.
pub struct Stream<S> {
    stream: S,
    elapsed: Elapsed,
}

/// Port of a simulated board behind a TCP socket.
pub type TcpPort = Stream<TcpStream>;

impl TcpPort {
    /// Connects to a device at `address` (HOST:PORT).
    ///
    /// # Errors
    /// [`Error::Open`]: no server listens there.
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
            advice: "start a simulated board at that address with `flexor serve --tcp ADDR`",
        })?;
        Ok(Self::begin(stream))
    }
}

impl<S> Stream<S> {
    /// Creates a port whose time is 0 now.
    pub(super) fn begin(stream: S) -> Self {
        let elapsed = Elapsed::begin();
        Self { stream, elapsed }
    }
}

/// Stream of bytes whose writing end can be duplicated for a second thread.
pub trait SplitStream: Read + Write + Send {
    /// Returns a second writing end of the same stream.
    fn clone_writer(&self) -> io::Result<Box<dyn Write + Send>>;
}

impl SplitStream for TcpStream {
    fn clone_writer(&self) -> io::Result<Box<dyn Write + Send>> {
        Ok(Box::new(self.try_clone()?))
    }
}

impl<S: SplitStream> Port for Stream<S> {
    fn now_us(&mut self) -> u64 {
        self.elapsed.us()
    }

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        self.stream.write_all(frame)
    }

    fn outlet(&mut self) -> io::Result<Option<Outlet>> {
        Ok(Some(Outlet {
            line: self.stream.clone_writer()?,
            clock: Box::new(SystemClock::start()),
        }))
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
                    // A signal arrived; the caller may want to end.
                    ErrorKind::Interrupted => return Ok(Vec::new()),
                    _ => return Err(e),
                },
            }
        }
    }
}
