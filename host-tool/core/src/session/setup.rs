//! Reads and checks together everything that the device needs before it is armed: wearer, channels,
//! groups, sync, joint, wall, arm and modulated joints.

use std::convert::Infallible;

use firmware::control::JointSpec;
use firmware::device::{Draft, Mistake, Part, Rule};
use firmware::haptics::WallSpec;
use firmware::pulse::{GroupSpec, Partner};
use firmware::safety::{SetupError, WearerSpec};

use super::channels::Channels;
use super::fields::PARTNERS;
use super::joint::read_joint;
use super::limb::{SessionLimb, read_limb};
use super::limits::{check_current_sum, check_duration};
use super::modulation::{SessionJoint, peak_mistakes, read_modulations, report_modulation_mistake};
use super::verdict::{report_group_mistake, report_mistake};
use super::wall::read_wall;
use super::worn::WearerContext;
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// The part of a session file that configures the device, as far as it could be read.
pub(super) struct SetupSpec {
    pub(super) wearer: WearerSpec,
    pub(super) channels: Channels,
    pub(super) groups: Vec<GroupSpec>,
    pub(super) sync: Option<u8>,
    pub(super) joint: Option<JointSpec>,
    pub(super) wall: Option<WallSpec>,
    pub(super) limb: Option<SessionLimb>,
    pub(super) modulations: Vec<SessionJoint>,
    /// Whether the file has a `[[modulation]]`, with or without errors.
    pub(super) has_modulation: bool,
    /// Channels that the host may not drive, because a controller on the device does: bit i is
    /// channel i on the link.
    pub(super) controlled: u16,
}

/// Reads the part of the file that configures the device into a [`Draft`], which is the device's
/// own checker, and reports everything that the draft refuses.
pub(super) fn read_setup(
    root: &Table<'_>,
    person: &WearerContext,
    duration_us: u64,
    notes: &mut Vec<String>,
) -> SetupSpec {
    let mut draft = Draft::default();
    let wearer = person.limits(root);
    let mut mistakes: Vec<Mistake> = draft.set_wearer(wearer).err().into_iter().collect();
    let channels = Channels::read(root, person, &mut draft, duration_us, notes);
    let mut groups = Vec::new();
    let tables = root.tables("group");
    for (place, t) in tables.iter().enumerate() {
        groups.extend(read_group(t, &channels));
        // If the device refuses the groups, the last one is the cause.
        if let Err(e) = draft.set_groups(groups.iter().copied().collect()) {
            groups.pop();
            if let Rule::Setup(SetupError::Group(e)) = e.rule {
                report_group_mistake(&tables[..=place], e);
            }
        }
    }
    let sync = root.optional_table("sync", |t| Some(channels.find(t, "channel")?.index()));
    let sync = sync.flatten();
    mistakes.extend(draft.set_sync(sync).err());
    if root.has("joint") && root.has("wall") {
        root.report("wall", Problem::JointAndWall {}); // sound or not
    }
    let joint = root.table("joint").and_then(|t| read_joint(t, &channels));
    mistakes.extend(joint.clone().and_then(|spec| draft.set_joint(spec).err()));
    let wall = root.table("wall").and_then(|t| read_wall(t, &channels));
    mistakes.extend(wall.and_then(|spec| draft.set_wall(spec).err()));
    if root.has("joint") || root.has("wall") {
        check_limb_combination(root); // sound or not
    }
    let limb = read_limb(root, person, &channels);
    if let Some(limb) = &limb {
        // The arm and its lines were already checked with the wearer file.
        let _ = draft.set_endpoint(limb.spec);
        for line in &limb.lines {
            let _ = draft.set_line(line.clone());
        }
    }
    let modulations = read_modulations(root, &channels);
    for joint in &modulations {
        // The device stops at the first mistake; here all are reported.
        joint.spec.report_mistakes(&mut |mistake| {
            let (part, rule) = (Part::Modulation(joint.spec.joint), mistake.into());
            mistakes.push(Mistake { part, rule });
        });
        if draft.set_modulation(joint.spec).is_err() {
            mistakes.extend(peak_mistakes(&joint.spec, &channels));
        }
    }
    let Ok(_) = draft.examine(|mistake| {
        mistakes.push(mistake);
        Ok::<(), Infallible>(())
    });
    check_current_sum(root, &wearer, &channels.list, &channels.beyond);
    check_duration(root, &wearer, &channels.list, notes);
    for mistake in mistakes {
        match mistake.part {
            Part::Modulation(joint) => {
                report_modulation_mistake(root, &channels, &modulations, joint, mistake);
            }
            _ => report_mistake(root, &channels.list, mistake),
        }
    }
    SetupSpec {
        wearer,
        channels,
        groups,
        sync,
        joint,
        wall,
        limb,
        modulations,
        has_modulation: root.has("modulation"),
        controlled: draft.controlled_channels(),
    }
}

/// Reports setpoints of forces at the hand in a session with a joint or a wall.
fn check_limb_combination(root: &Table<'_>) {
    if let Some(t) = root.table("setpoints")
        && t.word("kind") == "endpoint-force"
    {
        t.report("kind", Problem::JointAndLimb {});
    }
}

fn read_group(t: &Table<'_>, channels: &Channels) -> Option<GroupSpec> {
    if !t.is_valid() {
        return None;
    }
    let mut members = 0u16;
    for &(number, _) in t.integers("channels") {
        let channel = number as u8; // 1–10: checked
        channels.find_number(t, "channels", channel)?;
        let bit = 1 << (channel - 1);
        if members & bit != 0 {
            t.report("channels", Problem::ChannelTwice { channel });
            return None;
        }
        members |= bit;
    }
    let partner = t.choice("partner", &PARTNERS).unwrap_or(Partner::Conducted);
    Some(GroupSpec { members, partner })
}
