//! The running `flexor` program, and the shell that sends it signals.

use crate::program::FLEXOR;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Time after which a program counts as hanging.
const PATIENCE: Duration = Duration::from_secs(120);

/// A running program, killed when dropped.
pub struct Program {
    process: Child,
    folder: PathBuf,
    shell: Child,
    orders: ChildStdin,
}

impl Program {
    /// Starts the program in `folder`; no file that it writes may exceed `most` bytes.
    pub fn start(folder: &Path, arguments: &[&str], most: Option<u64>) -> Self {
        Self::begin((folder, arguments), most, Stdio::inherit())
    }

    /// Starts the program in `folder` at this terminal.
    pub fn start_at(terminal: &Path, folder: &Path, arguments: &[&str]) -> Self {
        let typed = File::open(terminal).unwrap();
        Self::begin((folder, arguments), None, typed.into())
    }

    fn begin((folder, arguments): (&Path, &[&str]), most: Option<u64>, stdin: Stdio) -> Self {
        let mut command = match most {
            None => Command::new(FLEXOR),
            Some(most) => {
                // Without the trap the limit would cause a signal instead of an error.
                let mut command = Command::new("sh");
                let limited = r#"trap '' 25; exec prlimit --fsize="$0" -- "$@""#;
                command.args(["-c", limited, &most.to_string(), FLEXOR]);
                command
            }
        };
        let file = |name: &str| File::create(folder.join(name)).unwrap();
        let process = command
            .current_dir(folder)
            .args(arguments)
            .env("NO_COLOR", "1")
            .stdin(stdin)
            .stdout(file("stdout"))
            .stderr(file("stderr"))
            .spawn()
            .unwrap();
        // The shell's builtin `kill` starts at once.
        let mut shell = Command::new("sh").stdin(Stdio::piped()).spawn().unwrap();
        let orders = shell.stdin.take().unwrap();
        Self {
            process,
            folder: folder.to_owned(),
            shell,
            orders,
        }
    }

    /// Sends `signal` through the shell, and returns the time of the order.
    pub fn signal(&mut self, signal: &str) -> Instant {
        let now = Instant::now();
        writeln!(self.orders, "kill -{signal} {}", self.process.id()).unwrap();
        now
    }

    pub fn is_running(&mut self) -> bool {
        self.process.try_wait().unwrap().is_none()
    }

    /// Waits until the condition holds; returns false if the program ends before.
    pub fn wait_until(&mut self, is_so: impl Fn() -> bool) -> bool {
        let begin = Instant::now();
        while !is_so() {
            if !self.is_running() {
                return false;
            }
            assert!(begin.elapsed() < PATIENCE, "it hangs");
            std::thread::sleep(Duration::from_millis(1));
        }
        true
    }

    /// Returns whether the program handles the signal of this number by now, as Linux reports.
    pub fn handles_signal(&self, signal: u32) -> bool {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.process.id()));
        let caught = status.ok().and_then(|status| {
            let line = status
                .lines()
                .find_map(|line| line.strip_prefix("SigCgt:"))?;
            u64::from_str_radix(line.trim(), 16).ok()
        });
        caught.is_some_and(|caught| caught & 1 << (signal - 1) != 0)
    }

    pub fn wait(&mut self) -> ExitStatus {
        let begin = Instant::now();
        loop {
            if let Some(status) = self.process.try_wait().unwrap() {
                return status;
            }
            assert!(begin.elapsed() < PATIENCE, "it hangs: {}", self.error());
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Returns the standard error so far.
    pub fn error(&self) -> String {
        std::fs::read_to_string(self.folder.join("stderr")).unwrap()
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        for child in [&mut self.process, &mut self.shell] {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
