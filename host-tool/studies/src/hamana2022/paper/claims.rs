//! Judges the paper's claims in one replication: one forearm of each participant.

use super::anova::{complete_means, replications};
use super::{Part, draw_results};
use crate::hamana2022::angles::{IndexAngles, bends_others_above, index_angles};
use crate::hamana2022::experiments::{Condition, Experiment, Protocol, StimulationResult};
use crate::hamana2022::held::Hold;
use crate::hamana2022::replication::{Averages, Replication, Test};
use crate::hamana2022::sessions::{Session, mean};
use crate::hamana2022::torque_claims::{jointly, torque_verdicts};
use crate::hamana2022::tracked::LAWS;
use host_core::statistics;
use std::collections::BTreeMap;

/// Participants of experiment 4.
const CONTROLLED: [&str; 3] = ["P", "Q", "S"];
/// Largest flexion of a finger that counts as not flexed much, as a fraction of its range.
const NOT_MUCH: f64 = 0.2;
/// Angle from which on two points count as saturated, °.
const SATURATED_DEG: f64 = 95.0;
/// Printed r_th, and the step of its search.
const R_TH: [f64; 2] = [0.7, 0.1];
/// Loss of angle below which a finger does not sink, and from which on it sinks, °.
const SINKS_DEG: [f64; 2] = [1.0, 20.0];

/// All experiments of one replication. Each has the parts of its participants.
#[derive(Default)]
pub(super) struct ReplicationParts {
    pub selectivity: Vec<Part>,
    pub torque: Vec<Part>,
    pub intensities: Vec<Part>,
    pub posture: Vec<Part>,
    /// Experiment 4 and the hold; empty in a replication without them.
    pub control: Vec<Part>,
    pub hold: Vec<Part>,
}

/// Verdict on each claim by its identifier; `None` if the replication cannot judge it.
pub(super) type Verdicts = BTreeMap<String, Option<bool>>;

/// Quantities of a replication by name.
pub(super) type Quantities = BTreeMap<String, f64>;

/// Returns the averages and tests of experiment 1 or 2; `None` without participants, or if one of them
/// has no session: its absence is no agreement.
fn replication(experiment: Experiment, parts: &[Part]) -> Option<(Replication, Vec<Averages>)> {
    let sessions = parts.iter().map(|part| {
        let session = part.became.as_ref().ok()?.session()?;
        Some(Averages::from_session(
            experiment,
            &session.conditions,
            &session.stimulated,
        ))
    });
    let averages: Vec<Averages> = sessions.collect::<Option<_>>()?;
    (!averages.is_empty()).then(|| (Replication::from_averages(&averages), averages))
}

fn session_of<'p>(parts: &'p [Part], name: &'p str) -> Option<&'p Session> {
    draw_results(parts, name).find_map(|result| result.session())
}

impl ReplicationParts {
    /// Judges every claim, and returns the compared quantities.
    pub fn judge(&self, protocol: &Protocol, fully_deg: f64) -> (Verdicts, Quantities) {
        let (mut verdicts, mut quantities) = (Verdicts::new(), Quantities::new());
        let mut note = |id: &str, verdict: Option<bool>| {
            verdicts.insert(id.to_owned(), verdict);
        };
        for (id, verdict) in self.individuation(protocol, &mut quantities) {
            note(id, verdict);
        }
        for (id, verdict) in self.torque(protocol, &mut quantities) {
            note(id, verdict);
        }
        for (id, verdict) in self.angles(fully_deg) {
            note(id, verdict);
        }
        for (id, verdict) in self.thresholds(&mut quantities) {
            note(id, verdict);
        }
        for (id, verdict) in self.postures(protocol) {
            note(id, verdict);
        }
        if !self.control.is_empty() {
            for (id, verdict) in self.tracking(protocol, &mut quantities) {
                note(id, verdict);
            }
            for (id, verdict) in self.holds(&mut quantities) {
                note(id, verdict);
            }
        }
        // A ratio has no value where a torque is 0.
        quantities.retain(|_, value| value.is_finite());
        (verdicts, quantities)
    }

    fn individuation(
        &self,
        protocol: &Protocol,
        quantities: &mut Quantities,
    ) -> Vec<(&'static str, Option<bool>)> {
        let Some((replication, averages)) = replication(Experiment::Selectivity, &self.selectivity)
        else {
            return Vec::new();
        };
        let patterns = &replication.patterns;
        let above = |numbers: &[usize], least: f64| {
            jointly(
                numbers
                    .iter()
                    .map(|&number| Some(patterns[number]? > least)),
            )
        };
        for (averages, part) in averages.iter().zip(&self.selectivity) {
            if let (Some(zero), Some(late)) = (averages.patterns[0], averages.patterns[8]) {
                let name = &part.participant;
                quantities.insert(format!("{name}, II at 0 µs"), zero);
                quantities.insert(
                    format!("{name}, II at 2000 µs less that at 0 µs"),
                    late - zero,
                );
            }
        }
        let together = patterns[0].zip(patterns[8]).map(|(zero, late)| zero < late);
        let p = |test: Test| test.map(|[_, p]| p < protocol.significant);
        let late: Vec<usize> = (5..patterns.len()).collect();
        vec![
            ("1-selective", above(&late, protocol.selective)),
            ("1-above-0.9", above(&[6, 8, 10, 12], 0.9)),
            ("1-together", together),
            ("1-phase", p(replication.friedman)),
            ("1-isolation", p(replication.isolation).map(|is| !is)),
        ]
    }

    fn torque(
        &self,
        protocol: &Protocol,
        quantities: &mut Quantities,
    ) -> Vec<(&'static str, Option<bool>)> {
        let Some((replication, _)) = replication(Experiment::Torque, &self.torque) else {
            return Vec::new();
        };
        if let Some([conducted, isolated]) = replication.one_point {
            quantities.insert("torque of one point, conducted".to_owned(), conducted);
            quantities.insert("torque of one point, isolated".to_owned(), isolated);
            if let Some(two) = replication.patterns[8] {
                let ratio = two / conducted;
                quantities.insert("torque of two points at 2000 µs over one".to_owned(), ratio);
            }
            if let (Some(c), Some(i)) = (replication.patterns[8], replication.patterns[9]) {
                let name = "torque of two points at 2000 µs, conducted over isolated";
                quantities.insert(name.to_owned(), c / i);
            }
        }
        let verdicts = torque_verdicts(&replication, protocol.significant);
        let joint = jointly(verdicts.iter().map(|(_, verdict)| *verdict));
        verdicts.into_iter().chain([("2-jointly", joint)]).collect()
    }

    fn angles(&self, fully_deg: f64) -> Vec<(&'static str, Option<bool>)> {
        let Some(session) = session_of(&self.intensities, "P") else {
            return Vec::new();
        };
        let at = |letter: char, measure: &dyn Fn(&StimulationResult) -> f64| {
            mean(session, |c: &Condition| c.name.starts_with(letter), measure)
        };
        let alone = |letter: char| {
            let others = [0, 2, 3, 4].map(|digit| at(letter, &|s| s.flexed[digit]));
            jointly(others.map(|flexed| Some(flexed? < NOT_MUCH)))
        };
        let is_full = |letter: char| Some(at(letter, &|s| s.index_deg)? >= fully_deg);
        vec![
            (
                "3-alone",
                jointly(['a', 'b', 'c', 'd', 'e', 'f'].map(alone)),
            ),
            ("3-over", bends_others_above(session)),
            ("3-full", jointly(['d', 'e'].map(is_full))),
        ]
    }

    fn thresholds(&self, quantities: &mut Quantities) -> Vec<(&'static str, Option<bool>)> {
        let results = CONTROLLED.map(|name| draw_results(&self.posture, name).next());
        let mut lower = Vec::new();
        let mut near = Vec::new();
        for (name, result) in CONTROLLED.into_iter().zip(results) {
            let ratio = result.and_then(|result| result.voltages.ratio);
            if let Some(ratio) = ratio {
                quantities.insert(format!("{name}, r_th"), ratio);
            }
            lower.push(result.map(|result| {
                let points = result
                    .voltages
                    .most_v
                    .into_iter()
                    .zip(result.voltages.threshold_v);
                let mut points = points.into_iter();
                ratio.is_some_and(|r| points.all(|(most, threshold)| r * most < threshold))
            }));
            let is_near = |ratio: f64| (ratio - R_TH[0]).abs() <= R_TH[1] + 1e-9;
            near.push(result.map(|_| ratio.is_some_and(is_near)));
        }
        vec![
            ("4-lower-threshold", jointly(lower)),
            ("4-r-th", jointly(near)),
        ]
    }

    fn postures(&self, protocol: &Protocol) -> Vec<(&'static str, Option<bool>)> {
        let all = CONTROLLED.map(|name| session_of(&self.posture, name).and_then(index_angles));
        let each =
            |holds: &dyn Fn(IndexAngles) -> bool| jointly(all.map(|angles| angles.map(holds)));
        let [p, q, _] = all;
        let saturated = |[_, two]: IndexAngles| two.iter().all(|deg| *deg >= SATURATED_DEG);
        vec![
            (
                "p-one-falls",
                each(&|[one, _]| one[0] > one[1] && one[0] > one[2]),
            ),
            (
                "p-two-saturated",
                jointly([p, q].map(|angles| angles.map(saturated))),
            ),
            ("p-two-50", each(&|[_, two]| two[1] >= protocol.posture_deg)),
            ("p-two-more", each(&|[one, two]| two[2] > one[2])),
        ]
    }

    fn tracking(
        &self,
        protocol: &Protocol,
        quantities: &mut Quantities,
    ) -> Vec<(&'static str, Option<bool>)> {
        let law = LAWS[0];
        for name in CONTROLLED {
            let tracking = draw_results(&self.control, name).find_map(|result| result.tracking());
            let means = tracking.map_or([None; 2], |tracking| tracking.means(law));
            for (mean, points) in means.into_iter().zip(["one point", "two points"]) {
                if let Some(mean) = mean {
                    quantities.insert(format!("{name}, RMSE with {points}, °"), mean);
                }
            }
        }
        let means = complete_means(&self.control, law).into_iter().next();
        let better = means.map(|means| means.iter().all(|[one, two]| two < one));
        let analysis = replications(&self.control, law).into_iter().next();
        let p = |source: usize| {
            analysis
                .as_ref()
                .map(|values| values[source][1] < protocol.significant)
        };
        vec![
            ("4-two-better", better),
            ("4-points", p(0)),
            ("4-participants", p(1).map(|is| !is)),
            ("4-interaction", p(2).map(|is| !is)),
        ]
    }

    fn holds(&self, quantities: &mut Quantities) -> Vec<(&'static str, Option<bool>)> {
        let drops = CONTROLLED.map(|name| -> Option<[f64; 2]> {
            let held = draw_results(&self.hold, name).find_map(|result| result.held())?;
            let mean = |place: usize| {
                statistics::mean(held.iter().map(|pair: &[Hold; 2]| pair[place].drop_deg()))
            };
            Some([mean(0)?, mean(1)?])
        });
        for (name, drop) in CONTROLLED.into_iter().zip(drops) {
            for (drop, points) in drop.into_iter().flatten().zip(["one point", "two points"]) {
                quantities.insert(format!("{name}, loss in the hold with {points}, °"), drop);
            }
        }
        let [p, q, _] = drops;
        let [none_deg, sinks_deg] = SINKS_DEG;
        vec![
            (
                "h-two-less",
                jointly(drops.map(|drop| drop.map(|[one, two]| two < one))),
            ),
            (
                "h-two-none",
                jointly([p, q].map(|drop| drop.map(|[_, two]| two < none_deg))),
            ),
            (
                "h-one-sinks",
                jointly(drops.map(|drop| drop.map(|[one, _]| one >= sinks_deg))),
            ),
        ]
    }
}
