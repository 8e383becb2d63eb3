//! The progress of one channel's train: phases of a pulse, pulses of a burst, and bursts.

mod changes;
mod seals;
#[cfg(test)]
mod tests;

use super::{BurstTime, EventQueue, Picture, RenderError, Supply};
use crate::pulse::Train;
use crate::pulse::plan::{Levels, PulseStart, State, WindowPlan};
use crate::seal::Checksum;
use crate::units::{DacCode, Micros, us};
use core::num::{NonZeroU16, NonZeroU32};

#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub(super) enum Phase {
    /// Waiting for the next pulse at `due`.
    Rest,
    /// In one of the stretches of a pulse, see [`PulsePart`].
    Pulsing,
    /// In a grounding that another member's pulse interrupts (isolated group).
    Interrupted,
    /// After a triggered train has played, until its period is over. A trigger before that would
    /// cause pulses at a higher rate than the limits were checked for.
    Recovering,
}

/// Index of the stretch that grounds a biphasic pulse; a monophasic pulse is over before it.
const GROUNDING: u8 = 3;

/// A stretch of a pulse during which the outputs do not change: a phase, the gap between two
/// phases, or the grounding.
#[derive(Clone, Copy, Debug, Hash)]
struct PulsePart {
    shows: Picture,
    length_us: NonZeroU16,
}

/// A pulse that has begun, kept to compute residual charge.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Recent {
    start: Micros,
    code: DacCode,
    width_us: u16,
}

/// Progress of the train of one channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lane {
    pub(super) train: Train,
    pub(super) phase: Phase,
    /// The lane's part of the picture now; disconnected whenever the lane does not determine the
    /// channel's state.
    pub(super) shows: Picture,
    /// Stretches of each pulse of the burst: first phase, gap, second phase; or phase, grounding.
    /// A grounding after the second phase is derived from both phases, as most trains have none.
    stretches: [Option<PulsePart>; 3],
    /// Index of the stretch in progress.
    stretch: u8,
    /// Time of the next edge. `None`: no edge before a trigger, another member's pulse or a new
    /// start.
    pub(super) due: Option<Micros>,
    pub(super) burst_start: Micros,
    /// Time from burst start to burst start from now on, µs.
    pub(super) period_us: u32,
    /// Time from the start of the previous burst to `burst_start`, µs; 0 for the first burst of a
    /// train.
    pub(super) since_burst_us: u32,
    /// Time from this burst to the next, µs, if it differs from the period; else 0.
    next_us: u32,
    /// Index in the burst of the pulse that starts at `due` (or is in progress).
    pub(super) pulse: u8,
    /// DAC code of the burst; `None` if it is left out.
    pub(super) code: Option<DacCode>,
    pub(super) bursts_left: u16,
    /// Grounding that another member's pulse can delay in an isolated group, µs. It counts as part
    /// of this lane's pulse when the pulse must end in time.
    pub(super) tail_us: u16,
    /// The latest pulses, in a ring: at most three in the two windows that are rendered but not
    /// played yet, and one in progress. Pulses of a lane do not overlap, so their sequence does not
    /// matter; code 0 means no pulse.
    pub(super) recent: [Recent; 4],
    /// Index of the oldest entry of `recent`, modulo 4.
    pub(super) oldest: u8,
    /// Checksum over the state that changes from edge to edge.
    seal: Checksum,
    /// Checksum over train, stretches and tail, which are set once.
    train_seal: Checksum,
}

impl Lane {
    /// Returns a lane on `channel` that waits for its start. If `sync`, it drives the sync output.
    pub(super) fn new_waiting(train: Train, channel: usize, sync: bool) -> Self {
        let sync = if sync { Levels::SYNC } else { 0 };
        let width_us = train.spec().width_us;
        let cathodic = Picture::pulsing_in(channel, State::Cathodic);
        let anodic = Picture::pulsing_in(channel, State::Anodic);
        let (first, second) = if train.spec().shape.cathodic_first() {
            (cathodic, anodic)
        } else {
            (anodic, cathodic)
        };
        let stretch = |picture, length_us| {
            Some(PulsePart {
                shows: Picture(picture),
                length_us: NonZeroU16::new(length_us)?,
            })
        };
        let stretches = if train.spec().shape.is_biphasic() {
            let gap = Picture::pulsing_in(channel, State::Isolated);
            [
                stretch(first.0 | sync, width_us),
                stretch(gap.0, train.gap_us()),
                stretch(second.0, width_us),
            ]
        } else {
            let grounded = Levels::ISOLATED.with_channel(channel, State::Grounded);
            [
                stretch(first.0 | sync, width_us),
                stretch(grounded.0, train.spec().ground_us),
                None,
            ]
        };
        Self {
            train,
            phase: Phase::Rest,
            shows: Picture::ISOLATED,
            stretches,
            stretch: 0,
            due: None,
            burst_start: Micros::new(0),
            period_us: train.spec().period_us,
            since_burst_us: 0,
            next_us: 0,
            pulse: 0,
            code: None,
            bursts_left: 0,
            tail_us: 0,
            recent: [Recent::default(); 4],
            oldest: 0,
            seal: Checksum::default(),
            train_seal: Checksum::default(),
        }
    }

    /// Returns the charge that remains if pulses are truncated at `at`, in DAC-code·µs, anodic
    /// positive. A monophasic pulse counts in full until its grounding is over.
    pub(super) fn residual_charge(&self, at: Micros) -> i32 {
        let biphasic = self.train.spec().shape.is_biphasic();
        let under_way = self.recent.iter().find_map(|pulse| {
            let t = (at - pulse.start).us();
            let end = self.train.occupied_us(pulse.width_us).cast_signed(); // at most 21 200 µs
            (pulse.code.get() != 0 && (0..end).contains(&t)).then_some((t, pulse))
        });
        let Some((t, pulse)) = under_way else {
            return 0;
        };
        let (code, width) = (i32::from(pulse.code.get()), i32::from(pulse.width_us));
        let second = width + i32::from(self.train.gap_us());
        let balance = if biphasic {
            (t - second).clamp(0, width)
        } else {
            0
        };
        // At most 500 µs · 65 535.
        let net = (t.min(width) - balance) * code;
        if self.train.spec().shape.cathodic_first() {
            -net
        } else {
            net
        }
    }

    pub(super) fn begin(&mut self, epoch: Micros) {
        self.phase = Phase::Rest;
        self.burst_start = epoch + us(self.train.spec().offset_us);
        self.due = Some(self.burst_start);
        self.since_burst_us = 0;
        self.pulse = 0;
        self.bursts_left = self.train.spec().repeats;
    }

    /// Returns whether the train's previous run is over at `epoch`, so that it may start again
    /// then.
    pub(super) fn is_free(&self, epoch: Micros) -> bool {
        match (self.phase, self.due) {
            (Phase::Rest, None) => true,
            (Phase::Recovering, Some(over)) => epoch.has_reached(over),
            _ => false,
        }
    }

    /// Ends a train that plays: no burst begins at `end` or later, which is less than a period
    /// ahead; the burst in progress is completed. Returns whether the train was playing.
    pub(super) fn end_at(&mut self, end: Micros) -> bool {
        let is_between = self.phase == Phase::Rest && self.pulse == 0;
        if self.due.is_none() && is_between || self.phase == Phase::Recovering {
            return false;
        }
        // Time from the burst in progress, or the next burst, to the first that is still
        // undecided.
        let after = us(if is_between { 0 } else { self.period_us });
        let one_more = (self.burst_start + after).is_before(end);
        let left = u16::from(!is_between) + u16::from(one_more);
        if left == 0 {
            // Between bursts, the last period is over when the next burst would begin.
            (self.phase, self.due) = (Phase::Recovering, Some(self.burst_start));
        } else if self.bursts_left == 0 || self.bursts_left > left {
            self.bursts_left = left;
        }
        true
    }

    /// Advances this lane, which depends on no other lane, through the window of `agenda`.
    #[inline(always)]
    pub(super) fn advance(
        &mut self,
        channel: u8,
        agenda: &mut EventQueue,
        supply: &mut impl Supply,
        plan: &mut WindowPlan,
    ) -> Result<(), RenderError> {
        while let Some(now) = self.due
            && let Some(slot) = agenda.slot(now)
        {
            let old = self.shows;
            self.perform_edge(channel, now, supply, plan)?;
            agenda.insert(slot, old.0 ^ self.shows.0);
        }
        Ok(())
    }

    /// Performs the edge at `now`, the time of `due`.
    #[inline(always)]
    pub(super) fn perform_edge(
        &mut self,
        channel: u8,
        now: Micros,
        supply: &mut impl Supply,
        plan: &mut WindowPlan,
    ) -> Result<(), RenderError> {
        match self.phase {
            // At most 3 + 1.
            Phase::Pulsing => self.begin_stretch(self.stretch + 1, now),
            Phase::Rest => return self.start_pulse(channel, now, supply, plan),
            Phase::Interrupted => self.schedule_next(),
            Phase::Recovering => (self.phase, self.due) = (Phase::Rest, None),
        }
        Ok(())
    }

    /// Begins the stretch of this index, or after the last stretch waits for the next pulse.
    #[inline]
    fn begin_stretch(&mut self, stretch: u8, now: Micros) {
        if let Some(Some(next)) = self.stretches.get(usize::from(stretch)) {
            self.shows = next.shows;
            self.due = Some(now + us(next.length_us.get().into()));
            self.stretch = stretch;
        } else if stretch == GROUNDING && self.train.spec().ground_us != 0 {
            self.ground(now);
        } else {
            self.schedule_next();
        }
    }

    /// Grounds the channel after the second phase.
    #[inline(never)]
    fn ground(&mut self, now: Micros) {
        // Both lines of the channel, which the two phases raise one each, and nothing else.
        let lines = self
            .stretches
            .iter()
            .flatten()
            .fold(0, |a, s| a | s.shows.0);
        self.shows = Picture(lines & !Picture::PULSING & !Levels::SYNC);
        self.due = Some(now + us(self.train.spec().ground_us.into()));
        self.stretch = GROUNDING;
    }

    /// Updates the grounding of a member of an isolated group at `now`: another member's pulse
    /// interrupts it, and it begins again once no member pulses.
    pub(super) fn update_grounding(&mut self, now: Micros, pulsing: bool) {
        let is_grounding = self.phase == Phase::Pulsing && self.shows.pulsing() == 0;
        if is_grounding && pulsing {
            (self.phase, self.shows) = (Phase::Interrupted, Picture::ISOLATED);
            self.due = None;
        } else if self.phase == Phase::Interrupted && !pulsing {
            self.phase = Phase::Pulsing;
            self.begin_stretch(self.stretch, now);
        }
    }

    #[inline(never)]
    fn start_pulse(
        &mut self,
        channel: u8,
        now: Micros,
        supply: &mut impl Supply,
        plan: &mut WindowPlan,
    ) -> Result<(), RenderError> {
        if self.pulse == 0 {
            if !self.train_seal.matches(&self.fixed()) {
                return Err(RenderError::Memory);
            }
            let time = BurstTime {
                at: now,
                period_us: self.period_us,
                opens: self.since_burst_us == 0,
            };
            let burst = supply.burst(channel, time);
            self.code = burst.code;
            if self.train.spec().lists {
                self.next_us = supply.burst_interval_us(channel).map_or(0, NonZeroU32::get);
            }
            self.set_width(burst.width_us);
            if let Some(code) = self.code {
                plan.dac
                    .push((channel, code))
                    .map_err(|_| RenderError::Full)?;
            }
        }
        let width_us = self.width_us();
        let end = now + us(self.train.occupied_us(width_us) + u32::from(self.tail_us));
        match self.code {
            Some(code) if supply.may_pulse(channel, end) => {
                let pulse = PulseStart {
                    channel,
                    at: now,
                    code,
                    width_us,
                };
                plan.pulses.push(pulse).map_err(|_| RenderError::Full)?;
                if let Some(oldest) = self.recent.get_mut(usize::from(self.oldest % 4)) {
                    *oldest = Recent {
                        start: now,
                        code,
                        width_us,
                    };
                }
                self.oldest = self.oldest.wrapping_add(1); // 256 is whole rings
                self.phase = Phase::Pulsing;
                self.begin_stretch(0, now);
            }
            _ => self.schedule_next(),
        }
        Ok(())
    }

    /// Continues after a pulse that was played or left out: with the next pulse of the burst, the
    /// next burst, or the end of the train.
    #[inline(never)]
    fn schedule_next(&mut self) {
        let spec = self.train.spec();
        (self.phase, self.shows) = (Phase::Rest, Picture::ISOLATED);
        self.pulse = self.pulse.saturating_add(1);
        if self.pulse < spec.burst_count {
            self.due = Some(self.burst_start + us(self.train.pulse_offset_us(self.pulse)));
            return;
        }
        self.pulse = 0;
        if self.bursts_left == 1 {
            self.due = spec.trigger.is_some().then(|| {
                self.phase = Phase::Recovering;
                self.burst_start + us(self.period_us)
            });
            return;
        }
        self.bursts_left = self.bursts_left.saturating_sub(1); // 0 stays: endless
        let interval_us = match self.next_us {
            0 => self.period_us,
            next_us => next_us,
        };
        self.since_burst_us = interval_us;
        self.burst_start += us(interval_us);
        self.due = Some(self.burst_start);
    }
}
