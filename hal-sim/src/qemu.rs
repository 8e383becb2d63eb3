//! QEMU backend: runs the Thumb build of the device code on QEMU's STM32F405.
//!
//! Verifies arithmetic and logic, not timing: the image has no clock and takes its time from the
//! lock-step port, which is the machine's USART2.

use crate::images::{BuildError, Image};
use crate::lockstep::{Device, Remote};
use crate::native::seeded_session;
use firmware::link::message::ResetCause;
use firmware::lockstep::{Sensors, Sink};
use firmware::safety::FaultRecord;
use firmware::units::Micros;
use std::io::{self, Read};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use thiserror::Error;

const PROGRAM: &str = "qemu-system-arm";

/// Maximum time that QEMU may take to start, and to answer each command.
const PATIENCE: Duration = Duration::from_secs(20);

/// Reason why a device in QEMU could not be started.
#[derive(Debug, Error)]
pub enum StartError {
    /// The program `qemu-system-arm` is not on the PATH.
    #[error(
        "{PROGRAM} is not installed: install the package qemu-system-arm (Debian, Ubuntu: \
         `apt-get install qemu-system-arm`; macOS: `brew install qemu`)"
    )]
    NotInstalled,
    /// The file of the image does not exist; holds its path.
    #[error("there is no image at {0}; build it with `{build}`", build = Image::Qemu.command())]
    NoImage(PathBuf),
    /// The build of the image failed.
    #[error(transparent)]
    NotBuilt(#[from] BuildError),
    /// QEMU did not start, or ended before it connected.
    #[error("{PROGRAM} did not start: {0}")]
    Failed(String),
    /// Another system call failed.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// A device in QEMU. Dropping it ends the process.
pub struct Qemu {
    remote: Remote<TcpStream, TcpStream>,
    process: Process,
}

impl Qemu {
    /// Starts QEMU with the image at `elf`; the device has booted at time 0.
    ///
    /// # Errors
    /// Returns a [`StartError`] if QEMU or the image is missing, or if QEMU does not start.
    pub fn start(elf: &Path) -> Result<Self, StartError> {
        if !elf.is_file() {
            return Err(StartError::NoImage(elf.to_owned()));
        }
        // QEMU connects to a port that this process holds: a free port for QEMU to listen on could
        // be taken in the meantime.
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        listener.set_nonblocking(true)?;
        let mut process = Process::start(elf, listener.local_addr()?.port())?;
        let stream = process.accept(&listener)?;
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        let remote = Remote::open(stream.try_clone()?, stream)
            .map_err(|e| StartError::Failed(process.explain(e).to_string()))?;
        Ok(Self { remote, process })
    }

    /// Resets the device and boots it at `at`, with `last_fault` as its recorded fault.
    ///
    /// # Errors
    /// Fails if QEMU has ended or hangs.
    pub fn boot(
        &mut self,
        at: Micros,
        reset: ResetCause,
        last_fault: Option<FaultRecord>,
    ) -> io::Result<()> {
        let result = self.remote.boot(at, reset, last_fault);
        result.map_err(|e| self.process.explain(e))
    }

    /// Boots the device at 0 and derives the number of its first session from `seed`.
    ///
    /// # Errors
    /// Fails if QEMU has ended or hangs.
    pub fn boot_seeded(&mut self, seed: u64) -> io::Result<()> {
        self.remote.number_sessions(seeded_session(seed));
        self.boot(Micros::new(0), ResetCause::PowerOn, None)
    }

    /// Returns the number of commands sent on the lock-step port so far.
    #[must_use]
    pub const fn commands(&self) -> u64 {
        self.remote.commands()
    }
}

impl Device for Qemu {
    fn receive(
        &mut self,
        at: Micros,
        bytes: &[u8],
        sensors: &Sensors,
        sink: &mut dyn Sink,
    ) -> io::Result<()> {
        let result = self.remote.receive(at, bytes, sensors, sink);
        result.map_err(|e| self.process.explain(e))
    }

    fn advance(&mut self, to: Micros, sensors: &Sensors, sink: &mut dyn Sink) -> io::Result<()> {
        let result = self.remote.advance(to, sensors, sink);
        result.map_err(|e| self.process.explain(e))
    }
}

/// Process of QEMU, which is killed when this value is dropped.
struct Process(Child);

impl Process {
    fn start(elf: &Path, port: u16) -> Result<Self, StartError> {
        let child = Command::new(PROGRAM)
            .args([
                "-M",
                "netduinoplus2",
                "-display",
                "none",
                "-monitor",
                "none",
            ])
            .args(["-semihosting-config", "enable=on,target=native"])
            // USART1 is not connected, because QEMU faults on the registers of its clock.
            .args(["-serial", "null", "-serial"])
            .arg(format!("tcp:127.0.0.1:{port},nodelay=on"))
            .arg("-kernel")
            .arg(elf)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn();
        match child {
            Ok(child) => Ok(Self(child)),
            Err(e) if e.kind() == io::ErrorKind::NotFound => Err(StartError::NotInstalled),
            Err(e) => Err(e.into()),
        }
    }

    fn accept(&mut self, listener: &TcpListener) -> Result<TcpStream, StartError> {
        let start = Instant::now();
        loop {
            match listener.accept() {
                Ok((stream, _)) => return Ok(stream),
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => {}
                Err(e) => return Err(e.into()),
            }
            if self.0.try_wait()?.is_some() || start.elapsed() > PATIENCE {
                return Err(StartError::Failed(self.remaining_output()));
            }
            sleep(Duration::from_millis(2));
        }
    }

    /// Adds to `error` the last output of QEMU or of the image's panic handler.
    fn explain(&mut self, error: io::Error) -> io::Error {
        let words = self.remaining_output();
        io::Error::new(error.kind(), format!("QEMU: {error}. {words}"))
    }

    fn remaining_output(&mut self) -> String {
        let _ = self.0.kill(); // the process may have ended by itself
        let mut words = Vec::new();
        if let Some(mut stderr) = self.0.stderr.take() {
            let _ = stderr.read_to_end(&mut words); // a partial output is enough
        }
        String::from_utf8_lossy(&words).trim().to_owned()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill(); // the process may have ended by itself
        let _ = self.0.wait();
    }
}
