//! A TCP socket that serves one host at a time.

use std::io::{self, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use super::byte_stream::write_patiently;
use super::{ByteStream, WRITE_PATIENCE, keepalive};

/// How long a refused host may take to hang up after it was told.
const FAREWELL: Duration = Duration::from_secs(1);
/// Refused hosts attended to at once; more are simply closed.
const MOST_REFUSED: usize = 8;
/// How long a host that sends no more is sent what comes for it.
const ANSWERING: Duration = Duration::from_secs(1);
/// The same while its successor waits, which is not kept for as long as a host waits for an
/// answer (500 ms). The slowest answer, to `Arm`, takes 22 ms.
const ANSWERING_FOR_NEXT: Duration = Duration::from_millis(100);

/// Listens; the first host is served, others are refused until it leaves. One that vanished
/// without a word is found out about by [`keepalive`]; one that only closed its sending side
/// still gets its answers: for a second, or for 100 ms if another waits for the place.
#[derive(Debug)]
pub struct TcpWire {
    listener: TcpListener,
    refusal: Vec<u8>,
    host: Option<Host>,
    /// Let in as soon as the host, which sends no more, has its answers.
    successor: Option<TcpStream>,
    /// Told and closed for writing, but not dropped yet: closing a socket with
    /// unread bytes would reset it, and the refusal might never be seen.
    refused: Vec<(TcpStream, Instant)>,
    refusals: u64,
}

/// The host that is served.
#[derive(Debug)]
struct Host {
    stream: TcpStream,
    /// When its last byte was read, if it said that it sends no more.
    ended: Option<Instant>,
}

impl TcpWire {
    /// Listens at `address` (port 0: any free one). A second host is sent the
    /// bytes `refusal` and disconnected.
    ///
    /// # Errors
    /// If the address cannot be resolved or is in use.
    pub fn bind(address: impl ToSocketAddrs, refusal: Vec<u8>) -> io::Result<TcpWire> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        Ok(TcpWire {
            listener,
            refusal,
            host: None,
            successor: None,
            refused: Vec::new(),
            refusals: 0,
        })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// If the system cannot tell.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// How many hosts were refused so far.
    pub fn refusals(&self) -> u64 {
        self.refusals
    }

    /// Lets waiting hosts in or turns them away. Call only when the present
    /// host is known to be there still.
    fn accept_hosts(&mut self) -> io::Result<()> {
        self.refused.retain_mut(is_still_leaving);
        loop {
            match self.listener.accept() {
                Ok((stream, _)) => match &self.host {
                    None => {
                        self.host = Host::new(stream).ok(); // else it broke off
                        // It may have left already, for another who waits.
                        return Ok(());
                    }
                    Some(host) if host.ended.is_some() && self.successor.is_none() => {
                        self.successor = Some(stream);
                    }
                    Some(_) => self.refuse(stream),
                },
                Err(error) if is_transient(&error) => return Ok(()),
                // It broke off before it was let in.
                Err(error) if error.kind() == io::ErrorKind::ConnectionAborted => {}
                Err(error) => return Err(error),
            }
        }
    }

    /// Tells a host that it is not served. It may be gone already: its loss.
    fn refuse(&mut self, mut stream: TcpStream) {
        self.refusals += 1;
        let told = stream
            .set_nonblocking(true)
            .and_then(|()| stream.write_all(&self.refusal))
            .and_then(|()| stream.shutdown(Shutdown::Write));
        if told.is_ok() && self.refused.len() < MOST_REFUSED {
            self.refused.push((stream, Instant::now()));
        }
    }
}

impl Host {
    fn new(stream: TcpStream) -> io::Result<Self> {
        stream.set_nonblocking(true)?;
        stream.set_nodelay(true)?;
        keepalive::enable_keepalive(&stream)?;
        let ended = None;
        Ok(Self { stream, ended })
    }

    /// Moves what has arrived into `buf`: how many bytes, 0 for nothing now. `None` once the
    /// host is gone, or has had time for its answers.
    fn read(&mut self, buf: &mut [u8], is_awaited: bool) -> Option<usize> {
        if let Some(ended) = self.ended {
            let patience = match is_awaited {
                true => ANSWERING_FOR_NEXT,
                false => ANSWERING,
            };
            return (ended.elapsed() < patience).then_some(0);
        }
        match self.stream.read(buf) {
            Ok(0) if !buf.is_empty() => {
                self.ended = Some(Instant::now());
                Some(0)
            }
            Ok(count) => Some(count),
            Err(error) => is_transient(&error).then_some(0),
        }
    }
}

impl ByteStream for TcpWire {
    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
        if let Some(host) = &mut self.host {
            match host.read(buf, self.successor.is_some()) {
                Some(0) => {}
                Some(count) => return Ok(count),
                None => {
                    // Report the absence before anyone else is let in.
                    self.host = None;
                    return Ok(0);
                }
            }
        }
        if let Some(next) = self.successor.take_if(|_| self.host.is_none()) {
            self.host = Host::new(next).ok(); // else it broke off while it waited
            return Ok(0);
        }
        self.accept_hosts()?;
        Ok(0)
    }

    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        if let Some(host) = &mut self.host
            && write_patiently(bytes, WRITE_PATIENCE, |bytes| host.stream.write(bytes)).is_err()
        {
            self.host = None;
        }
        Ok(())
    }

    fn connected(&self) -> bool {
        self.host.is_some()
    }
}

/// Reads and forgets what a refused host says; false once it may be dropped.
fn is_still_leaving((stream, since): &mut (TcpStream, Instant)) -> bool {
    let mut ignored = [0; 256];
    match stream.read(&mut ignored) {
        Ok(0) => false,
        Ok(_) => since.elapsed() < FAREWELL,
        Err(error) => is_transient(&error) && since.elapsed() < FAREWELL,
    }
}

/// Errors that say "nothing now".
fn is_transient(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
    )
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use super::*;
    use keepalive::tests::is_watched;

    #[test]
    fn a_served_host_is_watched() {
        let mut wire = TcpWire::bind("127.0.0.1:0", Vec::new()).unwrap();
        let address = wire.local_addr().unwrap();
        let _host = TcpStream::connect(address).unwrap();
        while !wire.connected() {
            assert_eq!(wire.read(&mut [0; 8]).unwrap(), 0);
        }
        assert!(is_watched(address));
    }
}
