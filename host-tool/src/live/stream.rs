//! Reads standard input and writes standard output without waiting.

use std::io;
use std::time::Duration;

/// Largest write, bytes: a pipe with any room accepts this many.
pub const AT_ONCE: usize = 4096;

/// Reads the waiting input, `most` bytes or a little more. Returns whether the input is still open.
#[cfg(unix)]
pub fn read_available(into: &mut Vec<u8>, most: usize) -> bool {
    use rustix::event::PollFlags;
    use rustix::io::Errno;
    let input = io::stdin();
    let mut bytes = [0; AT_ONCE];
    let end = into.len() + most;
    while into.len() < end {
        match poll_stream(&input, PollFlags::IN, Duration::ZERO) {
            Ok(now) if now.is_empty() => return true,
            Ok(_) => {}
            Err(_) => return false,
        }
        match rustix::io::read(&input, &mut bytes) {
            Ok(0) => return false,
            Ok(read) => into.extend_from_slice(&bytes[..read]),
            Err(Errno::INTR | Errno::AGAIN) => return true,
            Err(_) => return false,
        }
    }
    true
}

/// Writes as much of `bytes` as fits, at most [`AT_ONCE`], and returns the number of bytes written.
/// With an empty slice it only checks whether there is a reader.
///
/// # Errors
/// Fails if there is no reader any more.
#[cfg(unix)]
pub fn write_available(bytes: &[u8]) -> io::Result<usize> {
    use rustix::event::PollFlags;
    use rustix::io::Errno;
    let output = io::stdout();
    let now = poll_stream(&output, PollFlags::OUT, Duration::ZERO)?;
    if now.intersects(PollFlags::ERR | PollFlags::HUP | PollFlags::NVAL) {
        return Err(io::ErrorKind::BrokenPipe.into());
    }
    if !now.contains(PollFlags::OUT) || bytes.is_empty() {
        return Ok(0);
    }
    match rustix::io::write(&output, &bytes[..bytes.len().min(AT_ONCE)]) {
        Err(Errno::INTR | Errno::AGAIN) => Ok(0),
        written => Ok(written?),
    }
}

/// Waits up to `patience` until a stream is in a `wanted` state or closed, and returns its state.
#[cfg(unix)]
fn poll_stream(
    stream: &impl std::os::fd::AsFd,
    wanted: rustix::event::PollFlags,
    patience: Duration,
) -> io::Result<rustix::event::PollFlags> {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let mut descriptors = [PollFd::new(stream, wanted)];
    let patience = Timespec::try_from(patience).unwrap_or_default();
    match poll(&mut descriptors, Some(&patience)) {
        Err(rustix::io::Errno::INTR) => Ok(PollFlags::empty()),
        polled => polled
            .map(|_| descriptors[0].revents())
            .map_err(io::Error::from),
    }
}

/// Redirects standard output and error to /dev/null if they accept nothing for `patience`, so that
/// no later output can block.
#[cfg(unix)]
pub fn discard_unread_output(patience: Duration) {
    use rustix::event::PollFlags;
    let Ok(nowhere) = std::fs::OpenOptions::new().write(true).open("/dev/null") else {
        return;
    };
    let has_room = |now: io::Result<PollFlags>| now.is_ok_and(|now| now == PollFlags::OUT);
    // If this fails, a second signal still ends the program.
    if !has_room(poll_stream(&io::stdout(), PollFlags::OUT, patience)) {
        let _ = rustix::stdio::dup2_stdout(&nowhere);
    }
    if !has_room(poll_stream(&io::stderr(), PollFlags::OUT, patience)) {
        let _ = rustix::stdio::dup2_stderr(&nowhere);
    }
}

/// Returns whether input is waiting or arrives within `patience`.
///
/// # Errors
/// Fails if the input has closed.
#[cfg(unix)]
pub fn has_input(patience: Duration) -> io::Result<bool> {
    use rustix::event::PollFlags;
    let now = poll_stream(&io::stdin(), PollFlags::IN, patience)?;
    if now.intersects(PollFlags::ERR | PollFlags::HUP | PollFlags::NVAL) {
        return Err(io::ErrorKind::BrokenPipe.into());
    }
    Ok(now.contains(PollFlags::IN))
}

/// Reports the end of the input, because without `poll` it cannot be checked without waiting.
#[cfg(not(unix))]
pub fn read_available(_: &mut Vec<u8>, _: usize) -> bool {
    false
}

/// Writes all bytes, in the belief that there is a reader.
///
/// # Errors
/// Fails if there is no reader any more.
#[cfg(not(unix))]
pub fn write_available(bytes: &[u8]) -> io::Result<usize> {
    use io::Write;
    io::stdout().write_all(bytes).map(|()| bytes.len())
}

/// Only waits for `patience`.
///
/// # Errors
/// Never fails.
#[cfg(not(unix))]
pub fn has_input(patience: Duration) -> io::Result<bool> {
    std::thread::sleep(patience);
    Ok(false)
}

/// Does nothing, because nothing is known about readers.
#[cfg(not(unix))]
pub fn discard_unread_output(_: Duration) {}
