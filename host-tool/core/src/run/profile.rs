//! Profiles a session on the chip simulator, with every cycle accounted for.

use super::chip::power_on;
use super::open_error::{ChipError, OpenError};
use super::simulated::simulated_port;
use super::{Observation, Observer, RunError, SessionFile, run};
use crate::clock::Clock;
use crate::link::Interruption;
use firmware::lockstep::Sensors;
use firmware::units::Micros;
use hal_sim::chip::Cycle;
use hal_sim::chip::board::Board;
use hal_sim::chip::board::wiring::CORE_HZ;
use hal_sim::chip::cpu::system::Latencies;
use hal_sim::chip::image::Image;
use hal_sim::chip::profile::{Owner, Profile, Summary};
use hal_sim::chip::soc::flash::Prefetched;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Profile of a session from its first telemetry sample to the end of its trains.
#[derive(Debug)]
pub struct Profiled {
    /// Totals of the profiled part, such as cycles and instructions executed.
    pub summary: Summary,
    /// Cycles and instructions that each function took.
    pub profile: Profile,
    /// How long the board took to boot, before the profiled part.
    pub booted: Booted,
    /// Time for which this computer simulated the profiled part, by the clock that was passed to
    /// [`profile`]. It includes the profiling itself.
    pub spent: Duration,
}

/// Duration of a board's boot in cycles, time and instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Booted {
    /// Core clock cycles from power-on until device time began to count, including those at the
    /// slow clock after a reset.
    pub clock: Cycle,
    /// Device time at which the board had booted and the host opened its port, µs.
    pub port_us: u64,
    /// Instructions executed from power-on until the host opened the port.
    pub instructions: u64,
}

/// Reason why a session could not be profiled.
#[derive(Debug, thiserror::Error)]
pub enum ProfileError {
    /// The board could not be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The session ended before its end.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The session ended before its first telemetry sample, at which the profile would have started
    /// (E544).
    #[error(
        "E544 the session ended before the first telemetry row (after 10 ms), so there is nothing \
         to profile; set a longer `duration_s`"
    )]
    TooShort,
}

impl From<ChipError> for ProfileError {
    fn from(error: ChipError) -> Self {
        Self::Open(error.into())
    }
}

impl Profiled {
    /// Returns the percentage of all profiled cycles that `owner` took.
    #[must_use]
    pub fn owner_percent(&self, owner: Owner) -> f64 {
        self.percent(self.profile.owner(owner).cycles)
    }

    /// Converts a number of cycles into a percentage of all profiled cycles.
    #[must_use]
    pub fn percent(&self, cycles: Cycle) -> f64 {
        100.0 * cycles as f64 / self.summary.total.max(1) as f64
    }

    /// Returns the length of the profiled part in simulated time, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.summary.total as f64 / f64::from(CORE_HZ)
    }

    /// Returns how many seconds were simulated per second of this computer's time; above 1 the
    /// simulation is faster than real time.
    #[must_use]
    pub fn real_time_factor(&self) -> f64 {
        self.seconds() / self.spent.as_secs_f64()
    }

    /// Returns how many million instructions were simulated per second of this computer's time.
    /// That time includes simulation while the core was asleep and executed nothing.
    #[must_use]
    pub fn mips(&self) -> f64 {
        self.summary.instructions as f64 / self.spent.as_secs_f64() * 1e-6
    }
}

/// Observer that starts the profile at the first telemetry sample and ends it when the trains have
/// ended.
struct Watch<'a, O> {
    board: &'a Mutex<Board<Profile>>,
    clock: &'a dyn Clock,
    began: Option<Duration>,
    /// Where the result of the profile is stored when the trains have ended.
    ended: &'a mut Option<(Summary, Profile, Duration)>,
    observer: O,
}

impl<O: Observer> Observer for Watch<'_, O> {
    fn observe(&mut self, seen: Observation<'_>) {
        // A step that panicked ends the run, and its profile is never read.
        let board = || self.board.lock().unwrap_or_else(PoisonError::into_inner);
        match seen {
            Observation::Sample(_) if self.began.is_none() => {
                let mut board = board();
                board.observer.restart();
                board.around.restart_counts();
                board.cpu.system.latencies = Latencies::default();
                self.began = Some(self.clock.now());
            }
            Observation::Progress(part) => {
                if let Some(began) = self.began.filter(|_| part >= 1.0) {
                    let spent = self.clock.now().saturating_sub(began);
                    let mut board = board();
                    let summary = Summary::from_board(&mut board);
                    *self.ended = Some((summary, board.observer.clone(), spent));
                }
                self.observer.observe(seen);
            }
            _ => {}
        }
    }

    fn interruption(&self) -> Option<Interruption> {
        self.observer.interruption()
    }
}

/// Runs the session of `file` on a board that executes `image`, and returns its profile.
/// `prefetched` sets how instructions are read from the flash, and `seed` determines the noise of
/// the simulated wearer. `clock` measures how long the simulation takes. `observer` receives the
/// progress, and a signal that it reports ends the run.
///
/// # Errors
/// Returns a [`ProfileError`] if the board cannot be opened, the session ends early, or it is too
/// short.
pub fn profile(
    file: &SessionFile,
    image: &Image,
    prefetched: Prefetched,
    seed: u64,
    clock: &dyn Clock,
    observer: impl Observer + Send,
) -> Result<Profiled, ProfileError> {
    let mut board = power_on(&file.session, image, Profile::new(image))?;
    board.around.soc.flash.set_prefetched(prefetched);
    board.boot(&Sensors::default()).map_err(ChipError::Board)?;
    let booted = Booted {
        clock: board.around.origin(),
        port_us: board.now_us(),
        instructions: board.cpu.instructions,
    };
    let boot = Micros::new(board.now_us() as u32); // far from wrapping
    let board = Arc::new(Mutex::new(board));
    let port = simulated_port(&file.session, seed, Box::new(board.clone()), boot)?;
    let mut ended = None;
    let watch = Watch {
        board: &board,
        clock,
        began: None,
        ended: &mut ended,
        observer,
    };
    let (outcome, _) = run(file, port, None, watch);
    if let Some(error) = outcome.error {
        return Err(error.into());
    }
    let (summary, profile, spent) = ended.ok_or(ProfileError::TooShort)?;
    Ok(Profiled {
        summary,
        profile,
        booted,
        spent,
    })
}
