//! Detection of channels that can drive in opposite directions at the same time. Stages that share
//! one high-voltage supply cannot do so: the common return is either its positive or its negative
//! end. One of the two electrodes would get next to nothing, while its own stage shows the full
//! current (docs/reference/hardware.md, Supply of the stages).

use super::Channel;
use crate::pulse::{CHANNELS, DEAD_TIME_US, Group, Partner, Train, gcd};

/// Returns the pairs of channels, from 0 and the lower first, that can drive in opposite
/// directions at the same time, or with less than the dead time between them.
///
/// The result is exact for trains of one period that start at the common epoch, and for members of
/// one isolated group. For trains of different periods, every distance between pulses counts that
/// the greatest common divisor of the periods allows; all of these distances occur in endless
/// trains. A variable width counts with all its values. If a train starts by a trigger, takes lists
/// or changes its rate, every distance to other trains counts. The number of bursts in a train is
/// ignored.
pub fn opposed_pairs<'a>(
    channels: &'a [Option<Channel>; CHANNELS],
    groups: &'a [Group],
) -> impl Iterator<Item = (u8, u8)> + 'a {
    let used = move || {
        (0u8..)
            .zip(channels)
            .filter_map(|(n, channel)| Some((n, channel.as_ref()?)))
    };
    used().flat_map(move |(n, own)| {
        let later = used().filter(move |(m, _)| *m > n);
        later.filter_map(move |(m, other)| {
            let bits = 1 << n | 1 << m; // at most 9
            let is_one_group = groups.iter().any(|group| {
                group.partner() == Partner::Isolated && group.members() & bits == bits
            });
            own.opposes(other, is_one_group).then_some((n, m))
        })
    })
}

/// An interval of time relative to a pulse's start, µs.
#[derive(Clone, Copy)]
struct RelativeInterval {
    from_us: u32,
    length_us: u32,
}

impl RelativeInterval {
    /// Returns the interval in which a pulse of `train` may drive this sign, at any of its widths;
    /// `None` if the train never drives it.
    fn of(train: &Train, is_cathodic: bool) -> Option<Self> {
        let shape = train.spec().shape;
        let widths = train.widths();
        let (narrowest, widest) = (u32::from(*widths.start()), u32::from(*widths.end()));
        if shape.cathodic_first() == is_cathodic {
            return Some(Self {
                from_us: 0,
                length_us: widest,
            });
        }
        shape.is_biphasic().then(|| Self {
            from_us: narrowest + u32::from(train.gap_us()),
            length_us: 2 * widest - narrowest, // to twice the widest and the gap
        })
    }

    /// Returns the interval of a whole burst of `train`, relative to its start.
    fn burst(train: &Train) -> Self {
        let last = train.spec().burst_count.saturating_sub(1);
        Self {
            from_us: 0,
            length_us: train.pulse_offset_us(last) + train.driven_us(),
        }
    }

    /// Returns the interval moved later by `us`.
    const fn delayed_by(self, us: u32) -> Self {
        Self {
            from_us: self.from_us + us, // below 2^23
            ..self
        }
    }

    /// Returns whether the two intervals, each repeated every `every_us`, overlap or come closer
    /// than the dead time.
    const fn overlaps(self, other: Self, every_us: u32) -> bool {
        let every_us = if every_us == 0 { 1 } else { every_us };
        // Time from the other interval's start to this one's, below `every_us`; all sums are below
        // 2^24.
        let behind = (self.from_us % every_us + every_us - other.from_us % every_us) % every_us;
        let dead_us = DEAD_TIME_US as u32;
        behind < other.length_us + dead_us || every_us - behind < self.length_us + dead_us
    }
}

impl Channel {
    fn opposes(&self, other: &Self, is_one_group: bool) -> bool {
        let is_known = is_one_group || self.is_steady() && other.is_steady();
        [true, false].into_iter().any(|is_cathodic| {
            let own = RelativeInterval::of(&self.train, is_cathodic);
            let its = RelativeInterval::of(&other.train, !is_cathodic);
            match (own, its) {
                (Some(own), Some(its)) => !is_known || self.meets_in(own, other, its),
                _ => false,
            }
        })
    }

    /// Returns whether the interval `own` of any of this channel's pulses meets the interval `its`
    /// of any of the other's.
    fn meets_in(&self, own: RelativeInterval, other: &Self, its: RelativeInterval) -> bool {
        let (a, b) = (self.train.spec(), other.train.spec());
        let every_us = gcd(a.period_us, b.period_us);
        let bursts = [&self.train, &other.train]
            .map(|train| RelativeInterval::burst(train).delayed_by(train.spec().offset_us));
        let [first, second] = bursts;
        first.overlaps(second, every_us)
            && (0..a.burst_count).any(|i| {
                let own = own.delayed_by(a.offset_us + self.train.pulse_offset_us(i));
                (0..b.burst_count).any(|j| {
                    let its = its.delayed_by(b.offset_us + other.train.pulse_offset_us(j));
                    own.overlaps(its, every_us)
                })
            })
    }
}
