//! Wearers of a participant for an experiment: of the posterior, or of the prior.

use super::data::Table;
use super::forearm::Forearm;
use super::posterior::AcceptedForearm;
use super::prior::Prior;
use super::reference::{SOLVED, UNSOLVED};
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

    /// Returns the first forearm of the prior, from number 1000 · `draw` on, that has voltages in a
    /// session of each table; with `is_below`, the greatest ones of the session of table 7 lie below
    /// the end of the search. Of each table, the first session with voltages among as many as the
    /// calibration's reference has counts. `None` if there is no such forearm among 1000.
    ///
    /// # Errors
    /// Fails if the declaration or the hand is invalid.
    pub fn complete_forearm(
        &self,
        draw: u64,
        is_below: bool,
    ) -> Result<Option<AcceptedForearm>, TwoPointsError> {
        for index in draw * TRIED..(draw + 1) * TRIED {
            let mut forearm = self.forearm(index)?;
            let Some(solved) = self.solved_with_voltages(&mut forearm, index, is_below)? else {
                continue;
            };
            let mut unsolved = [None; 2];
            for (table, setup) in Table::UNSOLVED.into_iter().zip(&mut unsolved) {
                *setup = self.setup_with_voltages(&mut forearm, (index, table), &solved)?;
                if setup.is_none() {
                    break;
                }
            }
            if unsolved.iter().all(Option::is_some) {
                return Ok(Some(AcceptedForearm {
                    participant: self.participant.name.clone(),
                    drawn: (self.seed, index),
                    is_strict: false,
                    weight: 1.0,
                    solved,
                    unsolved,
                }));
            }
        }
        Ok(None)
    }

    /// Returns the first session of table 7 with voltages.
    fn solved_with_voltages(
        &self,
        forearm: &mut Forearm,
        index: u64,
        is_below: bool,
    ) -> Result<Option<Solved>, TwoPointsError> {
        let table = Table::Seven;
        let last_v = (table.end_v() / STEP_V).floor() * STEP_V;
        for session in 0..SOLVED {
            let Some(solved) = self.reference(forearm, (index, session))? else {
                continue;
            };
            let hand = self.hand_of(forearm, (index, table), (&solved, solved.setup))?;
            let Ok(wearer) = wearer(hand, table)? else {
                continue;
            };
            let mut most_v = wearer.voltages.most_v.iter();
            if !is_below || most_v.all(|most_v| *most_v < last_v) {
                return Ok(Some(solved));
            }
        }
        Ok(None)
    }

    /// Returns the first session of table 2 or 3 with voltages.
    fn setup_with_voltages(
        &self,
        forearm: &mut Forearm,
        (index, table): (u64, Table),
        solved: &Solved,
    ) -> Result<Option<Setup>, TwoPointsError> {
        for session in 0..UNSOLVED {
            let Some(points) = self.any_pair(forearm, (index, table, session)) else {
                return Ok(None);
            };
            let setup = Setup { session, points };
            let mut hand = self.hand_of(forearm, (index, table), (solved, setup))?;
            if Voltages::search(&mut hand, table.end_v())?.is_some() {
                return Ok(Some(setup));
            }
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
