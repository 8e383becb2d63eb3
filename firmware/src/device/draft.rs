//! The setup that a host edits, one part at a time, and arms as a whole; and the
//! rules between its parts, which stand nowhere else.

mod requests;

use super::mistake::{Mistake, Part, Rule};
use super::part::{ControlPart, Muscle};
use crate::control::{ForceControl, ForceSpec, Joint, JointSpec};
use crate::haptics::{Wall, WallSpec};
use crate::muscle::{MuscleSpec, Recruitment};
use crate::pulse::{CHANNELS, GroupError, GroupSpec, MAX_GROUPS, TrainSpec, check_members};
use crate::range::{OutOfRange, Range};
use crate::safety::{
    Channel, ChannelSpec, Setup, SetupError, Stages, Sums, Wearer, WearerSpec, check_group,
};
use crate::units::Amplitude;
use heapless::Vec;

/// What a host has configured so far.
///
/// Every part is checked by itself when it is set; [`Self::examine`] checks all
/// together. The device refuses by the first [`Mistake`]; a host that wants to tell
/// all of them, before it sends any, asks the same draft.
///
/// ```
/// use firmware::device::{Draft, Part, Rule};
/// use std::convert::Infallible;
///
/// let mut draft = Draft::default();
/// draft.set_sync(Some(3)).unwrap();
/// let mut rules = Vec::new();
/// let setup = draft.examine(|mistake| {
///     rules.push((mistake.part, mistake.rule));
///     Ok::<(), Infallible>(())
/// });
/// assert!(setup.unwrap().is_none());
/// let no_train = (Part::Sync, Rule::NoTrain { channel: 3 });
/// assert_eq!(rules, [(Part::Setup, Rule::NothingToArm), no_train]);
/// ```
#[derive(Clone, Debug)]
pub struct Draft {
    /// What every channel's stage is held against.
    stages: Stages,
    wearer: WearerSpec,
    groups: Vec<GroupSpec, MAX_GROUPS>,
    sync: Option<u8>,
    joint: Option<JointSpec>,
    wall: Option<WallSpec>,
    channels: [Option<ChannelSpec>; CHANNELS],
    muscles: [Option<MuscleSpec>; CHANNELS],
    forces: [Option<ForceSpec>; CHANNELS],
    /// What the three above come to, wherever all are there. A table takes some
    /// 80,000 cycles, and with the most steps and rates below the train's at most 2
    /// ms (rows `inverse_table` and `inverse_table_slow` of docs/charts/cycles.csv):
    /// each is made with the request that completes or changes it, so that arming
    /// makes none.
    tables: [Option<Result<ForceControl, OutOfRange>>; CHANNELS],
}

impl Default for Draft {
    /// For a device that takes any stage.
    fn default() -> Self {
        Self::on(Stages::AsDeclared)
    }
}

/// What the channel of `spec` is for this wearer; with a `force` at every rate that it
/// may ask for.
///
/// # Errors
/// The first limit that it exceeds.
pub fn channel_of(
    spec: &ChannelSpec,
    force: Option<&ForceSpec>,
    wearer: &Wearer,
) -> Result<Channel, SetupError> {
    match force {
        Some(force) => spec.validate_rates(force.min_period_us, force.max_period_us, wearer),
        None => spec.validate(wearer),
    }
}

/// Of a channel's number.
const CHANNEL: Range = Range::new("channel", 0, CHANNELS as i32 - 1);

/// The parts, each checked by itself: the errors are of the part, or of the number
/// of its channel. A part that is refused leaves the one before.
#[expect(clippy::missing_errors_doc, reason = "said once for all")]
impl Draft {
    /// An empty draft for a device with these stages.
    #[must_use]
    pub fn on(stages: Stages) -> Self {
        Self {
            stages,
            wearer: WearerSpec::default(),
            groups: Vec::new(),
            sync: None,
            joint: None,
            wall: None,
            channels: [None; CHANNELS],
            muscles: [None; CHANNELS],
            forces: [None; CHANNELS],
            tables: [const { None }; CHANNELS],
        }
    }

    /// Forgets everything but the stages, in place.
    pub fn clear(&mut self) {
        self.wearer = WearerSpec::default();
        self.groups.clear();
        (self.sync, self.joint, self.wall) = (None, None, None);
        self.channels.fill(None);
        self.muscles.fill(None);
        self.forces.fill(None);
        for table in &mut self.tables {
            *table = None;
        }
    }

    /// The wearer's limits; [`WearerSpec::default`] until set.
    pub fn set_wearer(&mut self, spec: WearerSpec) -> Result<(), Mistake> {
        spec.validate().map_err(Mistake::of(Part::Wearer))?;
        self.wearer = spec;
        Ok(())
    }

    /// A channel's pulses, within the wearer's limits of now.
    pub fn set_channel(&mut self, channel: u8, spec: ChannelSpec) -> Result<(), Mistake> {
        let wearer = self.wearer.validate().map_err(Mistake::of(Part::Wearer))?;
        let checked = spec.validate(&wearer);
        checked.map_err(Mistake::of(Part::Channel(channel)))?;
        self.check_stage(channel, &spec)?;
        *slot(&mut self.channels, channel)? = Some(spec);
        self.tabulate(channel)
    }

    /// The muscle under a channel.
    pub fn set_muscle(&mut self, channel: u8, spec: MuscleSpec) -> Result<(), Mistake> {
        let checked = spec.validate();
        checked.map_err(Mistake::of(Part::Muscle(channel)))?;
        *slot(&mut self.muscles, channel)? = Some(spec);
        self.tabulate(channel)
    }

    /// Force control of a channel.
    pub fn set_force(&mut self, channel: u8, spec: ForceSpec) -> Result<(), Mistake> {
        let checked = spec.check();
        checked.map_err(Mistake::of(Part::Force(channel)))?;
        *slot(&mut self.forces, channel)? = Some(spec);
        self.tabulate(channel)
    }

    /// Which channels share a muscle.
    pub fn set_groups(&mut self, groups: Vec<GroupSpec, MAX_GROUPS>) -> Result<(), Mistake> {
        let checked = check_members(&groups).map_err(SetupError::Group);
        checked.map_err(Mistake::of(Part::Groups))?;
        self.groups = groups;
        Ok(())
    }

    /// The channel that drives sync out.
    pub fn set_sync(&mut self, channel: Option<u8>) -> Result<(), Mistake> {
        channel.map_or(Ok(()), check_channel)?;
        self.sync = channel;
        Ok(())
    }

    /// The controlled joint.
    pub fn set_joint(&mut self, spec: JointSpec) -> Result<(), Mistake> {
        Joint::new(&spec).map_err(Mistake::of(Part::Joint))?;
        self.joint = Some(spec);
        Ok(())
    }

    /// The virtual wall.
    pub fn set_wall(&mut self, spec: WallSpec) -> Result<(), Mistake> {
        Wall::new(&spec).map_err(Mistake::of(Part::Wall))?;
        self.wall = Some(spec);
        Ok(())
    }

    /// Holds a channel's declared stage against the board's.
    fn check_stage(&self, channel: u8, spec: &ChannelSpec) -> Result<(), Mistake> {
        let checked = self.stages.check(channel, &spec.stage);
        let checked = checked.map_err(SetupError::from);
        checked.map_err(Mistake::of(Part::Channel(channel)))
    }

    fn tabulate(&mut self, channel: u8) -> Result<(), Mistake> {
        let spec = slot(&mut self.channels, channel)?;
        let muscle = slot(&mut self.muscles, channel)?;
        if let (Some(spec), Some(muscle), Some(force)) =
            (spec, muscle, slot(&mut self.forces, channel)?)
        {
            let control = Recruitment::new(muscle.recruitment).and_then(|recruitment| {
                let period_us = spec.train.period_us;
                ForceControl::new(channel, force, muscle.force, recruitment, period_us)
            });
            *slot(&mut self.tables, channel)? = Some(control);
        }
        Ok(())
    }
}

impl Draft {
    /// Checks everything again, together. Hands each mistake to `found`, until that
    /// answers with an error; a rule between parts is held only against parts that
    /// are sound by themselves. What comes of no mistake is what the pulser works
    /// with; what the controller works with are the [`Self::parts`], all of which
    /// can be built then.
    ///
    /// # Errors
    /// Those of `found`.
    pub fn examine<E>(
        &self,
        mut found: impl FnMut(Mistake) -> Result<(), E>,
    ) -> Result<Option<Setup>, E> {
        let mut is_sound = true;
        let mut found = |mistake| {
            is_sound = false;
            found(mistake)
        };
        let wearer = match self.wearer.validate() {
            Ok(wearer) => wearer,
            Err(e) => return found(Mistake::of(Part::Wearer)(e)).map(|()| None),
        };
        let mut channels: [Option<Channel>; CHANNELS] = [None; CHANNELS];
        let specs = self.channels.iter().zip(&self.forces);
        for (index, (slot, (spec, force))) in (0u8..).zip(channels.iter_mut().zip(specs)) {
            let Some(spec) = spec else { continue };
            match channel_of(spec, force.as_ref(), &wearer) {
                Ok(channel) => *slot = Some(channel),
                Err(e) => found(Mistake::of(Part::Channel(index))(e))?,
            }
            self.check_stage(index, spec).or_else(&mut found)?;
        }
        if self.used() == 0 {
            found(Mistake::of(Part::Setup)(Rule::NothingToArm))?;
        }
        let sums = Sums::of(&channels);
        let together = sums.check(&wearer).map_err(SetupError::Sum);
        together.map_or_else(|e| found(Mistake::of(Part::Setup)(e)), Ok)?;
        self.examine_joint_and_wall(&mut found)?;
        self.examine_forces(&mut found)?;
        if let Some(sync) = self.sync
            && self.used() & 1 << sync == 0
        {
            found(Mistake::of(Part::Sync)(Rule::NoTrain { channel: sync }))?; // sync <= 9
        }
        for part in self.parts() {
            part.map_or_else(&mut found, |_| Ok(()))?;
        }
        let used = self.used();
        let trains = channels.map(|channel| channel.map(|c| c.train));
        let mut groups = Vec::new();
        for spec in &self.groups {
            match check_group(spec, &channels, &trains) {
                Ok(group) => {
                    let _ = groups.push(group); // as many as there are specs
                }
                // Of a train that is there, but not sound, everything has been told.
                Err(GroupError::NoTrain { channel }) if used & 1 << channel != 0 => {} // <= 9
                Err(e) => found(Mistake::of(Part::Groups)(SetupError::Group(e)))?,
            }
        }
        Ok(is_sound.then_some(Setup {
            wearer,
            channels,
            sums,
            groups,
            sync: self.sync,
            controlled: self.controlled(),
        }))
    }

    /// Channels that the joint, the wall or force control drives, as bits: a host
    /// may not.
    #[must_use]
    pub fn controlled(&self) -> u16 {
        let forces = (0u8..)
            .zip(&self.forces)
            .filter(|(_, force)| force.is_some());
        forces.fold(self.guided(), |mask, (channel, _)| mask | 1 << channel) // below 10
    }

    /// Channels of the joint and of the wall, as bits.
    fn guided(&self) -> u16 {
        let joint = self.joint.iter().flat_map(JointSpec::points);
        let wall = self.wall.iter().flat_map(WallSpec::demands);
        let all = joint
            .map(|p| p.channel)
            .chain(wall.map(|(channel, ..)| channel));
        all.fold(0, |mask, channel| mask | 1 << channel) // at most 9
    }

    /// What the controller works with; one is built at a time.
    pub(super) fn parts(&self) -> impl Iterator<Item = Result<ControlPart, Mistake>> {
        let periods = self
            .channels
            .map(|spec| spec.map_or(0, |s| s.train.period_us));
        let channels = core::iter::once(Ok(ControlPart::Channels {
            channels: self.used(),
            live_widths: self.live_widths(),
            periods_us: periods,
        }));
        let tables = self.tables.iter();
        let muscles = (0u8..).zip(self.muscles.iter().zip(tables));
        let muscles = muscles.filter_map(|(channel, (muscle, table))| {
            Some(self.muscle(channel, muscle.as_ref()?, table.as_ref()))
        });
        let joint = self.joint.iter().map(|spec| {
            let joint = Joint::new(spec).map_err(Mistake::of(Part::Joint));
            Ok(ControlPart::Joint(joint?))
        });
        let wall = self.wall.iter().map(|spec| {
            let wall = Wall::new(spec).map_err(Mistake::of(Part::Wall));
            Ok(ControlPart::Wall(wall?))
        });
        channels.chain(muscles).chain(joint).chain(wall)
    }

    /// A muscle, if its model can follow its channel's bursts, and its table.
    fn muscle(
        &self,
        channel: u8,
        spec: &MuscleSpec,
        table: Option<&Result<ForceControl, OutOfRange>>,
    ) -> Result<ControlPart, Mistake> {
        let part = Part::Muscle(channel);
        if let Some(Some(channel)) = self.channels.get(usize::from(channel)) {
            let train = &channel.train;
            if has_live_width(train) {
                return Err(Mistake::of(part)(Rule::WidthChanges));
            }
            let follows = spec.force.check_train(train.burst_count, train.period_us);
            follows.map_err(Mistake::of(part))?;
        }
        let (force, recruitment) = spec.validate().map_err(Mistake::of(part))?;
        let muscle = Muscle {
            channel,
            recruitment,
            force,
        };
        let control = table.cloned().transpose();
        let control = control.map_err(Mistake::of(Part::Force(channel)))?;
        Ok(ControlPart::Muscle(muscle, control))
    }

    /// Channels whose pulse width may change, as bits.
    fn live_widths(&self) -> u16 {
        let channels = (0u8..).zip(&self.channels); // below 10
        channels.fold(0, |live, (index, spec)| {
            let is_live = spec
                .as_ref()
                .is_some_and(|spec| has_live_width(&spec.train));
            live | u16::from(is_live) << index
        })
    }

    /// Channels with a train, as bits.
    fn used(&self) -> u16 {
        let channels = (0u8..).zip(&self.channels); // below 10
        channels.fold(0, |used, (index, spec)| {
            used | u16::from(spec.is_some()) << index
        })
    }

    /// Checks the channels of the joint or the wall.
    fn examine_joint_and_wall<E>(
        &self,
        found: &mut impl FnMut(Mistake) -> Result<(), E>,
    ) -> Result<(), E> {
        for point in self.joint.iter().flat_map(JointSpec::points) {
            let demand = (point.channel, point.max, "max");
            self.within_limit(Part::Joint, demand)
                .map_or_else(&mut *found, Ok)?;
        }
        let Some(wall) = &self.wall else {
            return Ok(());
        };
        // The device measures one angle, for a joint or for a wall.
        if let Some(joint) = &self.joint {
            let mut channels = wall.demands().map(|(channel, ..)| channel);
            let shared = channels.find(|c| joint.points().any(|point| point.channel == *c));
            found(Mistake::of(Part::Wall)(Rule::JointAndWall { shared }))?;
        }
        for demand in wall.demands() {
            self.within_limit(Part::Wall, demand)
                .map_or_else(&mut *found, Ok)?;
        }
        Ok(())
    }

    /// Checks the channels under force control.
    fn examine_forces<E>(&self, found: &mut impl FnMut(Mistake) -> Result<(), E>) -> Result<(), E> {
        let guided = self.guided();
        for (channel, (spec, muscle)) in (0u8..).zip(self.forces.iter().zip(&self.muscles)) {
            if spec.is_none() {
                continue;
            }
            let part = Part::Force(channel);
            match muscle {
                None => found(Mistake::of(part)(Rule::NoMuscle))?,
                Some(muscle) => {
                    let demand = (channel, muscle.recruitment.limit, "limit");
                    self.within_limit(part, demand)
                        .map_or_else(&mut *found, Ok)?;
                }
            }
            if guided & 1 << channel != 0 {
                found(Mistake::of(part)(Rule::Controlled))?; // below 10
            }
        }
        Ok(())
    }

    /// Checks that `part` finds its channel and asks for no more than its limit.
    fn within_limit(
        &self,
        part: Part,
        (channel, amplitude, field): (u8, Amplitude, &'static str),
    ) -> Result<(), Mistake> {
        let config = self.channels.get(usize::from(channel)).copied().flatten();
        let limit = match config {
            None => return Err(Mistake::of(part)(Rule::NoTrain { channel })),
            Some(config) => config.limit,
        };
        if amplitude > limit {
            return Err(Mistake::of(part)(Rule::AboveLimit {
                channel,
                field,
                limit,
            }));
        }
        Ok(())
    }
}

/// Whether a setpoint may ask for another width than the train's own.
const fn has_live_width(train: &TrainSpec) -> bool {
    train.max_width_us > train.width_us
}

/// The draft's slot of a channel that a host named.
fn slot<T>(slots: &mut [Option<T>; CHANNELS], channel: u8) -> Result<&mut Option<T>, Mistake> {
    check_channel(channel)?;
    let none = Mistake::of(Part::Setup)(Rule::NothingToArm); // the number was just checked
    slots.get_mut(usize::from(channel)).ok_or(none)
}

/// Checks the number of a channel that a host named.
pub(super) fn check_channel(channel: u8) -> Result<(), Mistake> {
    CHANNEL.check(channel).map_err(Mistake::of(Part::Setup))
}
