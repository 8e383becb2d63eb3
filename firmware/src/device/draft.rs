//! The setup that a host edits, one request at a time, and arms as a whole.

use super::{ControlSetup, Muscle};
use crate::control::{FORCE_CHANNELS, ForceControl, ForceSpec, Joint, JointSpec};
use crate::haptics::{Wall, WallSpec};
use crate::link::{Code, Refusal};
use crate::muscle::{MuscleSpec, Recruitment};
use crate::pulse::{CHANNELS, GroupSpec, MAX_GROUPS};
use crate::safety::{Channel, ChannelSpec, Setup, WearerSpec};
use crate::units::Amplitude;
use heapless::Vec;

/// What a host has configured so far.
#[derive(Debug, Default)]
pub(super) struct Draft {
    pub(super) wearer: WearerSpec,
    pub(super) channels: [Option<ChannelSpec>; CHANNELS],
    pub(super) muscles: [Option<MuscleSpec>; CHANNELS],
    pub(super) groups: Vec<GroupSpec, MAX_GROUPS>,
    pub(super) sync: Option<u8>,
    pub(super) joint: Option<JointSpec>,
    pub(super) wall: Option<WallSpec>,
    pub(super) forces: [Option<ForceSpec>; CHANNELS],
}

impl Draft {
    /// Checks everything again, together, and builds what pulser and
    /// controller work with.
    pub(super) fn build(&self) -> Result<(Setup, ControlSetup), Refusal<'static>> {
        let wearer = self.wearer.validate()?;
        let mut channels: [Option<Channel>; CHANNELS] = [None; CHANNELS];
        let mut control = ControlSetup::default();
        for (index, (slot, spec)) in (0u8..).zip(channels.iter_mut().zip(&self.channels)) {
            let Some(spec) = spec else { continue };
            let channel = match self.forces.get(usize::from(index)).copied().flatten() {
                Some(force) => spec.validate_up_to(force.min_period_us, &wearer),
                None => spec.validate(&wearer),
            };
            *slot = Some(channel.map_err(|e| Refusal::from(e).on(index))?);
            control.channels |= 1 << index; // index < 10
        }
        if control.channels == 0 {
            return Err(Refusal::new(Code::NothingToArm, "channels"));
        }
        for (channel, muscle) in (0u8..).zip(&self.muscles) {
            let Some(spec) = muscle else { continue };
            let (force, recruitment) = spec.validate().map_err(|e| Refusal::from(e).on(channel))?;
            let muscle = Muscle {
                channel,
                recruitment,
                force,
            };
            let _ = control.muscles.push(muscle); // as many slots as channels
        }
        let mut controlled = 0;
        if let Some(spec) = &self.joint {
            for point in spec.flexors.iter().chain([&spec.extensor]) {
                within_limit(&channels, "joint", (point.channel, point.max, "max"))?;
                controlled |= 1 << point.channel; // a channel that exists
            }
            control.joint = Some(Joint::new(spec)?);
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
                within_limit(&channels, "wall", demand)?;
            }
            controlled = spec
                .demands()
                .fold(0, |all, (channel, ..)| all | 1 << channel); // they exist
            control.wall = Some(Wall::new(spec)?);
        }
        controlled |= self.build_forces(&channels, &mut control, controlled)?;
        if let Some(sync) = self.sync
            && control.channels & 1 << sync == 0
        {
            return Err(Refusal::new(Code::NoTrain, "sync").on(sync)); // sync <= 9
        }
        let setup = Setup::new(wearer, channels, &self.groups, self.sync, controlled)?;
        Ok((setup, control))
    }

    /// Puts channels under force control. Returns which, as bits.
    fn build_forces(
        &self,
        channels: &[Option<Channel>; CHANNELS],
        control: &mut ControlSetup,
        controlled: u16,
    ) -> Result<u16, Refusal<'static>> {
        let mut taken = 0;
        for (channel, (spec, muscle)) in (0u8..).zip(self.forces.iter().zip(&self.muscles)) {
            let Some(spec) = spec else { continue };
            if control.forces.is_full() {
                let full = Refusal::new(Code::OutOfRange, "force channels").on(channel);
                return Err(full.allowed(0, FORCE_CHANNELS as i32));
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
            let period_us = channels.get(usize::from(channel)).copied().flatten();
            let period_us = period_us.map_or(0, |c| c.train.spec().period_us);
            let named = |e| Refusal::from(e).on(channel);
            let recruitment = Recruitment::new(muscle.recruitment).map_err(named)?;
            let force = ForceControl::new(channel, spec, muscle.force, recruitment, period_us);
            let _ = control.forces.push(force.map_err(named)?); // it is not full
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
pub(super) fn slot<T>(
    slots: &mut [Option<T>; CHANNELS],
    channel: u8,
) -> Result<&mut Option<T>, Refusal<'static>> {
    slots
        .get_mut(usize::from(channel))
        .ok_or(Refusal::new(Code::OutOfRange, "channel").allowed(0, CHANNELS as i32 - 1))
}
