//! Trait for byte streams that a host program can open.

use std::io;
use std::time::{Duration, Instant};

/// A stream of bytes to a host that may connect and disconnect. Nothing here waits for the host,
/// except that a write waits briefly for buffer space.
pub trait ByteStream {
    /// Reads received bytes into `buf` and returns their number: 0 if there are none or no host is
    /// connected. Also accepts a new host.
    ///
    /// # Errors
    /// Fails only if the stream itself is unusable; a host that disconnects is no error.
    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize>;

    /// Sends all bytes, in order. Without a host they are dropped, as on a cable that is not
    /// plugged in; they are also lost if a host does not read for [`WRITE_PATIENCE`] (TCP then
    /// disconnects it).
    ///
    /// # Errors
    /// Fails only if the stream itself is unusable.
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Returns whether a host was connected when the stream was last read or written.
    fn connected(&self) -> bool;
}

/// Time that a write waits for a host that does not read.
pub const WRITE_PATIENCE: Duration = Duration::from_millis(500);

/// Writes all of `bytes` with `write`, which may report that there is no buffer space now.
///
/// # Errors
/// Returns the error of `write`, or `TimedOut` after `patience` without buffer space.
pub(super) fn write_patiently(
    mut bytes: &[u8],
    patience: Duration,
    mut write: impl FnMut(&[u8]) -> io::Result<usize>,
) -> io::Result<()> {
    let mut progress = Instant::now();
    while !bytes.is_empty() {
        match write(bytes) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(count) => {
                bytes = &bytes[count..];
                progress = Instant::now();
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                if progress.elapsed() >= patience {
                    return Err(io::ErrorKind::TimedOut.into());
                }
                std::thread::sleep(Duration::from_micros(100));
            }
            Err(error) => return Err(error),
        }
    }
    Ok(())
}
