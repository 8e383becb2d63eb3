//! Errors of the link, with advice on each.

use super::Signal;
use firmware::link::{Code, Refusal, SCHEMA};
use firmware::safety::Fault;
use std::fmt;
use std::io;

/// Failure of a request or of the path to the device.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The device refused the request.
    #[error("{0}")]
    Refused(RefusalInWords),
    /// E501: the device did not answer in time.
    #[error(
        "E501 the device did not answer {request} within {waited_ms} ms; is the device powered and is this its port?"
    )]
    NoAnswer {
        /// Name of the request that was not answered.
        request: &'static str,
        /// Time for which the host waited for the answer, ms.
        waited_ms: u64,
    },
    /// E502: the path to the device broke.
    #[error(
        "E502 lost the device: {0}; the device disconnects its outputs by itself after the host timeout; reconnect and run again"
    )]
    Lost(io::Error),
    /// E503: the request with this name does not fit a frame.
    #[error("E503 the request {0} is too long for one frame; send fewer items")]
    TooLarge(&'static str),
    /// E580: a signal arrived while the host waited for the device.
    #[error("E580 {0} came while the program waited for the device; run the command again")]
    Interrupted(Signal),
    /// E508: the device uses another version of the protocol.
    #[error(
        "E508 the device has protocol schema {device:#018x}, this program has {SCHEMA:#018x}; {}",
        advice(Code::SchemaMismatch)
    )]
    OtherSchema {
        /// Schema hash of the device's protocol.
        device: u64,
    },
    /// E509: the computer did not run the program for a time, and the device's answers or messages
    /// were missing afterwards.
    #[error(
        "E509 this computer did not run this program for {stalled_ms} ms (suspended, asleep or too busy): {then}; run again"
    )]
    HostStalled {
        /// Time for which the program did not run, ms.
        stalled_ms: u64,
        /// What was missing or went wrong afterwards, in words.
        then: String,
    },
    /// E504: the port cannot be opened.
    #[error("E504 cannot open {port}: {reason}; {advice}")]
    Open {
        /// Path of the serial port, or address.
        port: String,
        /// Reason from the operating system.
        reason: String,
        /// What the user can do about it.
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
    /// Two numbers that explain the refusal. Their meaning depends on the code; usually they are
    /// the allowed minimum and maximum. `None` if the refusal has no numbers.
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
    /// Returns the code of the refusal; `None` if this version of the program does not know its
    /// number.
    #[must_use]
    pub fn code(&self) -> Option<Code> {
        Code::from_number(self.number)
    }

    /// Returns the latched fault because of which the request was refused; `None` for another
    /// reason.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        let allowed = self.allowed;
        let (number, _) = allowed.filter(|_| self.code() == Some(Code::FaultLatched))?;
        Fault::from_number(u16::try_from(number).ok()?)
    }
}

impl RefusalInWords {
    /// Returns whether the two numbers are the sum over all channels that would result, and the
    /// largest allowed sum.
    fn is_sum(&self) -> bool {
        matches!(self.code(), Some(Code::SumLimit | Code::SumRmsLimit))
    }

    /// Returns a space and the unit of the two numbers; an empty text for codes where the name of
    /// the field gives the unit.
    fn unit(&self) -> &'static str {
        match self.code() {
            Some(Code::CurrentLimit | Code::RmsLimit | Code::DensityLimit) => " µA",
            Some(Code::ChargeLimit) => " nC",
            Some(Code::TimeOver) => " s",
            Some(Code::DoseReached) => " mC",
            Some(Code::TooFarAhead | Code::TimeGoesBack) => " µs",
            // Thousandths of the stage's unit.
            Some(
                Code::AboveWearerLimit
                | Code::TooLargeStep
                | Code::ChargeAtWidth
                | Code::AboveStart
                | Code::ListTooSteep,
            ) => " µA or mV",
            _ => "",
        }
    }

    /// Returns whether the first number is the number of a joint.
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
            match (self.fault(), self.code()) {
                (Some(fault), _) => write!(f, " (fault {min}: {fault:?})")?,
                (None, Some(Code::ForceOutOfReach)) => {
                    write!(f, " (allowed: 0, and {min} to {max} mN)")?;
                }
                (None, Some(Code::WrenchOutOfReach)) => {
                    write!(f, " ({max} \u{2030} of it is possible)")?;
                }
                (None, Some(Code::OppositePhases)) => {
                    write!(f, " (with channel {})", min.saturating_add(1))?;
                }
                (None, Some(Code::LoadTooLow)) => write!(f, " (measured: {max} Ω)")?,
                (None, Some(Code::OtherStage)) => write!(f, " (the board has {max})")?,
                (None, Some(Code::ShareLimit)) => {
                    write!(f, " (share: {min}; bound: {max}; in millionths)")?;
                }
                (None, Some(Code::AboveStart)) => {
                    let unit = self.unit();
                    write!(f, " ({min} pulses would be lower; start: {max}{unit})")?;
                }
                _ if self.names_joint() => write!(f, " (joint {min})")?,
                _ if self.is_sum() => write!(f, " ({min} µA; allowed: {max} µA)")?,
                _ if min == max => write!(f, " (allowed: only {min}{})", self.unit())?,
                _ => write!(f, " (allowed: {min} to {max}{})", self.unit())?,
            }
        }
        if let Some(code) = self.code() {
            write!(f, "; {}", advice(code))?;
        }
        Ok(())
    }
}

/// Returns the reason for a refusal with this code, as a phrase.
#[must_use]
pub fn meaning(code: Code) -> &'static str {
    words(code).0
}

/// Returns what a user can do about a refusal with this code.
#[must_use]
pub fn advice(code: Code) -> &'static str {
    words(code).1
}

/// Returns the reason for a refusal with this code, and what a user can do about it.
#[rustfmt::skip]
const fn words(code: Code) -> (&'static str, &'static str) {
    match code {
        Code::BadCrc => ("a frame arrived with a wrong CRC", "check the cable and send the request again"),
        Code::MalformedFrame => ("the bytes between two delimiters are not a valid frame", "check the cable and send the request again"),
        Code::FrameTooLong => ("a frame is longer than any message of the protocol", "check the cable and send the request again"),
        Code::UnknownMessage => ("a frame does not contain a message of this protocol", "use flexor and firmware of the same version"),
        Code::SchemaMismatch => ("host and device use different versions of the protocol", "use flexor and firmware of the same version"),
        Code::NoSession => ("no session is open", "send Hello first"),
        Code::SessionTaken => ("another host has the session open", "close the other program, or wait for its host timeout"),
        Code::DeviceBusy => ("the device cannot accept more requests at the moment", "send setpoints at most once per millisecond"),
        Code::SimulatorOnly => ("only a simulator accepts this request", "send it to flexor serve with a simulator"),
        Code::OutOfRange => ("the value is outside the allowed range", "choose a value within the range"),
        Code::BurstOverlaps => ("the pulses of a burst would overlap", "lengthen burst_interval_us or shorten the pulse"),
        Code::BurstTooLong => ("the burst must end at least 500 µs before the next one begins", "lower the frequency or shorten the burst"),
        Code::CurrentLimit => ("the channel's limit exceeds the wearer's current limit", "lower the channel's limit"),
        Code::ChargeLimit => ("the channel's limit exceeds the wearer's charge limit per phase", "lower the channel's limit or its pulse width"),
        Code::RmsLimit => ("the channel's limit exceeds the wearer's rms current limit", "lower the channel's limit, its pulse width or its pulse rate"),
        Code::AboveWearerLimit => ("the amplitude is above the wearer's limit for this channel", "request a lower amplitude, or agree on a new limit with the wearer"),
        Code::NoTrain => ("this channel has no train in the setup", "configure the channel before arming"),
        Code::TwoGroups => ("the channel is in two groups", "name each channel once"),
        Code::IsolationOverlaps => ("pulses in an isolated group would overlap, but only one of its channels can be connected at a time", "separate the pulses by phase offsets, or use a conducted group"),
        Code::NoTimeToGround => ("the isolated group leaves too little time to ground the output after a pulse", "lower the rate, shorten ground_us or move the phase offsets"),
        Code::ChannelTwice => ("the channel is named twice", "name each channel once"),
        Code::Controlled => ("a joint, a wall, an arm or force control drives this channel", "set the joint's angle, the hand's force or the channel's force instead"),
        Code::RateChanges => ("the pulse rate may change, and then pulses of the isolated group could overlap", "fix the rate (min_period_us = period_us, no max_period_us), or use a conducted group"),
        Code::NoMuscle => ("force control needs a muscle on this channel", "configure the channel's muscle before arming"),
        Code::AmplitudeCount => ("there must be one amplitude per channel in the mask", "send as many values as the mask has bits"),
        Code::NothingToArm => ("no channel is configured", "configure at least one channel"),
        Code::JointAndWall => ("a joint and a wall cannot run together, because the device measures one angle", "send Clear and configure one of them"),
        Code::WrongState => ("the request is not possible in the device's present state", "request Status, then stop, acknowledge or arm first"),
        Code::NotArmed => ("a setpoint arrived before the device was armed", "arm and start first"),
        Code::ArmInputOpen => ("neither the arm input nor the hand-held stop is closed", "close the arm switch or press the hand-held stop"),
        Code::ElectrodeOff => ("the electrode check measured too little current", "check electrode, gel and lead of this channel"),
        Code::ElectrodeShort => ("the electrode check measured too much current", "check whether this channel's electrodes touch each other"),
        Code::Cancelled => ("a stop cancelled arming", "arm again"),
        Code::FaultLatched => ("a fault is latched", "find the cause of the fault, then acknowledge it (flexor run --acknowledge)"),
        Code::Stopped => ("a stop arrived before the request was carried out", "arm and start again to continue"),
        Code::NoJoint => ("neither a joint nor a wall is configured", "configure a joint or a wall before arming"),
        Code::SetpointTime => ("the setpoint's time is too far off or out of order", "estimate the clock offset again, and send setpoints in order"),
        Code::MeasurementTime => ("the measurement's time is in the future or out of order", "estimate the clock offset again, and send measurements in order"),
        Code::SensorNotHost => ("the setup does not say that the host measures this angle", "set the joint's sensor to host, or the arm's posture to measured"),
        Code::NoForceControl => ("this channel is not under force control", "put the channel under force control before arming"),
        Code::ForceOutOfReach => ("the muscle cannot give this force within the wearer's limits", "request less force, or agree on a new limit or a higher pulse rate with the wearer"),
        Code::StagesUnknown => ("the board does not know its output stages", "store its stage table with flexor stages --store (docs/reference/hardware.md)"),
        Code::OtherStage => ("the board's output stage differs from the one in the setup", "configure the stage that the board has; flexor stages prints it"),
        Code::DensityLimit => ("the channel's limit exceeds the rms current that its electrode allows (2 mA/cm²)", "use a larger electrode and give its area, or lower the limit, the pulse width or the rate"),
        Code::SumLimit => ("with all channels at their limits, the peak current through the common return is too large", "lower the limits, or separate the pulses in time: one period for all channels, and phase offsets at least one pulse apart"),
        Code::SumRmsLimit => ("with all channels at their limits, the rms current through the common return is too large", "lower limits, pulse widths or rates, or use a larger return electrode and give its area"),
        Code::TimeOver => ("the wearer's stimulation time is used up; it counts until power is removed", "end the day's session; for another wearer, switch the device off and on"),
        Code::AllowanceLost => ("a reset erased the device's count of the wearer's stimulation time and charge", "end the day's session; for another wearer, switch the device off and on"),
        Code::DoseReached => ("the channel has delivered the wearer's largest total charge; it counts until power is removed", "end the day's session; for another wearer, switch the device off and on"),
        Code::TooLargeStep => ("the amplitude rises faster than the wearer's limits allow, from one burst to the next or within a second", "raise it in smaller steps; it may be lowered at once"),
        Code::ChargeAtWidth => ("at this pulse width the amplitude exceeds the charge limit per phase", "request a lower amplitude or a shorter pulse width"),
        Code::NoLists => ("this channel's train does not accept pulse lists", "set lists in its train before arming"),
        Code::ListPlays => ("a pulse list is still playing", "wait for its last pulse, or end it with a setpoint for its channel"),
        Code::NotRisen => ("the channel has not finished its rise from zero, and a pulse list cannot raise it", "set an amplitude of the channel and wait until its rise has ended"),
        Code::WidthChanges => ("the pulse width may change, but the recruitment of the channel's muscle is known at one width only", "remove the muscle or max_width_us"),
        Code::NoStageMemory => ("this device stores no table of its output stages", "store the table on a board; a simulator has the stages of its session"),
        Code::OtherSetup => ("the setup to be armed differs from the setup in the device", "send Clear and the whole setup again, then arm"),
        Code::LoadTooLow => ("with the load measured at arming, the channel's limit exceeds the wearer's limits", "lower the channel's limit or its full scale, or check electrodes and gel"),
        Code::PhaseLost => ("the electrode check measured current in only one phase of the pulses", "check this channel's output stage and the line of the missing phase"),
        Code::HandStopOpen => ("this wearer is stimulated only while the hand-held stop is held closed", "press the hand-held stop and hold it; the arm key alone is not enough"),
        Code::JointAndLimb => ("an arm cannot run beside a joint or a wall, because a measurement would apply to both", "send Clear and configure one of them"),
        Code::NoLimb => ("no arm is configured", "configure the arm and its lines before arming"),
        Code::WrenchOutOfReach => ("the arm's muscles cannot give this force within the wearer's limits", "request a smaller force, or change the posture of the arm"),
        Code::NoMuscleHelps => ("no muscle of the arm helps to produce this force", "request another direction, or configure a muscle that pulls in this direction"),
        Code::NoPosture => ("an angle of the arm has not been measured, or its measurement is too old", "send a measurement of each of the nine angles first"),
        Code::JointAndModulation => ("modulated joints cannot run beside a joint, a wall or an arm, because a measurement would apply to both", "send Clear and configure one of them"),
        Code::ShareLimit => ("the share of a muscle's intensity is below 0 or above 1 at some angle of the joint", "choose another quartic, or a narrower range of angles"),
        Code::NoPhaseJoint => ("the joint that gives the phase is not in the setup", "configure that joint too, or name another"),
        Code::OppositePhases => ("two channels can drive in opposite directions at the same time, but the board's stages share one supply or their supply is not stored", "move their pulses apart within one period, or give both the same direction; if each stage has its own supply, store that: flexor stages --store ... --supply separate"),
        Code::NoModulation => ("this joint is not modulated", "configure its modulation before arming"),
        Code::NoAngle => ("a modulated joint has no recent angle within its range, so no object can be held", "send a measurement of each joint first"),
        Code::HoldExpired => ("the object was held for longer than allowed", "send that it is released, then that it is held"),
        Code::TooFarAhead => ("the setpoint is due too long after the device's present time", "send it later, or check the host's estimate of the device's clock"),
        Code::TooManyWaiting => ("the queue of timed setpoints is full", "send the setpoint when the first one in the queue is due"),
        Code::TimeGoesBack => ("the setpoint is due less than 250 µs after the latest one in the queue", "send timed setpoints in order, and those for the same time in one request"),
        Code::NoBootLoader => ("the image on this device does not enter the chip's boot loader on request", "enter it with the board's buttons (flexor board show), or use a debug probe"),
        Code::InputsClosed => ("arm key or hand-held stop is closed", "open both, and send the request again"),
        Code::AboveStart => ("the amplitude is above the channel's start, so the first of the fixed number of pulses would be lower than requested", "request at most start, or agree on a larger start with the wearer"),
        Code::ListTooSteep => ("a pulse of the list is further above the previous one than the wearer's limits allow", "list smaller steps, or agree on a larger start with the wearer"),
        Code::CountedControlled => ("a controller drives this channel, so its train cannot have a fixed number of pulses", "remove repeats"),
        Code::NoFatigue => ("this muscle has no fatigue parameters", "configure the muscle with its fatigue parameters, or choose another model level"),
    }
}
