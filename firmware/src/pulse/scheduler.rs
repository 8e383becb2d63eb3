//! Renders windows: from edge to edge of all channels, in time order.

use super::plan::{Change, Levels, WindowPlan};
use super::{CHANNELS, Group, MAX_GROUPS, Partner, TRIGGER_DELAY_US, Train, WINDOW_US};
use crate::units::{DacCode, Micros};
use heapless::Vec;

mod agenda;
mod lane;
#[cfg(test)]
mod tests;

use agenda::Agenda;
use lane::{Lane, Phase};

/// What the scheduler asks before it pulses. `safety` answers; a refusal means
/// silence, never a smaller pulse.
pub trait Supply {
    /// Amplitude for a whole burst on `channel` that starts at `at`; `None`
    /// leaves it out.
    fn burst(&mut self, channel: u8, at: Micros) -> Option<DacCode>;
    /// Whether a pulse may still start that has its last edge at `end`.
    fn may_pulse(&mut self, channel: u8, end: Micros) -> bool;
}

/// Why a window could not be rendered. Either is a fault: outputs isolate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum RenderError {
    /// An edge lies before the window: a refill was missed.
    Late,
    /// More edges than a window can hold; excluded by validation.
    Full,
}

/// All channels' trains under way. Small state, no time of its own.
#[derive(Debug)]
pub struct Scheduler {
    lanes: [Option<Lane>; CHANNELS],
    groups: Vec<Group, MAX_GROUPS>,
    sync: Option<u8>,
    base: Levels,
    /// What each lane asks for on its own channel, kept up to date edge by edge.
    own: Levels,
    /// Channels between their first and last driven edge, kept likewise.
    pulsing: u16,
    /// What the outputs are at: `own`, and what groups make of it.
    levels: Levels,
    agenda: Agenda,
    /// Earliest `due` of all lanes, so that an idle window costs one compare.
    next: Option<Micros>,
}

impl Default for Scheduler {
    fn default() -> Self {
        Self::new()
    }
}

impl Scheduler {
    /// Without trains: everything isolated.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            lanes: [None; CHANNELS],
            groups: Vec::new(),
            sync: None,
            base: Levels::ISOLATED,
            own: Levels::ISOLATED,
            pulsing: 0,
            levels: Levels::ISOLATED,
            agenda: Agenda::new(),
            next: None,
        }
    }

    /// Drops every train and isolates every channel.
    pub fn clear(&mut self) {
        *self = Self::new();
    }

    /// Drops every train and holds all channels grounded until the next call.
    pub fn ground_all(&mut self) {
        self.clear();
        self.base = Levels::GROUNDED;
        self.own = Levels::GROUNDED;
        self.levels = Levels::GROUNDED;
    }

    /// Starts `trains` at `epoch`, which must not lie before the next window;
    /// triggered trains wait. `sync` names the channel that drives sync out.
    pub fn start(
        &mut self,
        trains: &[Option<Train>; CHANNELS],
        groups: &[Group],
        sync: Option<u8>,
        epoch: Micros,
    ) {
        self.clear();
        self.groups.extend(groups.iter().copied().take(MAX_GROUPS));
        self.sync = sync;
        for (lane, train) in self.lanes.iter_mut().zip(trains) {
            *lane = train.map(|train| {
                let mut lane = Lane::waiting(train);
                if !train.spec().triggered {
                    lane.begin(epoch);
                }
                lane
            });
        }
        for group in groups.iter().filter(|g| g.partner() == Partner::Isolated) {
            let members = || (0..CHANNELS).filter(|c| group.members() & 1 << c != 0);
            let ground = |c: usize| {
                trains
                    .get(c)
                    .copied()
                    .flatten()
                    .map_or(0, |t| t.spec().ground_us)
            };
            let tail_us = members().map(ground).max().unwrap_or(0);
            for channel in members() {
                if let Some(Some(lane)) = self.lanes.get_mut(channel) {
                    lane.tail_us = tail_us;
                }
            }
        }
        self.refresh_next();
    }

    /// Charge left on each channel if everything is isolated at `at`, which
    /// lies in a rendered window: DAC-code·µs, anodic positive.
    #[must_use]
    pub fn residual(&self, at: Micros) -> [i32; CHANNELS] {
        self.lanes
            .map(|lane| lane.map_or(0, |lane| lane.residual(at)))
    }

    /// A trigger edge captured at `at`: prepared trains start
    /// [`TRIGGER_DELAY_US`] later, plus their offset. Returns how many of
    /// them; trains whose last period is not over are left alone, and so is an
    /// isolated group with such a train, whose distances hold from one trigger.
    pub fn trigger(&mut self, at: Micros) -> usize {
        let epoch = at.plus(TRIGGER_DELAY_US);
        let mut busy = 0u16;
        for (channel, lane) in self.lanes.iter().enumerate() {
            let is_busy = lane.as_ref().is_some_and(|lane| !lane.is_free(epoch));
            busy |= u16::from(is_busy) << channel; // below 16
        }
        for group in &self.groups {
            if group.partner() == Partner::Isolated && group.members() & busy != 0 {
                busy |= group.members();
            }
        }
        let mut started = 0;
        for (channel, lane) in self.lanes.iter_mut().enumerate() {
            if let Some(lane) = lane
                && lane.train.spec().triggered
                && busy & 1 << channel == 0
            {
                lane.begin(epoch);
                started += 1;
            }
        }
        self.refresh_next();
        started
    }

    /// Width of one phase on `channel`, µs; 0 without a train.
    #[must_use]
    pub fn phase_width_us(&self, channel: u8) -> u16 {
        let lane = self.lanes.get(usize::from(channel)).copied().flatten();
        lane.map_or(0, |lane| lane.train.spec().width_us)
    }

    /// Whether every train has played; never with one that waits for triggers.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        let mut lanes = self.lanes.iter().flatten();
        self.next.is_none() && !lanes.any(|lane| lane.train.spec().triggered)
    }

    /// Whether no channel is inside a pulse or its grounding.
    #[must_use]
    pub fn is_resting(&self) -> bool {
        let mut lanes = self.lanes.iter().flatten();
        lanes.all(|lane| matches!(lane.phase, Phase::Rest | Phase::Recovering))
    }

    /// Renders the window at `start` into `plan`.
    ///
    /// # Errors
    /// [`RenderError`]; `plan` must then not be played.
    pub fn render(
        &mut self,
        start: Micros,
        supply: &mut impl Supply,
        plan: &mut WindowPlan,
    ) -> Result<(), RenderError> {
        plan.reset(start, self.levels);
        let Some(next) = self.next.filter(|n| n.is_before(start.plus(WINDOW_US))) else {
            return Ok(());
        };
        if next.is_before(start) {
            return Err(RenderError::Late);
        }
        self.agenda.begin(start);
        for (channel, lane) in self.lanes.iter().enumerate() {
            if let Some(due) = lane.as_ref().and_then(|lane| lane.due) {
                self.agenda.enter(due, channel);
            }
        }
        while let Some((slot, channels)) = self.agenda.next() {
            self.advance(start.plus(slot.into()), channels, supply, plan)?;
            let levels = self.grouped(self.own);
            if levels != self.levels {
                self.levels = levels;
                plan.changes
                    .push(Change { slot, levels })
                    .map_err(|_| RenderError::Full)?;
            }
        }
        self.refresh_next();
        Ok(())
    }

    /// Takes `channels` through their edges of `now`, then settles which
    /// groundings that interrupts or resumes.
    fn advance(
        &mut self,
        now: Micros,
        channels: u16,
        supply: &mut impl Supply,
        plan: &mut WindowPlan,
    ) -> Result<(), RenderError> {
        for channel in bits(channels) {
            if let Some(Some(lane)) = self.lanes.get_mut(channel) {
                // channel < 10 fits u8.
                lane.edge(channel as u8, now, supply, plan)?;
                if let Some(due) = lane.due {
                    self.agenda.enter(due, channel);
                }
                self.show(channel);
            }
        }
        for index in 0..self.groups.len() {
            if let Some(group) = self.groups.get(index).copied()
                && group.partner() == Partner::Isolated
                && group.members() & channels != 0
            {
                self.settle_grounding(group, now);
            }
        }
        Ok(())
    }

    fn settle_grounding(&mut self, group: Group, now: Micros) {
        let pulsing = self.pulsing & group.members();
        for channel in bits(group.members()) {
            let Some(Some(lane)) = self.lanes.get_mut(channel) else {
                continue;
            };
            if lane.phase == Phase::Grounding && pulsing != 0 {
                lane.phase = Phase::Interrupted;
                if let Some(due) = lane.due.take() {
                    self.agenda.withdraw(due, channel);
                }
            } else if lane.phase == Phase::Interrupted && pulsing == 0 {
                lane.go(Phase::Grounding, now, lane.train.spec().ground_us);
                if let Some(due) = lane.due {
                    self.agenda.enter(due, channel);
                }
            }
            self.show(channel);
        }
    }

    /// Brings what is known of all lanes up to date with one of them.
    fn show(&mut self, channel: usize) {
        let Some(Some(lane)) = self.lanes.get(channel) else {
            return;
        };
        let state = lane.state().unwrap_or(self.base.state(channel));
        self.own = self.own.with(channel, state);
        if self.sync == Some(channel as u8) {
            let high = u32::from(lane.phase == Phase::First) * Levels::SYNC;
            self.own.0 = self.own.0 & !Levels::SYNC | high;
        }
        let pulsing = u16::from(lane.is_pulsing()) << (channel % 16);
        self.pulsing = self.pulsing & !(1 << (channel % 16)) | pulsing;
    }

    /// `levels` with the silent members of pulsing groups grounded. Those of an
    /// isolated group are isolated already.
    fn grouped(&self, mut levels: Levels) -> Levels {
        for group in &self.groups {
            let pulsing = self.pulsing & group.members();
            if pulsing != 0 && group.partner() == Partner::Conducted {
                levels.0 |= Levels::grounded(group.members() & !pulsing).0;
            }
        }
        levels
    }

    fn refresh_next(&mut self) {
        let mut next: Option<Micros> = None;
        for due in self.lanes.iter().flatten().filter_map(|lane| lane.due) {
            if next.is_none_or(|n| due.is_before(n)) {
                next = Some(due);
            }
        }
        self.next = next;
    }
}

/// Positions of the bits of `mask`, lowest first.
fn bits(mut mask: u16) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        let lowest = (mask != 0).then(|| mask.trailing_zeros() as usize);
        mask &= mask.wrapping_sub(1);
        lowest
    })
}
