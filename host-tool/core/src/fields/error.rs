//! Errors of a session or wearer file, and their places in it.

use std::fmt;
use std::ops::Range;

/// Maximum number of errors that are reported one by one.
pub(crate) const MOST: usize = 200;

/// Place of an error in a file.
#[derive(Clone, Debug, Default)]
pub(crate) struct Place {
    /// Path of the field.
    pub(crate) field: String,
    /// Text of the value in the file.
    pub(crate) given: String,
    /// Byte range in the text.
    pub(crate) span: Range<usize>,
}

/// Declares [`Problem`]: number, fields, message, and a remedy if the message does not contain it.
/// A message may name its place.
macro_rules! problems {
    (at $path:ident, $given:ident: $($number:literal $name:ident { $($field:ident: $type:ty),* } $message:literal $remedy:literal)*) => {
        /// A reason for which a session or wearer file is refused. This is the only list of the
        /// numbers 400–499, 630–639, 650–669 and 750–758; they are stable. `allowed`
        /// describes the values that the field may have.
        #[derive(Clone, PartialEq, Debug)]
        #[expect(missing_docs, reason = "each message explains its fields")]
        pub enum Problem {
            $(#[doc = $message] $name { $($field: $type),* },)*
        }

        impl Problem {
            /// Every number of the list, in its order.
            pub const NUMBERS: &[u16] = &[$($number),*];

            /// Returns the stable number, 400–499, 630–639, 650–669 or 750–758.
            #[must_use]
            pub const fn number(&self) -> u16 {
                match self {
                    $(Self::$name { .. } => $number,)*
                }
            }

            /// Returns the message for an error at this place.
            pub(super) fn message(&self, place: &Place) -> String {
                let Place { field: $path, given: $given, .. } = place;
                match self {
                    $(Self::$name { $($field),* } => {
                        let _ = ($path, $given, $($field),*); // most name some of them
                        format!($message)
                    })*
                }
            }

            /// Returns the remedy, or an empty text if the message contains it.
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
        "`{field}` is {given}, which is no finite number of at most 38 digits" ""
    407 OutOfRange { allowed: String }
        "`{field}` is {given}, allowed is {allowed}" ""
    408 UnknownChoice { close: Option<String>, known: String }
        "`{field}` cannot be {given}" ""
    409 SaidTwice { other: String }
        "`{field}` and `{other}` say the same: give one of them" ""
    410 NotInOrder { after: String }
        "`{field}` is {given}, but it must come after {after}" ""
    411 More { count: usize }
        "there are {count} more mistakes" "mend these first"
    412 ControlCharacter { character: String }
        "`{field}` has the character {character}, which no page and no picture may hold"
        "leave it out"
    420 ChannelTwice { channel: u8 }
        "channel {channel} is named once more by `{field}`" ""
    421 NoSuchChannel { channel: u8 }
        "`{field}` names channel {channel}, which the file does not have" ""
    430 TwoGroups { channel: u8 }
        "channel {channel} is in two groups" ""
    431 IsolationOverlaps { channel: u8, other: u8 }
        "channels {channel} and {other} cannot isolate each other: their pulses overlap at some time"
        "give them the same period and offsets at least a pulse width apart, or set partner = \"conducted\""
    432 NoTimeToGround { channel: u8 }
        "channel {channel} has no time to ground: isolation interrupts it, and no unbroken `ground_us` remains before its next pulse"
        "move the offsets further apart, shorten `ground_us`, or give all members the same period"
    440 BurstOverlaps { min_us: u32 }
        "pulses of a burst overlap: `{field}` must be at least {min_us} µs" ""
    441 BurstTooLong { min_us: u32 }
        "a burst runs into the next one: the period must be at least {min_us} µs" ""
    450 CurrentLimit { limit: String, max_ma: String, by: &'static str }
        "`{field}` = {limit}, allowed are {max_ma} mA, {by}"
        "lower the limit"
    451 ChargeLimit { limit: String, uc: String, max_uc: String }
        "at `{field}` = {limit} one phase is {uc} µC, allowed are {max_uc} µC, `wearer.max_charge_uc`"
        "lower the limit or the pulse width"
    452 RmsLimit { limit: String, ma: String, max_ma: String }
        "at `{field}` = {limit} the train comes to {ma} mA rms, allowed are {max_ma} mA, `wearer.max_rms_ma`"
        "lower the limit, the pulse width, the frequency or the number of pulses in a burst"
    453 AboveChannelLimit { channel: u8, limit: String }
        "`{field}` is {given}, allowed is 0 to channel {channel}'s `limit` of {limit}"
        "ask for what the channel may put out; its `limit` is what its wearer tolerates"
    454 DensityLimit { limit: String, ma: String, area_mm2: u32, max_ma: String }
        "at `{field}` = {limit} the train comes to {ma} mA rms, allowed are {max_ma} mA, 2 mA/cm² under `area_mm2` = {area_mm2}"
        "say `area_mm2` of a larger electrode, or lower the limit, the pulse width or the frequency"
    455 SumLimit { who: String, sum_ma: String, max_ma: String }
        "{who} at their limits put {sum_ma} mA through the common return at once, allowed are {max_ma} mA, `wearer.max_sum_ma`"
        "lower limits, or give all trains one period and offsets at least a pulse apart"
    456 SumRmsLimit { who: String, sum_ma: String, max_ma: String, by: SumBound }
        "{who} at their limits put {sum_ma} mA rms through the common return, allowed are {max_ma} mA, {by}"
        "lower limits, widths or frequencies"
    460 Controlled { channel: u8 }
        "`{field}` names channel {channel}, which the joint or the wall drives" ""
    461 NoJoint { wanted: &'static str }
        "{wanted} needs a `[joint]`, and the file has none" ""
    462 TooSlow { timeout_ms: u16 }
        "`{field}` is {given}: setpoints would be further apart than the {timeout_ms} ms of silence that end stimulation"
        "raise it, or `wearer.host_timeout_ms`"
    463 NoFatigue {}
        "`{field}` is calcium-force-fatigue, but nothing says how the muscle tires"
        "give the muscle `fatigue`; `fatigue = {}` takes the quadriceps' of Ding 2003"
    464 NothingToFit {}
        "no channel has a `muscle`, so there is nothing to choose by"
        "give the channels a `muscle`, or leave `[fidelity]` out"
    465 NothingTriggered {}
        "no channel waits for a trigger, so `[simulated_trigger]` would start nothing"
        "give a channel's train `triggered = true`, or leave `[simulated_trigger]` out"
    466 NeverTried { flexion_nm: String, stiffness: String, allowed: String }
        "a wearer of `flexion_nm` = {flexion_nm} and `stiffness_nm_per_rad` = {stiffness} is weaker than a quarter or stronger than four times the reference, on whom the law was never tried: with this torque the stiffness may be {allowed}"
        "measure both again; or leave `joint.wearer` out, or take law = \"paper\", which steers by no wearer"
    467 OutsideBounds { reach: String }
        "`{field}` is {given}, and the file's own setpoints of this channel go {reach}"
        "widen the bounds, or keep the file's setpoints within them"
    468 SessionTooLong { most_s: u32 }
        "`{field}` is {given}, allowed are {most_s} s, `wearer.max_session_s`: the device would end it there"
        "shorten it; `max_session_s` is what the wearer bears since power came up"
    470 OutOfReach { newton: f64, channel: u8, min_n: f64, max_n: f64 }
        "`{field}` is {newton} N: within its limits channel {channel} gives 0 N, and from {min_n} to {max_n} N"
        "ask for a force in there, or raise the channel's `limit` or its `force.max_frequency_hz`"
    471 NoForceControl { channel: u8 }
        "`{field}` names channel {channel}, which has no `force`" ""
    472 NoMuscle { channel: u8 }
        "channel {channel} has a `force` and no `muscle` to find it with" ""
    473 RateChanges { channel: u8 }
        "channel {channel} may change its pulse rate, and is in an isolated group, whose pulses would then meet"
        "leave `force.max_frequency_hz` and `force.min_frequency_hz` out, or set partner = \"conducted\""
    474 ForceControlled { channel: u8 }
        "`{field}` names channel {channel}, which is under force control" ""
    475 WrenchOutOfReach { at_s: f64, force: String, channel: u8, percent: f64, nearest: String }
        "at {at_s} s `{field}` asks for {force}, and channel {channel}'s muscle is not strong enough within its limit: {percent} % can be made, {nearest}"
        "ask for that much, or hold the arm otherwise"
    476 NoMuscleHelps { at_s: f64, force: String }
        "at {at_s} s `{field}` asks for {force}, and no muscle of the session helps towards it as the arm is held"
        "ask for another direction, or stimulate a muscle that pulls that way"
    477 NoLimb {}
        "`{field}` is {given}, and there is no wearer file with a `[limb]`"
        "name one in `[wearer] file`: it says where the muscles pull"
    478 NoLine {}
        "`{field}` is {given}, and no channel of the session has a `[[limb.line]]` in the wearer file"
        "stimulate channels of the arm's muscles"
    479 JointAndLimb {}
        "`{field}` is {given}, which cannot run beside a `[joint]` or a `[wall]`: a measurement would be of both"
        "keep one of them"
    480 JointAndWall {}
        "a `[joint]` and a `[wall]` cannot run together: the device measures one angle"
        "keep one of them"
    481 Misplaced { why: String }
        "`{field}`: {why}"
        "move it; electrodes are 2.5 cm across or 2.0 × 1.5 cm, and the return's 4 × 9 cm end at the wrist"
    482 CurrentIntoHand { channel: u8 }
        "`{field}` names channel {channel}, whose stage drives a current: the simulated hand knows voltages alone"
        "give the channel a voltage stage"
    483 Programmed { channel: u8 }
        "`{field}` names channel {channel}, which a `[[program]]` plays"
        "leave it out of one of them: a channel has one program, and nothing beside it"
    484 NotEndless { channel: u8, why: &'static str }
        "`{field}` names channel {channel}, whose train {why}: a program plays endless trains from the common start"
        "leave that out of the train, or drive the channel by `[setpoints]`"
    485 RampTooShort { channel: u8, from: String, to: String, least: String, nearest: String }
        "`{field}` is {given}, and channel {channel} goes from {from} to {to} in {least} s at least, by the wearer's rise and steps: {nearest}"
        "give it that time; a shorter `rise_ms` is the wearer's to accept"
    486 NoSmoothRamp { channel: u8, from: String, to: String }
        "`{field}` is {given}, and channel {channel} cannot go smoothly from {from} to {to} in any time: a µs of width is more than a burst may rise"
        "change the amplitude alone, or lower it"
    487 RateBelowTrain { least_hz: String }
        "`{field}` is {given}, and each burst of a `[[program]]` gets its own order: {least_hz} at least"
        "raise it, or leave `[setpoints]` out"
    488 SilenceTooShort { channel: u8, least: String }
        "`{field}` is {given}, which leaves channel {channel} less than {least} s of silence before it rises again: not one of its bursts might be left out"
        "leave that time at least, a period of its train"
    489 OnTooShort { channel: u8, on: String, up: String, down: String, nearest: String }
        "`{field}` is {given}: channel {channel} is on for {on} s, and its ramps take {up} s up and {down} s down: {nearest}"
        "leave it on for longer, or shorten its ramps"
    490 StepTooShort { channel: u8, least: String }
        "`{field}` is {given}, less than a period of channel {channel}'s train after the step before: {least} at least"
        "hold each step for a burst at least"
    491 BeginsAfterEnd { channel: u8, begins: String }
        "`{field}` is {given}: channel {channel} would begin at {begins} s, when the session is over"
        "begin earlier, or lengthen `duration_s`"
    492 StepTooLarge { channel: u8, from: String, to: String, most: String }
        "`{field}` is {given}: channel {channel} is ordered from {from} to {to} at once, and the wearer's `max_step_ma` and `max_step_ma_per_s` allow {most} more"
        "go there in smaller steps, or through 0; on the way of a ramp, leave the channel's `start` out"
    630 ChargeAtWidth { value: String, width_us: u16, most: String, max_uc: String }
        "{value} for {width_us} µs is more than the {max_uc} µC of one phase that the wearer's limits and the channel's allow, `wearer.max_charge_uc`: at this width {most} at most (`{field}`)"
        "lower the amplitude or the width, there or on the way to the next point"
    631 FixedWidth { channel: u8, own_us: u16 }
        "`{field}` is {given}, and channel {channel}'s width is {own_us} µs and never changes"
        "give its train a `max_width_us`, the largest width it is to have"
    632 WidthChanges { channel: u8 }
        "channel {channel} has a `muscle`, whose recruitment holds at one width, and a `max_width_us`"
        "leave one of them out"
    633 NoLists { channel: u8 }
        "`{field}` names channel {channel}, whose train takes no lists of pulses"
        "say `lists = true` in its train"
    634 NeverHeld { channel: u8 }
        "channel {channel}'s train plays while the trigger input is held, and `[simulated_trigger]` never holds it"
        "say `held_s`, how long it is held after each edge"
    635 HeldTooLong { most_s: String }
        "`{field}` is {given}: with edges this close an input is released 1 ms before the next only if it is held for {most_s} s at most"
        "hold it for less, or put its edges further apart"
    636 NeverRises { channel: u8 }
        "`{field}` names channel {channel}, which nothing raises: a list plays in place of pulses that play"
        "give the channel `values`, as small as may be if nothing is to be felt before"
    637 CountedRises { channel: u8, value: String, start: String, pulses: u32 }
        "channel {channel} plays {pulses} pulses of its `repeats` below {value}, which is above its `start` of {start} (`{field}`)"
        "raise `start`, the largest amplitude that the wearer accepts at once, or lower the amplitude"
    638 CountedControlled { channel: u8 }
        "`{field}` is {given}, and channel {channel} is controlled: its amplitudes rise, and the first of a fixed number of pulses would be lower than was computed"
        "leave `repeats` out"
    650 WearerUnreadable { reason: String }
        "the wearer file cannot be read: {reason}"
        "check path and permissions; `[wearer] file` is relative to the session's own folder"
    651 WearerSchema { known: u16 }
        "`{field}` is {given}: this program reads wearer files of schema {known}"
        "use the flexor that wrote it, or calibrate again"
    652 WearerName {}
        "`{field}` is {given}, but a pseudonym is of 1 to 64 letters, digits and hyphens" "never use a person's name"
    653 ThresholdsDisordered { why: String }
        "`{field}` is {given}, {why}"
        "a threshold lies below the limit, a minimum not above the maximum, nor that above the limit; measure again"
    657 NoElectrode { channel: u8 }
        "`{field}` is {channel}, and the wearer file has no electrode of that channel"
        "calibrate it, or stimulate another channel: nobody knows its limit"
    658 HoldsElsewhere { channel: u8, there: String }
        "`{field}` is {given}, and channel {channel}'s thresholds in the wearer file hold at {there}"
        "stimulate as they were found, or calibrate so; a width may differ where the file has a `strength_duration`"
    659 Loosened { allowed: String }
        "`{field}` is {given}, and the wearer file allows {allowed}"
        "a session may only tighten its wearer file: leave the field out, or tighten it"
    660 AnotherPerson { name: String }
        "`{field}` is {given}, and the wearer file is {name}'s"
        "name the file of whoever is stimulated"
    661 NoWearerFile {}
        "`{field}` needs `wearer.file`"
        "name the wearer's file, or leave it out"
    662 OutsideHapticRange { channel: u8, range: String }
        "`{field}` is {given}, outside channel {channel}'s haptic range, {range} (I_MT to 1.5 I_MT)"
        "0 is allowed too; without `wearer.haptic_range` the wearer's `limit` alone holds"
    665 NotAWearer { file: String }
        "{file} is no wearer file: it says neither of which `schema` it is, nor by `evidence` where its numbers are from"
        "name a wearer's file, as docs/wearers.md describes them"
    750 ShareOutside { share: String, at_deg: f64 }
        "`{field}` goes through {given}, and its quartic is {share} at {at_deg}°: a share is 0 to 1 at every angle"
        "move the five values away from there, or narrow the joint's range"
    751 ModulationBeside { other: String }
        "`{field}` is {given}, which cannot follow its angle beside {other}: a measurement would be of both"
        "keep one of them"
    752 NoPhaseJoint { elbow: &'static str }
        "`{field}` is {given}, and the file has no `[[modulation]]` of joint = \"{elbow}\", whose motion tells its phase"
        "add it, with or without shares"
    753 HeldForTooLong { most_s: f64 }
        "`{field}` is {given} for longer than {most_s} s, `modulation.longest_hold_s`: the device would let go there"
        "release it before, or raise `longest_hold_s`"
    754 NothingModulated {}
        "`{field}` is {given}, and the file has no `[[modulation]]`: nothing would be stimulated" ""
    756 NeverGrabbed {}
        "`{field}` is {given}, and the file has `[[modulation]]`s, which stimulate only while an object is held"
        "say kind = \"held\""
    757 JointTwice {}
        "`{field}` is {given}, which an earlier `[[modulation]]` is of" ""
    758 PeakAboveLimit { channel: u8, peak: String, at_deg: f64, limit: String }
        "`{field}` is {given}, of which the joint's share makes {peak} at {at_deg}°: above channel {channel}'s limit of {limit}"
        "lower it, or the share there"
}

/// Bound on the rms current of all channels together.
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
    /// Returns the remedy, if the message does not contain it.
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
                "{}, or say `wearer.return_area_mm2` of a larger electrode",
                self.remedy()
            )),
            _ => Some(self.remedy().to_owned()).filter(|remedy| !remedy.is_empty()),
        }
    }

    /// Returns the text that is written under the place in the file.
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
