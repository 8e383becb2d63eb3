//! The rules between the parts, and the setup that follows from parts that satisfy them all.

use super::{Draft, Mistake, Part, Rule, validate_channel};
use crate::control::{Endpoint, ForceControl, Joint, JointSpec};
use crate::device::part::{ControlPart, Muscle};
use crate::haptics::{Modulation, ModulationError, ModulationSpec, Wall, WallSpec};
use crate::limb::{LimbSpec, LineSpec};
use crate::muscle::MuscleSpec;
use crate::pulse::{CHANNELS, GroupError, TrainSpec};
use crate::range::OutOfRange;
use crate::safety::{Channel, Setup, SetupError, Sums, check_group, opposed_pairs};
use crate::units::Amplitude;
use heapless::Vec;

impl Draft {
    /// Checks all parts again, together. Passes each mistake to `found`, until `found` returns an
    /// error. A rule between parts is checked only for parts that are valid by themselves. Without
    /// a mistake, the result is the setup for the pulser, and every controller and model can be
    /// built from its specification in [`Self::parts`].
    ///
    /// # Errors
    /// Returns the error of `found`.
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
            Err(e) => return found(Mistake::in_part(Part::Wearer)(e)).map(|()| None),
        };
        let mut channels: [Option<Channel>; CHANNELS] = [None; CHANNELS];
        let specs = self.channels.iter().zip(&self.forces);
        for (index, (slot, (spec, force))) in (0u8..).zip(channels.iter_mut().zip(specs)) {
            let Some(spec) = spec else { continue };
            match validate_channel(spec, force.as_ref(), &wearer) {
                Ok(channel) => *slot = Some(channel),
                Err(e) => found(Mistake::in_part(Part::Channel(index))(e))?,
            }
            self.check_stage(index, spec).or_else(&mut found)?;
            if spec.train.repeats != 0 && self.controlled_channels() & 1 << index != 0 {
                found(Mistake::in_part(Part::Channel(index))(
                    Rule::CountedControlled,
                ))?; // <= 9
            }
        }
        if self.used_channels() == 0 {
            found(Mistake::in_part(Part::Setup)(Rule::NothingToArm))?;
        }
        let sums = Sums::of(&channels);
        let together = sums.check(&wearer).map_err(SetupError::Sum);
        together.map_or_else(|e| found(Mistake::in_part(Part::Setup)(e)), Ok)?;
        self.examine_joint_and_wall(&mut found)?;
        self.examine_forces(&mut found)?;
        self.examine_limb(&mut found)?;
        self.examine_modulations(&mut found)?;
        if let Some(sync) = self.sync
            && self.used_channels() & 1 << sync == 0
        {
            found(Mistake::in_part(Part::Sync)(Rule::NoTrain {
                channel: sync,
            }))?; // sync <= 9
        }
        for part in self.parts() {
            part.map_or_else(&mut found, |_| Ok(()))?;
        }
        let used = self.used_channels();
        let trains = channels.map(|channel| channel.map(|c| c.train));
        let mut groups = Vec::new();
        for spec in &self.groups {
            match check_group(spec, &channels, &trains) {
                Ok(group) => {
                    let _ = groups.push(group); // as many as there are specs
                }
                // A train that is present but invalid has been reported already.
                Err(GroupError::NoTrain { channel }) if used & 1 << channel != 0 => {} // <= 9
                Err(e) => found(Mistake::in_part(Part::Groups)(SetupError::Group(e)))?,
            }
        }
        if !self.stages.may_oppose() {
            for (channel, other) in opposed_pairs(&channels, &groups) {
                found(Mistake::in_part(Part::Setup)(SetupError::Opposed {
                    channel,
                    other,
                }))?;
            }
        }
        Ok(is_sound.then_some(Setup {
            wearer,
            channels,
            sums,
            groups,
            sync: self.sync,
            controlled: self.controlled_channels(),
        }))
    }

    /// Returns the channels that the joint, the wall, the arm or force control drives, bit i for
    /// channel i. A host may not set their amplitudes.
    #[must_use]
    pub fn controlled_channels(&self) -> u16 {
        let forces = (0u8..)
            .zip(&self.forces)
            .filter(|(_, force)| force.is_some());
        let forces = forces.map(|(channel, _)| channel);
        let channels = forces.chain(self.lines.iter().map(|line| line.channel));
        channels.fold(self.angle_driven_channels(), |mask, channel| {
            mask | 1 << channel
        }) // below 10
    }

    /// Returns the channels of the joint, of the wall and of joints whose stimulation follows
    /// their angles, bit i for channel i.
    fn angle_driven_channels(&self) -> u16 {
        let joint = self.joint.iter().flat_map(JointSpec::points);
        let wall = self.wall.iter().flat_map(WallSpec::demands);
        let modulated = self.modulations.iter().flatten();
        let modulated = modulated.flat_map(ModulationSpec::muscles);
        let channels = joint
            .map(|p| p.channel)
            .chain(wall.map(|(channel, ..)| channel))
            .chain(modulated.map(|muscle| muscle.channel));
        channels.fold(0, |mask, channel| mask | 1 << channel) // at most 9
    }

    /// Returns the controller's setup part by part; one part is built at a time.
    pub(in crate::device) fn parts(&self) -> impl Iterator<Item = Result<ControlPart, Mistake>> {
        let periods = self
            .channels
            .map(|spec| spec.map_or(0, |s| s.train.period_us));
        let channels = core::iter::once(Ok(ControlPart::Channels {
            channels: self.used_channels(),
            live_widths: self.live_width_channels(),
            periods_us: periods,
        }));
        let tables = self.tables.iter();
        let muscles = (0u8..).zip(self.muscles.iter().zip(tables));
        let muscles = muscles.filter_map(|(channel, (muscle, table))| {
            Some(self.muscle(channel, muscle.as_ref()?, table.as_ref()))
        });
        let joint = self.joint.iter().map(|spec| {
            let joint = Joint::new(spec).map_err(Mistake::in_part(Part::Joint));
            Ok(ControlPart::Joint(joint?))
        });
        let wall = self.wall.iter().map(|spec| {
            let wall = Wall::new(spec).map_err(Mistake::in_part(Part::Wall));
            Ok(ControlPart::Wall(wall?))
        });
        let endpoint = self.endpoint.iter();
        let endpoint = endpoint.map(|spec| Ok(ControlPart::Limb(*spec)));
        let modulations = self.modulations.iter().flatten();
        let modulations = modulations.map(|spec| {
            let part = Part::Modulation(spec.joint);
            // Its shares were checked when it was set: checking four joints twice more would take
            // longer than the watchdog allows.
            let joint = Modulation::from_checked(spec).map_err(Mistake::in_part(part));
            Ok(ControlPart::Modulation(joint?))
        });
        let guided = joint.chain(wall).chain(endpoint).chain(modulations);
        channels.chain(muscles).chain(guided)
    }

    /// Returns a channel's muscle and its force table, if the muscle model can follow the
    /// channel's bursts.
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
                return Err(Mistake::in_part(part)(Rule::WidthChanges));
            }
            let follows = spec.force.check_train(train.burst_count, train.period_us);
            follows.map_err(Mistake::in_part(part))?;
        }
        let (force, recruitment) = spec.validate().map_err(Mistake::in_part(part))?;
        let muscle = Muscle {
            channel,
            recruitment,
            force,
        };
        let control = table.cloned().transpose();
        let control = control.map_err(Mistake::in_part(Part::Force(channel)))?;
        Ok(ControlPart::Muscle(muscle, control))
    }

    /// Returns the channels whose pulse width may change, bit i for channel i.
    fn live_width_channels(&self) -> u16 {
        let channels = (0u8..).zip(&self.channels); // below 10
        channels.fold(0, |live, (index, spec)| {
            let is_live = spec
                .as_ref()
                .is_some_and(|spec| has_live_width(&spec.train));
            live | u16::from(is_live) << index
        })
    }

    /// Returns the lines of action of the arm, by rising channel.
    pub(in crate::device) fn lines(&self) -> &[LineSpec] {
        &self.lines
    }

    /// Returns the channels with a train, bit i for channel i.
    fn used_channels(&self) -> u16 {
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
            self.check_limit(Part::Joint, demand)
                .map_or_else(&mut *found, Ok)?;
        }
        let Some(wall) = &self.wall else {
            return Ok(());
        };
        // The device measures one angle, for a joint or for a wall.
        if let Some(joint) = &self.joint {
            let mut channels = wall.demands().map(|(channel, ..)| channel);
            let shared = channels.find(|c| joint.points().any(|point| point.channel == *c));
            found(Mistake::in_part(Part::Wall)(Rule::JointAndWall { shared }))?;
        }
        for demand in wall.demands() {
            self.check_limit(Part::Wall, demand)
                .map_or_else(&mut *found, Ok)?;
        }
        Ok(())
    }

    /// Checks the channels under force control.
    fn examine_forces<E>(&self, found: &mut impl FnMut(Mistake) -> Result<(), E>) -> Result<(), E> {
        let guided = self.angle_driven_channels();
        for (channel, (spec, muscle)) in (0u8..).zip(self.forces.iter().zip(&self.muscles)) {
            if spec.is_none() {
                continue;
            }
            let part = Part::Force(channel);
            match muscle {
                None => found(Mistake::in_part(part)(Rule::NoMuscle))?,
                Some(muscle) => {
                    let demand = (channel, muscle.recruitment.limit, "limit");
                    self.check_limit(part, demand)
                        .map_or_else(&mut *found, Ok)?;
                }
            }
            if guided & 1 << channel != 0 {
                found(Mistake::in_part(part)(Rule::Controlled))?; // below 10
            }
        }
        Ok(())
    }

    /// Checks the arm's channels, and that the arm has channels.
    fn examine_limb<E>(&self, found: &mut impl FnMut(Mistake) -> Result<(), E>) -> Result<(), E> {
        if self.endpoint.is_none() && self.lines.is_empty() {
            return Ok(());
        }
        let is_beside = self.joint.is_some() || self.wall.is_some();
        // At most 10.
        let count = LimbSpec::LINE_COUNT.check(self.lines.len() as i64);
        count.or_else(|e| found(Mistake::in_part(Part::Limb)(e)))?;
        // Building succeeds if the parts are valid by themselves.
        let built = self.endpoint.map(|spec| Endpoint::new(&spec, &self.lines));
        if let (true, Some(Err(e))) = (count.is_ok(), built) {
            found(Mistake::in_part(Part::Limb)(e))?;
        }
        for (is_wrong, rule) in [
            (self.endpoint.is_none(), Rule::NoLimb),
            (is_beside, Rule::JointAndLimb),
        ] {
            if is_wrong {
                found(Mistake::in_part(Part::Limb)(rule))?;
            }
        }
        for line in &self.lines {
            let part = Part::Line(line.channel);
            let demand = (line.channel, line.limit, "limit");
            self.check_limit(part, demand)
                .map_or_else(&mut *found, Ok)?;
            let forces = self.forces.get(usize::from(line.channel));
            let is_driven = self.angle_driven_channels() & 1 << line.channel != 0; // below 10
            if is_driven || forces.is_some_and(Option::is_some) {
                found(Mistake::in_part(part)(Rule::Controlled))?;
            }
        }
        Ok(())
    }

    /// Checks the joints whose stimulation follows their angles: the joint that determines the
    /// phase of each exists, no channel belongs to two muscles, and no channel exceeds its limit
    /// at any angle.
    fn examine_modulations<E>(
        &self,
        found: &mut impl FnMut(Mistake) -> Result<(), E>,
    ) -> Result<(), E> {
        let is_beside = self.joint.is_some() || self.wall.is_some();
        let is_beside = is_beside || self.endpoint.is_some() || !self.lines.is_empty();
        let mut taken = 0u16;
        for spec in self.modulations.iter().flatten() {
            let part = Part::Modulation(spec.joint);
            if is_beside {
                found(Mistake::in_part(part)(Rule::JointAndModulation))?;
            }
            let mut joints = self.modulations.iter().flatten();
            if !joints.any(|modulation_spec| modulation_spec.joint == spec.phase_joint) {
                let joint = spec.phase_joint;
                found(Mistake::in_part(part)(Rule::NoPhaseJoint { joint }))?;
            }
            for channel in spec.muscles().map(|muscle| muscle.channel) {
                let bit = 1 << channel; // at most 9
                if taken & bit != 0 {
                    let twice = ModulationError::ChannelTwice { channel };
                    found(Mistake::in_part(part)(twice))?;
                }
                taken |= bit;
            }
            for demand in spec.demands() {
                self.check_limit(part, demand)
                    .map_or_else(&mut *found, Ok)?;
            }
        }
        Ok(())
    }

    /// Checks that `part` finds its channel and asks for no more than the channel's limit.
    fn check_limit(
        &self,
        part: Part,
        (channel, amplitude, field): (u8, Amplitude, &'static str),
    ) -> Result<(), Mistake> {
        let config = self.channels.get(usize::from(channel)).copied().flatten();
        let limit = match config {
            None => return Err(Mistake::in_part(part)(Rule::NoTrain { channel })),
            Some(config) => config.limit,
        };
        if amplitude > limit {
            return Err(Mistake::in_part(part)(Rule::AboveLimit {
                channel,
                field,
                limit,
            }));
        }
        Ok(())
    }
}

/// Returns whether a setpoint may ask for a width other than the train's own.
const fn has_live_width(train: &TrainSpec) -> bool {
    train.max_width_us > train.width_us
}
