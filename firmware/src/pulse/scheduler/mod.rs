//! The scheduler, which renders windows from edge to edge of all channels, in the order of time.

use super::plan::{Change, Levels, State, WindowPlan};
use super::{CHANNELS, Group, MAX_GROUPS, Partner, Train, WINDOW_US};
use crate::seal::{CheckSchedule, Checksum};
use crate::units::{Micros, us};
use heapless::Vec;

mod agenda;
mod isolated;
mod lane;
mod memory;
mod supply;
#[cfg(test)]
mod tests;
mod triggers;

use agenda::EventQueue;
use isolated::{advance_together, earliest, next_edge_times};
use lane::{Lane, Phase};
pub use supply::{Burst, BurstTime, Supply};
use triggers::Gate;

/// The middle of a phase of a channel's pulses.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Middle {
    /// Time from the pulse's start to the middle, µs.
    pub after_us: u32,
    /// Whether it is the middle of the second phase.
    pub second: bool,
    /// Half of the phase's width, µs.
    pub half_us: u32,
    /// Time from burst to burst, µs.
    pub period_us: u32,
}

/// The reason why a window could not be rendered. Each one is a fault, which disconnects the
/// outputs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum RenderError {
    /// An edge lies before the window: a refill was missed.
    Late,
    /// The window has more edges than it can hold, which validation excludes.
    Full,
    /// The scheduler's memory changed by itself.
    Memory,
}

/// The combined output of all lanes, updated edge by edge: [`Levels`] in the lower bits, and above
/// them bit 21 + i while channel i is between its first and its last driven edge.
#[derive(Clone, Copy, Debug, Hash)]
struct Picture(u32);

impl Picture {
    const ISOLATED: Self = Self(0);
    const SHIFT: usize = 2 * CHANNELS + 1;
    const PULSING: u32 = ((1 << CHANNELS) - 1) << Self::SHIFT;

    /// Returns a picture in which `channel` (below [`CHANNELS`]) is inside a pulse and in `state`.
    const fn pulsing_in(channel: usize, state: State) -> Self {
        let bit = 1 << (Self::SHIFT + channel % CHANNELS);
        Self(Levels::ISOLATED.with_channel(channel, state).0 | bit)
    }

    const fn levels(self) -> Levels {
        Levels(self.0 & !Self::PULSING)
    }

    /// Returns the channels that are inside a pulse, bit i for channel i.
    const fn pulsing(self) -> u16 {
        (self.0 >> Self::SHIFT) as u16 // ten bits
    }
}

/// Player of the trains of all channels. It has little state and no clock of its own.
#[derive(Clone, Debug)]
pub struct Scheduler {
    lanes: [Option<Lane>; CHANNELS],
    groups: Vec<Group, MAX_GROUPS>,
    picture: Picture,
    /// The output levels at the end of the last rendered window.
    levels: Levels,
    agenda: EventQueue,
    /// Earliest `due` of all lanes, so that an idle window needs only one comparison.
    next: Option<Micros>,
    /// State of the trigger input, for trains that play while it is active.
    gate: Gate,
    /// Checksum over `picture`, `levels`, `next` and `gate`.
    seal: Checksum,
    /// Checksum over `groups`.
    groups_seal: Checksum,
    /// Selects the lane whose memory is verified next. Lanes without an edge take their turn, too.
    turn: CheckSchedule,
}

impl Default for Scheduler {
    fn default() -> Self {
        Self::new()
    }
}

impl Scheduler {
    /// Returns a scheduler without trains, with every channel disconnected.
    #[must_use]
    pub fn new() -> Self {
        let mut new = Self {
            lanes: [None; CHANNELS],
            groups: Vec::new(),
            picture: Picture::ISOLATED,
            levels: Levels::ISOLATED,
            agenda: EventQueue::new(),
            next: None,
            gate: Gate::NONE,
            seal: Checksum::default(),
            groups_seal: Checksum::of(&Vec::<Group, MAX_GROUPS>::new()),
            turn: CheckSchedule::new(0, CHANNELS as u8),
        };
        new.renew_checksum();
        new
    }

    /// Removes every train and disconnects every channel.
    pub fn clear(&mut self) {
        // Cleared in place: a new scheduler would need room on the stack first.
        self.lanes.fill(None);
        self.groups.clear();
        (self.picture, self.levels) = (Picture::ISOLATED, Levels::ISOLATED);
        self.agenda.clear();
        (self.next, self.gate) = (None, Gate::NONE);
        self.groups_seal = Checksum::of(&self.groups);
        self.renew_checksum();
    }

    /// Removes every train and keeps all channels grounded until [`Self::start`] or
    /// [`Self::clear`].
    pub fn ground_all(&mut self) {
        self.clear();
        self.picture = Picture(Levels::GROUNDED.0);
        self.levels = Levels::GROUNDED;
        self.renew_checksum();
    }

    /// Starts `trains` at `epoch`, which must not lie before the next window; triggered trains
    /// wait. `sync` is the channel that drives the sync output.
    pub fn start(
        &mut self,
        trains: &[Option<Train>; CHANNELS],
        groups: &[Group],
        sync: Option<u8>,
        epoch: Micros,
    ) {
        self.clear();
        self.groups.extend(groups.iter().copied().take(MAX_GROUPS));
        for (channel, (lane, train)) in self.lanes.iter_mut().zip(trains).enumerate() {
            *lane = train.map(|train| {
                let drives_sync = sync.is_some_and(|s| usize::from(s) == channel);
                let mut lane = Lane::new_waiting(train, channel, drives_sync);
                if train.spec().trigger.is_none() {
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
        self.groups_seal = Checksum::of(&self.groups);
        self.gate = Gate::for_channels(self.waiting_channels(true));
        for lane in self.lanes.iter_mut().flatten() {
            lane.renew_train_checksum();
            lane.renew_checksum();
        }
        self.refresh_next();
    }

    /// Returns the charge that remains on each channel if everything is disconnected at `at`,
    /// which lies in a rendered window: DAC-code·µs, anodic positive.
    #[must_use]
    pub fn residual_charge(&self, at: Micros) -> [i32; CHANNELS] {
        self.lanes
            .map(|lane| lane.map_or(0, |lane| lane.residual_charge(at)))
    }

    /// Changes the period of `channel` to `period_us` from its next burst on. That burst is moved,
    /// but never into a window before `start`, the next window to be rendered. The caller must
    /// know that the limits allow the period.
    pub fn set_period(&mut self, channel: u8, period_us: u32, start: Micros) {
        let lane = self.lanes.get_mut(usize::from(channel));
        if let Some(Some(lane)) = lane
            && lane.set_period(period_us, start)
        {
            self.refresh_next();
        }
    }

    /// Returns the middle of the first phase of the latest burst's pulses on `channel`, or of
    /// their second phase if `second` is set and they have one; `None` without a train.
    #[inline]
    #[must_use]
    pub fn phase_middle(&self, channel: u8, second: bool) -> Option<Middle> {
        let lane = self.lanes.get(usize::from(channel))?.as_ref()?;
        let spec = lane.train.spec();
        let width_us = u32::from(lane.width_us());
        let second = second && spec.shape.is_biphasic();
        let to_second_us = width_us + u32::from(lane.train.gap_us()); // at most 700
        Some(Middle {
            after_us: width_us / 2 + if second { to_second_us } else { 0 },
            second,
            half_us: width_us / 2,
            period_us: lane.period_us,
        })
    }

    /// Returns whether every train has played; never true with a train that waits for triggers.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        let mut lanes = self.lanes.iter().flatten();
        self.next.is_none() && !lanes.any(|lane| lane.train.spec().trigger.is_some())
    }

    /// Returns whether no channel is inside a pulse or its grounding.
    #[must_use]
    pub fn is_resting(&self) -> bool {
        let mut lanes = self.lanes.iter().flatten();
        lanes.all(|lane| matches!(lane.phase, Phase::Rest | Phase::Recovering))
    }

    /// Returns whether no edge of any channel lies in the window at `start`.
    #[must_use]
    pub fn is_idle(&self, start: Micros) -> bool {
        let end = start + us(WINDOW_US);
        self.next.is_none_or(|next| !next.is_before(end))
    }

    /// Renders the window at `start` into `plan`.
    ///
    /// # Errors
    /// [`RenderError`]; `plan` must then not be played, and nothing may be rendered before trains
    /// start again.
    pub fn render(
        &mut self,
        start: Micros,
        supply: &mut impl Supply,
        plan: &mut WindowPlan,
    ) -> Result<(), RenderError> {
        self.verify_next_checksums()?;
        plan.reset(start, self.levels);
        let Some(next) = self.next.filter(|n| n.is_before(start + us(WINDOW_US))) else {
            return Ok(());
        };
        if next.is_before(start) {
            return Err(RenderError::Late);
        }
        self.render_busy(start, supply, plan)
    }

    /// Renders a window with edges. It is a separate function, so that an idle window stays cheap.
    #[inline(never)]
    fn render_busy(
        &mut self,
        start: Micros,
        supply: &mut impl Supply,
        plan: &mut WindowPlan,
    ) -> Result<(), RenderError> {
        self.agenda.begin(start);
        let open = self.verify_due_lanes()?;
        for group in &self.groups {
            if group.partner() == Partner::Isolated {
                let members = group.members();
                advance_together(&mut self.lanes, members, &mut self.agenda, supply, plan)?;
            }
        }
        let mut next = u32::MAX;
        for (lane, channel) in self.lanes.iter_mut().zip(0..) {
            if let Some(lane) = lane {
                if self.agenda.offset_us(lane.due) < WINDOW_US {
                    lane.advance(channel, &mut self.agenda, supply, plan)?;
                }
                next = next.min(self.agenda.offset_us(lane.due));
            }
        }
        self.next = (next != u32::MAX).then(|| start + us(next));
        for channel in bit_positions(open.into()) {
            if let Some(Some(lane)) = self.lanes.get_mut(channel) {
                lane.renew_checksum();
            }
        }
        if self.groups.iter().all(|g| g.partner() == Partner::Isolated) {
            self.emit(plan, |picture, _| picture.levels())?;
        } else {
            self.emit(plan, levels_with_groups)?;
        }
        self.renew_checksum();
        Ok(())
    }

    /// Applies the changes in the agenda to the picture, and enters the levels that `outputs`
    /// computes from it into the plan.
    fn emit(
        &mut self,
        plan: &mut WindowPlan,
        outputs: impl Fn(Picture, &[Group]) -> Levels,
    ) -> Result<(), RenderError> {
        let (mut picture, mut last) = (self.picture, self.levels);
        let result = self.agenda.drain(|slot, changes| {
            picture.0 ^= changes;
            let levels = outputs(picture, &self.groups);
            if levels == last {
                return Ok(());
            }
            last = levels;
            let change = Change { slot, levels };
            plan.changes.push(change).map_err(|_| RenderError::Full)
        });
        (self.picture, self.levels) = (picture, last);
        result
    }

    #[inline(never)]
    fn refresh_next(&mut self) {
        self.next = earliest(next_edge_times(&self.lanes, u16::MAX));
        self.renew_checksum();
    }
}

/// Returns the levels for a picture, with the rules of groups applied: silent members of a pulsing
/// group are grounded. Members of an isolated group are disconnected already.
fn levels_with_groups(picture: Picture, groups: &[Group]) -> Levels {
    let mut levels = picture.levels();
    for group in groups {
        let pulsing = picture.pulsing() & group.members();
        if pulsing != 0 && group.partner() == Partner::Conducted {
            levels.0 |= Levels::grounded(group.members() & !pulsing).0;
        }
    }
    levels
}

/// Returns the positions of the bits set in `mask`, lowest first.
pub(crate) fn bit_positions(mut mask: u32) -> impl Iterator<Item = usize> + Clone {
    core::iter::from_fn(move || {
        let lowest = mask.trailing_zeros() as usize;
        mask = mask.checked_sub(1)? & mask; // ends without a bit
        Some(lowest)
    })
}
