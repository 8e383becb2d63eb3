//! Runs the program at its own terminal, to test what a person sees and types.

use crate::program::FLEXOR;
use nix::fcntl::OFlag;
use nix::pty::{grantpt, posix_openpt, ptsname_r, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::os::fd::OwnedFd;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::process::{Child, Command, ExitStatus};
use std::time::Duration;

/// A `flexor` process whose standard streams are a pseudo-terminal.
pub struct TerminalProgram {
    process: Child,
    master: File,
    pub seen: String,
}

/// Returns the size of a terminal.
pub fn size(columns: u16, rows: u16) -> Winsize {
    Winsize {
        ws_row: rows,
        ws_col: columns,
        ws_xpixel: 0,
        ws_ypixel: 0,
    }
}

/// Opens the two ends of a terminal, which no other program of a test inherits.
fn terminal(winsize: Winsize) -> (File, File) {
    let flags = OFlag::O_RDWR | OFlag::O_NOCTTY | OFlag::O_CLOEXEC | OFlag::O_NONBLOCK;
    let master = posix_openpt(flags).unwrap();
    grantpt(&master).unwrap();
    unlockpt(&master).unwrap();
    let mut options = File::options();
    options.read(true).write(true);
    options.custom_flags(OFlag::O_NOCTTY.bits());
    let slave = options.open(ptsname_r(&master).unwrap()).unwrap();
    tcsetwinsize(&slave, winsize).unwrap();
    (File::from(OwnedFd::from(master)), slave)
}

impl TerminalProgram {
    /// Starts the program with these arguments in `folder`.
    pub fn start(folder: &Path, words: &str, winsize: Winsize) -> Self {
        let (master, slave) = terminal(winsize);
        // Starts a session with this controlling terminal.
        let mut command = Command::new("setsid");
        command.args(["--ctty", FLEXOR]);
        command.args(words.split_whitespace());
        command.current_dir(folder).env("TERM", "xterm");
        command.stdin(slave.try_clone().unwrap());
        command.stdout(slave.try_clone().unwrap());
        command.stderr(slave);
        let process = command.spawn().unwrap();
        let seen = String::new();
        Self {
            process,
            master,
            seen,
        }
    }

    /// Reads the available output.
    pub fn read(&mut self) {
        let mut bytes = [0; 4096];
        match self.master.read(&mut bytes) {
            Ok(count) => self.seen += &String::from_utf8_lossy(&bytes[..count]),
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                std::thread::sleep(Duration::from_millis(1));
            }
            // The other end was closed.
            Err(_) => {}
        }
    }

    /// Reads until this text appears, and discards the output before it.
    pub fn wait_for_text(&mut self, wanted: &str) {
        while !self.seen.contains(wanted) {
            assert!(self.process.try_wait().unwrap().is_none(), "{}", self.seen);
            self.read();
        }
        let (_, rest) = self.seen.split_once(wanted).unwrap();
        self.seen = rest.to_owned();
    }

    /// Types the whole text, as fast as the program accepts it.
    pub fn type_text(&mut self, text: &str) {
        let mut rest = text.as_bytes();
        while !rest.is_empty() {
            match self.master.write(rest) {
                Ok(count) => rest = &rest[count..],
                Err(_) => self.read(),
            }
        }
    }

    /// Changes the size of the terminal.
    pub fn resize(&self, columns: u16, rows: u16) {
        tcsetwinsize(&self.master, size(columns, rows)).unwrap();
    }

    /// Closes the terminal, and returns how the program ends.
    pub fn close(mut self) -> ExitStatus {
        drop(self.master);
        self.process.wait().unwrap()
    }

    /// Reads until the program ends, and returns its exit code.
    pub fn wait_for_exit(&mut self) -> Option<i32> {
        loop {
            if let Some(status) = self.process.try_wait().unwrap() {
                self.read();
                return status.code();
            }
            self.read();
        }
    }
}
