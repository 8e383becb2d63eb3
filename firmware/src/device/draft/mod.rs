//! The setup that a host edits, one part at a time, and arms as a whole. The rules between its
//! parts are only here.

mod examination;
mod requests;

use super::mistake::{Mistake, Part, Rule};
use crate::control::{EndpointSpec, ForceControl, ForceSpec, Joint, JointSpec};
use crate::haptics::{JOINTS, ModulationSpec, Wall, WallSpec};
use crate::limb::{LineSpec, Lines};
use crate::muscle::{MuscleSpec, Recruitment};
use crate::pulse::{CHANNELS, GroupSpec, MAX_GROUPS, check_members};
use crate::range::{OutOfRange, Range};
use crate::safety::{Channel, ChannelSpec, SetupError, Stages, Wearer, WearerSpec};
use heapless::Vec;

/// The setup that a host has configured so far.
///
/// Every part is checked by itself when it is set; [`Self::examine`] checks all together. The
/// device refuses with the first [`Mistake`]; a host that wants to report all mistakes before it
/// sends any part uses the same draft.
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
    /// The board's stages, with which every channel's stage is compared.
    stages: Stages,
    wearer: WearerSpec,
    groups: Vec<GroupSpec, MAX_GROUPS>,
    sync: Option<u8>,
    joint: Option<JointSpec>,
    wall: Option<WallSpec>,
    endpoint: Option<EndpointSpec>,
    /// Lines of action of the arm's muscles, by rising channel.
    lines: Lines,
    /// Joints whose stimulation follows their angles, by the number of the joint.
    modulations: [Option<ModulationSpec>; JOINTS],
    channels: [Option<ChannelSpec>; CHANNELS],
    muscles: [Option<MuscleSpec>; CHANNELS],
    forces: [Option<ForceSpec>; CHANNELS],
    /// Force control of the channels for which train, muscle and force control are all set. Its
    /// table takes some 80,000 cycles to compute, and with the most steps and rates below the
    /// train's at most 2 ms (rows `inverse_table` and `inverse_table_slow` of
    /// docs/charts/cycles.csv). The table is computed with the request that completes or changes
    /// these parts, so that arming computes none.
    tables: [Option<Result<ForceControl, OutOfRange>>; CHANNELS],
}

impl Default for Draft {
    /// Returns an empty draft for a device that accepts any stage.
    fn default() -> Self {
        Self::for_stages(Stages::AsConfigured)
    }
}

/// Checks the channel of `spec` for this wearer; with `force`, at every pulse rate that force
/// control may ask for.
///
/// # Errors
/// Returns the first limit that the channel exceeds.
pub fn validate_channel(
    spec: &ChannelSpec,
    force: Option<&ForceSpec>,
    wearer: &Wearer,
) -> Result<Channel, SetupError> {
    match force {
        Some(force) => spec.validate_rates(force.min_period_us, force.max_period_us, wearer),
        None => spec.validate(wearer),
    }
}

/// Range of a channel's number.
const CHANNEL: Range = Range::new("channel", 0, CHANNELS as i32 - 1);

/// Setters for the parts, each checked by itself. Errors name the part, or the number of its
/// channel. If a part is refused, the earlier one stays.
#[expect(clippy::missing_errors_doc, reason = "said once for all")]
impl Draft {
    /// Returns an empty draft for a device with these stages.
    #[must_use]
    pub fn for_stages(stages: Stages) -> Self {
        Self {
            stages,
            wearer: WearerSpec::default(),
            groups: Vec::new(),
            sync: None,
            joint: None,
            wall: None,
            endpoint: None,
            lines: Lines::new(),
            modulations: [None; JOINTS],
            channels: [None; CHANNELS],
            muscles: [None; CHANNELS],
            forces: [None; CHANNELS],
            tables: [const { None }; CHANNELS],
        }
    }

    /// Resets everything but the stages, in place.
    pub fn clear(&mut self) {
        self.wearer = WearerSpec::default();
        self.groups.clear();
        (self.sync, self.joint, self.wall) = (None, None, None);
        self.endpoint = None;
        self.lines.clear();
        self.modulations.fill(None);
        self.channels.fill(None);
        self.muscles.fill(None);
        self.forces.fill(None);
        for table in &mut self.tables {
            *table = None;
        }
    }

    /// Sets the wearer's limits; [`WearerSpec::default`] holds until they are set.
    pub fn set_wearer(&mut self, spec: WearerSpec) -> Result<(), Mistake> {
        spec.validate().map_err(Mistake::in_part(Part::Wearer))?;
        self.wearer = spec;
        Ok(())
    }

    /// Sets a channel's pulses, which must keep the wearer's limits as they are now.
    pub fn set_channel(&mut self, channel: u8, spec: ChannelSpec) -> Result<(), Mistake> {
        let wearer = self
            .wearer
            .validate()
            .map_err(Mistake::in_part(Part::Wearer))?;
        let checked = spec.validate(&wearer);
        checked.map_err(Mistake::in_part(Part::Channel(channel)))?;
        self.check_stage(channel, &spec)?;
        *slot(&mut self.channels, channel)? = Some(spec);
        self.update_force_table(channel)
    }

    /// Sets the muscle that a channel stimulates, for its muscle model and for force control.
    pub fn set_muscle(&mut self, channel: u8, spec: MuscleSpec) -> Result<(), Mistake> {
        let checked = spec.validate();
        checked.map_err(Mistake::in_part(Part::Muscle(channel)))?;
        *slot(&mut self.muscles, channel)? = Some(spec);
        self.update_force_table(channel)
    }

    /// Puts a channel under force control. Its train and its muscle may be set later.
    pub fn set_force(&mut self, channel: u8, spec: ForceSpec) -> Result<(), Mistake> {
        let checked = spec.check();
        checked.map_err(Mistake::in_part(Part::Force(channel)))?;
        *slot(&mut self.forces, channel)? = Some(spec);
        self.update_force_table(channel)
    }

    /// Sets the groups of channels that share a muscle.
    pub fn set_groups(&mut self, groups: Vec<GroupSpec, MAX_GROUPS>) -> Result<(), Mistake> {
        let checked = check_members(&groups).map_err(SetupError::Group);
        checked.map_err(Mistake::in_part(Part::Groups))?;
        self.groups = groups;
        Ok(())
    }

    /// Sets the channel that drives the sync output; `None` for no channel.
    pub fn set_sync(&mut self, channel: Option<u8>) -> Result<(), Mistake> {
        channel.map_or(Ok(()), check_channel)?;
        self.sync = channel;
        Ok(())
    }

    /// Sets the joint whose angle is controlled, and replaces the earlier one.
    pub fn set_joint(&mut self, spec: JointSpec) -> Result<(), Mistake> {
        Joint::new(&spec).map_err(Mistake::in_part(Part::Joint))?;
        self.joint = Some(spec);
        Ok(())
    }

    /// Sets the virtual wall, and replaces the earlier one.
    pub fn set_wall(&mut self, spec: WallSpec) -> Result<(), Mistake> {
        Wall::new(&spec).map_err(Mistake::in_part(Part::Wall))?;
        self.wall = Some(spec);
        Ok(())
    }

    /// Sets the arm whose hand exerts a wanted force.
    pub fn set_endpoint(&mut self, spec: EndpointSpec) -> Result<(), Mistake> {
        spec.check().map_err(Mistake::in_part(Part::Limb))?;
        self.endpoint = Some(spec);
        Ok(())
    }

    /// Sets the line of action of a channel's muscle, and replaces the earlier line of that
    /// channel.
    pub fn set_line(&mut self, spec: LineSpec) -> Result<(), Mistake> {
        let mut first = Ok(());
        let part = Part::Line(spec.channel);
        spec.report_mistakes(&mut |range| {
            if first.is_ok() {
                first = Err(Mistake::in_part(part)(range));
            }
        });
        first?;
        let before = |line: &LineSpec| line.channel < spec.channel;
        let place = self.lines.iter().take_while(|line| before(line)).count();
        match self.lines.get_mut(place) {
            Some(line) if line.channel == spec.channel => *line = spec,
            // As many places as channels.
            _ => drop(self.lines.insert(place, spec)),
        }
        Ok(())
    }

    /// Sets a joint whose stimulation follows its angle, and replaces the earlier one of that
    /// number.
    pub fn set_modulation(&mut self, spec: ModulationSpec) -> Result<(), Mistake> {
        let part = Part::Modulation(spec.joint);
        spec.check().map_err(Mistake::in_part(part))?;
        if let Some(slot) = self.modulations.get_mut(usize::from(spec.joint)) {
            *slot = Some(spec); // the number was just checked
        }
        Ok(())
    }

    /// Compares a channel's configured stage with the board's.
    fn check_stage(&self, channel: u8, spec: &ChannelSpec) -> Result<(), Mistake> {
        let checked = self.stages.check(channel, &spec.stage);
        let checked = checked.map_err(SetupError::from);
        checked.map_err(Mistake::in_part(Part::Channel(channel)))
    }

    fn update_force_table(&mut self, channel: u8) -> Result<(), Mistake> {
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

/// Returns the draft's slot for a channel number that a host sent.
fn slot<T>(slots: &mut [Option<T>; CHANNELS], channel: u8) -> Result<&mut Option<T>, Mistake> {
    check_channel(channel)?;
    let none = Mistake::in_part(Part::Setup)(Rule::NothingToArm); // the number was just checked
    slots.get_mut(usize::from(channel)).ok_or(none)
}

/// Checks a channel number that a host sent.
pub(super) fn check_channel(channel: u8) -> Result<(), Mistake> {
    CHANNEL
        .check(channel)
        .map_err(Mistake::in_part(Part::Setup))
}
