//! Reference table of the calibration: voltages and results of a forearm's sessions, whatever they
//! are.

use super::data::Table;
use super::prior::Prior;
use super::setup::Setup;
use crate::hamana2022::TwoPointsError;
use crate::hamana2022::pattern::{Pattern, Points};
use crate::hamana2022::voltages::{STEP_V, Voltages};
use hal_sim::body::hand::Hand;
use hal_sim::body::hand::spec::A;
use serde::{Deserialize, Serialize};

/// Number of sessions of table 7 of a forearm.
pub const SOLVED: u64 = 8;
/// Number of sessions of each of tables 2 and 3 for each session of table 7.
pub const UNSOLVED: u64 = 12;
/// Phase difference of two points in experiment 2 that counts, µs.
const APART_US: u32 = 10_000;

/// Sessions of one forearm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReferenceForearm {
    /// Number of the forearm, from 0.
    pub index: u64,
    /// Sessions of table 7 in which both points have a threshold and a greatest voltage.
    pub solved: Vec<SolvedReference>,
}

/// A session of table 7 with sessions of the other tables.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolvedReference {
    /// Number of the session.
    pub session: u64,
    /// The session. Its result is r_th, the smallest ratio of both greatest voltages that bends the
    /// finger.
    pub seven: ReferenceSession,
    /// Sessions of table 2, with individuation at 0 µs as result, and of table 3, with the torque of
    /// two points over that of the stronger one, conducted, as result. `None` without voltages.
    pub others: [Vec<Option<ReferenceSession>>; 2],
}

/// Greatest voltages of a session and one result.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReferenceSession {
    /// Greatest selective voltages of A and B, in steps of the search.
    pub most: [i32; 2],
    /// Result; `None` without a value.
    pub result: Option<f64>,
}

impl Prior<'_> {
    /// Simulates the sessions of forearm `index`, each at one random pair of places.
    ///
    /// # Errors
    /// Fails if the declaration or a hand is invalid.
    pub fn reference_forearm(&self, index: u64) -> Result<ReferenceForearm, TwoPointsError> {
        let mut forearm = self.forearm(index)?;
        let mut reference = ReferenceForearm {
            index,
            solved: Vec::new(),
        };
        if forearm.pairs().is_empty() {
            return Ok(reference);
        }
        for session in 0..SOLVED {
            let Some(solved) = self.reference(&mut forearm, (index, session))? else {
                continue;
            };
            let mut session_of = |table: Table, number: u64| {
                let points = match table {
                    Table::Seven => Some(solved.setup.points),
                    _ => self.any_pair(&forearm, (index, table, number)),
                };
                let Some(points) = points else {
                    return Ok(None);
                };
                let setup = Setup {
                    session: number,
                    points,
                };
                let hand = self.hand_of(&mut forearm, (index, table), (&solved, setup))?;
                measure(hand, table)
            };
            let Some(seven) = session_of(Table::Seven, session)? else {
                continue;
            };
            let mut others = [Vec::new(), Vec::new()];
            for (table, own) in Table::UNSOLVED.into_iter().zip(&mut others) {
                for number in session * UNSOLVED..(session + 1) * UNSOLVED {
                    own.push(session_of(table, number)?);
                }
            }
            reference.solved.push(SolvedReference {
                session,
                seven,
                others,
            });
        }
        Ok(reference)
    }
}

/// Searches the greatest voltages of a session and computes its result.
fn measure(mut hand: Hand, table: Table) -> Result<Option<ReferenceSession>, TwoPointsError> {
    let Some(voltages) = Voltages::search(&mut hand, table.end_v())? else {
        return Ok(None);
    };
    let most_v = voltages.most_v;
    let mut respond = |points: Points| {
        let pattern = Pattern {
            points,
            isolated: false,
        };
        hand.respond(&pattern.period(most_v))
    };
    let two = |after_us| Points::Two { first: A, after_us };
    let result = match table {
        Table::Seven => voltages.ratio,
        Table::Two => respond(two(0))?.individuation(),
        Table::Three => {
            let both = respond(two(APART_US))?.index_nm();
            let [a, b] = [respond(Points::One(0))?, respond(Points::One(1))?];
            let one = a.index_nm().max(b.index_nm());
            (one > 0.0).then(|| both / one)
        }
    };
    Ok(Some(ReferenceSession {
        most: most_v.map(|volts| (volts / STEP_V).round() as i32),
        result,
    }))
}
