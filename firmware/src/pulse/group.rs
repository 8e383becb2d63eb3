//! Groups of channels that share a muscle, and the state of each member while another pulses
//! (Hamana 2022, section II-D and figure 6).

use super::{CHANNELS, Train};
use crate::range::{OutOfRange, Range};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Largest number of groups on a device: each needs at least two of ten channels.
pub const MAX_GROUPS: usize = CHANNELS / 2;

/// State of a member that does not pulse while another member does.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize, Schema)]
pub enum Partner {
    /// The member is grounded, so that current may return through it.
    Conducted,
    /// The member is disconnected from the stimulator.
    Isolated,
}

/// A group of channels as a host configures it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize, Schema)]
pub struct GroupSpec {
    /// Members of the group, bit i for channel i: at least two, each in one group only.
    pub members: u16,
    /// State of a member that does not pulse while another member does.
    pub partner: Partner,
}

/// A group whose members exist and whose trains satisfy its rule.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Group {
    members: u16,
    partner: Partner,
}

impl GroupSpec {
    /// Range of the number of groups.
    pub const COUNT: Range = Range::new("groups", 0, MAX_GROUPS as i32);
    /// Range of [`Self::members`].
    pub const MEMBERS: Range = Range::new("members", 0, (1 << CHANNELS) - 1);
    /// Range of the number of members of a group.
    pub const SIZE: Range = Range::new("number of members", 2, CHANNELS as i32);

    /// Checks the group against the trains it joins.
    ///
    /// # Errors
    /// Returns the first rule between them that the group breaks.
    pub fn check(&self, trains: &[Option<Train>; CHANNELS]) -> Result<Group, GroupError> {
        let &Self { members, partner } = self;
        if let Some(channel) = channels(members).find(|&c| train(trains, c).is_none()) {
            return Err(GroupError::NoTrain { channel });
        }
        if partner == Partner::Isolated {
            check_isolation(members, trains)?;
        }
        Ok(Group { members, partner })
    }
}

impl From<OutOfRange> for GroupError {
    fn from(e: OutOfRange) -> Self {
        Self::Members(e)
    }
}

impl Group {
    /// Returns the members of the group, bit i for channel i.
    #[must_use]
    pub const fn members(&self) -> u16 {
        self.members
    }

    /// Returns the state of a member that does not pulse while another member does.
    #[must_use]
    pub const fn partner(&self) -> Partner {
        self.partner
    }
}

/// The reason why a set of groups is not possible.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum GroupError {
    /// A group needs two or more of the ten channels.
    Members(OutOfRange),
    /// A member has no train, so the group could not coordinate its pulses.
    NoTrain {
        /// The member without a train, from 0.
        channel: u8,
    },
    /// Channel `channel` is already in another group.
    TwoGroups {
        /// The channel in both groups, from 0.
        channel: u8,
    },
    /// Pulses of the two channels overlap at some time, so neither can be disconnected while the
    /// other pulses.
    IsolationOverlaps {
        /// One of the two channels, from 0.
        channel: u8,
        /// The other of the two channels, from 0.
        other: u8,
    },
    /// Channel `channel` may change its pulse rate. Pulses of an isolated group are kept apart by
    /// their phase offsets, which hold at the trains' own rates only.
    RateChanges {
        /// The member whose rate may change, from 0.
        channel: u8,
    },
    /// Disconnecting `channel` interrupts its grounding, and no uninterrupted stretch of the
    /// configured length remains before its next burst.
    NoTimeToGround {
        /// The channel that is grounded after its pulses, from 0.
        channel: u8,
    },
}

/// Checks groups without their trains: the number of groups, and that each has two or more of the
/// ten channels, none of them in two groups.
///
/// # Errors
/// Returns the first rule that some group breaks.
pub fn check_members(specs: &[GroupSpec]) -> Result<(), GroupError> {
    let mut taken = 0u16;
    GroupSpec::COUNT.check(specs.len() as i64)?;
    for spec in specs {
        GroupSpec::MEMBERS.check(spec.members)?;
        GroupSpec::SIZE.check(spec.members.count_ones())?;
        if let Some(channel) = channels(spec.members & taken).next() {
            return Err(GroupError::TwoGroups { channel });
        }
        taken |= spec.members;
    }
    Ok(())
}

fn channels(mask: u16) -> impl Iterator<Item = u8> {
    (0..CHANNELS as u8).filter(move |c| mask & 1 << c != 0)
}

fn train(trains: &[Option<Train>; CHANNELS], channel: u8) -> Option<&Train> {
    trains.get(usize::from(channel)).and_then(Option::as_ref)
}

fn check_isolation(mask: u16, trains: &[Option<Train>; CHANNELS]) -> Result<(), GroupError> {
    for channel in channels(mask) {
        let Some(a) = train(trains, channel) else {
            continue;
        };
        for other in channels(mask).filter(|&o| o > channel) {
            let Some(b) = train(trains, other) else {
                continue;
            };
            if can_overlap(a, b) {
                return Err(GroupError::IsolationOverlaps { channel, other });
            }
        }
        if a.spec().ground_us != 0 && !can_ground(channel, mask, trains) {
            return Err(GroupError::NoTimeToGround { channel });
        }
    }
    Ok(())
}

/// Returns whether driven parts of two endless trains ever coincide. Start times differ by a fixed
/// amount modulo the greatest common divisor of the periods, and every residue occurs, so one
/// residue check is exact.
fn can_overlap(a: &Train, b: &Train) -> bool {
    if a.spec().trigger != b.spec().trigger {
        return true; // two epochs: any distance occurs
    }
    let g = i64::from(gcd(a.spec().period_us, b.spec().period_us));
    let (da, db) = (i64::from(a.driven_us()), i64::from(b.driven_us()));
    (0..a.spec().burst_count).any(|i| {
        (0..b.spec().burst_count).any(|j| {
            let distance = start(a, i) - start(b, j);
            let after_b = distance.rem_euclid(g);
            after_b < db || g - after_b < da
        })
    })
}

fn start(train: &Train, pulse: u8) -> i64 {
    i64::from(train.spec().offset_us) + i64::from(train.pulse_offset_us(pulse))
}

/// Returns the greatest common divisor.
pub(crate) const fn gcd(mut a: u32, mut b: u32) -> u32 {
    while b != 0 {
        (a, b) = (b, a % b); // b != 0 here
    }
    a
}

/// Returns whether each pulse of a member that is grounded is followed by `ground_us` of
/// uninterrupted grounding. The grounding restarts after every interruption, and must end before
/// the member's next pulse or, after a burst, two windows before its next burst. Returns `false` if
/// the group has no common period.
fn can_ground(channel: u8, mask: u16, trains: &[Option<Train>; CHANNELS]) -> bool {
    let Some(own) = train(trains, channel) else {
        return false;
    };
    let period = i64::from(own.spec().period_us);
    if channels(mask)
        .any(|m| train(trains, m).is_none_or(|t| i64::from(t.spec().period_us) != period))
    {
        return false;
    }
    let ground = i64::from(own.spec().ground_us);
    (0..own.spec().burst_count).all(|i| {
        let begin = start(own, i);
        let last = i + 1 == own.spec().burst_count;
        let deadline = if last {
            start(own, 0) + period - 500
        } else {
            begin + i64::from(own.spec().burst_interval_us) - i64::from(super::DEAD_TIME_US)
        };
        let mut free = begin + i64::from(own.driven_us());
        // Every interruption moves `free` forward, so this loop ends.
        while let Some(end) = first_interruption(free, free + ground, channel, mask, trains) {
            free = end;
            if free > deadline {
                return false;
            }
        }
        free + ground <= deadline
    })
}

/// Returns the end of a pulse of another member that overlaps `from..to`, if any.
fn first_interruption(
    from: i64,
    to: i64,
    channel: u8,
    mask: u16,
    trains: &[Option<Train>; CHANNELS],
) -> Option<i64> {
    channels(mask)
        .filter(|&m| m != channel)
        .filter_map(|m| train(trains, m))
        .find_map(|t| {
            let (period, driven) = (i64::from(t.spec().period_us), i64::from(t.driven_us()));
            (0..t.spec().burst_count).find_map(|j| {
                // The pulse of this index that ends after `from`, earliest first.
                let first = from + (start(t, j) - from).rem_euclid(period);
                let begin = if first - period + driven > from {
                    first - period
                } else {
                    first
                };
                (begin < to).then_some(begin + driven)
            })
        })
}

#[cfg(test)]
mod tests {
    use super::super::{TrainSpec, train::tests::PLAIN};
    use super::*;

    const MONO: TrainSpec = TrainSpec::monophasic(200, 1_000, 20_000);

    fn two(a: TrainSpec, b: TrainSpec, partner: Partner) -> Result<(), GroupError> {
        let mut trains = [None; CHANNELS];
        trains[0] = Some(a.validate().unwrap());
        trains[1] = Some(b.validate().unwrap());
        let spec = GroupSpec {
            members: 0b11,
            partner,
        };
        spec.check(&trains).map(|_| ())
    }

    #[test]
    fn isolation_needs_pulses_apart() {
        for (offset_us, ok) in [
            (0, false),
            (50, false),
            (199, false),
            (200, true),
            (2000, true),
            (19_801, false),
        ] {
            let shifted = TrainSpec { offset_us, ..MONO };
            assert!(two(MONO, shifted, Partner::Conducted).is_ok());
            let isolated = two(MONO, shifted, Partner::Isolated);
            if ok {
                assert_eq!(isolated, Ok(()), "{offset_us}");
            } else {
                assert_eq!(
                    isolated,
                    Err(GroupError::IsolationOverlaps {
                        channel: 0,
                        other: 1
                    })
                );
            }
        }
    }

    #[test]
    fn different_rates_meet_sooner_or_later() {
        let faster = TrainSpec {
            period_us: 19_999,
            offset_us: 10_000,
            ..PLAIN
        };
        assert!(two(PLAIN, faster, Partner::Isolated).is_err());
        let double = TrainSpec {
            period_us: 10_000,
            offset_us: 5_000,
            ..PLAIN
        };
        assert!(two(PLAIN, double, Partner::Isolated).is_ok());
    }

    #[test]
    fn grounding_needs_an_uninterrupted_stretch() {
        let long = TrainSpec {
            ground_us: 15_000,
            ..MONO
        };
        let middle = TrainSpec {
            offset_us: 10_000,
            ..MONO
        };
        assert_eq!(
            two(long, middle, Partner::Isolated),
            Err(GroupError::NoTimeToGround { channel: 0 })
        );
    }

    #[test]
    fn members_must_exist_and_be_in_one_group() {
        let mut trains = [None; CHANNELS];
        trains[0] = Some(PLAIN.validate().unwrap());
        let conducted = |members| GroupSpec {
            members,
            partner: Partner::Conducted,
        };
        let single = check_members(&[conducted(1)]);
        assert!(matches!(single, Err(GroupError::Members(_))));
        let no_train = Err(GroupError::NoTrain { channel: 1 });
        assert_eq!(conducted(3).check(&trains), no_train);
        let two_groups = Err(GroupError::TwoGroups { channel: 1 });
        assert_eq!(check_members(&[conducted(3), conducted(6)]), two_groups);
    }
}
