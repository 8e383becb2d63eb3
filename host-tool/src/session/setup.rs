//! Wearer, channels, groups, sync and joint together: what the device arms.

use firmware::control::{Joint, JointSpec};
use firmware::haptics::WallSpec;
use firmware::pulse::{CHANNELS, GroupError, GroupSpec, MAX_GROUPS, Partner};
use firmware::safety::{Channel as Checked, Setup, SetupError, WearerSpec};

use super::channel::{Channel, read_channel, read_wearer};
use super::error::{Problem, SessionError};
use super::joint::{find, read_joint};
use super::table::Table;
use super::wall::read_wall;

/// The checked part of a file that configures the device.
pub(super) struct SetupSpec {
    pub(super) wearer: WearerSpec,
    pub(super) channels: Vec<Channel>,
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
) -> Result<SetupSpec, SessionError> {
    let (wearer, checked_wearer) = read_wearer(root)?;
    let mut checked: [Option<Checked>; CHANNELS] = [None; CHANNELS];
    let mut channels: Vec<Channel> = Vec::new();
    for t in root.tables("channel")?.required()? {
        let (channel, train) = read_channel(&t, &checked_wearer, duration_us, notes)?;
        let slot = &mut checked[usize::from(channel.index())]; // 0–9
        if slot.replace(train).is_some() {
            let (field, channel) = (t.path_of("number"), channel.number);
            return Err(t.error("number", Problem::ChannelTwice { field, channel }));
        }
        channels.push(channel);
    }
    channels.sort_unstable_by_key(|c| c.number);
    let tables = root.tables("group")?.or(Vec::new());
    let groups: Vec<GroupSpec> = tables
        .iter()
        .map(|t| read_group(t, &channels))
        .collect::<Result<_, _>>()?;
    let sync = read_sync(root, &channels)?;
    if root.has("joint") && root.has("wall") {
        return Err(root.error("wall", Problem::JointAndWall));
    }
    let joint = read_joint(root, &channels)?;
    let wall = read_wall(root, &channels)?;
    let points = joint.iter().flat_map(|(spec, _)| {
        let points = spec.flexors.iter().chain([&spec.extensor]);
        points.map(|p| p.channel)
    });
    let demands = wall.iter().flat_map(WallSpec::demands);
    let controlled = points
        .chain(demands.map(|(channel, ..)| channel))
        .fold(0, |mask, channel| mask | 1 << channel);
    let forced = channels.iter().filter(|c| c.force.is_some());
    let driven = forced.fold(controlled, |mask, c| mask | 1 << c.index());
    Setup::new(checked_wearer, checked, &groups, sync, driven)
        .map_err(|e| setup_error(root, &tables, &groups, e))?;
    Ok(SetupSpec {
        wearer,
        channels,
        groups,
        sync,
        joint,
        wall,
        controlled,
    })
}

fn read_group(t: &Table<'_>, channels: &[Channel]) -> Result<GroupSpec, SessionError> {
    t.only(&["channels", "partner"])?;
    let partners = [
        ("conducted", Partner::Conducted),
        ("isolated", Partner::Isolated),
    ];
    let mut members = 0u16;
    for channel in t.channels("channels")?.required()? {
        let field = t.path_of("channels");
        if channels.iter().all(|c| c.number != channel) {
            return Err(t.error("channels", Problem::NoSuchChannel { field, channel }));
        }
        let bit = 1 << (channel - 1); // 1–10
        if members & bit != 0 {
            return Err(t.error("channels", Problem::ChannelTwice { field, channel }));
        }
        members |= bit;
    }
    let partner = t.choice("partner", &partners)?.required()?;
    Ok(GroupSpec { members, partner })
}

fn read_sync(root: &Table<'_>, channels: &[Channel]) -> Result<Option<u8>, SessionError> {
    let Some(t) = root.table("sync")?.optional() else {
        return Ok(None);
    };
    t.only(&["channel"])?;
    find(&t, "channel", channels).map(|channel| Some(channel.index()))
}

/// Puts the firmware's verdict on the group concerned.
fn setup_error(
    root: &Table<'_>,
    tables: &[Table<'_>],
    groups: &[GroupSpec],
    e: SetupError,
) -> SessionError {
    // The n-th group that has this channel (from 0).
    let group = |channel: u8, n: usize| {
        let having = |(_, g): &(_, &GroupSpec)| g.members & 1 << channel != 0;
        let found = tables.iter().zip(groups).filter(having).nth(n);
        found.map_or(root, |(table, _)| table)
    };
    let (table, problem) = match e {
        SetupError::Group(GroupError::Members(e)) if e.field.ends_with("members") => {
            let few = tables
                .iter()
                .zip(groups)
                .find(|(_, g)| g.members.count_ones() < 2);
            let table = few.map_or(root, |(table, _)| table);
            let allowed = format!("{} to {} channels", e.min, e.max);
            return table.out_of_range("channels", allowed);
        }
        SetupError::Group(GroupError::TwoGroups { channel: c }) => {
            (group(c, 1), Problem::TwoGroups { channel: c + 1 })
        }
        SetupError::Group(GroupError::IsolationOverlaps { channel: c, other }) => {
            let (channel, other) = (c + 1, other + 1);
            (group(c, 0), Problem::IsolationOverlaps { channel, other })
        }
        SetupError::Group(GroupError::NoTimeToGround { channel: c }) => {
            (group(c, 0), Problem::NoTimeToGround { channel: c + 1 })
        }
        SetupError::Group(GroupError::RateChanges { channel: c }) => {
            (group(c, 0), Problem::RateChanges { channel: c + 1 })
        }
        SetupError::Group(GroupError::NoTrain { channel: c }) => {
            let (field, channel) = ("channels".into(), c + 1);
            (group(c, 0), Problem::NoSuchChannel { field, channel })
        }
        // Channels are checked one by one before; what is left is the number
        // of groups.
        _ => return root.out_of_range("group", format!("at most {MAX_GROUPS} groups")),
    };
    table.error("channels", problem)
}
