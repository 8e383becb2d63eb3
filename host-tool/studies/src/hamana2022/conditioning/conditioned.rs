//! Judges one forearm: with which probability its sessions meet the printed voltages.
//!
//! A session has a skin and a pair of places. While one point is pulsed the other floats, which
//! changes nothing, so that each place is judged once for each skin, and the pairs are summed with
//! their probabilities instead of being drawn.

use super::data::{PrintedVoltages, Table};
use super::forearm::{Forearm, Pair};
use super::judged::{Accepted, CHOICE, Candidate, Choice, Effort, JudgedForearm};
use super::prior::{Prior, SessionDraw};
use super::setup::{Setup, Solved};
use crate::hamana2022::TwoPointsError;
use crate::hamana2022::couplings::{fit, fit_flexor};
use crate::hamana2022::voltages::{
    STEP_V, calibrate, calibrate_fast, greatest_angle_deg, search_extensor, search_point,
    visible_and_alone,
};
use hal_sim::body::hand::spec::{A, B, E};
use hal_sim::body::hand::{Hand, HandSpec};
use hal_sim::random::unit;
use std::collections::BTreeMap;

/// Place in a session's random stream of the offsets of three thresholds, after those of its ranges.
const THRESHOLDS: u64 = 0x100;
/// Place in the stream of table 7's sessions of the chance by which an unlikely forearm is kept.
const ROULETTE: u64 = 0x120;

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
            Some((_, most_v)) => self.solve_sessions(&mut forearm, (index, most_v), effort)?,
            None => [self.reference(&mut forearm, index)?, Accepted::default()],
        };
        judged.solved = [all.met[0], all.met[1]];
        let mut candidate = |accepted: Accepted<Solved>, place: u64| {
            let part = unit(self.session_stream(index, Table::Seven), ROULETTE + place);
            let kept = accepted.with_chance(effort.kept_from, part);
            kept.map(|kept| self.candidate(&mut forearm, (index, effort), kept))
                .transpose()
        };
        judged.posterior = candidate(all, 0)?;
        judged.strict = candidate(strict, 1)?;
        Ok(judged)
    }

    /// Judges the sessions of table 7: all that meet the data, and those that also meet the second
    /// condition.
    fn solve_sessions(
        &self,
        forearm: &mut Forearm,
        (index, most_v): (u64, [f64; 2]),
        effort: Effort,
    ) -> Result<[Accepted<Solved>; 2], TwoPointsError> {
        let stream = effort.stream(self.session_stream(index, Table::Seven));
        let mut choices = [Choice::new(stream), Choice::new(!stream)];
        let mut met_a = 0.0;
        let others = by_a(forearm.pairs());
        let [sessions, _] = effort.sessions;
        for session in effort.first_session..effort.first_session + sessions {
            let draw = self.session(forearm.spec(), (index, Table::Seven, session))?;
            let [a_v, b_v, e_v] = self.thresholds_v(index, &draw)?;
            for (&a, others) in &others {
                let mut hand = forearm.hand_with_one(draw.spec.clone(), a)?;
                calibrate_fast(&mut hand, a_v)?;
                let Some([_, greatest_a]) = self.meets_seven(&mut hand, most_v[A])? else {
                    continue;
                };
                met_a += others
                    .iter()
                    .map(|(_, probability)| probability)
                    .sum::<f64>();
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
                    choices[0].offer(probability, solved);
                    if is_flexed && self.is_flexed(&mut hand, greatest_b)? {
                        choices[1].offer(probability, solved);
                    }
                }
            }
        }
        let sessions = sessions as f64;
        Ok(choices.map(|choice| Accepted {
            met: [met_a / sessions, choice.total / sessions],
            chosen: choice.chosen,
        }))
    }

    fn meets_seven(
        &self,
        hand: &mut Hand,
        printed_v: f64,
    ) -> Result<Option<[f64; 2]>, TwoPointsError> {
        search_near(hand, printed_v, (self.noise_v(), Table::Seven.end_v()))
    }

    /// Solves session 0 of table 7 for the thresholds, whatever its greatest voltages: for a
    /// participant without table 7 they are drawn from the population's ranges. The pair of places
    /// is drawn by its probability.
    pub(super) fn reference(
        &self,
        forearm: &mut Forearm,
        index: u64,
    ) -> Result<Accepted<Solved>, TwoPointsError> {
        let Some(points) = self.any_pair(forearm, (index, Table::Seven)) else {
            return Ok(Accepted::default());
        };
        let draw = self.session(forearm.spec(), (index, Table::Seven, 0))?;
        let [a_v, b_v, e_v] = self.thresholds_v(index, &draw)?;
        let mut hand = forearm.hand(draw.spec, points)?;
        calibrate(&mut hand, a_v)?;
        if !fit(&mut hand, Some(b_v), Some(e_v))? {
            return Ok(Accepted::default());
        }
        let setup = Setup { session: 0, points };
        let solved = Solved {
            setup,
            factor: hand.factor,
            coupling: hand.spec().coupling,
        };
        Ok(Accepted {
            met: [1.0; 2],
            chosen: Some(solved),
        })
    }

    /// Draws a pair of places for a session of `table` by its probability; `None` if there are no two
    /// selective places.
    pub(super) fn any_pair(
        &self,
        forearm: &Forearm,
        (index, table): (u64, Table),
    ) -> Option<[usize; 2]> {
        let mut choice = Choice::new(self.session_stream(index, table) ^ CHOICE);
        for pair in forearm.pairs() {
            choice.offer(pair.probability, pair.points);
        }
        choice.chosen
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

    /// Judges the sessions of tables 2 and 3 on a solved forearm.
    fn candidate(
        &self,
        forearm: &mut Forearm,
        (index, effort): (u64, Effort),
        (solved, probability): (Solved, f64),
    ) -> Result<Candidate, TwoPointsError> {
        let mut candidate = Candidate {
            solved,
            probability,
            unsolved: [None; 2],
        };
        let voltages = PrintedVoltages::of(self.participant);
        let tables = Table::UNSOLVED.into_iter().zip(voltages.unsolved_v);
        for ((table, most_v), accepted) in tables.zip(&mut candidate.unsolved) {
            let Some(most_v) = most_v else { continue };
            let came =
                self.unsolved_sessions(forearm, (index, table, most_v), (&solved, effort))?;
            *accepted = Some(came);
            if came.chosen.is_none() {
                // The weight is 0 whatever the other table gives.
                break;
            }
        }
        Ok(candidate)
    }

    /// Judges the sessions of table 2 or 3: thresholds follow from electrodes and skin.
    fn unsolved_sessions(
        &self,
        forearm: &mut Forearm,
        (index, table, most_v): (u64, Table, [f64; 2]),
        (solved, effort): (&Solved, Effort),
    ) -> Result<Accepted<Setup>, TwoPointsError> {
        let mut choice = Choice::new(effort.stream(self.session_stream(index, table)));
        let (mut met_a, [_, sessions]) = (0.0, effort.sessions);
        let within = (self.noise_v(), table.end_v());
        let others = by_a(forearm.pairs());
        for session in effort.first_session..effort.first_session + sessions {
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
                    met_a += probability;
                    let is_met = match known_b.get(&b) {
                        Some(is_met) => *is_met,
                        None => meets(forearm, B, b)?,
                    };
                    known_b.insert(b, is_met);
                    if is_met {
                        let points = [a, b];
                        choice.offer(probability, Setup { session, points });
                    }
                }
            }
        }
        let sessions = sessions as f64;
        Ok(Accepted {
            met: [met_a / sessions, choice.total / sessions],
            chosen: choice.chosen,
        })
    }
}
