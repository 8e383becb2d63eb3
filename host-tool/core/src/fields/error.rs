//! Errors of a session or wearer file, and their places in it.

use std::fmt;
use std::ops::Range;

/// Largest number of errors of a file that are reported one by one. Further errors are only
/// counted.
pub(crate) const MOST: usize = 200;

/// Place of an error in a file.
#[derive(Clone, Debug, Default)]
pub(crate) struct Place {
    /// Path of the field with the error, for example "channel.train.width_us".
    pub(crate) field: String,
    /// Text of the field's value in the file, or "left out".
    pub(crate) given: String,
    /// Range of bytes in the text of the file that the error message marks.
    pub(crate) span: Range<usize>,
}

/// Declares [`Problem`] from a list. Each entry has a number, a name, values, a message, and a
/// remedy, which is empty if the message contains it. In the messages, the first two names of the
/// list stand for the path of the field and for its text in the file.
macro_rules! problems {
    (at $path:ident, $given:ident: $($number:literal $name:ident { $($field:ident: $type:ty),* } $message:literal $remedy:literal)*) => {
        /// A reason for which a session or wearer file is refused. This is the only list of the
        /// error numbers 400–499, 630–639, 650–669 and 750–758, which never change their meaning.
        /// In all variants, `allowed` describes the values that the field may have.
        #[derive(Clone, PartialEq, Debug)]
        #[expect(missing_docs, reason = "each message explains its fields")]
        pub enum Problem {
            $(#[doc = $message] $name { $($field: $type),* },)*
        }

        impl Problem {
            /// Error numbers of all variants, in the order of the list.
            pub const NUMBERS: &[u16] = &[$($number),*];

            /// Returns the error number, which never changes its meaning: 400–499, 630–639, 650–669
            /// or 750–758.
            #[must_use]
            pub const fn number(&self) -> u16 {
                match self {
                    $(Self::$name { .. } => $number,)*
                }
            }

            /// Returns the message, which quotes the field and its value at `place`.
            pub(super) fn message(&self, place: &Place) -> String {
                let Place { field: $path, given: $given, .. } = place;
                match self {
                    $(Self::$name { $($field),* } => {
                        let _ = ($path, $given, $($field),*); // most name some of them
                        format!($message)
                    })*
                }
            }

            /// Returns what the user should do about the problem, or an empty text if the message
            /// says so.
            const fn remedy(&self) -> &'static str {
                match self {
                    $(Self::$name { .. } => $remedy,)*
                }
            }
        }
    };
}

problems! {
    at field, given:
    400 Unreadable { reason: String }
        "the session file cannot be read: {reason}" ""
    401 Syntax { reason: String }
        "not valid TOML: {reason}" ""
    402 UnknownField { close: Option<String>, known: String }
        "there is no field `{field}`" ""
    403 WrongType { expected: &'static str, found: &'static str }
        "`{field}` must be {expected}, not {found}" ""
    404 MissingField {}
        "`{field}` is missing" ""
    405 NotExact { step: String }
        "`{field}` is {given}: the device counts in steps of {step}" ""
    406 NotFinite { allowed: Option<String> }
        "`{field}` is {given}, but must be a finite number with at most 38 digits" ""
    407 OutOfRange { allowed: String }
        "`{field}` is {given}; allowed: {allowed}" ""
    408 UnknownChoice { close: Option<String>, known: String }
        "`{field}` cannot be {given}" ""
    409 SaidTwice { other: String }
        "`{field}` and `{other}` exclude each other: give only one of them" ""
    410 NotInOrder { after: String }
        "`{field}` is {given}, but must be greater than {after}" ""
    411 More { count: usize }
        "there are {count} more mistakes"
        "correct the listed mistakes first"
    412 ControlCharacter { character: String }
        "`{field}` contains the character {character}, which reports and charts cannot show"
        "delete the character"
    420 ChannelTwice { channel: u8 }
        "`{field}` names channel {channel} a second time"
        "name each channel only once here"
    421 NoSuchChannel { channel: u8 }
        "`{field}` names channel {channel}, which the file does not have"
        "add the channel, or correct the number"
    430 TwoGroups { channel: u8 }
        "channel {channel} is in two groups"
        "remove it from one of them"
    431 IsolationOverlaps { channel: u8, other: u8 }
        "the pulses of channels {channel} and {other} overlap at some time, so neither can be disconnected while the other pulses"
        "give them the same period and offsets at least a pulse width apart, or set partner = \"conducted\""
    432 NoTimeToGround { channel: u8 }
        "channel {channel} has too little time for `ground_us`: pulses of its isolated group interrupt the grounding before its next pulse"
        "move the offsets further apart, shorten `ground_us`, or give all members the same period"
    440 BurstOverlaps { min_us: u32 }
        "pulses of a burst overlap: `{field}` must be at least {min_us} µs" ""
    441 BurstTooLong { min_us: u32 }
        "a burst runs into the next one: the period must be at least {min_us} µs" ""
    450 CurrentLimit { limit: String, max_ma: String, by: &'static str }
        "`{field}` is {limit}; allowed: at most {max_ma} mA ({by})"
        "lower the limit"
    451 ChargeLimit { limit: String, uc: String, max_uc: String }
        "at `{field}` = {limit} one phase carries {uc} µC; allowed: at most {max_uc} µC (`wearer.max_charge_uc`)"
        "lower the limit or the pulse width"
    452 RmsLimit { limit: String, ma: String, max_ma: String }
        "at `{field}` = {limit} the train has {ma} mA rms; allowed: at most {max_ma} mA (`wearer.max_rms_ma`)"
        "lower the limit, the pulse width, the frequency or the number of pulses in a burst"
    453 AboveChannelLimit { channel: u8, limit: String }
        "`{field}` is {given}; allowed: 0 to {limit}, the `limit` of channel {channel}"
        "choose an amplitude in this range; raise the `limit` only if the wearer tolerates it"
    454 DensityLimit { limit: String, ma: String, area_mm2: u32, max_ma: String }
        "at `{field}` = {limit} the train has {ma} mA rms; allowed: at most {max_ma} mA (2 mA/cm² under `area_mm2` = {area_mm2})"
        "enter the `area_mm2` of a larger electrode, or lower the limit, the pulse width or the frequency"
    455 SumLimit { who: String, sum_ma: String, max_ma: String }
        "with {who} at their limits, the common return carries {sum_ma} mA at one moment; allowed: at most {max_ma} mA (`wearer.max_sum_ma`)"
        "lower the limits, or give all trains the same period and offsets at least one pulse apart"
    456 SumRmsLimit { who: String, sum_ma: String, max_ma: String, by: SumBound }
        "with {who} at their limits, the common return carries {sum_ma} mA rms; allowed: at most {max_ma} mA ({by})"
        "lower the limits, pulse widths or frequencies"
    460 Controlled { channel: u8 }
        "`{field}` names channel {channel}, which a controller of this session drives"
        "leave the channel out here, or remove it from the controller"
    461 NoJoint { wanted: &'static str }
        "{wanted} needs a `[joint]`, and the file has none" ""
    462 TooSlow { timeout_ms: u16 }
        "`{field}` is {given}: the time between setpoints would exceed the host silence of {timeout_ms} ms that ends stimulation"
        "raise the rate or `wearer.host_timeout_ms`"
    463 NoFatigue {}
        "`{field}` is \"calcium-force-fatigue\", but the muscle has no `fatigue`"
        "add `fatigue` to the muscle; `fatigue = {}` uses the values of the quadriceps (Ding 2003)"
    464 NothingToFit {}
        "`[fidelity]` selects muscle models, but no channel has a `muscle`"
        "add a `muscle` to the channels, or delete `[fidelity]`"
    465 NothingTriggered {}
        "no channel waits for a trigger, so `[simulated_trigger]` would start nothing"
        "set `triggered = true` in the train of a channel, or delete `[simulated_trigger]`"
    466 NeverTried { flexion_nm: String, stiffness: String, allowed: String }
        "with `flexion_nm` = {flexion_nm} and `stiffness_nm_per_rad` = {stiffness} the wearer is weaker than a quarter of the reference wearer or stronger than four times it, a range in which the controller was never tested; allowed with this torque: a stiffness of {allowed} N·m/rad"
        "measure both values again, delete `joint.wearer`, or set law = \"paper\", which uses no model of the wearer"
    467 OutsideBounds { reach: String }
        "`{field}` is {given}, but the setpoints of this channel in the file go {reach}"
        "widen the bounds, or keep the setpoints of the file within them"
    468 SessionTooLong { most_s: u32 }
        "`{field}` is {given}; allowed: at most {most_s} s (`wearer.max_session_s`), after which the device ends the session"
        "shorten the session; `max_session_s` limits the total stimulation since power-on"
    470 OutOfReach { newton: f64, channel: u8, min_n: f64, max_n: f64 }
        "`{field}` is {newton} N; allowed: 0 N, or {min_n} to {max_n} N, which channel {channel} can give within its limits"
        "choose a force in this range, or raise the channel's `limit` or its `force.max_frequency_hz`"
    471 NoForceControl { channel: u8 }
        "`{field}` names channel {channel}, which has no `force`"
        "add `force` to the channel, or name another channel"
    472 NoMuscle { channel: u8 }
        "channel {channel} has a `force`, but not the `muscle` that force control needs"
        "add a `muscle` to the channel"
    473 RateChanges { channel: u8 }
        "channel {channel} may change its pulse rate, but is in an isolated group, where its pulses would then overlap with others"
        "delete `force.max_frequency_hz` and `force.min_frequency_hz`, or set partner = \"conducted\""
    474 ForceControlled { channel: u8 }
        "`{field}` names channel {channel}, which is under force control"
        "name another channel, or delete the channel's `force`"
    475 WrenchOutOfReach { at_s: f64, force: String, channel: u8, percent: f64, nearest: String }
        "at {at_s} s `{field}` asks for {force}, but the muscle of channel {channel} is too weak within its limit; possible: {percent} % of it, {nearest}"
        "ask for at most this force, or change the posture"
    476 NoMuscleHelps { at_s: f64, force: String }
        "at {at_s} s `{field}` asks for {force}, but no muscle of the session pulls in this direction in this posture"
        "choose another direction, or stimulate a muscle that pulls that way"
    477 NoLimb {}
        "`{field}` is {given}, but the session has no wearer file with a `[limb]`"
        "name one in `[wearer] file`; it describes where the muscles pull"
    478 NoLine {}
        "`{field}` is {given}, but no channel of the session has a `[[limb.line]]` in the wearer file"
        "stimulate channels of the arm's muscles"
    479 JointAndLimb {}
        "`{field}` is {given}, which cannot be combined with a `[joint]` or a `[wall]`: both would use the same measurement"
        "keep only one of them"
    480 JointAndWall {}
        "a `[joint]` and a `[wall]` cannot be combined: the device measures only one angle"
        "keep only one of them"
    481 Misplaced { why: String }
        "`{field}`: {why}"
        "move the electrode; electrodes are round (2.5 cm) or small (2.0 × 1.5 cm), and the return electrode (4 × 9 cm) ends at the wrist"
    482 CurrentIntoHand { channel: u8 }
        "`{field}` names channel {channel}, which has a current stage, but the simulated hand accepts only voltages"
        "give the channel a voltage stage"
    483 Programmed { channel: u8 }
        "`{field}` names channel {channel}, which a `[[program]]` already drives"
        "remove it from one of the two: a channel with a program can have no other setpoints"
    484 NotEndless { channel: u8, why: &'static str }
        "`{field}` names channel {channel}, whose train {why}, but a program needs an endless train from the common start"
        "remove this from the train, or drive the channel by `[setpoints]`"
    485 RampTooShort { channel: u8, from: String, to: String, least: String, nearest: String }
        "`{field}` is {given}, which is too fast: within the wearer's rise and step limits channel {channel} needs at least {least} s from {from} to {to}; {nearest}"
        "shorten `wearer.rise_ms` only if the wearer accepts it"
    486 NoSmoothRamp { channel: u8, from: String, to: String }
        "`{field}` is {given}, but channel {channel} cannot go smoothly from {from} to {to} in any time: widening a pulse by 1 µs already exceeds the rise that one burst may have"
        "change only the amplitude, or lower it"
    487 RateBelowTrain { least_hz: String }
        "`{field}` is {given}, but each burst of a `[[program]]` needs its own setpoint; allowed: at least {least_hz} Hz"
        "raise the rate, or delete `[setpoints]`"
    488 SilenceTooShort { channel: u8, least: String }
        "`{field}` is {given}, but channel {channel} needs a pause of at least {least} s, one period of its train, before it rises again"
        "lengthen the pause"
    489 OnTooShort { channel: u8, on: String, up: String, down: String, nearest: String }
        "`{field}` is {given}: channel {channel} is on for {on} s, which is too short for its ramps of {up} s up and {down} s down; allowed: {nearest}"
        "keep it on for longer, or shorten its ramps"
    490 StepTooShort { channel: u8, least: String }
        "`{field}` is {given}, less than one period of channel {channel}'s train after the previous step; allowed: at least {least} s"
        "hold each step for at least one burst"
    491 BeginsAfterEnd { channel: u8, begins: String }
        "`{field}` is {given}: channel {channel} would begin at {begins} s, after the end of the session"
        "begin earlier, or lengthen `duration_s`"
    492 StepTooLarge { channel: u8, from: String, to: String, most: String }
        "`{field}` is {given}: channel {channel} would jump from {from} to {to}, but the wearer's `max_step_ma` and `max_step_ma_per_s` allow an increase of at most {most}"
        "use smaller steps, or go through 0; if this happens within a ramp, delete the channel's `start`"
    630 ChargeAtWidth { value: String, width_us: u16, most: String, max_uc: String }
        "`{field}`: {value} for {width_us} µs exceeds the charge of {max_uc} µC per phase that `wearer.max_charge_uc` and the channel's limit allow; allowed at this width: at most {most}"
        "lower the amplitude or the width, here or on the way to the next point"
    631 FixedWidth { channel: u8, own_us: u16 }
        "`{field}` is {given}, but the width of channel {channel} is fixed at {own_us} µs"
        "set `max_width_us` in its train to the largest width that it may have"
    632 WidthChanges { channel: u8 }
        "channel {channel} has a `max_width_us` and a `muscle`, whose recruitment holds for one width only"
        "delete one of them"
    633 NoLists { channel: u8 }
        "`{field}` names channel {channel}, whose train does not accept lists of pulses"
        "set `lists = true` in its train"
    634 NeverHeld { channel: u8 }
        "the train of channel {channel} plays while the trigger input is held, but `[simulated_trigger]` never holds it"
        "set `held_s`, the time for which it is held after each edge"
    635 HeldTooLong { most_s: String }
        "`{field}` is {given}, but the input must be released 1 ms before the next edge; allowed with these edges: at most {most_s} s"
        "shorten it, or put the edges further apart"
    636 NeverRises { channel: u8 }
        "`{field}` names channel {channel}, whose amplitude stays 0: a list only replaces pulses that are already playing"
        "give the channel an amplitude in `values`, which may be too small to feel"
    637 CountedRises { channel: u8, value: String, start: String, pulses: u32 }
        "`{field}` is {value}, but the `start` of channel {channel} is {start}: {pulses} pulses of its `repeats` would be lower while the amplitude rises"
        "raise `start`, the largest amplitude that the wearer accepts at once, or lower the amplitude"
    638 CountedControlled { channel: u8 }
        "`{field}` is {given}, but a controller drives channel {channel}: its amplitude rises gradually, so the first of a fixed number of pulses would be lower than computed"
        "delete `repeats`"
    650 WearerUnreadable { reason: String }
        "the wearer file cannot be read: {reason}"
        "check path and permissions; `[wearer] file` is relative to the session's own folder"
    651 WearerSchema { known: u16 }
        "`{field}` is {given}, but this program reads wearer files of schema {known}"
        "use the version of flexor that wrote the file, or calibrate again"
    652 WearerName {}
        "`{field}` is {given}, but a pseudonym has 1 to 64 letters, digits and hyphens"
        "never use a person's name"
    653 ThresholdsDisordered { why: String }
        "`{field}` is {given}, {why}"
        "required: rheobase ≤ motor_threshold < limit, start ≤ limit, minimum ≤ maximum ≤ limit, from_hz ≤ frequency_hz ≤ to_hz; measure again"
    657 NoElectrode { channel: u8 }
        "`{field}` is {channel}, but the wearer file has no electrode for this channel, so its limit is unknown"
        "calibrate the channel, or stimulate another one"
    658 HoldsElsewhere { channel: u8, there: String }
        "`{field}` is {given}, but channel {channel}'s thresholds in the wearer file hold only for {there}"
        "use that setting, or calibrate with the new one; a width may differ if the file has a `strength_duration`"
    659 Loosened { allowed: String }
        "`{field}` is {given}, but the wearer file allows {allowed}"
        "delete the field, or make it stricter: a session may only tighten its wearer file"
    660 AnotherPerson { name: String }
        "`{field}` is {given}, but the wearer file belongs to {name}"
        "use the file of the wearer who is stimulated"
    661 NoWearerFile {}
        "`{field}` needs `wearer.file`"
        "add `wearer.file`, or delete the field"
    662 OutsideHapticRange { channel: u8, range: String }
        "`{field}` is {given}, which leaves channel {channel}'s haptic range, {range} (I_MT to 1.5 I_MT)"
        "use 0 or an amplitude in this range, or delete `wearer.haptic_range`, so that only the wearer's `limit` applies"
    665 NotAWearer { file: String }
        "{file} is not a wearer file: it has neither `schema` nor `evidence`"
        "name a wearer file; docs/reference/wearers.md describes them"
    750 ShareOutside { share: String, at_deg: f64 }
        "the quartic through `{field}` = {given} is {share} at {at_deg}°; allowed: 0 to 1 at every angle"
        "change the values near this angle, or narrow the joint's range"
    751 ModulationBeside { other: String }
        "`{field}` is {given}, which cannot be combined with {other}: both would use the same measurement"
        "keep only one of them"
    752 NoPhaseJoint { elbow: &'static str }
        "`{field}` is {given}, but the file has no `[[modulation]]` with joint = \"{elbow}\", whose motion determines the phase"
        "add it, with or without shares"
    753 HeldForTooLong { most_s: f64 }
        "`{field}` is {given} for longer than {most_s} s (`modulation.longest_hold_s`), after which the device ends the hold"
        "set `held` to false earlier, or raise `longest_hold_s`"
    754 NothingModulated {}
        "`{field}` is {given}, but the file has no `[[modulation]]`, so nothing would be stimulated"
        "add a `[[modulation]]`, or choose another kind"
    756 NeverGrabbed {}
        "`{field}` is {given}, but the file has a `[[modulation]]`, which stimulates only while an object is held"
        "set kind = \"held\""
    757 JointTwice {}
        "`{field}` is {given}, but an earlier `[[modulation]]` has the same joint"
        "delete one of them, or choose another joint"
    758 PeakAboveLimit { channel: u8, peak: String, at_deg: f64, limit: String }
        "`{field}` is {given}; with the joint's share this becomes {peak} at {at_deg}°, above channel {channel}'s limit of {limit}"
        "lower it, or the share at this angle"
}

/// Origin of the limit on the rms current of all channels together.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SumBound {
    /// The wearer's `max_sum_rms_ma`.
    Wearer,
    /// The limit of 2 mA/cm² under a common return of this area, mm².
    Area(u32),
}

impl fmt::Display for SumBound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Wearer => f.write_str("`wearer.max_sum_rms_ma`"),
            Self::Area(mm2) => write!(f, "2 mA/cm² under `wearer.return_area_mm2` = {mm2}"),
        }
    }
}

impl Problem {
    /// Returns what the user should do about the problem: the remedy, or the names that are
    /// possible. Returns `None` if the message says so.
    pub(super) fn help(&self) -> Option<String> {
        match self {
            Self::UnknownField { close, known, .. } | Self::UnknownChoice { close, known, .. } => {
                Some(match close {
                    Some(close) => format!("did you mean `{close}`? Possible here: {known}"),
                    None => format!("possible here: {known}"),
                })
            }
            Self::SumRmsLimit {
                by: SumBound::Area(_),
                ..
            } => Some(format!(
                "{}, or enter the `wearer.return_area_mm2` of a larger electrode",
                self.remedy()
            )),
            _ => Some(self.remedy().to_owned()).filter(|remedy| !remedy.is_empty()),
        }
    }

    /// Returns the values that the field may have, if the problem is that its value is outside of
    /// them.
    pub(super) fn allowed(&self) -> Option<&str> {
        match self {
            Self::OutOfRange { allowed }
            | Self::NotFinite {
                allowed: Some(allowed),
            } => Some(allowed),
            _ => None,
        }
    }

    /// Returns the short text that is written under the marked place when the file is shown.
    pub(super) fn label(&self) -> String {
        match self {
            Self::UnknownField { .. } => "unknown".into(),
            Self::WrongType { expected, .. } => format!("expected {expected}"),
            Self::MissingField { .. } => "missing from here".into(),
            Self::OutOfRange { allowed, .. }
            | Self::NotFinite {
                allowed: Some(allowed),
                ..
            } => allowed.clone(),
            _ => "here".into(),
        }
    }
}
