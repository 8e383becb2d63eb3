//! Renders windows: a sweep over every channel's next edge, in time order.

use super::plan::{Change, Levels, PulseStart, State, WindowPlan};
use super::{CHANNELS, Group, MAX_GROUPS, Partner, TRIGGER_DELAY_US, Train, WINDOW_US};
use crate::units::{DacCode, Micros};
use heapless::Vec;

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

/// How far the trains of a [`Scheduler`] are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Progress {
    /// Every train has played; never with a train that waits for triggers.
    pub finished: bool,
    /// No channel is inside a pulse or its grounding.
    pub resting: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Phase {
    /// Waiting for the next pulse of `due`.
    Rest,
    First,
    Gap,
    Second,
    Grounding,
    /// Grounding that another member's pulse interrupts (isolated group).
    Interrupted,
    /// A triggered train has played; until its period is over, the next
    /// trigger would pulse faster than the limits were checked for.
    Recovering,
}

#[derive(Clone, Copy, Debug)]
struct Lane {
    train: Train,
    phase: Phase,
    /// The next edge. `None`: no edge before a trigger, another member or a
    /// new start.
    due: Option<Micros>,
    burst_start: Micros,
    /// Pulse of the burst that `due` starts (or that is under way).
    pulse: u8,
    /// Amplitude of the burst; `None` if it is left out.
    code: Option<DacCode>,
    bursts_left: u16,
    /// Grounding that a partner's pulse can leave behind in an isolated group:
    /// counts as part of this lane's pulse when it must end in time.
    tail_us: u16,
    /// The latest pulses, newest first: three can lie in a rendered but unplayed
    /// horizon of two windows, the fourth is under way.
    recent: [Option<PulseStart>; 4],
}

/// All channels' trains under way. Small state, no time of its own.
#[derive(Debug)]
pub struct Scheduler {
    lanes: [Option<Lane>; CHANNELS],
    groups: Vec<Group, MAX_GROUPS>,
    sync: Option<u8>,
    base: Levels,
    levels: Levels,
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
            levels: Levels::ISOLATED,
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

    /// How far the trains are.
    #[must_use]
    pub fn progress(&self) -> Progress {
        let lanes = || self.lanes.iter().flatten();
        Progress {
            finished: self.next.is_none() && !lanes().any(|lane| lane.train.spec().triggered),
            resting: lanes().all(|lane| matches!(lane.phase, Phase::Rest | Phase::Recovering)),
        }
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
        let end = start.plus(WINDOW_US);
        while let Some(now) = self.next.filter(|next| next.is_before(end)) {
            // 0 <= slot < 250 after the check, so the cast is exact.
            let slot = now.since(start);
            if slot < 0 {
                return Err(RenderError::Late);
            }
            self.advance_to(now, supply, plan)?;
            let levels = self.current_levels();
            if levels != self.levels {
                self.levels = levels;
                let change = Change {
                    slot: slot as u8,
                    levels,
                };
                plan.changes.push(change).map_err(|_| RenderError::Full)?;
            }
            self.refresh_next();
        }
        Ok(())
    }

    /// Takes every lane whose edge is `now` through it, then settles which
    /// groundings are interrupted.
    fn advance_to(
        &mut self,
        now: Micros,
        supply: &mut impl Supply,
        plan: &mut WindowPlan,
    ) -> Result<(), RenderError> {
        for (channel, lane) in self.lanes.iter_mut().enumerate() {
            let Some(lane) = lane.as_mut().filter(|lane| lane.due == Some(now)) else {
                continue;
            };
            // channel < 10 fits u8.
            lane.edge(channel as u8, now, supply, plan)?;
        }
        for index in 0..self.groups.len() {
            let Some(group) = self.groups.get(index).copied() else {
                break;
            };
            if group.partner() == Partner::Isolated {
                self.settle_grounding(group, now);
            }
        }
        Ok(())
    }

    fn settle_grounding(&mut self, group: Group, now: Micros) {
        let pulsing = self.pulsing(group.members());
        for (channel, lane) in self.lanes.iter_mut().enumerate() {
            let Some(lane) = lane
                .as_mut()
                .filter(|_| group.members() & 1 << channel != 0)
            else {
                continue;
            };
            if lane.phase == Phase::Grounding && pulsing != 0 {
                (lane.phase, lane.due) = (Phase::Interrupted, None);
            } else if lane.phase == Phase::Interrupted && pulsing == 0 {
                lane.phase = Phase::Grounding;
                lane.due = Some(now.plus(lane.train.spec().ground_us.into()));
            }
        }
    }

    /// Members of `mask` between their first and last driven edge.
    fn pulsing(&self, mask: u16) -> u16 {
        let mut pulsing = 0;
        for (channel, lane) in self.lanes.iter().enumerate() {
            if lane.is_some_and(|lane| lane.is_pulsing()) {
                pulsing |= 1 << channel;
            }
        }
        pulsing & mask
    }

    fn current_levels(&self) -> Levels {
        let mut levels = self.base;
        for (channel, lane) in self.lanes.iter().enumerate() {
            if let Some(state) = lane.as_ref().and_then(Lane::state) {
                levels = levels.with(channel, state);
            }
            if self.sync.is_some_and(|s| usize::from(s) == channel)
                && lane.is_some_and(|lane| lane.phase == Phase::First)
            {
                levels.0 |= Levels::SYNC;
            }
        }
        for group in &self.groups {
            let pulsing = self.pulsing(group.members());
            if pulsing == 0 || group.partner() == Partner::Isolated {
                continue; // silent members of an isolated group are isolated already
            }
            for channel in (0..CHANNELS).filter(|c| group.members() & !pulsing & 1 << c != 0) {
                levels = levels.with(channel, State::Grounded);
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

impl Lane {
    const fn waiting(train: Train) -> Self {
        Self {
            train,
            phase: Phase::Rest,
            due: None,
            burst_start: Micros(0),
            pulse: 0,
            code: None,
            bursts_left: 0,
            tail_us: 0,
            recent: [None; 4],
        }
    }

    /// Charge that a truncation at `at` leaves, in DAC-code·µs, anodic positive.
    /// A monophasic pulse counts in full until its grounding is over.
    fn residual(&self, at: Micros) -> i32 {
        let width = i32::from(self.train.spec().width_us);
        let second = width + i32::from(self.train.gap_us());
        let biphasic = self.train.spec().shape.is_biphasic();
        let under_way = self.recent.iter().flatten().find_map(|pulse| {
            let t = at.since(pulse.at);
            let end = self.train.occupied_us().cast_signed(); // at most 20 500 µs
            (0..end)
                .contains(&t)
                .then_some((t, i32::from(pulse.code.0)))
        });
        let Some((t, code)) = under_way else { return 0 };
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

    fn begin(&mut self, epoch: Micros) {
        self.phase = Phase::Rest;
        self.burst_start = epoch.plus(self.train.spec().offset_us);
        self.due = Some(self.burst_start);
        self.pulse = 0;
        self.bursts_left = self.train.spec().repeats;
    }

    /// Whether a train that begins at `epoch` follows this one's end.
    fn is_free(&self, epoch: Micros) -> bool {
        match (self.phase, self.due) {
            (Phase::Rest, None) => true,
            (Phase::Recovering, Some(over)) => epoch.has_reached(over),
            _ => false,
        }
    }

    const fn is_pulsing(&self) -> bool {
        matches!(self.phase, Phase::First | Phase::Gap | Phase::Second)
    }

    /// The lane's own state; `None` where it leaves the channel alone.
    const fn state(&self) -> Option<State> {
        let cathodic = self.train.spec().shape.cathodic_first();
        match self.phase {
            Phase::Rest | Phase::Recovering => None,
            Phase::First => Some(if cathodic {
                State::Cathodic
            } else {
                State::Anodic
            }),
            Phase::Gap | Phase::Interrupted => Some(State::Isolated),
            Phase::Second => Some(if cathodic {
                State::Anodic
            } else {
                State::Cathodic
            }),
            Phase::Grounding => Some(State::Grounded),
        }
    }

    fn edge(
        &mut self,
        channel: u8,
        now: Micros,
        supply: &mut impl Supply,
        plan: &mut WindowPlan,
    ) -> Result<(), RenderError> {
        let spec = *self.train.spec();
        match self.phase {
            Phase::Rest => return self.start_pulse(channel, now, supply, plan),
            Phase::First if spec.shape.is_biphasic() => {
                self.go(Phase::Gap, now, self.train.gap_us());
            }
            Phase::First => self.go(Phase::Grounding, now, spec.ground_us),
            Phase::Gap => self.go(Phase::Second, now, spec.width_us),
            Phase::Second | Phase::Grounding | Phase::Interrupted => self.rest(),
            Phase::Recovering => (self.phase, self.due) = (Phase::Rest, None),
        }
        Ok(())
    }

    fn go(&mut self, phase: Phase, now: Micros, length_us: u16) {
        self.phase = phase;
        self.due = Some(now.plus(length_us.into()));
    }

    fn start_pulse(
        &mut self,
        channel: u8,
        now: Micros,
        supply: &mut impl Supply,
        plan: &mut WindowPlan,
    ) -> Result<(), RenderError> {
        if self.pulse == 0 {
            self.code = supply.burst(channel, now);
            if let Some(code) = self.code {
                plan.dac
                    .push((channel, code))
                    .map_err(|_| RenderError::Full)?;
            }
        }
        let end = now.plus(self.train.occupied_us() + u32::from(self.tail_us));
        match self.code {
            Some(code) if supply.may_pulse(channel, end) => {
                let pulse = PulseStart {
                    channel,
                    at: now,
                    code,
                };
                plan.pulses.push(pulse).map_err(|_| RenderError::Full)?;
                let [first, second, third, _] = self.recent;
                self.recent = [Some(pulse), first, second, third];
                self.go(Phase::First, now, self.train.spec().width_us);
            }
            _ => self.rest(),
        }
        Ok(())
    }

    /// After a pulse, played or left out: on to the next of the burst, the
    /// next burst, or the end of the train.
    fn rest(&mut self) {
        let spec = self.train.spec();
        self.phase = Phase::Rest;
        self.pulse = self.pulse.saturating_add(1);
        if self.pulse < spec.burst_count {
            self.due = Some(
                self.burst_start
                    .plus(self.train.pulse_offset_us(self.pulse)),
            );
            return;
        }
        self.pulse = 0;
        if self.bursts_left == 1 {
            self.due = spec.triggered.then(|| {
                self.phase = Phase::Recovering;
                self.burst_start.plus(spec.period_us)
            });
            return;
        }
        self.bursts_left = self.bursts_left.saturating_sub(1); // 0 stays: endless
        self.burst_start = self.burst_start.plus(spec.period_us);
        self.due = Some(self.burst_start);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Shape, TrainSpec, train::tests::PLAIN};
    use super::*;

    struct Always;
    impl Supply for Always {
        fn burst(&mut self, _: u8, _: Micros) -> Option<DacCode> {
            Some(DacCode(1000))
        }
        fn may_pulse(&mut self, _: u8, _: Micros) -> bool {
            true
        }
    }

    fn edges(
        specs: &[TrainSpec],
        groups: &[Group],
        windows: u32,
        epoch: Micros,
    ) -> std::vec::Vec<(i32, Levels)> {
        let mut trains = [None; CHANNELS];
        for (train, spec) in trains.iter_mut().zip(specs) {
            *train = Some(spec.validate().unwrap());
        }
        let mut scheduler = Scheduler::new();
        scheduler.start(&trains, groups, Some(0), epoch);
        let mut plan = WindowPlan::new();
        let mut out = std::vec::Vec::new();
        for k in 0..windows {
            let start = epoch.plus(k * WINDOW_US);
            scheduler.render(start, &mut Always, &mut plan).unwrap();
            for c in &plan.changes {
                out.push((start.plus(c.slot.into()).since(epoch), c.levels));
            }
        }
        out
    }

    #[test]
    fn biphasic_edges_fall_on_their_microsecond_across_the_wrap() {
        let spec = TrainSpec {
            offset_us: 130,
            ..PLAIN
        };
        let s = |state| Levels::ISOLATED.with(0, state);
        let sync = |l: Levels| Levels(l.0 | Levels::SYNC);
        for epoch in [Micros(0), Micros(u32::MAX - 150)] {
            assert_eq!(
                edges(&[spec], &[], 100, epoch),
                [
                    (130, sync(s(State::Cathodic))),
                    (330, Levels::ISOLATED),
                    (430, s(State::Anodic)),
                    (630, Levels::ISOLATED),
                    (20_130, sync(s(State::Cathodic))),
                    (20_330, Levels::ISOLATED),
                    (20_430, s(State::Anodic)),
                    (20_630, Levels::ISOLATED),
                ]
            );
        }
    }

    #[test]
    fn an_interrupted_grounding_starts_again() {
        let mono = TrainSpec {
            shape: Shape::MonophasicCathodic,
            gap_us: 0,
            ground_us: 1000,
            ..PLAIN
        };
        let other = TrainSpec {
            offset_us: 700,
            ..mono
        };
        let mut trains = [None; CHANNELS];
        trains[0] = Some(mono.validate().unwrap());
        trains[1] = Some(other.validate().unwrap());
        let spec = super::super::GroupSpec {
            members: 3,
            partner: Partner::Isolated,
        };
        let groups = super::super::check_groups(&[spec], &trains).unwrap();
        let states: std::vec::Vec<_> = edges(&[mono, other], &groups, 79, Micros(0))
            .into_iter()
            .map(|(t, l)| (t, l.state(0), l.state(1)))
            .collect();
        use State::*;
        assert_eq!(
            states,
            [
                (0, Cathodic, Isolated),
                (200, Grounded, Isolated),
                (700, Isolated, Cathodic),
                (900, Grounded, Grounded),
                (1900, Isolated, Isolated),
            ]
        );
    }

    #[test]
    fn a_missed_window_is_an_error() {
        let mut trains = [None; CHANNELS];
        trains[0] = Some(PLAIN.validate().unwrap());
        let mut scheduler = Scheduler::new();
        scheduler.start(&trains, &[], None, Micros(0));
        let late = scheduler.render(Micros(250), &mut Always, &mut WindowPlan::new());
        assert_eq!(late, Err(RenderError::Late));
    }

    #[test]
    fn a_trigger_starts_a_prepared_train_once() {
        let spec = TrainSpec {
            triggered: true,
            repeats: 1,
            ..PLAIN
        };
        let mut trains = [None; CHANNELS];
        trains[4] = Some(spec.validate().unwrap());
        let mut scheduler = Scheduler::new();
        scheduler.start(&trains, &[], None, Micros(0));
        let mut plan = WindowPlan::new();
        scheduler.render(Micros(0), &mut Always, &mut plan).unwrap();
        assert!(plan.changes.is_empty() && !scheduler.progress().finished);
        assert_eq!(scheduler.trigger(Micros(77)), 1);
        assert_eq!(scheduler.trigger(Micros(99)), 0);
        let mut starts = std::vec::Vec::new();
        for k in 1..400 {
            scheduler
                .render(Micros(k * 250), &mut Always, &mut plan)
                .unwrap();
            starts.extend(plan.pulses.iter().map(|p| p.at));
        }
        assert_eq!(starts, [Micros(1077)]);
    }
}
