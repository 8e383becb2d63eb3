//! A drive in real time, on a thread of its own, that stimulates only while its program lives.
//!
//! The thread reads from the device, records, sends keep-alives and programs. It does so while a
//! *lease* runs, which every call of the program renews. A program that hangs, is held by a
//! debugger or has failed renews nothing: the thread then stops the device. A process that does not
//! run at all sends nothing, and the device stops by its host timeout.

use super::{Drive, DriveError, DriveState};
use crate::clock::{Clock, SystemClock};
use firmware::link::Request;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Longest lease on a real device.
pub const MAX_LEASE: Duration = Duration::from_secs(10);

/// Longest time for which the thread reads from the device before it looks for calls, µs.
const SLICE_US: u64 = 1_000;

/// Time between two looks for calls while nothing is armed.
const IDLE: Duration = Duration::from_millis(50);

type Job = Box<dyn FnOnce(&mut Drive) + Send>;

/// Drive on a thread of its own, with a lease.
pub struct LeasedDrive {
    jobs: Sender<Job>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    clock: SystemClock,
    lease: Duration,
    progress: Mutex<Progress>,
}

/// State of the drive, as its thread last saw it.
#[derive(Default)]
struct Progress {
    /// Time at which the lease was last renewed.
    renewed: Duration,
    /// Time since the start of the trains, µs.
    time_us: u64,
    is_running: bool,
    /// Error that ended the trial and that no call has returned yet.
    ended: Option<DriveError>,
}

impl Shared {
    fn progress(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn renew(&self) {
        self.progress().renewed = self.clock.now();
    }
}

impl LeasedDrive {
    /// Moves `drive` to a thread of its own. The program must make a call at least once per
    /// `lease` while the device stimulates.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn start(drive: Drive, lease: Duration) -> std::io::Result<Self> {
        let (jobs, calls) = channel();
        let shared = Arc::new(Shared {
            clock: SystemClock::start(),
            lease,
            progress: Mutex::default(),
        });
        let own = Arc::clone(&shared);
        let named = std::thread::Builder::new().name("flexor-drive".to_owned());
        let thread = Some(named.spawn(move || own.serve(drive, &calls))?);
        Ok(Self {
            jobs,
            shared,
            thread,
        })
    }

    /// Carries out `call` on the drive's thread, renews the lease, and returns the result.
    ///
    /// # Errors
    /// The errors of `call`; the error that ended the trial since the last call; or the drive is
    /// gone.
    pub fn call<T: Send + 'static>(
        &self,
        call: impl FnOnce(&mut Drive) -> Result<T, DriveError> + Send + 'static,
    ) -> Result<T, DriveError> {
        self.take_end()?;
        self.shared.renew();
        // If the trial ended meanwhile, the reason says more than what the call then met.
        let called = self.inspect(call)?;
        called.map_err(|error| self.take_end().err().unwrap_or(error))
    }

    /// Carries out `look` on the drive's thread without renewing the lease, and returns the result.
    ///
    /// # Errors
    /// The drive is gone.
    pub fn inspect<T: Send + 'static>(
        &self,
        look: impl FnOnce(&mut Drive) -> T + Send + 'static,
    ) -> Result<T, DriveError> {
        let (answer, answered) = sync_channel(1);
        let job: Job = Box::new(move |drive| {
            let _ = answer.send(look(drive)); // nobody waits if the caller is gone
        });
        self.jobs.send(job).map_err(|_| DriveError::Closed)?;
        answered.recv().map_err(|_| DriveError::Closed)
    }

    /// Sends setpoints as [`Drive::send`] does, unless they had to wait too long: an old setpoint is
    /// not played late.
    ///
    /// # Errors
    /// The errors of [`Drive::send`] and [`Self::call_promptly`].
    pub fn send(&self, requests: Vec<Request>) -> Result<(), DriveError> {
        self.call_promptly(move |drive| drive.send(requests))
    }

    /// Carries out `call` as [`Self::call`] does, unless it had to wait longer than the wearer's
    /// host timeout.
    ///
    /// # Errors
    /// The errors of [`Self::call`]; E774.
    pub fn call_promptly<T: Send + 'static>(
        &self,
        call: impl FnOnce(&mut Drive) -> Result<T, DriveError> + Send + 'static,
    ) -> Result<T, DriveError> {
        let (clock, asked) = (self.shared.clock, self.shared.clock.now());
        self.call(move |drive| {
            let waited = clock.now().saturating_sub(asked);
            let session = drive.session();
            let timeout_ms = session.map_or(u16::MAX, |session| session.wearer.host_timeout_ms);
            let timeout_ms = u64::from(timeout_ms);
            if waited > Duration::from_millis(timeout_ms) {
                let late_ms = u64::try_from(waited.as_millis()).unwrap_or(u64::MAX);
                return Err(DriveError::Late {
                    late_ms,
                    timeout_ms,
                });
            }
            call(drive)
        })
    }

    /// Renews the lease and returns the time since the start of the trains, µs, as the thread last
    /// saw it.
    ///
    /// # Errors
    /// The error that ended the trial since the last call; or the drive is gone.
    pub fn renew(&self) -> Result<u64, DriveError> {
        self.take_end()?;
        if self.thread.as_ref().is_none_or(JoinHandle::is_finished) {
            return Err(DriveError::Closed);
        }
        self.shared.renew();
        Ok(self.shared.progress().time_us)
    }

    /// Returns whether the device stimulates, as the thread last saw it.
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.shared.progress().is_running
    }

    /// Removes and returns the error that ended the trial since the last call, if there is one.
    ///
    /// # Errors
    /// That error.
    pub fn take_end(&self) -> Result<(), DriveError> {
        self.shared.progress().ended.take().map_or(Ok(()), Err)
    }

    /// Forgets the thread without a message to the device, for a process that was forked from the
    /// owner and in which the thread does not exist.
    pub fn abandon(mut self) {
        drop(self.thread.take());
    }
}

impl Drop for LeasedDrive {
    /// Stops and closes the device, and waits for the end of the thread.
    fn drop(&mut self) {
        let Some(thread) = self.thread.take() else {
            return;
        };
        // The thread ends when nobody can call it any more.
        self.jobs = channel().0;
        let _ = thread.join(); // a panic there was reported there
    }
}

impl Shared {
    /// Serves calls and keeps the device going until nobody can call any more.
    fn serve(&self, mut drive: Drive, calls: &Receiver<Job>) {
        loop {
            let job = match drive.state() {
                DriveState::Running => match calls.try_recv() {
                    Ok(job) => Some(job),
                    Err(TryRecvError::Empty) => None,
                    Err(TryRecvError::Disconnected) => break,
                },
                _ => match calls.recv_timeout(IDLE) {
                    Ok(job) => Some(job),
                    Err(RecvTimeoutError::Timeout) => None,
                    Err(RecvTimeoutError::Disconnected) => break,
                },
            };
            match job {
                Some(job) => job(&mut drive),
                None => self.advance(&mut drive),
            }
            let (time_us, is_running) = (drive.time_us(), drive.state() == DriveState::Running);
            let mut progress = self.progress();
            (progress.time_us, progress.is_running) = (time_us, is_running);
        }
        let _ = drive.close(); // nobody is left to hear of an error
    }

    /// Lets a running device go on for a moment, or stops it if the lease has run out.
    fn advance(&self, drive: &mut Drive) {
        if drive.state() != DriveState::Running {
            return;
        }
        let unattended = self.clock.now().saturating_sub(self.progress().renewed);
        let ended = match unattended > self.lease {
            true => Some(drive.stop_expired(self.lease.as_secs_f64())),
            false => drive.wait(SLICE_US).err(),
        };
        if ended.is_some() {
            self.progress().ended = ended;
        }
    }
}
