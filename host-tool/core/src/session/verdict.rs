//! Reports the device's verdict on a setup at the fields of the file that cause it.
//!
//! The rules are the device's ([`firmware::device::Draft`]). This module only maps each rule to a
//! field and a message.

use firmware::control::SpecError;
use firmware::device::{Mistake, Part, Rule};
use firmware::haptics::WallError;
use firmware::muscle::{CalciumForceSpec, MuscleModelError, RecruitmentSpec};
use firmware::pulse::{GroupError, GroupSpec, TrainError, TrainSpec};
use firmware::range::{OutOfRange, Range};
use firmware::safety::SetupError;

use super::channel::Channel;
use super::law::untried_stiffness;
use super::limits::channel_limit_problem;
use crate::fields::decimal::{format_range, format_scaled};
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// Range of τc for any train. The train of a channel may allow only a part of it.
const TAU_C_US: Range = CalciumForceSpec::TAU_C_US;
/// Range of τ1 for any muscle. Other constants of the muscle may allow only a part of it.
const TAU1_US: Range = CalciumForceSpec::TAU1_US;

/// Reports a mistake that the device finds in the setup, at the field that causes it. `root` is the
/// file, and `channels` are the channels that could be read.
pub(super) fn report_mistake(root: &Table<'_>, channels: &[Channel], mistake: Mistake) {
    match mistake.part {
        Part::Wearer => root.table("wearer").unwrap_or(root).report_refusal(mistake),
        Part::Channel(index) | Part::Muscle(index) | Part::Force(index) => {
            let mut tables = root.tables("channel").iter();
            let channel = channels.iter().find(|c| c.index() == index);
            match (tables.find(|t| names_channel(t, "number", index)), channel) {
                (_, Some(channel)) if mistake.rule == Rule::Controlled => {
                    if let Some(point) =
                        point_tables(root).find(|t| names_channel(t, "channel", index))
                    {
                        let channel = channel.number;
                        point.report("channel", Problem::ForceControlled { channel });
                    }
                }
                (Some(table), Some(channel)) => report_channel_mistake(table, channel, mistake),
                _ => {} // it is wrong by itself
            }
        }
        Part::Groups => {
            if let Rule::Setup(SetupError::Group(e)) = mistake.rule {
                report_group_mistake(root.tables("group"), e);
            }
        }
        Part::Joint | Part::Wall => {
            let name = ["joint", "wall"][usize::from(mistake.part == Part::Wall)];
            if let Some(t) = root.table(name) {
                report_joint_mistake(t, channels, mistake);
            }
        }
        // A channel of the arm may not have force control; the limit of the line came from the
        // channel.
        Part::Line(index) => {
            let mut tables = root.tables("channel").iter();
            let found = tables.find(|t| names_channel(t, "number", index));
            if let (Some(table), Rule::Controlled) = (found, mistake.rule) {
                let channel = index + 1; // at most 10
                table.report("force", Problem::ForceControlled { channel });
            }
        }
        // A setup without channels was already reported, as were the sum of the currents, for all
        // channels that can be added, and missing channels, where they are named. Modulated joints
        // are reported by the function that reads them.
        Part::Setup | Part::Sync | Part::Limb | Part::Modulation(_) => {}
    }
}

/// Returns the tables of the joint and of the wall that have a `channel` field.
fn point_tables<'r>(root: &'r Table<'r>) -> impl Iterator<Item = &'r Table<'r>> {
    let tables = root.table("joint").into_iter().chain(root.table("wall"));
    tables.flat_map(tables_with_channels)
}

/// Returns the tables within a joint or a wall that have a `channel` field, and the joint or wall
/// itself.
fn tables_with_channels<'r>(t: &'r Table<'r>) -> impl Iterator<Item = &'r Table<'r>> {
    let other = t.table("extensor").or(t.table("co_contraction"));
    std::iter::once(t).chain(t.tables("flexors")).chain(other)
}

/// Returns whether `field` holds the number of the channel with this `index` on the link (0–9).
fn names_channel(t: &Table<'_>, field: &str, index: u8) -> bool {
    t.has(field) && t.integer::<u8>(field) == index + 1 // at most 10
}

/// Reports a mistake in a channel, its muscle or its force control. `t` is the table of the
/// channel.
pub(crate) fn report_channel_mistake(t: &Table<'_>, channel: &Channel, mistake: Mistake) {
    let Channel { number, spec, .. } = channel;
    let train = t.table("train").unwrap_or(t);
    let milli = |value: u32| format_scaled(value.into(), 3);
    match mistake.rule {
        Rule::Setup(e) if let Some(problem) = channel_limit_problem(channel, e) => {
            t.report("limit", problem)
        }
        Rule::Setup(SetupError::Train(TrainError::BurstOverlaps {
            min_interval_us: min_us,
        })) => {
            train.report("burst_interval_us", Problem::BurstOverlaps { min_us });
        }
        Rule::Setup(SetupError::Train(TrainError::BurstTooLong {
            min_period_us: min_us,
        })) => {
            let period = ["period_us", "frequency_hz"][usize::from(!train.has("period_us"))];
            train.report(period, Problem::BurstTooLong { min_us });
        }
        Rule::WidthChanges => t.report("muscle", Problem::WidthChanges { channel: *number }),
        Rule::CountedControlled => {
            let channel = *number;
            train.report("repeats", Problem::CountedControlled { channel });
        }
        Rule::NoMuscle => t.report("force", Problem::NoMuscle { channel: *number }),
        Rule::Setup(SetupError::Range(e)) if e.field == "trigger" => {
            let name = ["triggered", "trigger"][usize::from(train.has("trigger"))];
            train.report_out_of_range(name, "no trigger with a `force`".into());
        }
        Rule::Setup(SetupError::Range(e)) if e.field == "lists" => {
            train.report_out_of_range("lists", "false with a `force`".into());
        }
        Rule::Setup(SetupError::Train(TrainError::Range(e))) if spec.train.lists => {
            let name = match e.field {
                "trigger" => ["triggered", "trigger"][usize::from(train.has("trigger"))],
                field => field,
            };
            match matches!(e.field, "trigger" | "repeats" | "burst_count") {
                true => {
                    let allowed = "with `lists` no trigger, repeats = 0 and burst_count = 1";
                    train.report_out_of_range(name, allowed.into());
                }
                false => t.report_refusal(mistake),
            }
        }
        Rule::Setup(SetupError::Range(e)) if e.field == TrainSpec::BURST_COUNT.field => {
            train.report_out_of_range("burst_count", "1 with a `force`".into());
        }
        // The train's period allows only a part of the range of a force's rates.
        Rule::Range(e) if e.field == "min_period_us" => {
            let max = e.max.min(spec.train.period_us.cast_signed());
            t.report_refusal(OutOfRange { max, ..e });
        }
        Rule::Range(e) if e.field == "max_period_us" => {
            let min = e.min.max(spec.train.period_us.cast_signed());
            t.report_refusal(OutOfRange { min, ..e });
        }
        // A muscle's calcium model also depends on the train.
        Rule::Range(e) if e.field == TAU_C_US.field && e.max < TAU_C_US.max => {
            let range = format_range(e.min.into(), e.max.into(), 3);
            let (count, every_ms) = (spec.train.burst_count, milli(spec.train.period_us));
            let allowed = format!("{range} with bursts of {count} pulses every {every_ms} ms");
            let muscle = t.table("muscle").unwrap_or(t);
            muscle.report_out_of_range("tau_c_ms", allowed);
        }
        _ => t.report_refusal(mistake),
    }
}

/// Reports a mistake in a muscle. `t` is the table that causes it: the muscle, or one of its
/// changes of model level. `channel` is the table of the channel.
pub(crate) fn report_muscle_mistake(t: &Table<'_>, channel: &Table<'_>, mistake: Mistake) {
    match mistake.rule {
        Rule::Muscle(MuscleModelError::NoFatigue) => {
            t.report("model", Problem::NoFatigue {});
        }
        // Full scales stay far below the bound of the recruitment curve, so a limit can only be too
        // low for the threshold.
        Rule::Muscle(MuscleModelError::Range(e)) if e.field == RecruitmentSpec::LIMIT.field => {
            let allowed = format!(
                "below the channel's limit of {}",
                channel.field_place("limit").given
            );
            t.report_out_of_range("motor_threshold", allowed);
        }
        // The shortest τ1 depends on K and τ2.
        Rule::Muscle(MuscleModelError::Range(e))
            if e.field == TAU1_US.field && e.min > TAU1_US.min =>
        {
            let range = format_range(e.min.into(), e.max.into(), 3);
            t.report_out_of_range("tau1_ms", format!("{range} with this `k` and `tau2_ms`"));
        }
        _ => t.report_refusal(mistake),
    }
}

/// Reports the rule that a group breaks. The error is reported at the group that has the channel
/// concerned, or at the last of `groups` if it concerns no single channel.
pub(super) fn report_group_mistake(groups: &[Table<'_>], e: GroupError) {
    let (channel, problem) = match e {
        GroupError::IsolationOverlaps { channel: c, other } => {
            let (channel, other) = (c + 1, other + 1); // at most 10
            (c, Problem::IsolationOverlaps { channel, other })
        }
        GroupError::NoTimeToGround { channel: c } => {
            (c, Problem::NoTimeToGround { channel: c + 1 })
        }
        GroupError::RateChanges { channel: c } => (c, Problem::RateChanges { channel: c + 1 }),
        GroupError::TwoGroups { channel: c } => (u8::MAX, Problem::TwoGroups { channel: c + 1 }),
        GroupError::Members(_) => {
            let size = GroupSpec::SIZE;
            let allowed = format!("{} to {} channels", size.min, size.max);
            (u8::MAX, Problem::OutOfRange { allowed })
        }
        GroupError::NoTrain { .. } => return, // told where it is named
    };
    let has = |t: &&Table<'_>| {
        t.integers("channels")
            .iter()
            .any(|(c, _)| *c == i64::from(channel) + 1)
    };
    if let Some(t) = groups.iter().find(has).or(groups.last()) {
        t.report("channels", problem);
    }
}

/// Reports a mistake in a joint or a wall. `t` is its table. The error is reported at the point
/// (channel with amplitudes) concerned, if there is one.
fn report_joint_mistake(t: &Table<'_>, channels: &[Channel], mistake: Mistake) {
    if let Rule::Joint(SpecError::Range(e)) = mistake.rule
        && let Some(wearer) = t.table("wearer")
        && let Some(why) = untried_stiffness(e, wearer.integer("flexion_nm"))
    {
        return wearer.report("stiffness_nm_per_rad", why);
    }
    let naming =
        |index| tables_with_channels(t).filter(move |t| names_channel(t, "channel", index));
    match mistake.rule {
        Rule::AboveLimit {
            channel: index,
            field,
            ..
        } => {
            let channel = channels.iter().find(|c| c.index() == index);
            if let (Some(point), Some(channel)) = (naming(index).next(), channel) {
                channel.report_above_limit(point, field);
            }
        }
        Rule::Joint(SpecError::ChannelTwice { channel: index })
        | Rule::Wall(WallError::ChannelTwice { channel: index }) => {
            if let Some(point) = naming(index).last() {
                let channel = index + 1; // at most 10
                point.report("channel", Problem::ChannelTwice { channel });
            }
        }
        Rule::Joint(SpecError::Range(e)) if e.field == "code_at_100 - code_at_0" => {
            let least = format!("at least {} away from `code_at_0_deg`", e.min);
            t.report_out_of_range("code_at_100_deg", least);
        }
        Rule::Joint(SpecError::Range(e)) if e.field == "threshold" => {
            let above = |t: &&Table<'_>| t.integer::<u32>("threshold") > t.integer::<u32>("max");
            let mut points = tables_with_channels(t).filter(|t| t.has("threshold"));
            points.find(above).unwrap_or(t).report_refusal(e);
        }
        // The channel's limit allows only a part of the range of an amplitude.
        Rule::Joint(SpecError::Range(e)) | Rule::Wall(WallError::Range(e))
            if matches!(e.field, "max" | "amplitude") =>
        {
            let is =
                |t: &&Table<'_>| t.has(e.field) && i64::from(t.integer::<u32>(e.field)) == e.value;
            let point = tables_with_channels(t).find(is).unwrap_or(t);
            let channel = channels
                .iter()
                .find(|c| names_channel(point, "channel", c.index()));
            let max = channel.map_or(e.max, |c| e.max.min(c.spec.limit.get().cast_signed()));
            point.report_refusal(OutOfRange { max, ..e });
        }
        // Missing channels, and a joint together with a wall, were already reported.
        Rule::NoTrain { .. } | Rule::JointAndWall { .. } => {}
        _ => t.report_refusal(mistake),
    }
}
