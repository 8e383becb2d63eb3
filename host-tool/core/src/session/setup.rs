//! Wearer, channels, groups, sync and joint together: what the device arms.

use firmware::control::{Joint, JointSpec};
use firmware::haptics::WallSpec;
use firmware::pulse::{GroupError, GroupSpec, Partner};
use firmware::safety::{Setup, SetupError, Wearer, WearerSpec};

use super::channel::{Channels, read_wearer};
use super::error::Problem;
use super::fields::PARTNERS;
use super::joint::read_joint;
use super::table::Table;
use super::wall::read_wall;

/// The part of a file that configures the device, as far as it could be read.
pub(super) struct SetupSpec {
    pub(super) wearer: WearerSpec,
    pub(super) channels: Channels,
    pub(super) groups: Vec<GroupSpec>,
    pub(super) sync: Option<u8>,
    pub(super) joint: Option<(JointSpec, Joint)>,
    pub(super) wall: Option<WallSpec>,
    /// Bit i: channel i on the link is the joint's or the wall's.
    pub(super) controlled: u16,
}

/// Reads everything that the device gets, and checks it as arming will.
pub(super) fn read_setup(
    root: &Table<'_>,
    duration_us: u64,
    notes: &mut Vec<String>,
) -> Option<SetupSpec> {
    let (wearer, checked_wearer) = read_wearer(root);
    let checked_wearer = checked_wearer?;
    let channels = Channels::read(root, &checked_wearer, duration_us, notes);
    let tables = root.tables("group");
    let groups: Vec<_> = tables.iter().map(|t| read_group(t, &channels)).collect();
    let sync = root.part("sync", |t| Some(channels.find(t, "channel")?.index()));
    if root.has("joint") && root.has("wall") {
        root.say("wall", Problem::JointAndWall {});
    }
    let joint = root.table("joint").map(|t| read_joint(t, &channels));
    let wall = root.table("wall").map(|t| read_wall(t, &channels));
    let are_whole = groups.iter().all(Option::is_some);
    let mut setup = SetupSpec {
        wearer,
        channels,
        groups: groups.into_iter().flatten().collect(),
        sync: sync.flatten(),
        joint: joint.flatten(),
        wall: wall.flatten(),
        controlled: 0,
    };
    setup.controlled = setup.driven();
    if are_whole && setup.channels.are_whole() {
        setup.check(&checked_wearer, tables);
    }
    Some(setup)
}

impl SetupSpec {
    /// Bit i: a joint or a wall drives channel i on the link.
    fn driven(&self) -> u16 {
        let points = self.joint.iter().flat_map(|(spec, _)| {
            let points = spec.flexors.iter().chain([&spec.extensor]);
            points.map(|p| p.channel)
        });
        let demands = self.wall.iter().flat_map(WallSpec::demands);
        let all = points.chain(demands.map(|(channel, ..)| channel));
        all.fold(0, |mask, channel| mask | 1 << channel)
    }

    /// Asks the firmware whether it would arm this: with each group by itself, so
    /// that one does not hide another, then with all.
    fn check(&self, wearer: &Wearer, tables: &[Table<'_>]) {
        let forced = self.channels.list.iter().filter(|c| c.force.is_some());
        let driven = forced.fold(self.controlled, |mask, c| mask | 1 << c.index());
        let armed = |groups| Setup::new(*wearer, self.channels.checked, groups, self.sync, driven);
        let each = tables.iter().zip(&self.groups);
        let refused = each.filter(|(table, group)| {
            let alone = armed(std::slice::from_ref(*group));
            alone.map_err(|e| refuse(table, e)).is_err()
        });
        if refused.count() > 0 {
            return;
        }
        if let Err(SetupError::Group(GroupError::TwoGroups { channel: c })) = armed(&self.groups) {
            let having = |(_, g): &(_, &GroupSpec)| g.members & 1 << c != 0;
            let second = tables.iter().zip(&self.groups).filter(having).nth(1);
            if let Some((table, _)) = second {
                table.say("channels", Problem::TwoGroups { channel: c + 1 });
            }
        }
    }
}

fn read_group(t: &Table<'_>, channels: &Channels) -> Option<GroupSpec> {
    if !t.is_sound() {
        return None;
    }
    let mut members = 0u16;
    for &(number, _) in t.wholes("channels") {
        let channel = number as u8; // 1–10: checked
        channels.numbered(t, "channels", channel)?;
        let bit = 1 << (channel - 1);
        if members & bit != 0 {
            let field = t.path_of("channels");
            t.say("channels", Problem::ChannelTwice { field, channel });
            return None;
        }
        members |= bit;
    }
    let partner = t.named("partner", &PARTNERS).unwrap_or(Partner::Conducted);
    Some(GroupSpec { members, partner })
}

/// Puts the firmware's verdict on a group.
fn refuse(t: &Table<'_>, e: SetupError) {
    let problem = match e {
        SetupError::Group(GroupError::IsolationOverlaps { channel: c, other }) => {
            let (channel, other) = (c + 1, other + 1);
            Problem::IsolationOverlaps { channel, other }
        }
        SetupError::Group(GroupError::NoTimeToGround { channel: c }) => {
            Problem::NoTimeToGround { channel: c + 1 }
        }
        SetupError::Group(GroupError::RateChanges { channel: c }) => {
            Problem::RateChanges { channel: c + 1 }
        }
        // What is left is how many members it has.
        _ => {
            let size = GroupSpec::SIZE;
            return t.out_of_range("channels", format!("{} to {} channels", size.min, size.max));
        }
    };
    t.say("channels", problem);
}
