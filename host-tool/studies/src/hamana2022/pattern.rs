//! Stimulation patterns of Hamana 2022 (figure 5): when each point is driven, grounded or floating.

use hal_sim::body::hand::Segment;
use hal_sim::body::hand::network::Terminal;
use hal_sim::body::hand::spec::{A, B};
use serde::{Deserialize, Serialize};

/// Period of every pattern, µs: 50 Hz.
pub const PERIOD_US: u32 = 20_000;
/// Width of every pulse, µs.
pub const WIDTH_US: u32 = 200;

/// Phase differences of the conducted patterns, µs.
const CONDUCTED_US: [u32; 10] = [0, 50, 100, 150, 200, 500, 1_000, 2_000, 5_000, 10_000];
/// Number of conducted phase differences that have no isolated counterpart. They are the first ones
/// in [`CONDUCTED_US`].
const SHORT: usize = 6;
/// Phase differences of the isolated patterns, µs.
const ISOLATED_US: [u32; 4] = [1_000, 2_000, 5_000, 10_000];

/// Points that are pulsed, and their timing.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Points {
    /// One point alone, [`A`] or [`B`].
    One(usize),
    /// A and B, each with one pulse in every period.
    Two {
        /// Point that is pulsed first, [`A`] or [`B`].
        first: usize,
        /// Time from the pulse of the first point to that of the other point, µs; 0 if both are
        /// pulsed at the same time.
        after_us: u32,
    },
}

/// Stimulation pattern of one period.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Pattern {
    /// Points that are pulsed, and their timing.
    pub points: Points,
    /// Whether a point floats while the other is pulsed, instead of being grounded. In an isolated
    /// pattern, a point without pulses always floats.
    pub isolated: bool,
}

impl Pattern {
    /// Returns the 25 patterns of two points. A before B and B before A are the same pattern at 0
    /// and at half a period.
    #[must_use]
    pub fn all_two_point() -> Vec<Self> {
        let conducted = CONDUCTED_US.map(|after_us| (after_us, false));
        let isolated = ISOLATED_US.map(|after_us| (after_us, true));
        let mut patterns = Vec::new();
        for (after_us, isolated) in conducted.into_iter().chain(isolated) {
            let is_one = after_us == 0 || 2 * after_us == PERIOD_US;
            let orders = if is_one { &[A][..] } else { &[A, B][..] };
            patterns.extend(orders.iter().map(|&first| Self {
                points: Points::Two { first, after_us },
                isolated,
            }));
        }
        patterns
    }

    /// Returns the four patterns of one point: A conducted, A isolated, B conducted, B isolated.
    #[must_use]
    pub fn all_one_point() -> [Self; 4] {
        [(A, false), (A, true), (B, false), (B, true)].map(|(point, isolated)| Self {
            points: Points::One(point),
            isolated,
        })
    }

    /// Returns the pattern of one point in experiments 3 and 4: isolated.
    #[must_use]
    pub const fn isolated_point(point: usize) -> Self {
        Self {
            points: Points::One(point),
            isolated: true,
        }
    }

    /// Returns the pattern of two points in experiments 3 and 4: A before B by 2 ms, conducted.
    #[must_use]
    pub const fn default_two_point() -> Self {
        Self {
            points: Points::Two {
                first: A,
                after_us: 2_000,
            },
            isolated: false,
        }
    }

    /// Returns the phase difference of two points, µs; `None` for a pattern of one point.
    #[must_use]
    pub const fn phase_difference_us(&self) -> Option<u32> {
        match self.points {
            Points::One(_) => None,
            Points::Two { after_us, .. } => Some(after_us),
        }
    }

    /// Returns the number in figure 5, from 0 to 13; `None` for one point. A before B and B before
    /// A have the same number. The isolated patterns are 7, 9, 11 and 13, as in the text and table
    /// 5; the caption of figure 11 disagrees.
    #[must_use]
    pub fn number(&self) -> Option<usize> {
        let after_us = self.phase_difference_us()?;
        let place = CONDUCTED_US
            .iter()
            .position(|&conducted_us| conducted_us == after_us)?;
        Some(match place.checked_sub(SHORT) {
            None => place,
            Some(place) => SHORT + 2 * place + usize::from(self.isolated),
        })
    }

    /// Returns a description such as "A then B after 2000 µs, conducted".
    #[must_use]
    pub fn in_words(&self) -> String {
        let name = |point| if point == A { "A" } else { "B" };
        let state = if self.isolated {
            "isolated"
        } else {
            "conducted"
        };
        match self.points {
            Points::One(point) => format!("{} alone, {state}", name(point)),
            Points::Two { after_us: 0, .. } => format!("A and B together, {state}"),
            Points::Two { first, after_us } => {
                let (first, second) = (name(first), name(1 - first));
                format!("{first} then {second} after {after_us} µs, {state}")
            }
        }
    }

    /// Returns when the pulses of A and of B start in the period, µs; `None` for a point without
    /// pulses.
    fn begins_us(&self) -> [Option<u32>; 2] {
        match self.points {
            Points::One(A) => [Some(0), None],
            Points::One(_) => [None, Some(0)],
            Points::Two { first: A, after_us } => [Some(0), Some(after_us)],
            Points::Two { after_us, .. } => [Some(after_us), Some(0)],
        }
    }

    /// Returns one period with negative pulses of these voltages at A and B, V.
    #[must_use]
    pub fn period(&self, volts: [f64; 2]) -> Vec<Segment> {
        let begins = self.begins_us();
        let edges = begins.iter().flatten().flat_map(|&at| [at, at + WIDTH_US]);
        let mut edges: Vec<u32> = edges.chain([0, PERIOD_US]).collect();
        edges.sort_unstable();
        edges.dedup();
        let segments = edges.windows(2).map(|edge| Segment {
            terminals: self.terminals(begins, volts, edge[0]),
            lasts_us: edge[1] - edge[0],
        });
        segments.collect()
    }

    fn terminals(&self, begins: [Option<u32>; 2], volts: [f64; 2], at: u32) -> [Terminal; 3] {
        let drives = begins.map(|begin| begin.is_some_and(|b| (b..b + WIDTH_US).contains(&at)));
        let terminal = |point: usize| match (drives[point], begins[point]) {
            (true, _) => Terminal::Driven(-volts[point]),
            (false, None) if self.isolated => Terminal::Floating,
            (false, _) if self.isolated && drives[1 - point] => Terminal::Floating,
            _ => Terminal::Grounded,
        };
        // The extensor's electrode is not connected in these experiments.
        [terminal(A), terminal(B), Terminal::Floating]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_25_and_4() {
        assert_eq!(Pattern::all_two_point().len(), 25);
        let isolated = Pattern::all_two_point()
            .iter()
            .filter(|p| p.isolated)
            .count();
        assert_eq!(isolated, 7);
    }

    #[test]
    fn numbers_are_figure_5_s() {
        let mut numbers = [0; 14];
        for pattern in Pattern::all_two_point() {
            let number = pattern.number().unwrap();
            numbers[number] += 1;
            assert_eq!(pattern.isolated, number >= 7 && number % 2 == 1);
        }
        assert_eq!(numbers, [1, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 1, 1]);
        assert_eq!(Pattern::default_two_point().number(), Some(8));
        assert_eq!(Pattern::all_one_point()[0].number(), None);
    }

    #[test]
    fn a_period_is_whole_and_says_what_figure_6_shows() {
        for pattern in Pattern::all_two_point()
            .into_iter()
            .chain(Pattern::all_one_point())
        {
            let lasts: u32 = pattern.period([20.0; 2]).iter().map(|s| s.lasts_us).sum();
            assert_eq!(lasts, PERIOD_US, "{pattern:?}");
        }
        use Terminal::{Driven, Floating, Grounded};
        let segments = |after_us, isolated| {
            let points = Points::Two { first: A, after_us };
            let period = Pattern { points, isolated }.period([24.0, 28.0]);
            let short = period
                .iter()
                .map(|s| (s.lasts_us, s.terminals[A], s.terminals[B]));
            short.collect::<Vec<_>>()
        };
        assert_eq!(
            segments(50, false),
            [
                (50, Driven(-24.0), Grounded),
                (150, Driven(-24.0), Driven(-28.0)),
                (50, Grounded, Driven(-28.0)),
                (19_750, Grounded, Grounded)
            ]
        );
        assert_eq!(
            segments(1_000, true),
            [
                (200, Driven(-24.0), Floating),
                (800, Grounded, Grounded),
                (200, Floating, Driven(-28.0)),
                (18_800, Grounded, Grounded)
            ]
        );
    }
}
