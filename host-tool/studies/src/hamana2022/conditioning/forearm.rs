//! Forearm of a simulated participant with all places at which its sessions may put electrodes.

use crate::hamana2022::TwoPointsError;
use crate::hamana2022::points::{are_apart, extensor_pad, places, selectivity_of_drives};
use crate::hamana2022::study::SHAPES;
use hal_sim::body::hand::field::{Pad, Shape};
use hal_sim::body::hand::{Hand, HandSpec, Places};
use std::collections::BTreeMap;

/// Two places of A and B, and the probability that a session has its electrodes there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Indices of the places of A and B.
    pub points: [usize; 2],
    /// Part of all sessions that have this pair.
    pub probability: f64,
}

/// Forearm with the solved places of its electrodes: round ones, or small ones if there are no two
/// selective places for round ones (Hamana 2022, II-B).
pub struct Forearm {
    spec: HandSpec,
    places: Places,
    /// Number of places of A and B; that of the extensor follows.
    count: usize,
    pairs: Vec<Pair>,
}

impl Forearm {
    /// Creates a forearm whose sessions take the most selective of the places that they try, each
    /// with probability `tried`, or the first selective ones of a random order (`None`).
    ///
    /// # Errors
    /// Fails if the tissue is invalid.
    pub fn new(spec: HandSpec, tried: Option<f64>) -> Result<Self, TwoPointsError> {
        let [round, small] = SHAPES;
        let forearm = Self::with_shape(spec, round, tried)?;
        match forearm.pairs.is_empty() {
            false => Ok(forearm),
            true => Self::with_shape(forearm.spec, small, tried),
        }
    }

    fn with_shape(
        spec: HandSpec,
        shape: Shape,
        tried: Option<f64>,
    ) -> Result<Self, TwoPointsError> {
        let pads: Vec<Pad> = places(&spec, shape).collect();
        let count = pads.len();
        let extensor = extensor_pad(&spec, shape);
        let places = Places::new(&spec, pads.iter().copied().chain([extensor]).collect())?;
        let selectivity = |place: usize| {
            let drives = places.units().iter().zip(places.flexor_drives(place));
            selectivity_of_drives(&spec, drives.map(|(unit, drive)| (unit, *drive)))
        };
        let places_by_selectivity = (0..count).map(|place| (place, selectivity(place)));
        let mut selective: Vec<(usize, f64)> = places_by_selectivity
            .filter(|(_, selectivity)| *selectivity > 1.0)
            .collect();
        selective.sort_by(|a, b| b.1.total_cmp(&a.1));
        let selective: Vec<usize> = selective.into_iter().map(|(place, _)| place).collect();
        let pairs = pairs(&pads, &selective, tried);
        Ok(Self {
            spec,
            places,
            count,
            pairs,
        })
    }

    /// Returns the possible pairs of places; empty if there are no two selective places.
    pub fn pairs(&self) -> &[Pair] {
        &self.pairs
    }

    /// Returns the parameters of the forearm.
    pub const fn spec(&self) -> &HandSpec {
        &self.spec
    }

    /// Creates the hand of a session with A and B at these places. `spec` is that of the forearm,
    /// with the session's skin and couplings.
    ///
    /// # Errors
    /// Fails if the circuit of the hand is invalid.
    pub fn hand(&mut self, spec: HandSpec, [a, b]: [usize; 2]) -> Result<Hand, TwoPointsError> {
        Ok(self.places.hand(spec, [a, b, self.count])?)
    }

    /// Creates a hand of which only A, at this place, is used. B lies where it is not in the way:
    /// as long as it floats, it changes nothing.
    ///
    /// # Errors
    /// Fails as [`Self::hand`] does.
    pub fn hand_with_one(&mut self, spec: HandSpec, place: usize) -> Result<Hand, TwoPointsError> {
        let other = match 2 * place < self.count {
            true => self.count - 1,
            false => 0,
        };
        self.hand(spec, [place, other])
    }
}

/// Lists the pairs that a session may choose from `selective`, the selective places from the most
/// selective one down. `tried` is the probability that the session tries a place, of which it then
/// takes the most selective ones; `None` takes the first two of a random order.
fn pairs(pads: &[Pad], selective: &[usize], tried: Option<f64>) -> Vec<Pair> {
    let mut probabilities: BTreeMap<[usize; 2], f64> = BTreeMap::new();
    for (rank, &first) in selective.iter().enumerate() {
        // The most selective place of those tried is the first one, so that no place before it is
        // tried. In a random order every place can be the second one.
        let others = match tried {
            Some(_) => &selective[rank + 1..],
            None => selective,
        };
        let apart = others
            .iter()
            .filter(|&&other| are_apart(&pads[other], &pads[first]));
        let apart: Vec<usize> = apart.copied().collect();
        for (nth, &second) in apart.iter().enumerate() {
            let probability = match tried {
                Some(tried) => geometric(tried, rank) * geometric(tried, nth),
                None => 1.0 / (selective.len() * apart.len()) as f64,
            };
            // A is the one nearer to the thumb.
            let points = match pads[first].y_m >= pads[second].y_m {
                true => [first, second],
                false => [second, first],
            };
            *probabilities.entry(points).or_default() += probability;
        }
    }
    let pairs = probabilities.into_iter();
    pairs
        .map(|(points, probability)| Pair {
            points,
            probability,
        })
        .collect()
}

/// Returns the probability that the first success of trials with this probability is number `nth`,
/// from 0.
fn geometric(success: f64, nth: usize) -> f64 {
    success * (1.0 - success).powi(nth as i32)
}
