//! Pseudo-terminal, which any program on this machine can open as a serial port.

mod link;

use std::fs::File;
use std::io::{self, Read, Write};
use std::os::fd::AsFd;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use nix::errno::Errno;
use nix::fcntl::{FcntlArg, FdFlag, OFlag, fcntl};
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::pty::openpty;
use nix::sys::termios::{FlushArg, SetArg, cfmakeraw, tcflush, tcgetattr, tcsetattr};

use super::byte_stream::write_patiently;
use super::{ByteStream, WRITE_PATIENCE};
use link::Link;

/// The board's end of a pseudo-terminal. Hosts open the other end by its path.
///
/// Hosts may close and reopen it. Unlike TCP it cannot refuse a second host; serial programs lock
/// the port among themselves.
#[derive(Debug)]
pub struct PtyWire {
    master: File,
    device: PathBuf,
    /// Symbolic link, which its destructor removes.
    _link: Link,
    connected: bool,
    /// Whether the host did not read for too long, so that writes no longer wait for it.
    stalled: bool,
}

impl PtyWire {
    /// Opens a raw pseudo-terminal and makes `path` a symbolic link to it. The link is removed on
    /// drop, unless another one has replaced it. An existing entry at `path` is replaced only if it
    /// is a link to a pseudo-terminal that no longer exists, as a crashed run leaves.
    ///
    /// # Errors
    /// Returns `AlreadyExists` if another entry is at `path`, including a link to an existing
    /// terminal; otherwise the error of the system.
    pub fn open(path: impl AsRef<Path>) -> io::Result<PtyWire> {
        let pty = openpty(None, None)?;
        make_ready(&pty.slave)?;
        fcntl(&pty.master, FcntlArg::F_SETFL(OFlag::O_NONBLOCK))?;
        fcntl(&pty.master, FcntlArg::F_SETFD(FdFlag::FD_CLOEXEC))?;
        let device = nix::unistd::ttyname(&pty.slave)?;
        // The slave end is closed here. While no process has it open, the master reports a hang-up,
        // which shows that no host is connected.
        drop(pty.slave);
        let link = Link::make(path.as_ref(), &device)?;
        Ok(PtyWire {
            master: File::from(pty.master),
            device,
            _link: link,
            connected: false,
            stalled: false,
        })
    }

    /// Returns the path of the terminal that the link points to.
    pub fn device(&self) -> &Path {
        &self.device
    }

    fn look_for_host(&mut self) -> io::Result<()> {
        let mut fds = [PollFd::new(self.master.as_fd(), PollFlags::POLLIN)];
        match poll(&mut fds, PollTimeout::ZERO) {
            Err(Errno::EINTR) => return Ok(()),
            result => result?,
        };
        let events = fds[0].revents().unwrap_or(PollFlags::empty());
        let was_connected = self.connected;
        self.connected = !events.contains(PollFlags::POLLHUP);
        if was_connected && !self.connected {
            self.clear_for_next_host()?;
        }
        Ok(())
    }

    /// Discards the bytes that the last host did not read, and resets its terminal settings.
    fn clear_for_next_host(&mut self) -> io::Result<()> {
        self.stalled = false;
        let slave = File::options()
            .read(true)
            .write(true)
            .custom_flags((OFlag::O_NOCTTY | OFlag::O_NONBLOCK).bits())
            .open(&self.device)?;
        Ok(make_ready(&slave)?)
    }
}

impl ByteStream for PtyWire {
    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
        self.look_for_host()?;
        match self.master.read(buf) {
            Ok(count) => Ok(count),
            Err(error) if is_absence(&error) => Ok(0),
            Err(error) => Err(error),
        }
    }

    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.look_for_host()?;
        if !self.connected {
            return Ok(());
        }
        let patience = if self.stalled {
            Duration::ZERO
        } else {
            WRITE_PATIENCE
        };
        let result = write_patiently(bytes, patience, |bytes| self.master.write(bytes));
        self.stalled = matches!(&result, Err(error) if error.kind() == io::ErrorKind::TimedOut);
        match result {
            Err(error) if self.stalled || is_absence(&error) => Ok(()),
            result => result,
        }
    }

    fn connected(&self) -> bool {
        self.connected
    }
}

/// Makes a terminal raw and discards its unread input.
fn make_ready(slave: &impl AsFd) -> nix::Result<()> {
    let mut settings = tcgetattr(slave)?;
    cfmakeraw(&mut settings);
    tcsetattr(slave, SetArg::TCSANOW, &settings)?;
    tcflush(slave, FlushArg::TCIFLUSH)
}

/// Returns whether the error means that there are no bytes now, or no host.
fn is_absence(error: &io::Error) -> bool {
    let hung_up = error.raw_os_error() == Some(Errno::EIO as i32);
    hung_up
        || matches!(
            error.kind(),
            io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
        )
}
