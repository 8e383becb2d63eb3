//! The setup that a host edits, one request at a time, and arms as a whole.

use super::Muscle;
use super::mail::ControlPart;
use crate::control::{ForceControl, ForceSpec, Joint, JointSpec};
use crate::haptics::{Wall, WallSpec};
use crate::link::{Code, Refusal};
use crate::muscle::{MuscleSpec, OutOfRange, Recruitment};
use crate::pulse::{CHANNELS, GroupSpec, MAX_GROUPS};
use crate::safety::{Channel, ChannelSpec, Setup, WearerSpec};
use crate::units::Amplitude;
use heapless::Vec;

/// What a host has configured so far.
#[derive(Debug, Default)]
pub(super) struct Draft {
    pub(super) wearer: WearerSpec,
    pub(super) groups: Vec<GroupSpec, MAX_GROUPS>,
    pub(super) sync: Option<u8>,
    pub(super) joint: Option<JointSpec>,
    pub(super) wall: Option<WallSpec>,
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

impl Draft {
    /// Forgets everything, in place.
    pub(super) fn clear(&mut self) {
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

    /// Gives a channel its pulses.
    pub(super) fn set_channel(
        &mut self,
        channel: u8,
        spec: ChannelSpec,
    ) -> Result<(), Refusal<'static>> {
        *slot(&mut self.channels, channel)? = Some(spec);
        self.tabulate(channel)
    }

    /// Gives a channel a muscle.
    pub(super) fn set_muscle(
        &mut self,
        channel: u8,
        spec: MuscleSpec,
    ) -> Result<(), Refusal<'static>> {
        *slot(&mut self.muscles, channel)? = Some(spec);
        self.tabulate(channel)
    }

    /// Puts a channel under force control.
    pub(super) fn set_force(
        &mut self,
        channel: u8,
        spec: ForceSpec,
    ) -> Result<(), Refusal<'static>> {
        *slot(&mut self.forces, channel)? = Some(spec);
        self.tabulate(channel)
    }

    fn tabulate(&mut self, channel: u8) -> Result<(), Refusal<'static>> {
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

    /// Checks everything again, together, and builds what the pulser works with.
    /// What the controller works with are the [`Self::parts`], all of which can
    /// be built then.
    pub(super) fn check(&self) -> Result<Setup, Refusal<'static>> {
        let wearer = self.wearer.validate()?;
        let mut channels: [Option<Channel>; CHANNELS] = [None; CHANNELS];
        let specs = self.channels.iter().zip(&self.forces);
        for (index, (slot, (spec, force))) in (0u8..).zip(channels.iter_mut().zip(specs)) {
            let Some(spec) = spec else { continue };
            let channel = match force {
                Some(force) => {
                    spec.validate_rates(force.min_period_us, force.max_period_us, &wearer)
                }
                None => spec.validate(&wearer),
            };
            *slot = Some(channel.map_err(|e| Refusal::from(e).on(index))?);
        }
        if self.used() == 0 {
            return Err(Refusal::new(Code::NothingToArm, "channels"));
        }
        let joint_or_wall = self.check_joint_and_wall(&channels)?;
        let controlled = joint_or_wall | self.check_forces(&channels, joint_or_wall)?;
        if let Some(sync) = self.sync
            && self.used() & 1 << sync == 0
        {
            return Err(Refusal::new(Code::NoTrain, "sync").on(sync)); // sync <= 9
        }
        for part in self.parts() {
            part?;
        }
        Ok(Setup::new(
            wearer,
            channels,
            &self.groups,
            self.sync,
            controlled,
        )?)
    }

    /// What the controller works with; one is built at a time.
    pub(super) fn parts(&self) -> impl Iterator<Item = Result<ControlPart, Refusal<'static>>> {
        let periods = self
            .channels
            .map(|spec| spec.map_or(0, |s| s.train.period_us));
        let channels = core::iter::once(Ok(ControlPart::Channels(self.used(), periods)));
        let tables = self.tables.iter();
        let muscles = (0u8..).zip(self.muscles.iter().zip(tables));
        let muscles = muscles.filter_map(|(channel, (muscle, table))| {
            let spec = muscle.as_ref()?;
            let muscle = self.check_train(channel, spec);
            let muscle = muscle.and_then(|()| Self::muscle(channel, spec, table.as_ref()));
            Some(muscle.map_err(|refusal| refusal.on(channel)))
        });
        let joint = self.joint.iter();
        let joint = joint.map(|spec| Ok(Joint::new(spec).map(ControlPart::Joint)?));
        let wall = self.wall.iter();
        let wall = wall.map(|spec| Ok(Wall::new(spec).map(ControlPart::Wall)?));
        channels.chain(muscles).chain(joint).chain(wall)
    }

    /// Whether a muscle's model can follow its channel's bursts.
    fn check_train(&self, channel: u8, spec: &MuscleSpec) -> Result<(), Refusal<'static>> {
        if let Some(Some(channel)) = self.channels.get(usize::from(channel)) {
            let train = &channel.train;
            spec.force.check_train(train.burst_count, train.period_us)?;
        }
        Ok(())
    }

    fn muscle(
        channel: u8,
        spec: &MuscleSpec,
        table: Option<&Result<ForceControl, OutOfRange>>,
    ) -> Result<ControlPart, Refusal<'static>> {
        let (force, recruitment) = spec.validate()?;
        let muscle = Muscle {
            channel,
            recruitment,
            force,
        };
        let control = table.cloned().transpose()?;
        Ok(ControlPart::Muscle(muscle, control))
    }

    /// Channels with a train, as bits.
    fn used(&self) -> u16 {
        let channels = (0u8..).zip(&self.channels); // below 10
        channels.fold(0, |used, (index, spec)| {
            used | u16::from(spec.is_some()) << index
        })
    }

    /// Checks the channels of the joint or the wall. Returns them, as bits.
    fn check_joint_and_wall(
        &self,
        channels: &[Option<Channel>; CHANNELS],
    ) -> Result<u16, Refusal<'static>> {
        let mut controlled = 0;
        if let Some(spec) = &self.joint {
            for point in spec.flexors.iter().chain([&spec.extensor]) {
                within_limit(channels, "joint", (point.channel, point.max, "max"))?;
                controlled |= 1 << point.channel; // a channel that exists
            }
        }
        if let Some(spec) = &self.wall {
            // The device measures one angle, for a joint or for a wall.
            if self.joint.is_some() {
                let refusal = Refusal::new(Code::JointAndWall, "wall");
                let mut channels = spec.demands().map(|(channel, ..)| channel);
                let shared = channels.find(|channel| controlled & 1 << channel != 0); // <= 9
                return Err(shared.map_or(refusal, |channel| refusal.on(channel)));
            }
            for demand in spec.demands() {
                within_limit(channels, "wall", demand)?;
                controlled |= 1 << demand.0; // it exists
            }
        }
        Ok(controlled)
    }

    /// Checks the channels under force control. Returns them, as bits.
    fn check_forces(
        &self,
        channels: &[Option<Channel>; CHANNELS],
        controlled: u16,
    ) -> Result<u16, Refusal<'static>> {
        let mut taken = 0;
        for (channel, (spec, muscle)) in (0u8..).zip(self.forces.iter().zip(&self.muscles)) {
            if spec.is_none() {
                continue;
            }
            let muscle = muscle.ok_or(Refusal::new(Code::NoMuscle, "muscle").on(channel))?;
            within_limit(
                channels,
                "force",
                (channel, muscle.recruitment.limit, "limit"),
            )?;
            if controlled & 1 << channel != 0 {
                return Err(Refusal::new(Code::Controlled, "force").on(channel));
            }
            taken |= 1 << channel; // below 10
        }
        Ok(taken)
    }
}

/// Checks that `user` finds its channel and asks for no more than its limit;
/// a refusal names the field.
fn within_limit(
    channels: &[Option<Channel>; CHANNELS],
    user: &'static str,
    (channel, amplitude, field): (u8, Amplitude, &'static str),
) -> Result<(), Refusal<'static>> {
    let config = channels.get(usize::from(channel)).copied().flatten();
    let limit = config
        .ok_or(Refusal::new(Code::NoTrain, user).on(channel))?
        .limit;
    if amplitude > limit {
        let max = i32::try_from(limit.0).unwrap_or(i32::MAX);
        return Err(Refusal::new(Code::AboveWearerLimit, field)
            .on(channel)
            .allowed(0, max));
    }
    Ok(())
}

/// The draft's slot of a channel that a host named.
fn slot<T>(
    slots: &mut [Option<T>; CHANNELS],
    channel: u8,
) -> Result<&mut Option<T>, Refusal<'static>> {
    slots.get_mut(usize::from(channel)).ok_or(named_channel())
}

/// Checks the number of a channel that a host named.
pub(super) fn check_channel(channel: u8) -> Result<(), Refusal<'static>> {
    if usize::from(channel) < CHANNELS {
        Ok(())
    } else {
        Err(named_channel())
    }
}

fn named_channel() -> Refusal<'static> {
    Refusal::new(Code::OutOfRange, "channel").allowed(0, CHANNELS as i32 - 1)
}
