//! An independent check of each window before it plays: the edges on their way to the pins are
//! compared with the armed trains.
//!
//! The check knows trains, limits and groups, and nothing of how the scheduler makes edges of
//! them: it keeps its own copy of the armed trains and its own account of each channel, from edge
//! to edge. It checks the length of each phase; that the width and the DAC code are allowed
//! together; that two phases are equal and opposite with the gap between them; that a grounding
//! after a pulse is complete before the next pulse; the distance of pulses and bursts; that
//! nothing is grounded without a reason; and that no DAC code is above the code of the limit.
//! Silence breaks no rule.

use crate::pulse::{
    CHANNELS, Group, Levels, MAX_GROUPS, Partner, PulseStart, State as OutputState, Train,
    WindowPlan,
};
use crate::seal::{CheckSchedule, Checksum};
use crate::units::{DacCode, Micros, us};

/// A time longer than any period, and far from half the range of the clock.
const LONG_AGO_US: u32 = 1 << 30;

/// The output that is allowed on one channel.
#[derive(Clone, Copy, Debug, Hash)]
pub struct Expected {
    /// The channel's train, from which the lengths and distances of its edges follow.
    pub train: Train,
    /// Shortest time from burst to burst for which the limits were checked, µs.
    pub min_period_us: u32,
    /// Largest allowed DAC code.
    pub max_code: DacCode,
    /// Largest allowed product of a DAC code and the width of its phases, codes × µs.
    pub max_code_us: u32,
}

/// A rule that a window would have broken.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum BrokenRule {
    /// The memory of this check changed by itself.
    Memory,
    /// The window does not begin where the one before it ended.
    Start,
    /// A channel that was not armed is driven or has a DAC code.
    Channel,
    /// A phase or a gap has a wrong length, or a phase a wrong polarity.
    Phase,
    /// A pulse begins too early after the previous one.
    Spacing,
    /// A channel is grounded without a reason, or not long enough.
    Grounding,
    /// A DAC code is above the code of the limit.
    Code,
    /// The train does not allow a width, or the width gives more charge than is allowed.
    Width,
}

/// Position of a channel in its pulse.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
enum Part {
    Rest,
    First,
    Gap,
    Second,
    /// After a pulse that must be grounded, until the grounding is complete.
    Discharge,
}

#[derive(Clone, Copy, Debug, Hash)]
struct Line {
    part: Part,
    /// Time of the channel's latest edge.
    since: Micros,
    /// Start of the latest burst; meaningless while `pulses` is 0.
    burst: Micros,
    /// Start of the latest pulse; meaningless while `pulses` is 0.
    pulse: Micros,
    /// Number of pulses that the latest burst has begun; 0 if there was no burst, or none recently.
    pulses: u8,
    /// Width of the phases of the latest pulses, µs; 0 stands for the train's own width.
    width_us: u16,
}

/// The check of all windows: what each channel may output, and what it has output so far.
#[derive(Clone, Debug)]
pub struct OutputCheck {
    expected: [Option<Expected>; CHANNELS],
    lines: [Line; CHANNELS],
    groups: [Option<Group>; MAX_GROUPS],
    levels: Levels,
    /// `levels` with every bit inverted, which reveals a bit flip.
    inverse: Levels,
    /// Checksums of each channel: over its expected output, and over its account.
    seals: [(Checksum, Checksum); CHANNELS],
    /// Checksum over the groups.
    seal: Checksum,
    /// Selects the channel whose memory is verified next. Channels that do not change take their
    /// turn, too.
    turn: CheckSchedule,
}

impl OutputCheck {
    /// Returns a check in which nothing is armed and every channel is disconnected.
    #[must_use]
    pub fn new() -> Self {
        let mut check = Self {
            expected: [None; CHANNELS],
            lines: [Line::RESTING; CHANNELS],
            groups: [None; MAX_GROUPS],
            levels: Levels::ISOLATED,
            inverse: Levels::ISOLATED,
            seals: [(Checksum::default(), Checksum::default()); CHANNELS],
            seal: Checksum::default(),
            turn: CheckSchedule::new(4, CHANNELS as u8),
        };
        check.renew_all_checksums();
        check
    }

    /// Forbids all pulses from now on. All channels are disconnected or grounded, as `levels` say.
    pub fn disarm(&mut self, levels: Levels) {
        self.arm(|_| None, &[]);
        self.levels = levels;
        self.renew_all_checksums();
    }

    /// Allows, from now on, the output that `expected` returns for each channel. Every channel
    /// starts disconnected and without a pulse in progress.
    pub fn arm(&mut self, expected: impl Fn(u8) -> Option<Expected>, groups: &[Group]) {
        for (channel, slot) in (0..).zip(&mut self.expected) {
            *slot = expected(channel);
        }
        self.lines.fill(Line::RESTING);
        let mut groups = groups.iter().copied();
        for slot in &mut self.groups {
            *slot = groups.next();
        }
        self.levels = Levels::ISOLATED;
        self.renew_all_checksums();
    }

    fn renew_all_checksums(&mut self) {
        let lines = self.expected.iter().zip(&self.lines);
        for (seals, (expected, line)) in self.seals.iter_mut().zip(lines) {
            *seals = (Checksum::of(expected), Checksum::of(line));
        }
        self.seal = Checksum::of(&self.groups);
        self.inverse = Levels(!self.levels.0);
    }

    /// Checks a window that is about to be painted on the pulse tape.
    ///
    /// # Errors
    /// Returns the first rule that the window breaks; it must not be played then.
    pub fn check_window(&mut self, plan: &WindowPlan) -> Result<(), BrokenRule> {
        if self.levels.0 != !self.inverse.0 {
            return Err(BrokenRule::Memory);
        }
        if plan.initial.without_sync() != self.levels.without_sync() {
            return Err(BrokenRule::Start);
        }
        let mut is_live = false;
        for &(channel, code) in &plan.dac {
            let index = usize::from(channel);
            let expected = self.expected.get(index);
            let (Some(Some(expected)), Some((seal, _))) = (expected, self.seals.get(index)) else {
                return Err(BrokenRule::Channel);
            };
            // A burst begins, so the expected output must be unchanged.
            if !seal.matches(&Some(expected)) {
                return Err(BrokenRule::Memory);
            }
            if code > expected.max_code {
                return Err(BrokenRule::Code);
            }
            is_live |= expected.train.has_live_width();
        }
        self.verify_next_channel(plan.start)?;
        if plan.changes.is_empty() {
            return Ok(());
        }
        if is_live {
            self.take_widths(&plan.pulses)?;
        }
        for change in &plan.changes {
            let at = plan.start + us(change.slot.into());
            self.check_change(at, change.levels)?;
        }
        self.inverse = Levels(!self.levels.0);
        Ok(())
    }

    /// Verifies the memory of one channel after the other, and forgets the latest pulse of a
    /// channel before the clock wraps and makes its time ambiguous.
    fn verify_next_channel(&mut self, now: Micros) -> Result<(), BrokenRule> {
        let Some(turn) = self.turn.next() else {
            return Ok(());
        };
        let place = (self.lines.get_mut(turn), self.seals.get_mut(turn));
        let (Some(line), Some((armed, seal))) = place else {
            return Ok(());
        };
        let expected = self.expected.get(turn);
        if !seal.matches(line) || expected.is_some_and(|expected| !armed.matches(expected)) {
            return Err(BrokenRule::Memory);
        }
        if line.pulses != 0 && now.elapsed_since(line.pulse) > LONG_AGO_US {
            line.pulses = 0;
            *seal = Checksum::of(line);
        }
        Ok(())
    }

    /// Takes the widths of the bursts that begin in this window, some of which may differ from
    /// their trains' own. The edges of each burst are compared with these widths.
    #[inline(never)]
    fn take_widths(&mut self, pulses: &[PulseStart]) -> Result<(), BrokenRule> {
        for pulse in pulses {
            self.take_width(pulse)?;
        }
        Ok(())
    }

    fn take_width(&mut self, pulse: &PulseStart) -> Result<(), BrokenRule> {
        let index = usize::from(pulse.channel);
        let place = (self.lines.get_mut(index), self.seals.get_mut(index));
        let (Some(line), Some((_, seal))) = place else {
            return Err(BrokenRule::Channel);
        };
        let Some(Some(expected)) = self.expected.get(index) else {
            return Err(BrokenRule::Channel);
        };
        if !expected.train.has_live_width() {
            return Ok(()); // another is found with its first edge
        }
        let width_us = pulse.width_us;
        // At most 2^32: 65 535 · 65 535.
        let code_us = u32::from(pulse.code.get()) * u32::from(width_us);
        let widths = expected.train.widths();
        if !widths.contains(&width_us) || code_us > expected.max_code_us {
            return Err(BrokenRule::Width);
        }
        if line.width_us != width_us {
            if !seal.matches(line) {
                return Err(BrokenRule::Memory);
            }
            line.width_us = width_us;
            *seal = Checksum::of(line);
        }
        Ok(())
    }

    fn check_change(&mut self, at: Micros, levels: Levels) -> Result<(), BrokenRule> {
        let before = core::mem::replace(&mut self.levels, levels);
        let mut changed = before.changed_channels(levels);
        while changed != 0 {
            let channel = changed.trailing_zeros() as usize; // below CHANNELS
            changed &= changed.wrapping_sub(1);
            let (old, new) = (before.state(channel), levels.state(channel));
            let place = (self.lines.get_mut(channel), self.seals.get_mut(channel));
            let (Some(line), Some((_, seal))) = place else {
                return Err(BrokenRule::Channel);
            };
            if !seal.matches(line) {
                return Err(BrokenRule::Memory);
            }
            let expected = self.expected.get(channel).and_then(Option::as_ref);
            line.check_edge(expected, at, (old, new))?;
            *seal = Checksum::of(line);
        }
        self.check_grounded(levels)
    }

    /// Checks that each grounded channel has a reason: its own discharge, the pulse of another
    /// member of its group, or the grounding of all channels after a fault.
    fn check_grounded(&self, levels: Levels) -> Result<(), BrokenRule> {
        let grounded = levels.grounded_channels();
        let mut left = grounded;
        let mut discharges = true;
        while left != 0 {
            let channel = left.trailing_zeros() as usize; // below CHANNELS
            left &= left.wrapping_sub(1);
            let line = self.lines.get(channel);
            discharges &= line.is_some_and(|line| line.part == Part::Discharge);
        }
        // Mostly true, so that no group is checked.
        if discharges || levels.without_sync() == Levels::GROUNDED {
            return Ok(());
        }
        self.check_grouped(grounded)
    }

    /// Checks that every channel in `grounded` discharges after its own pulse, or belongs to a
    /// conducted group in which another member pulses.
    #[inline(never)]
    fn check_grouped(&self, grounded: u16) -> Result<(), BrokenRule> {
        if !self.seal.matches(&self.groups) {
            return Err(BrokenRule::Memory);
        }
        let (mut pulsing, mut reasons) = (0u16, 0u16);
        for (channel, line) in self.lines.iter().enumerate() {
            pulsing |= u16::from(line.is_pulsing()) << channel; // below 10
            reasons |= u16::from(line.part == Part::Discharge) << channel;
        }
        let conducted = self.groups.iter().flatten();
        for group in conducted.filter(|group| group.partner() == Partner::Conducted) {
            if group.members() & pulsing != 0 {
                reasons |= group.members() & !pulsing;
            }
        }
        if grounded & !reasons == 0 {
            Ok(())
        } else {
            Err(BrokenRule::Grounding)
        }
    }
}

impl Default for OutputCheck {
    fn default() -> Self {
        Self::new()
    }
}

impl Line {
    const RESTING: Self = Self {
        part: Part::Rest,
        since: Micros::new(0),
        burst: Micros::new(0),
        pulse: Micros::new(0),
        pulses: 0,
        width_us: 0,
    };

    const fn is_pulsing(&self) -> bool {
        matches!(self.part, Part::First | Part::Gap | Part::Second)
    }

    /// Checks that the channel may go from the state `old` to `new` at `at`.
    fn check_edge(
        &mut self,
        expected: Option<&Expected>,
        at: Micros,
        (old, new): (OutputState, OutputState),
    ) -> Result<(), BrokenRule> {
        let Some(expected) = expected else {
            // The pulse of another member of its group may ground the channel.
            return match new {
                OutputState::Cathodic | OutputState::Anodic => Err(BrokenRule::Channel),
                _ => Ok(()),
            };
        };
        let spec = expected.train.spec();
        let (first, second) = if spec.shape.cathodic_first() {
            (OutputState::Cathodic, OutputState::Anodic)
        } else {
            (OutputState::Anodic, OutputState::Cathodic)
        };
        let lasted = (at - self.since).us().cast_unsigned();
        self.since = at;
        let width = match self.width_us {
            0 => u32::from(spec.width_us),
            width_us => width_us.into(),
        };
        let is_off = matches!(new, OutputState::Isolated | OutputState::Grounded);
        self.part = match self.part {
            Part::First if lasted != width => return Err(BrokenRule::Phase),
            Part::First if spec.shape.is_biphasic() => match new {
                OutputState::Isolated => Part::Gap,
                _ => return Err(BrokenRule::Phase),
            },
            // Another member of an isolated group may begin at this very moment.
            Part::First if is_off => Part::Discharge,
            Part::First => return Err(BrokenRule::Grounding),
            Part::Gap if lasted != u32::from(expected.train.gap_us()) || new != second => {
                return Err(BrokenRule::Phase);
            }
            Part::Gap => Part::Second,
            Part::Second if lasted != width || !is_off => return Err(BrokenRule::Phase),
            Part::Second if spec.ground_us != 0 => Part::Discharge,
            Part::Second => Part::Rest,
            Part::Discharge if old == OutputState::Grounded => {
                // The grounding is interrupted by another member of an isolated group, or
                // complete.
                let is_full = lasted >= u32::from(spec.ground_us);
                match (is_full, new) {
                    (true, OutputState::Isolated) => Part::Rest,
                    (false, OutputState::Isolated) => Part::Discharge,
                    (true, _) if new == first => return self.begin(expected, at),
                    _ => return Err(BrokenRule::Grounding),
                }
            }
            Part::Discharge if new == OutputState::Grounded => Part::Discharge,
            Part::Discharge => return Err(BrokenRule::Grounding),
            Part::Rest if new == first => return self.begin(expected, at),
            Part::Rest if is_off => Part::Rest,
            Part::Rest => return Err(BrokenRule::Phase),
        };
        Ok(())
    }

    /// Checks the distances of a pulse that begins at `at`, and starts its account.
    fn begin(&mut self, expected: &Expected, at: Micros) -> Result<(), BrokenRule> {
        let spec = expected.train.spec();
        let since = |then: Micros| (at - then).us().cast_unsigned();
        if self.pulses == 0 || since(self.burst) >= expected.min_period_us {
            (self.burst, self.pulses) = (at, 1);
        } else if self.pulses < spec.burst_count
            && since(self.pulse) >= u32::from(spec.burst_interval_us)
        {
            self.pulses = self.pulses.saturating_add(1);
        } else {
            return Err(BrokenRule::Spacing);
        }
        (self.pulse, self.part) = (at, Part::First);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
