//! Standard input and output, of which nothing is waited for.

use std::io;
use std::time::Duration;

/// Most that is written at once, bytes: where there is room at all, a pipe has it for these.
pub const AT_ONCE: usize = 4096;

/// Takes what waits at the input, `most` bytes or a little more; whether the input goes on.
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

/// Writes as much of `bytes` as there is room for, [`AT_ONCE`] at most; how much that was.
/// With none it only looks whether somebody can read.
///
/// # Errors
/// Nobody can read it any more.
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

/// What is so of a stream, of `wanted` and of what ends it, within `patience`.
#[cfg(unix)]
fn poll_stream(
    stream: &impl std::os::fd::AsFd,
    wanted: rustix::event::PollFlags,
    patience: Duration,
) -> io::Result<rustix::event::PollFlags> {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let mut all = [PollFd::new(stream, wanted)];
    let patience = Timespec::try_from(patience).unwrap_or_default();
    match poll(&mut all, Some(&patience)) {
        Err(rustix::io::Errno::INTR) => Ok(PollFlags::empty()),
        polled => polled.map(|_| all[0].revents()).map_err(io::Error::from),
    }
}

/// From now on nothing that is said waits for somebody who does not read it: what has had no
/// reader for `patience` goes nowhere.
#[cfg(unix)]
pub fn discard_unread_output(patience: Duration) {
    use rustix::event::PollFlags;
    let Ok(nowhere) = std::fs::OpenOptions::new().write(true).open("/dev/null") else {
        return;
    };
    let has_room = |now: io::Result<PollFlags>| now.is_ok_and(|now| now == PollFlags::OUT);
    // Where that fails, a second signal still ends the program.
    if !has_room(poll_stream(&io::stdout(), PollFlags::OUT, patience)) {
        let _ = rustix::stdio::dup2_stdout(&nowhere);
    }
    if !has_room(poll_stream(&io::stderr(), PollFlags::OUT, patience)) {
        let _ = rustix::stdio::dup2_stderr(&nowhere);
    }
}

/// Whether something waits at the input, or comes within `patience`.
///
/// # Errors
/// Nothing can come any more.
#[cfg(unix)]
pub fn has_input(patience: Duration) -> io::Result<bool> {
    use rustix::event::PollFlags;
    let now = poll_stream(&io::stdin(), PollFlags::IN, patience)?;
    if now.intersects(PollFlags::ERR | PollFlags::HUP | PollFlags::NVAL) {
        return Err(io::ErrorKind::BrokenPipe.into());
    }
    Ok(now.contains(PollFlags::IN))
}

/// On systems without `poll` nobody can be asked without waiting: the input has ended.
#[cfg(not(unix))]
pub fn read_available(_: &mut Vec<u8>, _: usize) -> bool {
    false
}

/// As there, somebody is taken to read.
///
/// # Errors
/// Nobody can read it any more.
#[cfg(not(unix))]
pub fn write_available(bytes: &[u8]) -> io::Result<usize> {
    use io::Write;
    io::stdout().write_all(bytes).map(|()| bytes.len())
}

/// As there, only the time passes.
///
/// # Errors
/// None.
#[cfg(not(unix))]
pub fn has_input(patience: Duration) -> io::Result<bool> {
    std::thread::sleep(patience);
    Ok(false)
}

/// As there, nothing is known of readers.
#[cfg(not(unix))]
pub fn discard_unread_output(_: Duration) {}
