//! A session on the chip simulator, with every cycle of it accounted for.

use super::chip::power_on;
use super::open_error::{ChipError, OpenError};
use super::simulated::simulated;
use super::{Observer, RunError, Seen, SessionFile, run};
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

/// What a session cost, from its first telemetry to the end of its last pulse
/// train.
#[derive(Debug)]
pub struct Profiled {
    /// All the numbers.
    pub summary: Summary,
    /// Cycles and instructions by function.
    pub profile: Profile,
    /// How the board came up.
    pub booted: Booted,
    /// How long the counted part took on this computer, with the counting, by the clock that
    /// [`profile`] was given.
    pub spent: Duration,
}

/// How the board came up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Booted {
    /// Core cycles from power-on until device time began, slow clock included.
    pub clock: Cycle,
    /// Device time at which the host had opened the port, µs.
    pub port_us: u64,
    /// Instructions until then.
    pub instructions: u64,
}

/// Why there is no profile.
#[derive(Debug, thiserror::Error)]
pub enum ProfileError {
    /// There is no board.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The session ended early.
    #[error(transparent)]
    Run(#[from] RunError),
    /// It was over before it was telling.
    #[error("E544 the session is too short to be profiled: no telemetry came (10 ms)")]
    TooShort,
}

impl From<ChipError> for ProfileError {
    fn from(error: ChipError) -> Self {
        Self::Open(error.into())
    }
}

impl Profiled {
    /// Part of the time spent for `owner`, %.
    #[must_use]
    pub fn owner_percent(&self, owner: Owner) -> f64 {
        self.percent(self.profile.owner(owner).cycles)
    }

    /// `cycles` of the counted ones, %.
    #[must_use]
    pub fn percent(&self, cycles: Cycle) -> f64 {
        100.0 * cycles as f64 / self.summary.total.max(1) as f64
    }

    /// Simulated seconds that were counted, by the board's clock.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.summary.total as f64 / f64::from(CORE_HZ)
    }

    /// Simulated time over processor time.
    #[must_use]
    pub fn times_real_time(&self) -> f64 {
        self.seconds() / self.spent.as_secs_f64()
    }

    /// Instructions simulated per second of processor time, in millions: what
    /// happens while the core sleeps is part of that time.
    #[must_use]
    pub fn mips(&self) -> f64 {
        self.summary.instructions as f64 / self.spent.as_secs_f64() * 1e-6
    }
}

/// Counts from the first telemetry of the trains to their end.
struct Watch<'a, O> {
    board: &'a Mutex<Board<Profile>>,
    clock: &'a dyn Clock,
    began: Option<Duration>,
    /// What was counted, once the trains ended.
    ended: &'a mut Option<(Summary, Profile, Duration)>,
    observer: O,
}

impl<O: Observer> Observer for Watch<'_, O> {
    fn see(&mut self, seen: Seen<'_>) {
        // A step that panicked ends the run; its counts are not asked for.
        let board = || self.board.lock().unwrap_or_else(PoisonError::into_inner);
        match seen {
            Seen::Sample(_) if self.began.is_none() => {
                let mut board = board();
                board.observer.restart();
                board.around.restart_counts();
                board.cpu.system.latencies = Latencies::default();
                self.began = Some(self.clock.now());
            }
            Seen::Progress(part) => {
                if let Some(began) = self.began.filter(|_| part >= 1.0) {
                    let spent = self.clock.now().saturating_sub(began);
                    let mut board = board();
                    let summary = Summary::of(&mut board);
                    *self.ended = Some((summary, board.observer.clone(), spent));
                }
                self.observer.see(seen);
            }
            _ => {}
        }
    }

    fn interruption(&self) -> Option<Interruption> {
        self.observer.interruption()
    }
}

/// Runs `file` on a board that runs `image` from a flash read as `prefetched`
/// says; `seed` decides the simulated wearer's noise, `clock` measures how long that takes,
/// `observer` hears the part done and may end it by a signal.
///
/// # Errors
/// [`ProfileError`].
pub fn profile(
    file: &SessionFile,
    image: &Image,
    prefetched: Prefetched,
    seed: u64,
    clock: &dyn Clock,
    observer: impl Observer,
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
    let port = simulated(&file.session, seed, Box::new(board.clone()), boot)?;
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
