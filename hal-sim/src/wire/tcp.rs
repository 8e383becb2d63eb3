//! TCP socket that serves one host at a time.

use std::io::{self, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use super::byte_stream::write_patiently;
use super::{ByteStream, WRITE_PATIENCE, keepalive};

/// Time that a refused host has to disconnect after the refusal was sent.
const FAREWELL: Duration = Duration::from_secs(1);
/// Maximum number of refused hosts that are kept open at once; further ones are closed immediately.
const MOST_REFUSED: usize = 8;
/// Time during which a host that has closed its sending side still receives answers.
const ANSWERING: Duration = Duration::from_secs(1);
/// Time during which a host that has closed its sending side still receives answers while a
/// successor waits. It must be shorter than the 500 ms for which a host waits for an answer; the
/// slowest answer, to `Arm`, takes 22 ms.
const ANSWERING_FOR_NEXT: Duration = Duration::from_millis(100);

/// TCP server for one host; others are refused until that host leaves. [`keepalive`] detects a host
/// that vanished. A host that closed only its sending side still receives its answers: for one
/// second, or for 100 ms if another host waits.
#[derive(Debug)]
pub struct TcpWire {
    listener: TcpListener,
    refusal: Vec<u8>,
    host: Option<Host>,
    /// Host that is accepted as soon as the present one, which sends no more, has its answers.
    successor: Option<TcpStream>,
    /// Hosts that were sent the refusal and closed for writing, but are not dropped yet: closing a
    /// socket with unread bytes would reset it, and the refusal might be lost.
    refused: Vec<(TcpStream, Instant)>,
    refusals: u64,
}

/// Host that is being served.
#[derive(Debug)]
struct Host {
    stream: TcpStream,
    /// Time at which the host closed its sending side, if it did.
    ended: Option<Instant>,
}

impl TcpWire {
    /// Listens at `address` (port 0: any free port). A second host is sent the bytes `refusal` and
    /// disconnected.
    ///
    /// # Errors
    /// Fails if the address cannot be resolved or is in use.
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

    /// Returns the address at which the server listens.
    ///
    /// # Errors
    /// Fails if the system does not report the address.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Returns the number of hosts refused so far.
    pub fn refusals(&self) -> u64 {
        self.refusals
    }

    /// Accepts or refuses waiting hosts. Call this only when the present host is known to be
    /// connected still.
    fn accept_hosts(&mut self) -> io::Result<()> {
        self.refused.retain_mut(is_still_leaving);
        loop {
            match self.listener.accept() {
                Ok((stream, _)) => match &self.host {
                    None => {
                        // an error means that the connection broke
                        self.host = Host::new(stream).ok();
                        // It may have left already, to make way for another host that waits.
                        return Ok(());
                    }
                    Some(host) if host.ended.is_some() && self.successor.is_none() => {
                        self.successor = Some(stream);
                    }
                    Some(_) => self.refuse(stream),
                },
                Err(error) if is_transient(&error) => return Ok(()),
                // The connection broke before it was accepted.
                Err(error) if error.kind() == io::ErrorKind::ConnectionAborted => {}
                Err(error) => return Err(error),
            }
        }
    }

    /// Sends the refusal to a host. Errors are ignored: the host may have left already.
    fn refuse(&mut self, mut stream: TcpStream) {
        self.refusals += 1;
        let outcome = stream
            .set_nonblocking(true)
            .and_then(|()| stream.write_all(&self.refusal))
            .and_then(|()| stream.shutdown(Shutdown::Write));
        if outcome.is_ok() && self.refused.len() < MOST_REFUSED {
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

    /// Reads received bytes into `buf` and returns their number, 0 if there are none now. Returns
    /// `None` once the host has left or its time for answers is over.
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
                    // Report the absence before another host is accepted.
                    self.host = None;
                    return Ok(0);
                }
            }
        }
        if let Some(next) = self.successor.take_if(|_| self.host.is_none()) {
            // an error means that the connection broke while it waited
            self.host = Host::new(next).ok();
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

/// Reads and discards the bytes of a refused host; returns false once it may be dropped.
fn is_still_leaving((stream, since): &mut (TcpStream, Instant)) -> bool {
    let mut ignored = [0; 256];
    match stream.read(&mut ignored) {
        Ok(0) => false,
        Ok(_) => since.elapsed() < FAREWELL,
        Err(error) => is_transient(&error) && since.elapsed() < FAREWELL,
    }
}

/// Returns whether the error only means that there is nothing to read now.
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
