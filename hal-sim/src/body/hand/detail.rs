//! Level of detail of a hand in motion: which muscle pools it simulates, and how many motor units
//! stand for each pool.
//!
//! The motor units of a wearer are always the same ones. A coarser hand divides the units of a pool
//! into groups of similar units and simulates one unit of each group, which counts as often as the
//! group has units. Each further division splits the groups of the coarser hand.

use super::digits::INDEX;
use super::forearm::{Forearm, Unit};
use super::pools::Pool;
use super::spec::RETURN;

/// Muscle pools that are simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pools {
    /// Every pool.
    All,
    /// The pools that move the index finger. Nerves and muscles do not act on each other or on the
    /// currents, so that the index finger moves as in a hand with every pool, bit for bit.
    Index,
}

/// Level of detail of a hand in motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HandDetail {
    /// Muscle pools that are simulated; the digits of all others stay at rest.
    pub pools: Pools,
    /// Largest number of motor units that are simulated for each pool; `None` for every unit.
    pub units: Option<usize>,
}

impl HandDetail {
    /// Every motor unit of every pool.
    pub const FULL: Self = Self {
        pools: Pools::All,
        units: None,
    };
}

impl Pools {
    /// Returns whether this pool is simulated.
    #[must_use]
    pub fn contains(self, pool: Pool) -> bool {
        match self {
            Self::All => true,
            Self::Index => pool.flexed_digit() == Some(INDEX) || pool == Pool::ExtensorIndicis,
        }
    }
}

/// A motor unit that is simulated for a group of units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Representative {
    /// Index of the unit in [`Forearm::units`].
    pub unit: usize,
    /// Number of units in its group, itself included.
    pub count: usize,
}

/// Returns the motor units of `forearm` that a hand with this detail simulates, in the order of
/// [`Forearm::units`].
pub(super) fn representatives(forearm: &Forearm, detail: HandDetail) -> Vec<Representative> {
    let units = forearm.units().iter().enumerate();
    let kept: Vec<(usize, &Unit)> = units
        .filter(|(_, unit)| detail.pools.contains(unit.pool))
        .collect();
    let pools = kept.chunk_by(|a, b| a.1.pool == b.1.pool);
    let mut found: Vec<Representative> = pools
        .flat_map(|pool| {
            let pool: Vec<usize> = pool.iter().map(|(index, _)| *index).collect();
            let most = detail.units.unwrap_or(pool.len()).max(1);
            groups(forearm, pool, most)
                .into_iter()
                .map(|group| representative(forearm, &group))
                .collect::<Vec<_>>()
        })
        .collect();
    found.sort_by_key(|representative| representative.unit);
    found
}

/// Divides the units of a pool into at most `most` groups: again and again, the group with the
/// largest spread of excitability is halved at its median.
fn groups(forearm: &Forearm, pool: Vec<usize>, most: usize) -> Vec<Vec<usize>> {
    if most >= pool.len() {
        return pool.into_iter().map(|unit| vec![unit]).collect();
    }
    let mut groups = vec![pool];
    while groups.len() < most {
        let spreads = groups.iter().map(|group| widest(forearm, group));
        let largest = spreads
            .enumerate()
            .max_by(|(_, a), (_, b)| a.1.total_cmp(&b.1));
        let Some((place, (electrode, _))) = largest else {
            break;
        };
        let mut group = groups.swap_remove(place);
        let at = |unit: usize| forearm.excitability(unit)[electrode];
        group.sort_by(|a, b| at(*a).total_cmp(&at(*b)).then(a.cmp(b)));
        let upper = group.split_off(group.len() / 2);
        groups.extend([group, upper].into_iter().filter(|half| !half.is_empty()));
    }
    groups
}

/// Returns the electrode to which the units of a group respond most differently, and the sum of
/// their squared differences from the mean; −1 for a group that cannot be divided.
fn widest(forearm: &Forearm, group: &[usize]) -> (usize, f64) {
    if group.len() < 2 {
        return (0, -1.0);
    }
    let mean = mean(forearm, group);
    let spread = |electrode: usize| {
        let apart = group
            .iter()
            .map(|unit| forearm.excitability(*unit)[electrode] - mean[electrode]);
        apart.map(|apart| apart * apart).sum::<f64>()
    };
    let spreads = (0..RETURN).map(|electrode| (electrode, spread(electrode)));
    spreads
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0, 0.0))
}

/// Returns the mean excitability of a group by each electrode.
fn mean(forearm: &Forearm, group: &[usize]) -> [f64; RETURN] {
    let mut mean = [0.0; RETURN];
    for unit in group {
        for (sum, value) in mean.iter_mut().zip(forearm.excitability(*unit)) {
            *sum += value / group.len() as f64;
        }
    }
    mean
}

/// Returns the unit of a group that is nearest to the group's mean.
fn representative(forearm: &Forearm, group: &[usize]) -> Representative {
    let mean = mean(forearm, group);
    let distance = |unit: usize| {
        let pairs = forearm.excitability(unit).into_iter().zip(mean);
        pairs
            .map(|(value, mean)| (value - mean).powi(2))
            .sum::<f64>()
    };
    let nearest = group
        .iter()
        .copied()
        .min_by(|a, b| distance(*a).total_cmp(&distance(*b)).then(a.cmp(b)));
    Representative {
        unit: nearest.unwrap_or_default(), // no group is empty
        count: group.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::pools::POOLS;
    use super::super::{FittedHand, HandSpec};
    use super::*;
    use crate::body::hand::Hand;

    fn hand() -> Hand {
        let spec = HandSpec::nominal(0.42, 0.25, 7);
        let at = |along: f64, around: f64| {
            HandSpec::round_pad(along * spec.forearm_m, around * spec.around_m)
        };
        let points = [at(0.40, 0.03), at(0.66, 0.02), at(0.72, 0.45)];
        Hand::new(spec, points).unwrap()
    }

    /// Every unit belongs to one group, and a finer hand splits the groups of a coarser one.
    #[test]
    fn finer_groups_divide_coarser_ones() {
        let hand = hand();
        let every = hand.spec().units;
        for place in 0..POOLS.len() {
            let pool: Vec<usize> = (place * every..(place + 1) * every).collect();
            let mut coarser = vec![pool.clone()];
            for most in 1..=every {
                let finer = groups(hand.forearm(), pool.clone(), most);
                assert_eq!(finer.len(), most);
                let mut units = finer.concat();
                units.sort_unstable();
                assert_eq!(units, pool);
                let is_within = |part: &Vec<usize>, whole: &Vec<usize>| {
                    part.iter().all(|unit| whole.contains(unit))
                };
                for group in &finer {
                    assert!(coarser.iter().any(|whole| is_within(group, whole)));
                }
                coarser = finer;
            }
        }
    }

    #[test]
    fn representatives_count_for_every_unit_of_the_index_finger() {
        let hand = hand();
        let every = hand.spec().units;
        for units in [Some(1), Some(5), Some(every), Some(every + 1), None] {
            let pools = Pools::Index;
            let found = representatives(hand.forearm(), HandDetail { pools, units });
            let most = units.map_or(every, |units| units.min(every));
            assert_eq!(found.len(), 3 * most, "{units:?}");
            let counts = found.iter().map(|one| one.count);
            assert_eq!(counts.sum::<usize>(), 3 * every, "{units:?}");
            assert!(found.is_sorted_by_key(|one| one.unit));
        }
        let full = representatives(hand.forearm(), HandDetail::FULL);
        assert_eq!(full.len(), POOLS.len() * every);
        assert!(full.iter().all(|one| one.count == 1));
    }

    /// A hand with the pools of the index finger only moves that finger as one with all pools.
    #[test]
    fn other_pools_do_not_act_on_the_index_finger() {
        use crate::body::{Body, Drive, Lead};
        let hand = hand();
        let [a, b, e, _] = *hand.pads();
        let fitted = FittedHand {
            spec: hand.spec().clone(),
            points: [a, b, e],
            factor: 300.0,
            shift_m: [1e-3, -2e-3],
            channels: [0, 1, 2],
            simulated_units: None,
        };
        let mut hands = [
            fitted.to_moving_hand(5).unwrap(),
            fitted.to_index_finger(5).unwrap(),
        ];
        for moving in &mut hands {
            for at_us in (0..1_500_000).step_by(20_000) {
                for (channel, after_us) in [(0, 0), (1, 2_000)] {
                    let begin_us = at_us + after_us;
                    moving.set_lead(begin_us, channel, Lead::Cathodic(Drive::Volts(26.0)));
                    moving.set_lead(begin_us + 200, channel, Lead::Grounded);
                }
                moving.advance(at_us + 20_000);
            }
        }
        let [all, index] = hands;
        assert!(all.angle_deg() > 20.0, "{}", all.angle_deg());
        assert_eq!(all.angle_deg(), index.angle_deg());
        assert_eq!(all.sensed_deg(), index.sensed_deg());
        assert_eq!(all.loads(), index.loads());
        let [others, rest] = [&all, &index].map(|hand| hand.angles_deg()[2]);
        assert!(others != rest && rest == super::super::digits::REST_DEG[2]);
    }
}
