//! Judges one forearm: with which probability its sessions meet the printed voltages.
//!
//! A session has a skin and a pair of places. While one point is pulsed the other floats, which
//! changes nothing, so that each place is judged once for each skin, and the pairs are summed with
//! their probabilities instead of being drawn.

use super::data::{PrintedVoltages, Table};
use super::forearm::{Forearm, Pair};
use super::judged::{Accepted, Candidate, Choice, Effort, JudgedForearm};
use super::prior::{Prior, SessionDraw};
use super::setup::{Setup, Solved};
use super::weights::choose_by_weight;
use crate::hamana2022::TwoPointsError;
use crate::hamana2022::couplings::{fit, fit_flexor};
use crate::hamana2022::voltages::{
    STEP_V, calibrate, calibrate_fast, greatest_angle_deg, search_extensor, search_point,
    visible_and_alone,
};
use hal_sim::body::hand::spec::{A, B, E};
use hal_sim::body::hand::{Hand, HandSpec};
use hal_sim::random::{unit, word};
use std::collections::BTreeMap;
use std::ops::Range;

/// Place in a session's random stream of the offsets of three thresholds, after those of its ranges.
const THRESHOLDS: u64 = 0x100;
/// Changes the stream of a table's sessions to that of the choice of one of them.
const CHOICE: u64 = 0x110;

/// Returns the threshold and the greatest voltage that the search finds at A if the greatest one is
/// within `noise_v` of `printed_v`. The ends of that tolerance decide most cases without the whole
/// search.
fn search_near(
    hand: &mut Hand,
    printed_v: f64,
    (noise_v, end_v): (f64, f64),
) -> Result<Option<[f64; 2]>, TwoPointsError> {
    match visible_and_alone(hand, A, printed_v - noise_v)? {
        [true, true] => {}
        [true, false] => return Ok(None),
        // The threshold may still lie within the tolerance.
        [false, _] if visible_and_alone(hand, A, printed_v + noise_v)?[0] => {}
        [false, _] => return Ok(None),
    }
    let found = search_point(hand, A, end_v)?;
    Ok(found.filter(|[_, most]| (most - printed_v).abs() <= noise_v + 1e-9))
}

/// Returns the parameters of a hand whose A has this coupling.
fn with_coupling(spec: &HandSpec, coupling: f64) -> HandSpec {
    HandSpec {
        coupling: [coupling, 1.0, 1.0],
        ..spec.clone()
    }
}

/// Places of B by place of A, with the probability of each pair.
fn by_a(pairs: &[Pair]) -> BTreeMap<usize, Vec<(usize, f64)>> {
    let mut others: BTreeMap<usize, Vec<(usize, f64)>> = BTreeMap::new();
    for Pair {
        points: [a, b],
        probability,
    } in pairs
    {
        others.entry(*a).or_default().push((*b, *probability));
    }
    others
}

impl Prior<'_> {
    /// Judges forearm `index`.
    ///
    /// # Errors
    /// Fails if the declaration or a hand is invalid.
    pub fn judge(&self, index: u64, effort: Effort) -> Result<JudgedForearm, TwoPointsError> {
        let voltages = PrintedVoltages::of(self.participant);
        let mut forearm = self.forearm(index)?;
        let mut judged = JudgedForearm {
            pairs: forearm.pairs().len(),
            ..JudgedForearm::unjudged(&self.participant.name, index)
        };
        if judged.pairs == 0 {
            return Ok(judged);
        }
        let [all, strict] = match voltages.solved_v {
            Some((_, most_v)) => {
                self.solve_sessions(&mut forearm, (index, most_v), effort.solved)?
            }
            None => {
                let references = self.references(&mut forearm, index, effort.solved)?;
                [references, Accepted::default()]
            }
        };
        judged.solved = all.met;
        judged.posterior = self.candidate(&mut forearm, (index, effort), (&all, 0))?;
        judged.strict = self.candidate(&mut forearm, (index, effort), (&strict, 1))?;
        Ok(judged)
    }

    /// Judges the sessions of table 7: all that meet the data, and those that also meet the second
    /// condition.
    fn solve_sessions(
        &self,
        forearm: &mut Forearm,
        (index, most_v): (u64, [f64; 2]),
        sessions: u64,
    ) -> Result<[Accepted<Solved>; 2], TwoPointsError> {
        let mut accepted = [Accepted::default(), Accepted::default()];
        let share = 1.0 / sessions as f64;
        let others = by_a(forearm.pairs());
        for session in 0..sessions {
            let draw = self.session(forearm.spec(), (index, Table::Seven, session))?;
            let [a_v, b_v, e_v] = self.thresholds_v(index, &draw)?;
            for (&a, others) in &others {
                let mut hand = forearm.hand_with_one(draw.spec.clone(), a)?;
                calibrate_fast(&mut hand, a_v)?;
                let Some([_, greatest_a]) = self.meets_seven(&mut hand, most_v[A])? else {
                    continue;
                };
                let of_a: f64 = others.iter().map(|(_, probability)| probability).sum();
                accepted[0].add_a(share * of_a);
                // The extensor's point has a threshold and a greatest voltage, or there is no
                // experiment 4.
                let can_extend = fit(&mut hand, None, Some(e_v))?
                    && search_extensor(&mut hand, Table::Seven.end_v())?.is_some();
                if !can_extend {
                    continue;
                }
                let factor = hand.factor;
                let extensor = hand.spec().coupling[E];
                let is_flexed = self.is_flexed(&mut hand, greatest_a)?;
                for &(b, probability) in others {
                    // The coupling scales the drive of B's own current, not that of the return, so
                    // that B has to be solved for the factor of each A.
                    let mut hand = forearm.hand_with_one(draw.spec.clone(), b)?;
                    hand.factor = factor;
                    if !fit_flexor(&mut hand, A, b_v)? {
                        continue;
                    }
                    let Some([_, greatest_b]) = self.meets_seven(&mut hand, most_v[B])? else {
                        continue;
                    };
                    let points = [a, b];
                    let solved = Solved {
                        setup: Setup { session, points },
                        factor,
                        coupling: [1.0, hand.spec().coupling[A], extensor],
                    };
                    accepted[0].add(solved, share * probability);
                    if is_flexed && self.is_flexed(&mut hand, greatest_b)? {
                        accepted[1].add(solved, share * probability);
                    }
                }
            }
        }
        Ok(accepted)
    }

    fn meets_seven(
        &self,
        hand: &mut Hand,
        printed_v: f64,
    ) -> Result<Option<[f64; 2]>, TwoPointsError> {
        search_near(hand, printed_v, (self.noise_v(), Table::Seven.end_v()))
    }

    /// Solves the thresholds of sessions of table 7, whatever their greatest voltages.
    fn references(
        &self,
        forearm: &mut Forearm,
        index: u64,
        sessions: u64,
    ) -> Result<Accepted<Solved>, TwoPointsError> {
        let mut accepted = Accepted::default();
        let share = 1.0 / sessions as f64;
        for session in 0..sessions {
            accepted.add_a(share);
            if let Some(solved) = self.reference(forearm, (index, session))? {
                accepted.add(solved, share);
            }
        }
        Ok(accepted)
    }

    /// Solves a session of table 7 for the thresholds, whatever its greatest voltages: for a
    /// participant without table 7 they are drawn from the population's ranges. The pair of places
    /// is drawn by its probability. Returns `None` if no coupling gives the thresholds.
    pub(super) fn reference(
        &self,
        forearm: &mut Forearm,
        (index, session): (u64, u64),
    ) -> Result<Option<Solved>, TwoPointsError> {
        let Some(points) = self.any_pair(forearm, (index, Table::Seven, session)) else {
            return Ok(None);
        };
        let draw = self.session(forearm.spec(), (index, Table::Seven, session))?;
        let [a_v, b_v, e_v] = self.thresholds_v(index, &draw)?;
        let mut hand = forearm.hand(draw.spec, points)?;
        calibrate(&mut hand, a_v)?;
        let is_fitted = fit(&mut hand, Some(b_v), Some(e_v))?;
        Ok(is_fitted.then(|| Solved {
            setup: Setup { session, points },
            factor: hand.factor,
            coupling: hand.spec().coupling,
        }))
    }

    /// Draws a pair of places for a session by its probability; `None` if there are no two selective
    /// places.
    pub(super) fn any_pair(
        &self,
        forearm: &Forearm,
        (index, table, session): (u64, Table, u64),
    ) -> Option<[usize; 2]> {
        let stream = word(self.session_stream(index, table) ^ CHOICE, session);
        let pairs = forearm.pairs().iter();
        let pairs: Vec<([usize; 2], f64)> =
            pairs.map(|pair| (pair.points, pair.probability)).collect();
        choose_by_weight(&pairs, unit(stream, 0)).copied()
    }

    /// Returns the thresholds that a session of table 7 is solved for, V. Each is uniform over the
    /// printed step of the search and over the steps of its noise. Those of a participant without
    /// table 7 are drawn from the population's ranges.
    fn thresholds_v(&self, index: u64, draw: &SessionDraw) -> Result<[f64; 3], TwoPointsError> {
        let Some(printed_v) = self.participant.thresholds_v else {
            return self.population.thresholds_v(self.own_seed(), index);
        };
        let noise_v = self.noise_v();
        Ok(std::array::from_fn(|point| {
            let part = unit(draw.stream, THRESHOLDS + point as u64);
            printed_v[point] - STEP_V - noise_v + part * (STEP_V + 2.0 * noise_v)
        }))
    }

    fn noise_v(&self) -> f64 {
        f64::from(self.declaration.noise_steps) * STEP_V
    }

    /// Returns whether A alone flexes the index finger fully at its greatest voltage, if the second
    /// condition applies to this participant.
    fn is_flexed(&self, hand: &mut Hand, greatest_v: f64) -> Result<bool, TwoPointsError> {
        let strict = &self.declaration.strict;
        Ok(strict.participant == self.participant.name
            && greatest_angle_deg(hand, A, greatest_v)? >= strict.flexed_deg)
    }

    /// Judges the sessions of tables 2 and 3, with thresholds as several of the accepted sessions of
    /// table 7 have solved them. `place` tells candidates of one forearm apart. Returns `None` if the
    /// forearm is not kept.
    fn candidate(
        &self,
        forearm: &mut Forearm,
        (index, effort): (u64, Effort),
        (accepted, place): (&Accepted<Solved>, u64),
    ) -> Result<Option<Candidate>, TwoPointsError> {
        let stream = word(self.session_stream(index, Table::Seven) ^ CHOICE, !place);
        let Some(probability) = accepted.with_chance(effort.kept_from, unit(stream, 0)) else {
            return Ok(None);
        };
        let mut choice = Choice::new(word(stream, 1));
        let mut any = None;
        let (mut met, mut joint) = ([[0.0; 2]; 2], 0.0);
        let first = unit(stream, 1);
        let share = 1.0 / effort.chosen as f64;
        for number in 0..effort.chosen {
            // One of each stretch of equal weight.
            let Some(solved) = accepted.at((number as f64 + first) * share) else {
                break;
            };
            let tables = self.unsolved_tables(forearm, (index, number), (solved, effort))?;
            let mut of_tables = 1.0;
            for (sum, table) in met.iter_mut().zip(&tables) {
                let own = table.as_ref().map_or([1.0; 2], |accepted| accepted.met);
                *sum = [sum[0] + share * own[0], sum[1] + share * own[1]];
                of_tables *= own[1];
            }
            let part = |table: u64| unit(stream, 2 + 2 * number + table);
            let [two, three] = &tables;
            let chosen = [(two, 0), (three, 1)]
                .map(|(accepted, table)| accepted.as_ref()?.at(part(table)).copied());
            joint += share * of_tables;
            any = any.or(Some((*solved, [None; 2])));
            choice.offer(of_tables, (*solved, chosen));
        }
        Ok(choice.chosen.or(any).map(|(solved, unsolved)| Candidate {
            solved,
            probability,
            joint,
            met,
            unsolved,
        }))
    }

    /// Judges the sessions of tables 2 and 3 with the thresholds of one session of table 7, number
    /// `number` of those that are chosen; `None` for a table that prints nothing of the participant.
    /// Table 3 is not judged if no session meets table 2.
    fn unsolved_tables(
        &self,
        forearm: &mut Forearm,
        (index, number): (u64, u64),
        (solved, effort): (&Solved, Effort),
    ) -> Result<[Option<Accepted<Setup>>; 2], TwoPointsError> {
        let voltages = PrintedVoltages::of(self.participant);
        let first = number * effort.unsolved;
        let sessions = first..first + effort.unsolved;
        let mut is_lost = false;
        let mut judge = |(table, most_v): (Table, Option<[f64; 2]>)| match most_v {
            None => Ok(None),
            Some(_) if is_lost => Ok(Some(Accepted::default())),
            Some(most_v) => {
                let of = (index, table, most_v);
                let accepted = self.unsolved_sessions(forearm, of, (solved, sessions.clone()))?;
                is_lost = accepted.met[1] == 0.0;
                Ok::<_, TwoPointsError>(Some(accepted))
            }
        };
        let [two, three] = Table::UNSOLVED;
        let [two_v, three_v] = voltages.unsolved_v;
        Ok([judge((two, two_v))?, judge((three, three_v))?])
    }

    /// Judges sessions of table 2 or 3: thresholds follow from electrodes and skin.
    fn unsolved_sessions(
        &self,
        forearm: &mut Forearm,
        (index, table, most_v): (u64, Table, [f64; 2]),
        (solved, sessions): (&Solved, Range<u64>),
    ) -> Result<Accepted<Setup>, TwoPointsError> {
        let mut accepted = Accepted::default();
        let share = 1.0 / (sessions.end - sessions.start) as f64;
        let within = (self.noise_v(), table.end_v());
        let others = by_a(forearm.pairs());
        for session in sessions {
            let draw = self.session(forearm.spec(), (index, table, session))?;
            let meets = |forearm: &mut Forearm, point: usize, place: usize| {
                let spec = with_coupling(&draw.spec, solved.coupling[point]);
                let mut hand = forearm.hand_with_one(spec, place)?;
                hand.factor = solved.factor;
                Ok::<_, TwoPointsError>(search_near(&mut hand, most_v[point], within)?.is_some())
            };
            let mut known_b: BTreeMap<usize, bool> = BTreeMap::new();
            for (&a, others) in &others {
                if !meets(forearm, A, a)? {
                    continue;
                }
                for &(b, probability) in others {
                    accepted.add_a(share * probability);
                    let is_met = match known_b.get(&b) {
                        Some(is_met) => *is_met,
                        None => meets(forearm, B, b)?,
                    };
                    known_b.insert(b, is_met);
                    if is_met {
                        let points = [a, b];
                        accepted.add(Setup { session, points }, share * probability);
                    }
                }
            }
        }
        Ok(accepted)
    }
}
