//! `flexor calibrate` at a terminal: keys that come all at once, too early or not at all.

use crate::calibrate_orders::{PLAN, entries};
use crate::program::{FLEXOR, folder, ran, written};
use nix::fcntl::OFlag;
use nix::pty::{grantpt, posix_openpt, ptsname_r, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::os::fd::OwnedFd;
use std::os::unix::fs::OpenOptionsExt;
use std::path::PathBuf;
use std::process::{Child, Command};
use std::time::Duration;

/// The program at a terminal of its own.
struct Seated {
    folder: PathBuf,
    process: Child,
    master: File,
    seen: String,
}

fn size(columns: u16, rows: u16) -> Winsize {
    Winsize {
        ws_row: rows,
        ws_col: columns,
        ws_xpixel: 0,
        ws_ypixel: 0,
    }
}

/// The two ends of a terminal; no other program that a test starts holds one of them.
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

impl Seated {
    fn start(test: &str, plan: &str, winsize: Winsize) -> Self {
        let folder = folder(test);
        written(&folder, "plan.toml", plan);
        let (master, slave) = terminal(winsize);
        // A session of its own, of which this is the terminal.
        let mut command = Command::new("setsid");
        command.args(["--ctty", FLEXOR, "calibrate", "--electrodes", "plan.toml"]);
        command
            .args(["--out", "w.toml"])
            .current_dir(&folder)
            .env("TERM", "xterm");
        command.stdin(slave.try_clone().unwrap());
        command.stdout(slave.try_clone().unwrap());
        command.stderr(slave);
        let process = command.spawn().unwrap();
        let seen = String::new();
        Self {
            folder,
            process,
            master,
            seen,
        }
    }

    /// Reads what is there.
    fn read(&mut self) {
        let mut bytes = [0; 4096];
        match self.master.read(&mut bytes) {
            Ok(count) => self.seen += &String::from_utf8_lossy(&bytes[..count]),
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                std::thread::sleep(Duration::from_millis(1));
            }
            // The other side has gone.
            Err(_) => {}
        }
    }

    /// Reads until this is seen, and forgets what came before it.
    fn sees(&mut self, wanted: &str) {
        while !self.seen.contains(wanted) {
            assert!(self.process.try_wait().unwrap().is_none(), "{}", self.seen);
            self.read();
        }
        let (_, rest) = self.seen.split_once(wanted).unwrap();
        self.seen = rest.to_owned();
    }

    /// Types all of it, as fast as it is taken.
    fn types(&mut self, text: &str) {
        let mut rest = text.as_bytes();
        while !rest.is_empty() {
            match self.master.write(rest) {
                Ok(count) => rest = &rest[count..],
                Err(_) => self.read(),
            }
        }
    }

    fn given(&self) -> usize {
        entries(&self.folder, "given").len()
    }

    fn ended(&mut self) -> Option<i32> {
        loop {
            if let Some(status) = self.process.try_wait().unwrap() {
                self.read();
                return status.code();
            }
            self.read();
        }
    }
}

#[test]
fn pasted_keys_raise_nothing_and_do_not_keep_control_c() {
    let ups = "\u{1b}[A".repeat(1300);
    let raises = "+n".repeat(1900);
    for (pasted, most) in [(&ups, 1), (&raises, 1)] {
        let mut seated = Seated::start("calibrate_pasted", PLAN, size(80, 24));
        seated.sees("READY");
        seated.types(&format!("{pasted}\u{3}"));
        assert_eq!(seated.ended(), Some(1), "{}", seated.seen);
        let ended = entries(&seated.folder, "ended");
        assert!(ended[0].to_string().contains("E683"), "{ended:?}");
        // The first byte may come alone, and is a key then.
        assert!(seated.given() <= most);
    }
}

#[test]
fn a_paste_is_no_order_and_a_key_is_one() {
    let plan = PLAN.replace("10.0", "1.0");
    let mut seated = Seated::start("calibrate_paste", &plan, size(80, 24));
    seated.sees("\u{1b}[?2004h");
    seated.sees("READY");
    seated.types(&format!("\u{1b}[200~{}\u{1b}[201~", "+n".repeat(100)));
    // Answers before the question are none.
    seated.types("+");
    seated.sees(" ON");
    seated.types("y");
    seated.types("y");
    seated.sees("y / n");
    assert_eq!(seated.given(), 1);
    assert!(entries(&seated.folder, "found").is_empty());
    seated.types("n");
    seated.sees("READY");
    seated.types("+");
    seated.sees("ON");
    seated.types("\u{1b}");
    assert_eq!(seated.ended(), Some(1), "{}", seated.seen);
    assert_eq!(seated.given(), 2);
    assert!(seated.seen.contains("E683"), "{}", seated.seen);
}

#[test]
fn a_terminal_that_is_closed_ends_it() {
    let mut seated = Seated::start("calibrate_closed", PLAN, size(80, 24));
    seated.sees("READY");
    seated.types("+");
    seated.sees(" ON");
    drop(seated.master);
    let status = seated.process.wait().unwrap();
    assert_eq!(status.code(), Some(129));
    let ended = entries(&seated.folder, "ended");
    assert!(ended[0].to_string().contains("SIGHUP"), "{ended:?}");
    let again = [
        "calibrate",
        "--electrodes",
        "plan.toml",
        "--auto",
        "--resume",
    ];
    let (exit, told, error) = ran(&seated.folder, &[&again[..], &["--out", "w.toml"]].concat());
    assert_eq!(exit, Some(0), "{told}{error}");
}

#[test]
fn a_terminal_that_is_too_small_raises_nothing() {
    let mut seated = Seated::start("calibrate_small", PLAN, size(60, 10));
    seated.sees("SILENT");
    seated.sees("needed");
    while entries(&seated.folder, "armed").is_empty() {
        seated.read();
    }
    seated.types("+");
    tcsetwinsize(&seated.master, size(80, 24)).unwrap();
    // Notes come last on the screen.
    seated.sees("READY");
    seated.sees("E671");
    assert_eq!(seated.given(), 0);
    seated.types("+");
    seated.sees(" ON");
    tcsetwinsize(&seated.master, size(80, 3)).unwrap();
    seated.sees("END");
    seated.sees("needed");
    seated.types("\u{1b}");
    assert_eq!(seated.ended(), Some(1), "{}", seated.seen);
    assert_eq!(seated.given(), 1);
}
