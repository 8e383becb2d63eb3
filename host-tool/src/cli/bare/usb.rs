//! Connects the USB serial port of a simulated image to other programs, in real time.

use super::usage_error;
use anyhow::Context;
use hal_sim::chip::bare::Bare;
#[cfg(unix)]
use hal_sim::wire::pty::PtyWire;
use hal_sim::wire::{ByteStream, tcp::TcpWire};
use std::net::{SocketAddr, ToSocketAddrs};
#[cfg(unix)]
use std::path::Path;
use std::time::{Duration, Instant};

/// Delay after which the simulator counts as slower than real time; the clock then waits for it.
const LAG: Duration = Duration::from_millis(50);
/// Longest sleep between two reads of the wire.
const POLL: Duration = Duration::from_millis(1);

/// The connection to the program at the other end.
pub struct Line {
    wire: Box<dyn ByteStream>,
    place: String,
    /// Wall clock at device time 0, moved later whenever the simulator falls behind.
    begin: Instant,
    was_slow: bool,
}

impl Line {
    /// Opens a socket at `place` (`tcp:HOST:PORT` on this computer), or a pseudo-terminal at that
    /// path.
    ///
    /// # Errors
    /// Fails if the place cannot be opened or is not on this computer.
    pub fn open(place: &str) -> anyhow::Result<Self> {
        let (wire, place): (Box<dyn ByteStream>, String) = match place.strip_prefix("tcp:") {
            Some(address) => {
                let cannot = || format!("cannot listen at {address}");
                let places: Vec<SocketAddr> =
                    address.to_socket_addrs().with_context(cannot)?.collect();
                if let Some(beyond) = places
                    .iter()
                    .find(|socket_addr| !socket_addr.ip().is_loopback())
                {
                    return usage_error(format!(
                        "--usb is {beyond}: give an address of this computer, such as \
                         tcp:127.0.0.1:{}",
                        beyond.port()
                    ));
                }
                let wire = TcpWire::bind(&places[..], Vec::new()).with_context(cannot)?;
                let place = format!("tcp:{}", wire.local_addr()?);
                (Box::new(wire), place)
            }
            #[cfg(unix)]
            None => {
                let wire = PtyWire::open(Path::new(place));
                let wire =
                    wire.with_context(|| format!("cannot open a pseudo-terminal at {place}"))?;
                (Box::new(wire), place.to_owned())
            }
            #[cfg(not(unix))]
            None => {
                return usage_error(
                    "--usb: this system has no pseudo-terminals; give tcp:HOST:PORT",
                );
            }
        };
        Ok(Self {
            wire,
            place,
            begin: Instant::now(),
            was_slow: false,
        })
    }

    /// Returns the address at which other programs connect.
    pub fn place(&self) -> &str {
        &self.place
    }

    /// Transfers bytes both ways, then waits until the wall clock reaches device time.
    ///
    /// # Errors
    /// Fails if the wire can no longer be used.
    pub fn serve(&mut self, bare: &mut Bare) -> anyhow::Result<()> {
        let device = Duration::from_nanos(bare.now_ns());
        loop {
            self.wire.write_all(&bare.wires.received())?;
            let mut buffer = [0; 4096];
            let count = self.wire.read(&mut buffer)?;
            bare.send(&buffer[..count]);
            let elapsed = self.begin.elapsed();
            if elapsed > device + LAG {
                if !self.was_slow {
                    eprintln!("note: the simulator is slower than real time");
                }
                self.was_slow = true;
                self.begin += elapsed - device;
            }
            match device.checked_sub(elapsed) {
                Some(ahead) if !ahead.is_zero() => std::thread::sleep(ahead.min(POLL)),
                _ => return Ok(()),
            }
        }
    }
}
