//! The state machine that decides whether anything is put out, and how much.
//!
//! Boot → Idle → Armed → Stimulating → Stopping → Idle; anything → Fault →
//! Idle only by acknowledgement. Time is what the caller says it is: `now` is
//! the start of the window about to be rendered.

use super::check::{Electrode, judge};
use super::ramp::{Fall, Rise};
use super::{Channel, ElectrodeCheck, Fault, FaultRecord, Reading, Setup, limits};
use super::{Denied, Inputs, Notice, State, StopCause};
use crate::pulse::{CHANNELS, Scheduler, Supply, WINDOW_US};
use crate::units::{Amplitude, DacCode, Micros};

/// Implausible readings in a row that make a fault.
const READINGS_TO_FAULT: u8 = 3;

#[derive(Clone, Copy, Debug)]
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
    },
    Fault(FaultRecord),
    Grounding {
        until: Micros,
    },
}

/// The guard. One per device, owned by the pulser.
#[derive(Debug)]
pub struct Guard {
    mode: Mode,
    setup: Option<Setup>,
    wanted: [Amplitude; CHANNELS],
    rises: [Rise; CHANNELS],
    in_force: [Amplitude; CHANNELS],
    implausible: [u8; CHANNELS],
    heard: Micros,
    held_by_stop: bool,
}

impl Guard {
    /// A guard at reset; `latched` is the fault that the reset found recorded.
    #[must_use]
    pub fn new(latched: Option<FaultRecord>) -> Self {
        Self {
            mode: latched.map_or(Mode::Boot, Mode::Fault),
            setup: None,
            wanted: [Amplitude::ZERO; CHANNELS],
            rises: [Rise::default(); CHANNELS],
            in_force: [Amplitude::ZERO; CHANNELS],
            implausible: [0; CHANNELS],
            heard: Micros(0),
            held_by_stop: false,
        }
    }

    /// The reported state.
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

    /// The armed or last armed setup.
    #[must_use]
    pub const fn setup(&self) -> Option<&Setup> {
        self.setup.as_ref()
    }

    /// Whether a fault waits to be acknowledged.
    #[must_use]
    pub const fn is_latched(&self) -> bool {
        matches!(self.mode, Mode::Fault(_))
    }

    /// Whether the output supply is wanted.
    #[must_use]
    pub const fn pump(&self) -> bool {
        !matches!(
            self.mode,
            Mode::Boot | Mode::Idle | Mode::Fault(_) | Mode::Grounding { .. }
        )
    }

    /// Takes `setup` and begins the electrode check, whose pulses start at
    /// `epoch`. The verdict comes as [`Notice::Checked`].
    ///
    /// # Errors
    /// Not idle, a latched fault, or no closed arm input.
    pub fn arm(
        &mut self,
        setup: Setup,
        inputs: &Inputs,
        epoch: Micros,
    ) -> Result<ElectrodeCheck, Denied> {
        match self.mode {
            Mode::Idle => {}
            Mode::Fault(record) => return Err(Denied::FaultLatched(record.fault)),
            _ => return Err(Denied::WrongState(self.state())),
        }
        if !inputs.arm && !inputs.hand_stop {
            return Err(Denied::ArmInputOpen);
        }
        self.held_by_stop = inputs.hand_stop;
        let check = ElectrodeCheck::new(&setup);
        self.setup = Some(setup);
        self.quiet();
        self.mode = Mode::Checking {
            check,
            until: epoch.plus(ElectrodeCheck::length_us()),
        };
        Ok(check)
    }

    /// From armed to stimulating, because of an order that arrived at `heard`.
    ///
    /// # Errors
    /// Not armed.
    pub fn start(&mut self, heard: Micros) -> Result<(), Denied> {
        match self.mode {
            Mode::Armed { .. } => {
                self.mode = Mode::Stimulating;
                self.heard = heard;
                Ok(())
            }
            Mode::Fault(record) => Err(Denied::FaultLatched(record.fault)),
            _ => Err(Denied::WrongState(self.state())),
        }
    }

    /// A normal stop: always accepted, except that a fault stays latched.
    pub fn stop(&mut self, now: Micros) -> Option<Notice> {
        match self.mode {
            Mode::Stimulating => Some(self.fall(now, StopCause::Request)),
            Mode::Armed { .. } => Some(self.idle(StopCause::Request)),
            Mode::Checking { .. } => {
                self.idle(StopCause::Request);
                Some(Notice::Checked(Err(Denied::Cancelled)))
            }
            _ => None,
        }
    }

    /// Clears a latched fault after a last grounding that starts at `now`.
    ///
    /// # Errors
    /// No fault is latched.
    pub fn acknowledge(&mut self, now: Micros) -> Result<(), Denied> {
        let Mode::Fault(_) = self.mode else {
            return Err(Denied::WrongState(self.state()));
        };
        self.mode = Mode::Grounding {
            until: now.plus(limits::RECOVERY_GROUND_US),
        };
        Ok(())
    }

    /// A host's direct amplitude, refused beyond the wearer's limit.
    ///
    /// # Errors
    /// Not armed, no such channel, a controlled channel, above the limit.
    pub fn set_amplitude(&mut self, channel: u8, amplitude: Amplitude) -> Result<(), Denied> {
        self.check_amplitude(channel, amplitude)?;
        if let Some(wanted) = self.wanted.get_mut(usize::from(channel)) {
            *wanted = amplitude;
        }
        Ok(())
    }

    /// Whether [`Guard::set_amplitude`] would accept this.
    ///
    /// # Errors
    /// As there.
    pub fn check_amplitude(&self, channel: u8, amplitude: Amplitude) -> Result<(), Denied> {
        match self.mode {
            Mode::Armed { .. } | Mode::Stimulating => {}
            Mode::Fault(record) => return Err(Denied::FaultLatched(record.fault)),
            _ => return Err(Denied::NotArmed),
        }
        let setup = self.setup.as_ref().ok_or(Denied::NotArmed)?;
        let config = setup.channels.get(usize::from(channel)).copied().flatten();
        let limit = config.ok_or(Denied::NoChannel { channel })?.limit;
        if setup.controlled & 1u16.checked_shl(channel.into()).unwrap_or(0) != 0 {
            return Err(Denied::Controlled { channel });
        }
        if amplitude > limit {
            return Err(Denied::AboveLimit { channel, limit });
        }
        Ok(())
    }

    /// An amplitude that the control law computed. A joint's points stay
    /// within the limits of their channels, so the clamp here only matters if
    /// that promise were broken; the law reports its own as *limiting*.
    pub fn order(&mut self, channel: u8, amplitude: Amplitude) {
        let index = usize::from(channel);
        let config = self
            .setup
            .as_ref()
            .and_then(|s| s.channels.get(index).copied().flatten());
        if let Mode::Armed { .. } | Mode::Stimulating = self.mode
            && let (Some(config), Some(wanted)) = (config, self.wanted.get_mut(index))
        {
            *wanted = amplitude.min(config.limit);
        }
    }

    /// The period nearest to `period_us` that the limits of `channel` were
    /// checked for; `None` if nothing may be ordered now.
    #[must_use]
    pub fn order_period(&self, channel: u8, period_us: u32) -> Option<u32> {
        let (Mode::Armed { .. } | Mode::Stimulating) = self.mode else {
            return None;
        };
        let channels = &self.setup.as_ref()?.channels;
        let config = channels.get(usize::from(channel)).copied().flatten()?;
        // Not `clamp`, which panics if its bounds were the wrong way round.
        Some(
            period_us
                .max(config.min_period_us)
                .min(config.max_period_us),
        )
    }

    /// Amplitude of the channel's latest burst.
    #[must_use]
    pub fn in_force(&self, channel: u8) -> Amplitude {
        self.in_force
            .get(usize::from(channel))
            .copied()
            .unwrap_or_default()
    }

    /// The session owner's valid setpoint or keep-alive arrived at `at`. The
    /// latest counts: what went through the control law comes here later.
    pub const fn heard(&mut self, at: Micros) {
        if self.heard.is_before(at) {
            self.heard = at;
        }
    }

    /// Latches `fault`; the caller isolates the outputs at `at`.
    pub fn fault(&mut self, fault: Fault, at: Micros, residual: [i32; CHANNELS]) -> Notice {
        let record = FaultRecord {
            fault,
            at,
            residual,
        };
        self.mode = Mode::Fault(record);
        self.quiet();
        Notice::Faulted(record)
    }

    /// Moves the state on before the window at `now` is rendered. `Err` is a fault for the caller to
    /// latch.
    ///
    /// # Errors
    /// [`Fault::OverCurrent`], [`Fault::ElectrodeOff`].
    pub fn tick(
        &mut self,
        now: Micros,
        inputs: &Inputs,
        scheduler: &Scheduler,
    ) -> Result<Option<Notice>, Fault> {
        if inputs.over_current && self.pump() {
            return Err(Fault::OverCurrent);
        }
        if let Some(reading) = inputs.reading {
            if let Some(notice) = self.check_reading(reading, now) {
                return Ok(Some(notice));
            }
            self.watch_reading(reading)?;
        }
        // Once closed, it is in somebody's hand.
        self.held_by_stop |= inputs.hand_stop;
        let released = self.held_by_stop && !inputs.hand_stop;
        Ok(match self.mode {
            Mode::Boot => {
                self.mode = Mode::Idle;
                None
            }
            Mode::Idle | Mode::Fault(_) => None,
            Mode::Checking { .. } if released => {
                self.idle(StopCause::HandStop);
                Some(Notice::Checked(Err(Denied::ArmInputOpen)))
            }
            Mode::Checking { check, until } if now.has_reached(until) => {
                Some(self.end_check(check, now))
            }
            Mode::Checking { .. } => None,
            Mode::Armed { .. } if released => Some(self.idle(StopCause::HandStop)),
            Mode::Armed { since } if now.elapsed_since(since) >= limits::ARM_EXPIRY_US => {
                Some(self.idle(StopCause::ArmExpired))
            }
            Mode::Armed { .. } => None,
            Mode::Stimulating => self.tick_stimulating(now, released, scheduler.is_finished()),
            Mode::Stopping { cause, .. } if released && cause != StopCause::HandStop => {
                Some(self.cut(now))
            }
            Mode::Stopping { fall, cause } => {
                (now.has_reached(fall.end()) && scheduler.is_resting()).then(|| self.idle(cause))
            }
            Mode::Grounding { until } => now.has_reached(until).then(|| {
                self.mode = Mode::Idle;
                Notice::Recovered
            }),
        })
    }

    fn tick_stimulating(&mut self, now: Micros, released: bool, finished: bool) -> Option<Notice> {
        let timeout_us = self
            .setup
            .as_ref()
            .map_or(0, |s| s.wearer.host_timeout_us());
        if released {
            return Some(self.cut(now));
        }
        if finished {
            return Some(self.idle(StopCause::Finished));
        }
        // Judged at the end of the window about to be rendered, so that the
        // fall begins on the very microsecond inside it.
        if now.plus(WINDOW_US).elapsed_since(self.heard) > timeout_us {
            let from = self.heard.plus(timeout_us);
            return Some(self.fall(from, StopCause::HostSilent));
        }
        None
    }

    fn quiet(&mut self) {
        self.wanted = [Amplitude::ZERO; CHANNELS];
        self.rises = [Rise::default(); CHANNELS];
        self.in_force = [Amplitude::ZERO; CHANNELS];
        self.implausible = [0; CHANNELS];
    }

    fn idle(&mut self, cause: StopCause) -> Notice {
        self.mode = Mode::Idle;
        self.quiet();
        Notice::Idle(cause)
    }

    fn fall(&mut self, from: Micros, cause: StopCause) -> Notice {
        let length = self.setup.as_ref().map_or(0, |s| s.wearer.fall_us());
        self.mode = Mode::Stopping {
            fall: Fall::new(from, length),
            cause,
        };
        Notice::Stopping(cause)
    }

    /// The hand-held stop opened: no further pulse begins.
    fn cut(&mut self, now: Micros) -> Notice {
        self.mode = Mode::Stopping {
            fall: Fall::new(now, 0),
            cause: StopCause::HandStop,
        };
        Notice::Stopping(StopCause::HandStop)
    }

    fn end_check(&mut self, check: ElectrodeCheck, now: Micros) -> Notice {
        if let Some(channel) = check.missing() {
            self.idle(StopCause::Request);
            return Notice::Checked(Err(Denied::ElectrodeOff { channel }));
        }
        self.mode = Mode::Armed { since: now };
        Notice::Checked(Ok(()))
    }

    /// A reading during the check: ticks the channel off, or ends the check.
    /// What was read before the check's first window has played is of an
    /// earlier stimulation.
    fn check_reading(&mut self, reading: Reading, now: Micros) -> Option<Notice> {
        let Mode::Checking { check, until } = &mut self.mode else {
            return None;
        };
        if until.elapsed_since(now) > ElectrodeCheck::length_us() - 2 * WINDOW_US {
            return None; // the length is far above two windows
        }
        let channel = reading.channel;
        let config = self
            .setup
            .as_ref()
            .and_then(|s| s.channels.get(usize::from(channel)).copied().flatten())?;
        match judge(reading, &config.stage, check_amplitude(&config)) {
            Electrode::Fine => {
                check.passed(channel);
                None
            }
            Electrode::Off => None,
            Electrode::Short => {
                self.idle(StopCause::Request);
                Some(Notice::Checked(Err(Denied::ElectrodeShort { channel })))
            }
        }
    }

    /// A reading while stimulating: too much once, or too little three times.
    fn watch_reading(&mut self, reading: Reading) -> Result<(), Fault> {
        if !matches!(self.mode, Mode::Stimulating | Mode::Stopping { .. }) {
            return Ok(());
        }
        let index = usize::from(reading.channel);
        let config = self
            .setup
            .as_ref()
            .and_then(|s| s.channels.get(index).copied().flatten());
        let (Some(config), Some(&amplitude), Some(count)) = (
            config,
            self.in_force.get(index),
            self.implausible.get_mut(index),
        ) else {
            return Ok(());
        };
        match judge(reading, &config.stage, amplitude) {
            Electrode::Short => return Err(Fault::OverCurrent),
            Electrode::Off => *count = count.saturating_add(1),
            Electrode::Fine => *count = 0,
        }
        if *count >= READINGS_TO_FAULT {
            Err(Fault::ElectrodeOff)
        } else {
            Ok(())
        }
    }
}

/// Sub-threshold, and never above the wearer's limit.
fn check_amplitude(config: &Channel) -> Amplitude {
    config.stage.check_amplitude().min(config.limit)
}

impl Supply for Guard {
    fn burst(&mut self, channel: u8, at: Micros) -> Option<DacCode> {
        let index = usize::from(channel);
        let setup = self.setup.as_ref()?;
        let config = setup.channels.get(index).copied().flatten()?;
        let wanted = self.wanted.get(index).copied()?;
        let rise_us = setup.wearer.rise_us();
        let rise = self.rises.get_mut(index)?;
        let amplitude = match self.mode {
            Mode::Checking { .. } => check_amplitude(&config),
            // A ramp passes through code 0 without a gap in the schedule; a
            // channel that nobody asked for anything stays out of it.
            _ if wanted == Amplitude::ZERO => {
                *rise = Rise::default();
                return None;
            }
            // Too little for the DAC is nothing to rise from.
            Mode::Stimulating if config.stage.code(wanted) == DacCode(0) => {
                *rise = Rise::default();
                wanted
            }
            Mode::Stimulating => rise.apply(wanted, at, rise_us),
            Mode::Stopping { fall, .. } => fall.apply(rise.apply(wanted, at, rise_us), at),
            _ => return None,
        };
        *self.in_force.get_mut(index)? = amplitude;
        Some(config.stage.code(amplitude))
    }

    fn may_pulse(&mut self, _: u8, end: Micros) -> bool {
        match self.mode {
            Mode::Checking { .. } | Mode::Stimulating => true,
            Mode::Stopping { fall, .. } => fall.end().has_reached(end),
            _ => false,
        }
    }
}
