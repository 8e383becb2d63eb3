//! A byte stream that a host program can open.

use std::io;
use std::time::{Duration, Instant};

/// A stream of bytes to a host that may come and go. Nothing here waits for
/// the host, except that a write waits a little for room.
pub trait ByteStream {
    /// Moves what has arrived into `buf` and says how many bytes: 0 if nothing
    /// has, or if no host is connected. Also lets a new host in.
    ///
    /// # Errors
    /// Only if the stream itself is unusable; a host that goes away is no error.
    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize>;

    /// Sends all bytes, in order. Without a host they are dropped, as on a
    /// cable that is not plugged in; a host that does not read for
    /// [`WRITE_PATIENCE`] loses them too (and TCP disconnects it).
    ///
    /// # Errors
    /// Only if the stream itself is unusable.
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// True if a host was connected when the stream was last read or written.
    fn connected(&self) -> bool;
}

/// How long a write waits for a host that does not read.
pub const WRITE_PATIENCE: Duration = Duration::from_millis(500);

/// Writes all of `bytes` with `write`, which may say that there is no room now.
///
/// # Errors
/// The error of `write`, or `TimedOut` after `patience` without room.
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
