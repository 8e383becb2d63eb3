//! Errors of the link, with advice on each.

use super::Signal;
use firmware::link::{Code, Refusal, SCHEMA};
use firmware::safety::Fault;
use std::fmt;
use std::io;

/// Failure of a request or of the path to the device.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The device refused the request; the refusal has a number and a name.
    #[error("{0}")]
    Refused(RefusalInWords),
    /// E501: the device did not answer in time.
    #[error(
        "E501 no answer to {request} within {waited_ms} ms; is the device powered and is this its port?"
    )]
    NoAnswer {
        /// Name of the request.
        request: &'static str,
        /// Length of the wait, ms.
        waited_ms: u64,
    },
    /// E502: the path to the device broke.
    #[error(
        "E502 lost the device: {0}; outputs isolate by themselves after the host timeout; reconnect and run again"
    )]
    Lost(io::Error),
    /// E503: the named request does not fit a frame.
    #[error("E503 {0} does not fit a frame")]
    TooLarge(&'static str),
    /// E580: a signal arrived while the host waited.
    #[error("E580 {0} came: nothing is waited for any more")]
    Interrupted(Signal),
    /// E508: the device's messages are of another version.
    #[error(
        "E508 the device speaks schema {device:#018x}, this program {SCHEMA:#018x}; {}",
        advice(Code::SchemaMismatch)
    )]
    OtherSchema {
        /// Schema hash of the device.
        device: u64,
    },
    /// E509: the computer did not run the program for a time, and something was missing afterwards.
    #[error(
        "E509 this computer did not run this program for {stalled_ms} ms (suspended, asleep or too busy): {then}; run again"
    )]
    HostStalled {
        /// Length of that time, ms.
        stalled_ms: u64,
        /// Consequence, in words.
        then: String,
    },
    /// E504: the port cannot be opened.
    #[error("E504 cannot open {port}: {reason}; {advice}")]
    Open {
        /// Path of the serial port, or address.
        port: String,
        /// Reason that the system gives.
        reason: String,
        /// Advice to the user.
        advice: &'static str,
    },
}

impl From<io::Error> for Error {
    fn from(error: io::Error) -> Self {
        Self::Lost(error)
    }
}

/// Refusal of a request by the device; its text gives number, name, field, allowed range and
/// advice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RefusalInWords {
    /// Number of the refusal on the link.
    pub number: u16,
    /// Name of the field that was refused.
    pub field: String,
    /// Channel concerned, counted from 1; `None` if no channel is.
    pub channel: Option<u8>,
    /// Allowed minimum and maximum, or two other numbers, depending on the code; `None` if the
    /// refusal has none.
    pub allowed: Option<(i32, i32)>,
}

impl From<Refusal<'_>> for RefusalInWords {
    fn from(refusal: Refusal<'_>) -> Self {
        // Refusals with these codes always have a range, which may be 0 to 0.
        let ranged = [
            Code::OutOfRange,
            Code::AmplitudeCount,
            Code::WrenchOutOfReach,
            Code::NoPhaseJoint,
            Code::NoAngle,
        ];
        let only_zero = Code::from_number(refusal.code).is_some_and(|c| ranged.contains(&c));
        Self {
            number: refusal.code,
            field: refusal.field.to_owned(),
            channel: refusal.channel.map(|c| c.saturating_add(1)),
            allowed: (refusal.min != 0 || refusal.max != 0 || only_zero)
                .then_some((refusal.min, refusal.max)),
        }
    }
}

impl RefusalInWords {
    /// Returns the code, if this version knows the number.
    #[must_use]
    pub fn code(&self) -> Option<Code> {
        Code::from_number(self.number)
    }

    /// Returns the latched fault, if that is the reason for the refusal.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        let allowed = self.allowed;
        let (number, _) = allowed.filter(|_| self.code() == Some(Code::FaultLatched))?;
        Fault::from_number(u16::try_from(number).ok()?)
    }
}

impl RefusalInWords {
    /// Returns whether the two numbers are a sum that would result and the maximum allowed.
    fn is_sum(&self) -> bool {
        matches!(self.code(), Some(Code::SumLimit | Code::SumRmsLimit))
    }

    /// Returns whether the first number is the joint concerned.
    fn names_joint(&self) -> bool {
        matches!(self.code(), Some(Code::NoPhaseJoint | Code::NoAngle))
    }
}

impl fmt::Display for RefusalInWords {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "E{} ", self.number)?;
        if let Some(channel) = self.channel {
            write!(f, "channel {channel}, ")?;
        }
        write!(
            f,
            "{}: {}",
            self.field,
            self.code().map_or("refused", meaning)
        )?;
        if let Some((min, max)) = self.allowed {
            match self.fault() {
                Some(fault) => write!(f, " ({min}: {fault:?})")?,
                None if self.code() == Some(Code::ForceOutOfReach) => {
                    write!(f, " (allowed 0, and {min} to {max} mN)")?;
                }
                None if self.code() == Some(Code::WrenchOutOfReach) => {
                    write!(f, " ({max} \u{2030} of it can be made)")?;
                }
                None if self.code() == Some(Code::OppositePhases) => {
                    write!(f, " (with channel {})", min.saturating_add(1))?;
                }
                None if self.names_joint() => write!(f, " (joint {min})")?,
                None if self.is_sum() => write!(f, " ({min} µA, allowed {max})")?,
                None if min == max => write!(f, " (allowed only {min})")?,
                None => write!(f, " (allowed {min} to {max})")?,
            }
        }
        if let Some(code) = self.code() {
            write!(f, "; {}", advice(code))?;
        }
        Ok(())
    }
}

/// Returns the meaning of a refusal as a phrase.
#[must_use]
pub fn meaning(code: Code) -> &'static str {
    words(code).0
}

/// Returns advice on a refusal.
#[must_use]
pub fn advice(code: Code) -> &'static str {
    words(code).1
}

/// Returns the meaning of a refusal, and advice on it.
#[rustfmt::skip]
const fn words(code: Code) -> (&'static str, &'static str) {
    match code {
        Code::BadCrc => ("a frame arrived with a wrong CRC", "check the cable and send it again"),
        Code::MalformedFrame => ("bytes between delimiters are no frame", "check the cable and send it again"),
        Code::FrameTooLong => ("a frame is longer than any message", "check the cable and send it again"),
        Code::UnknownMessage => ("a frame holds no message of this protocol", "use the flexor and firmware of one version"),
        Code::SchemaMismatch => ("host and device speak different versions", "use the flexor and firmware of one version"),
        Code::NoSession => ("no session is open", "send Hello first"),
        Code::SessionTaken => ("another host holds the session", "close the other program, or wait for the host timeout"),
        Code::DeviceBusy => ("the device cannot take more requests now", "send setpoints at most once per millisecond"),
        Code::SimulatorOnly => ("only who serves a simulator takes this", "send it to flexor serve with a simulator"),
        Code::OutOfRange => ("outside the allowed range", "choose a value in the range"),
        Code::BurstOverlaps => ("pulses of a burst would overlap", "lengthen burst_interval_us or shorten the pulse"),
        Code::BurstTooLong => ("the burst does not end two windows before the next", "lower the frequency or shorten the burst"),
        Code::CurrentLimit => ("the limit exceeds the current limit in µA", "lower the channel's limit, its width or its rate"),
        Code::ChargeLimit => ("the limit exceeds the charge limit per phase in nC", "lower the channel's limit, its width or its rate"),
        Code::RmsLimit => ("the limit exceeds the rms current limit in µA", "lower the channel's limit, its width or its rate"),
        Code::AboveWearerLimit => ("above the wearer's limit for this channel", "ask for less, or agree on a new limit with the wearer"),
        Code::NoTrain => ("this channel has no train in the setup", "configure the channel before arming"),
        Code::TwoGroups => ("the channel is in two groups", "name each channel once"),
        Code::IsolationOverlaps => ("isolated pulses would overlap, which isolation makes impossible", "separate the pulses by their offsets, or use a conducted group"),
        Code::NoTimeToGround => ("isolation leaves too little time to ground after a pulse", "lower the rate, shorten ground_us or move the offsets"),
        Code::ChannelTwice => ("the channel is named twice", "name each channel once"),
        Code::Controlled => ("a joint, a wall, an arm or force control drives this channel", "set the joint's angle, the hand's force or the channel's force instead"),
        Code::RateChanges => ("its pulse rate may change, and in an isolated group that would make pulses meet", "fix its rate (min_period_us = period_us, no max_period_us), or use a conducted group"),
        Code::NoMuscle => ("force control needs the channel's muscle", "configure the channel's muscle before arming"),
        Code::AmplitudeCount => ("there must be one amplitude per channel in the mask", "send as many values as the mask has bits"),
        Code::NothingToArm => ("no channel is configured", "configure at least one channel"),
        Code::JointAndWall => ("a joint and a wall cannot run together: the device measures one angle", "send Clear and configure one of them"),
        Code::WrongState => ("not possible in the device's present state", "ask for Status and stop, acknowledge or arm first"),
        Code::NotArmed => ("a setpoint before arming", "arm and start first"),
        Code::ArmInputOpen => ("neither the arm input nor the hand-held stop is closed", "close the arm switch or press the hand-held stop"),
        Code::ElectrodeOff => ("the electrode check saw too little current", "check electrode, gel and lead of this channel"),
        Code::ElectrodeShort => ("the electrode check saw too much current", "check this channel's electrodes for contact with each other"),
        Code::Cancelled => ("arming was cancelled by a stop", "arm again"),
        Code::FaultLatched => ("a fault is latched", "find the fault's cause, then acknowledge it (flexor run --acknowledge)"),
        Code::Stopped => ("a stop came before this was carried out", "arm and start again if that is wanted"),
        Code::NoJoint => ("no joint and no wall is configured", "configure a joint before arming"),
        Code::SetpointTime => ("the setpoint's time is too far off or out of order", "refresh the clock offset and send in order"),
        Code::MeasurementTime => ("the measurement's time is ahead or out of order", "refresh the clock offset and send in order"),
        Code::SensorNotHost => ("the host does not measure this angle", "configure the joint's sensor as host, or the arm's posture as measured"),
        Code::NoForceControl => ("this channel is not under force control", "put the channel under force control before arming"),
        Code::ForceOutOfReach => ("the wearer's limits cannot give this force", "ask for less, or agree on a new limit or a higher pulse rate with the wearer"),
        Code::StagesUnknown => ("the board does not know its output stages", "store its stage table: flexor stages --store (docs/hardware.md)"),
        Code::OtherStage => ("the board's output stage is another than was declared", "declare the stage that the board has: flexor stages"),
        Code::DensityLimit => ("the limit exceeds the rms current in µA that this electrode takes at 2 mA/cm²", "use a larger electrode and say its area, or lower the limit, the width or the rate"),
        Code::SumLimit => ("all channels at their limits put more through the common return at once than is allowed", "lower limits, or move pulses apart: one period and offsets a pulse apart"),
        Code::SumRmsLimit => ("all channels at their limits put more rms current through the common return than is allowed", "lower limits, widths or rates, or use a larger return electrode and say its area"),
        Code::TimeOver => ("the wearer's time of stimulation is over until power comes up anew", "end the day's session; switch off and on for another wearer"),
        Code::AllowanceLost => ("the device lost count of the wearer's time and charge in a reset", "end the day's session; switch off and on for another wearer"),
        Code::DoseReached => ("the channel has put out the wearer's largest charge until power comes up anew", "end the day's session; switch off and on for another wearer"),
        Code::TooLargeStep => ("the amplitude rises faster than the wearer allows from burst to burst or in a second", "raise it in smaller steps; lower is always taken"),
        Code::ChargeAtWidth => ("at this width the amplitude exceeds the charge limit per phase", "ask for less, or for a shorter phase"),
        Code::NoLists => ("this channel's train takes no lists of pulses", "say lists in its train before arming"),
        Code::ListPlays => ("a list of pulses is under way", "wait for its last pulse; a setpoint of its channel ends it"),
        Code::NotRisen => ("the channel has not risen from zero, which no list of pulses does", "set an amplitude of the channel and wait for the wearer's rise"),
        Code::WidthChanges => ("its pulse width may change, and its muscle's recruitment holds at one", "leave the muscle out, or max_width_us"),
        Code::NoStageMemory => ("this device keeps no table of its output stages", "store it on a board; a simulator has the stages its session declares"),
        Code::OtherSetup => ("the setup that was armed is not the one the device holds", "send Clear and the whole setup again, then arm"),
        Code::LoadTooLow => ("through the load measured at arming, the channel's limit is more than the wearer's limits allow", "lower the channel's limit or its full scale, or check electrodes and gel"),
        Code::PhaseLost => ("the electrode check saw current in one phase of the pulses only", "check this channel's output stage and the line of the lost phase"),
        Code::HandStopOpen => ("this wearer is stimulated only while the hand-held stop is held closed", "press the hand-held stop and hold it: the arm key alone does not do"),
        Code::JointAndLimb => ("an arm cannot run beside a joint or a wall: a measurement would be of both", "send Clear and configure one of them"),
        Code::NoLimb => ("no arm is configured", "configure the arm and its lines before arming"),
        Code::WrenchOutOfReach => ("the arm's muscles cannot give this force within the wearer's limits", "ask for the share of it that can be made, or hold the arm otherwise"),
        Code::NoMuscleHelps => ("no muscle of the arm helps towards this force", "ask for another direction, or give the arm a line that pulls that way"),
        Code::NoPosture => ("an angle of the arm is not measured, or stale", "send a measurement of each of the nine angles first"),
        Code::JointAndModulation => ("joints that are modulated cannot run beside a joint, a wall or an arm: a measurement would be of both", "send Clear and configure one of them"),
        Code::ShareLimit => ("a share of a muscle's intensity is, in millionths, below 0 or above 1 at some angle of the joint", "choose another quartic, or a narrower range of angles"),
        Code::NoPhaseJoint => ("the joint that is to tell the phase is not in the setup", "configure it too, or name another"),
        Code::OppositePhases => ("two channels can drive in opposite directions at the same time, and the board's stages share one supply or do not say so", "move their pulses apart, in one period, or give both the same direction; on stages with a supply each: flexor stages --store ... --supply separate"),
        Code::NoModulation => ("no such joint is modulated", "configure it before arming"),
        Code::NoAngle => ("a modulated joint has no fresh angle within its range, so nothing can be held", "send a measurement of each joint first"),
        Code::HoldExpired => ("the object was held for longer than it may be", "say that it is released, then that it is held"),
        Code::TooFarAhead => ("the setpoint's time is more than 1 s ahead of the device's (to: µs ahead)", "send it later, or check the host's idea of the device's clock"),
        Code::TooManyWaiting => ("as many timed setpoints wait as may (to: how many)", "send it when the first of them is due"),
        Code::TimeGoesBack => ("the setpoint's time is less than 250 µs after the latest that waits (from: the soonest, µs ahead)", "send timed setpoints in order, those of one time in one request"),
        Code::AboveStart => ("the amplitude is above the channel's start, and a fixed number of pulses would begin below it (from: how many pulses; to: the largest that is played at once)", "ask for at most start, or agree on a larger one with the wearer"),
        Code::ListTooSteep => ("a pulse of the list is further above the one before than the wearer's rise allows", "list smaller steps, or agree on a larger start with the wearer"),
        Code::CountedControlled => ("this channel is controlled, and its train has a fixed number of pulses", "leave repeats out"),
        Code::NoFatigue => ("this muscle has no fatigue parameters", "configure the muscle with its fatigue, or choose another rung"),
    }
}
