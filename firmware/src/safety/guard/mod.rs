//! The state machine that decides whether pulses are output, and at which amplitude.
//!
//! | state | `arm` | `start` | `stop` | `acknowledge` | `fault` | let go | time is up |
//! |---|---|---|---|---|---|---|---|
//! | Boot | refused | refused | – | refused | Fault | Idle | Idle |
//! | Idle | Checking | refused | – | refused | Fault | – | – |
//! | Checking | refused | refused | Idle | refused | Fault | Idle | Armed |
//! | Armed | refused | Stimulating | Idle | refused | Fault | Idle | Idle |
//! | Stimulating | refused | refused | Stopping | refused | Fault | Stopping | Stopping |
//! | Stopping | refused | refused | – | refused | Fault | Stopping | Idle |
//! | Fault | refused | refused | – | Grounding | Fault | – | – |
//! | Grounding | refused | refused | – | refused | Fault | – | Idle |
//!
//! "–" means no change. *Let go* means that the hand-held stop opens after it was closed, or the
//! arm key that was closed at arming opens. `arm` needs one of them closed, and the hand-held stop
//! if the wearer's limits require it. *Time is up* when the electrode check ends (Idle if a channel
//! owes its reading), 10 s after arming, after the host's silence, and at the end of the fall and
//! of the last grounding. In addition, Stimulating ends in Idle once all trains have played, and a
//! reading may end Checking in Idle or be a fault. Hosts see Checking as Idle and Grounding as
//! Fault. Tests compare this chart and docs/reference/states.md with the code.
//!
//! Time is an argument: `now` is the start of the window that is about to be rendered.

mod allowance;
mod amplitude;
mod electrodes;
mod list;
mod memory;
mod step;
mod stopping;
#[cfg(test)]
mod tests;
mod timed;

use super::check::Load;
use super::list::Playing;
use super::ramp::{Fall, Rise};
use super::timed::TimedOrders;
use super::watch::Watch;
use super::{Denial, Inputs, Notice, State, StopCause};
use super::{ElectrodeCheck, Fault, FaultRecord, Setup, Stimulus, UsageAtBoot, limits};
use crate::pulse::{CHANNELS, Scheduler, WINDOW_US};
use crate::seal::Checksum;
use crate::units::{Micros, us};
use allowance::Allowance;
use memory::GuardChecksums;
use step::Step;
use stopping::{is_immediate, release_cause};

#[derive(Clone, Copy, Debug, Hash)]
enum Mode {
    Boot,
    Idle,
    Checking {
        check: ElectrodeCheck,
        until: Micros,
    },
    Armed {
        since: Micros,
    },
    Stimulating,
    Stopping {
        fall: Fall,
        cause: StopCause,
        /// Whether a [`Notice`] has reported the stop.
        is_told: bool,
    },
    Fault(FaultRecord),
    Grounding {
        until: Micros,
    },
}

/// The safety state machine. Each device has one, owned by the pulser.
#[derive(Clone, Debug)]
pub struct Guard {
    mode: Mode,
    setup: Option<Setup>,
    wanted: [Stimulus; CHANNELS],
    rises: [Rise; CHANNELS],
    in_force: [Stimulus; CHANNELS],
    steps: [Step; CHANNELS],
    /// Loads that the electrode check measured at arming.
    loads: [Load; CHANNELS],
    watches: [Watch; CHANNELS],
    heard: Micros,
    /// Inputs that a person holds closed, as bits of [`Inputs::closed`]. Opening one of them stops
    /// stimulation.
    held: u8,
    allowance: Allowance,
    /// Start of the latest electrode check; `None` before the first.
    checked: Option<Micros>,
    /// The list of pulses in progress.
    list: Playing,
    /// Checksum over `list`.
    list_seal: Checksum,
    /// Amplitudes of timed setpoints that are not due yet.
    waiting: TimedOrders,
    seals: GuardChecksums,
    /// Channels whose latest burst had less than the wanted amplitude, bit i for channel i. They
    /// are only reported, and so have no checksum.
    delayed: u16,
}

impl Guard {
    /// Returns a guard in its state after a reset. `latched` is the fault that was recorded before
    /// the reset, `found` the time and charge spent before it.
    #[must_use]
    pub fn new(latched: Option<FaultRecord>, found: UsageAtBoot) -> Self {
        let mut guard = Self {
            mode: latched.map_or(Mode::Boot, Mode::Fault),
            setup: None,
            wanted: [Stimulus::default(); CHANNELS],
            rises: [Rise::default(); CHANNELS],
            in_force: [Stimulus::default(); CHANNELS],
            steps: [Step::default(); CHANNELS],
            loads: [Load::default(); CHANNELS],
            watches: [Watch::default(); CHANNELS],
            heard: Micros::new(0),
            held: 0,
            allowance: Allowance::new(found),
            checked: None,
            list: Playing::NOTHING,
            list_seal: Checksum::of(&Playing::NOTHING),
            waiting: TimedOrders::NONE,
            seals: GuardChecksums::default(),
            delayed: 0,
        };
        guard.renew_all_checksums();
        guard.renew_checksums();
        guard
    }

    /// Returns the state that is reported to hosts.
    #[must_use]
    pub const fn state(&self) -> State {
        match self.mode {
            Mode::Boot => State::Boot,
            Mode::Idle | Mode::Checking { .. } => State::Idle,
            Mode::Armed { .. } => State::Armed,
            Mode::Stimulating => State::Stimulating,
            Mode::Stopping { .. } => State::Stopping,
            Mode::Fault(_) | Mode::Grounding { .. } => State::Fault,
        }
    }

    /// Returns the setup that is armed or was armed last; `None` before the first arming.
    #[must_use]
    pub const fn setup(&self) -> Option<&Setup> {
        self.setup.as_ref()
    }

    /// Returns whether a fault waits to be acknowledged.
    #[must_use]
    pub const fn is_latched(&self) -> bool {
        matches!(self.mode, Mode::Fault(_))
    }

    /// Returns whether the output supply must be on.
    #[must_use]
    pub const fn is_pump_on(&self) -> bool {
        !matches!(
            self.mode,
            Mode::Boot | Mode::Idle | Mode::Fault(_) | Mode::Grounding { .. }
        )
    }

    /// Takes `setup` and begins the electrode check. The check pulses start at `now`, or when the
    /// pause since the previous check is over; the returned time is their start. The result of the
    /// check is reported as [`Notice::Checked`].
    ///
    /// # Errors
    /// Refuses if the state is not Idle, a fault is latched, the input that must be closed is
    /// open, the wearer's allowance of time or charge is used up, or the amount spent before a
    /// reset is unknown.
    pub fn arm(
        &mut self,
        setup: &Setup,
        inputs: &Inputs,
        now: Micros,
    ) -> Result<(ElectrodeCheck, Micros), Denial> {
        match self.mode {
            Mode::Idle => {}
            Mode::Fault(record) => return Err(Denial::FaultLatched(record.fault)),
            _ => return Err(Denial::WrongState(self.state())),
        }
        if setup.wearer.spec().hand_stop_required && !inputs.hand_stop {
            return Err(Denial::HandStopOpen);
        }
        if inputs.closed() == 0 {
            return Err(Denial::ArmInputOpen);
        }
        self.allowance.check(setup)?;
        self.held = inputs.closed();
        let check = ElectrodeCheck::new(setup);
        let epoch = self.check_start(now);
        self.checked = Some(epoch);
        self.setup = Some(setup.clone());
        self.clear_amplitudes();
        self.loads = [Load::default(); CHANNELS];
        self.renew_all_checksums();
        self.open_core();
        self.mode = Mode::Checking {
            check,
            until: epoch + us(ElectrodeCheck::length_us()),
        };
        Ok((check, epoch))
    }

    /// Goes from Armed to Stimulating, after a start request that arrived at `heard`.
    ///
    /// # Errors
    /// Refuses if the state is not Armed.
    pub fn start(&mut self, heard: Micros) -> Result<(), Denial> {
        let is_whole = self.is_armed_setup_intact();
        match self.mode {
            Mode::Armed { .. } if is_whole => {
                self.open_core();
                self.mode = Mode::Stimulating;
                self.heard = heard;
                self.begin_time(heard);
                Ok(())
            }
            Mode::Fault(record) => Err(Denial::FaultLatched(record.fault)),
            _ => Err(Denial::WrongState(self.state())),
        }
    }

    /// Stops stimulation, arming or the electrode check. A stop is always accepted; a latched
    /// fault stays latched.
    pub fn stop(&mut self, now: Micros) -> Option<Notice> {
        match self.mode {
            Mode::Stimulating => Some(self.ramp_down(now, StopCause::Request)),
            Mode::Armed { .. } => Some(self.enter_idle(StopCause::Request)),
            Mode::Checking { .. } => {
                self.enter_idle(StopCause::Request);
                Some(Notice::Checked(Err(Denial::Cancelled)))
            }
            _ => None,
        }
    }

    /// Clears a latched fault after a last grounding that starts at `now`.
    ///
    /// # Errors
    /// Refuses if no fault is latched, or if the fault was found at boot: only a boot that does
    /// not find it clears it.
    pub fn acknowledge(&mut self, now: Micros) -> Result<(), Denial> {
        match self.mode {
            Mode::Fault(record) if record.found_at_boot => {
                return Err(Denial::FaultLatched(record.fault));
            }
            Mode::Fault(_) => {}
            _ => return Err(Denial::WrongState(self.state())),
        }
        self.open_core();
        self.mode = Mode::Grounding {
            until: now + us(limits::RECOVERY_GROUND_US),
        };
        Ok(())
    }

    /// Notes that a valid setpoint or keep-alive of the session's owner arrived at `at`. The
    /// latest time counts, because setpoints that pass through the control law are noted later
    /// than they arrived.
    pub fn keep_alive(&mut self, at: Micros) {
        if self.heard.is_before(at) {
            self.open_core();
            self.heard = at;
        }
    }

    /// Latches `found`; the caller disconnects the outputs at that time. `residual` is the charge
    /// left on each channel. If a fault is latched already, that one is kept and the new one is added to
    /// [`FaultRecord::later_faults`].
    pub fn fault(&mut self, found: &FaultRecord, residual: [i32; CHANNELS]) -> Notice {
        self.open_core();
        if let Mode::Fault(first) = &mut self.mode {
            if found.fault != first.fault {
                first.later_faults |= found.fault.bit();
            }
            return Notice::Faulted(*first);
        }
        self.count_time(found.at);
        self.close_allowance();
        let record = FaultRecord { residual, ..*found };
        self.mode = Mode::Fault(record);
        self.clear_amplitudes();
        Notice::Faulted(record)
    }

    /// Returns whether a rise or the slope limit kept the latest burst of `channel` below the
    /// wanted amplitude.
    #[must_use]
    pub const fn is_delayed(&self, channel: u8) -> bool {
        self.delayed & bit(channel) != 0
    }

    /// Updates the state before the window at `now` is rendered. An error is a fault that the
    /// caller must latch.
    ///
    /// # Errors
    /// [`Fault::OverCurrent`], [`Fault::ElectrodeOff`], [`Fault::PhaseLost`],
    /// [`Fault::LoadUnstable`].
    pub fn tick(
        &mut self,
        now: Micros,
        inputs: &Inputs,
        scheduler: &Scheduler,
    ) -> Result<Option<Notice>, Fault> {
        if inputs.over_current && self.is_pump_on() {
            return Err(Fault::OverCurrent);
        }
        let mut read = None;
        if let Some(reading) = inputs.reading {
            if let Mode::Checking { .. } = self.mode {
                read = self.check_reading(reading, now);
                if let Some(Notice::Checked(_)) = read {
                    return Ok(read);
                }
            } else {
                self.watch_reading(reading)?;
            }
        }
        // A hand-held stop that closes later counts as held from then on: its opening stops.
        let closed = inputs.closed();
        if closed & !self.held & Inputs::STOP != 0 {
            self.open_core();
            self.held |= Inputs::STOP;
        }
        let released = self.held & !closed;
        if let Mode::Stimulating | Mode::Stopping { .. } = self.mode
            && self.is_time_due(now)
        {
            self.count_time(now);
        }
        let change = match self.mode {
            Mode::Boot => {
                self.open_core();
                self.mode = Mode::Idle;
                None
            }
            Mode::Idle | Mode::Fault(_) => None,
            Mode::Checking { .. } if released != 0 => {
                self.enter_idle(release_cause(released));
                Some(Notice::Checked(Err(Denial::ArmInputOpen)))
            }
            Mode::Checking { check, until } if now.has_reached(until) => {
                Some(self.end_check(check, now))
            }
            Mode::Checking { .. } => None,
            Mode::Armed { .. } if released != 0 => Some(self.enter_idle(release_cause(released))),
            Mode::Armed { since } if now.elapsed_since(since) >= limits::ARM_EXPIRY_US => {
                Some(self.enter_idle(StopCause::ArmExpired))
            }
            Mode::Armed { .. } => None,
            Mode::Stimulating => self.tick_stimulating(now, released, scheduler.is_finished()),
            Mode::Stopping { cause, .. } if released != 0 && !is_immediate(cause) => {
                Some(self.stop_at_once(now, released))
            }
            Mode::Stopping {
                fall,
                cause,
                is_told: false,
            } => {
                self.begin_fall(fall, cause);
                Some(Notice::Stopping(cause))
            }
            Mode::Stopping { fall, cause, .. } => {
                (now.has_reached(fall.end()) && scheduler.is_resting()).then(|| {
                    self.count_time(now);
                    self.enter_idle(cause)
                })
            }
            Mode::Grounding { until } => now.has_reached(until).then(|| {
                self.open_core();
                self.mode = Mode::Idle;
                Notice::Recovered
            }),
        };
        Ok(change.or(read))
    }

    /// Returns whether [`Self::tick`] would change nothing and find no fault; `false` if this
    /// cannot be decided easily. For simulators, which may then omit the tick.
    #[must_use]
    #[inline]
    pub fn is_at_rest(&self, now: Micros, inputs: &Inputs, scheduler: &Scheduler) -> bool {
        let closed = inputs.closed();
        let is_let_go = self.held & !closed != 0;
        let is_taken_up = closed & !self.held & Inputs::STOP != 0;
        if inputs.over_current || inputs.reading.is_some() || is_let_go || is_taken_up {
            return false;
        }
        match self.mode {
            Mode::Idle | Mode::Fault(_) => true,
            Mode::Stimulating => {
                !scheduler.is_finished()
                    && self.host_silence_end(now).is_none()
                    && !self.is_time_due(now)
            }
            _ => false,
        }
    }

    fn tick_stimulating(&mut self, now: Micros, released: u8, finished: bool) -> Option<Notice> {
        if released != 0 {
            return Some(self.stop_at_once(now, released));
        }
        if finished {
            self.count_time(now);
            return Some(self.enter_idle(StopCause::Finished));
        }
        let from = self.host_silence_end(now)?;
        Some(self.ramp_down(from, StopCause::HostSilent))
    }

    /// Returns the time at which the host's silence became too long, or `None` if it is not too
    /// long at the end of the window at `now`. The end of the window counts, so that the fall can
    /// begin at the exact microsecond inside that window.
    fn host_silence_end(&self, now: Micros) -> Option<Micros> {
        let setup = self.setup.as_ref();
        let timeout_us = setup.map_or(0, |s| s.wearer.host_timeout_us());
        let is_silent = (now + us(WINDOW_US)).elapsed_since(self.heard) > timeout_us;
        is_silent.then(|| self.heard + us(timeout_us))
    }
}

/// Returns a mask with only the bit of `channel` set, for channels 0 to 15; 0 for any other.
const fn bit(channel: u8) -> u16 {
    match 1u16.checked_shl(channel as u32) {
        Some(bit) => bit,
        None => 0,
    }
}
