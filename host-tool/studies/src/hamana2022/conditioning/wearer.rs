//! Wearers of a participant for an experiment: of the posterior, or of the prior.

use super::data::Table;
use super::forearm::Forearm;
use super::posterior::AcceptedForearm;
use super::prior::Prior;
use super::setup::{Setup, Solved};
use crate::hamana2022::TwoPointsError;
use crate::hamana2022::points::{extensor_pad, is_selective, places};
use crate::hamana2022::study::SHAPES;
use crate::hamana2022::voltages::{STEP_V, Voltages, search_extensor};
use crate::hamana2022::wearers::Wearer;
use hal_sim::body::hand::field::{Field, Pad};
use hal_sim::body::hand::spec::{A, B, E};
use hal_sim::body::hand::{Hand, HandSpec, InvalidHand};

/// Number of prior forearms among which one with voltages in every session is looked for.
const TRIED: u64 = 1_000;

const NO_POINTS: &str = "no two selective points";
const NO_COUPLING: &str = "no coupling gives the thresholds";
const NO_VOLTAGES: &str = "a point moves nothing, or others too";
const NO_EXTENSION: &str = "the extensor's point extends nothing, or the wrist first";
/// A wearer, or the reason why there is none.
type WearerOrReason = Result<Wearer, &'static str>;

impl Prior<'_> {
    /// Creates the wearer of an accepted forearm in its session of `table`. The seed of this prior
    /// must be that of the forearm.
    ///
    /// # Errors
    /// Fails if the declaration or the hand is invalid.
    pub fn accepted_wearer(
        &self,
        accepted: &AcceptedForearm,
        table: Table,
    ) -> Result<WearerOrReason, TwoPointsError> {
        let setup = match table {
            Table::Two => accepted.unsolved[0],
            Table::Three => accepted.unsolved[1],
            Table::Seven => Some(accepted.solved.setup),
        };
        let Some(setup) = setup else {
            return Ok(Err(NO_POINTS));
        };
        let index = accepted.drawn.1;
        let forearm = self.forearm_spec(index)?;
        let pads = electrodes(&forearm, setup)?;
        let draw = self.session(&forearm, (index, table, setup.session))?;
        let spec = HandSpec {
            coupling: accepted.solved.coupling,
            ..draw.spec
        };
        let mut hand = Hand::new(spec, pads)?;
        hand.factor = accepted.solved.factor;
        wearer(hand, table)
    }

    /// Creates the wearer of forearm `index` of the prior in a session of `table`, whatever its
    /// greatest voltages.
    ///
    /// # Errors
    /// Fails if the declaration or the hand is invalid.
    pub fn prior_wearer(&self, index: u64, table: Table) -> Result<WearerOrReason, TwoPointsError> {
        let mut forearm = self.forearm(index)?;
        match self.solve_prior(&mut forearm, index)? {
            Ok(solved) => self.prior_session(&mut forearm, (index, table), &solved),
            Err(why) => Ok(Err(why)),
        }
    }

    fn solve_prior(
        &self,
        forearm: &mut Forearm,
        index: u64,
    ) -> Result<Result<Solved, &'static str>, TwoPointsError> {
        if forearm.pairs().is_empty() {
            return Ok(Err(NO_POINTS));
        }
        Ok(self.reference(forearm, (index, 0))?.ok_or(NO_COUPLING))
    }

    fn prior_session(
        &self,
        forearm: &mut Forearm,
        (index, table): (u64, Table),
        solved: &Solved,
    ) -> Result<WearerOrReason, TwoPointsError> {
        let setup = match table {
            Table::Seven => Some(solved.setup),
            other => {
                let points = self.any_pair(forearm, (index, other, 0));
                points.map(|points| Setup { session: 0, points })
            }
        };
        let Some(setup) = setup else {
            return Ok(Err(NO_POINTS));
        };
        let hand = self.hand_of(forearm, (index, table), (solved, setup))?;
        wearer(hand, table)
    }

    /// Returns the first forearm of the prior, from number 1000 · `draw` on, that has voltages in a
    /// session of each table; with `is_below`, the greatest ones of the session of table 7 lie below
    /// the end of the search. `None` if there is none among 1000.
    ///
    /// # Errors
    /// Fails if the declaration or the hand is invalid.
    pub fn complete_forearm(
        &self,
        draw: u64,
        is_below: bool,
    ) -> Result<Option<u64>, TwoPointsError> {
        let last_v = (Table::Seven.end_v() / STEP_V).floor() * STEP_V;
        'forearms: for index in draw * TRIED..(draw + 1) * TRIED {
            let mut forearm = self.forearm(index)?;
            let Ok(solved) = self.solve_prior(&mut forearm, index)? else {
                continue;
            };
            let of = (index, Table::Seven);
            let Ok(seven) = self.prior_session(&mut forearm, of, &solved)? else {
                continue;
            };
            let mut most_v = seven.voltages.most_v.iter();
            if is_below && !most_v.all(|most_v| *most_v < last_v) {
                continue;
            }
            for table in Table::UNSOLVED {
                let of = (index, table);
                if self.prior_session(&mut forearm, of, &solved)?.is_err() {
                    continue 'forearms;
                }
            }
            return Ok(Some(index));
        }
        Ok(None)
    }

    pub(super) fn hand_of(
        &self,
        forearm: &mut Forearm,
        (index, table): (u64, Table),
        (solved, setup): (&Solved, Setup),
    ) -> Result<Hand, TwoPointsError> {
        let draw = self.session(forearm.spec(), (index, table, setup.session))?;
        let mut hand = forearm.hand(draw.spec, setup.points)?;
        hand.factor = solved.factor;
        for point in [A, B, E] {
            hand.set_coupling(point, solved.coupling[point]);
        }
        Ok(hand)
    }
}

/// Searches the voltages of a hand in a session of `table`. Only the session of table 7 has an
/// extensor.
fn wearer(mut hand: Hand, table: Table) -> Result<WearerOrReason, TwoPointsError> {
    let Some(voltages) = Voltages::search(&mut hand, table.end_v())? else {
        return Ok(Err(NO_VOLTAGES));
    };
    let extensor_v = match table {
        Table::Seven => search_extensor(&mut hand, table.end_v())?,
        Table::Two | Table::Three => None,
    };
    if table == Table::Seven && extensor_v.is_none() {
        return Ok(Err(NO_EXTENSION));
    }
    Ok(Ok(Wearer {
        hand,
        voltages,
        extensor_v,
    }))
}

/// Returns the electrodes of a session: round ones if the forearm has selective places for them.
fn electrodes(spec: &HandSpec, setup: Setup) -> Result<[Pad; 3], TwoPointsError> {
    let field = Field::coarse(spec.tissue).map_err(InvalidHand::from)?;
    let units = spec.motor_units();
    let [round, small] = SHAPES;
    let pads = |shape| {
        let all: Vec<Pad> = places(spec, shape).collect();
        let [a, b] = setup.points;
        let pair = all.get(a).copied().zip(all.get(b).copied());
        pair.map(|(a, b)| [a, b, extensor_pad(spec, shape)])
    };
    let wrong = || TwoPointsError::Declaration("a session has no such places".to_owned());
    let pads_of_round = pads(round).ok_or_else(wrong)?;
    let is_round = pads_of_round[..2]
        .iter()
        .all(|pad| is_selective(spec, &field, &units, pad));
    match is_round {
        true => Ok(pads_of_round),
        false => pads(small).ok_or_else(wrong),
    }
}
