//! The setup that a host edits, one request at a time, and arms as a whole.

use super::{ControlSetup, Muscle};
use crate::control::{Joint, JointSpec};
use crate::haptics::{Wall, WallSpec};
use crate::link::{Code, Refusal};
use crate::muscle::MuscleSpec;
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
            *slot = Some(
                spec.validate(&wearer)
                    .map_err(|e| Refusal::from(e).on(index))?,
            );
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
        if let Some(sync) = self.sync
            && control.channels & 1 << sync == 0
        {
            return Err(Refusal::new(Code::NoTrain, "sync").on(sync)); // sync <= 9
        }
        let setup = Setup::new(wearer, channels, &self.groups, self.sync, controlled)?;
        Ok((setup, control))
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
