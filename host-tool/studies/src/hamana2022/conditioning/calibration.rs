//! Calibration of the conditioning: forearms of the prior stand for participants whose truth is known.
//!
//! A reference table of forearms at P's sizes and thresholds keeps the greatest voltages and results
//! of their sessions. Pseudo-participants are sets of sessions whose greatest voltages lie below the
//! end of the search. Their voltages, moved by the noise of the search, are conditioned on with the
//! whole table: all six, which few forearms meet, and those of table 7 alone. Forearms with such sets
//! are equally likely truths, and so are the sets of one forearm: the truth is a random one of the
//! accepted values, and its ranks are uniform. Without the truth's own forearm they would not be,
//! because few forearms are accepted; a truth is judged only if enough others are.

use super::data::Table;
use super::declaration::{DECLARED, Declaration};
use super::mechanism::Mechanism;
use super::outcome::{SIMULATED, number};
use super::prior::Prior;
use super::ranks::{band, deviations, largest, places, rank};
use super::reference::{ReferenceForearm, ReferenceSession, SolvedReference};
use super::weights::WeightSummary;
use crate::hamana2022::population::Population;
use crate::hamana2022::voltages::STEP_V;
use crate::hamana2022::wearers::Participants;
use crate::hamana2022::{Participant, TwoPointsError};
use crate::laboratory::{
    self, Curve, Outcome, Plot, Plots, Preregistration, Row, Sheet, SheetAxis, StudyIdentity,
};
use hal_sim::random::{Random, unit, word};
use std::collections::BTreeMap;

/// Name of the study on the command line.
pub const CALIBRATION: &str = "hamana-calibration";
/// Participant whose sizes and thresholds the pseudo-participants have.
const SIZED: &str = "P";
/// Fewest forearms, as an effective number, by which a pseudo-participant is judged.
const FEWEST: f64 = 4.0;
/// Changes the seed to that of the noise of pseudo-data and of ties.
const NOISE: u64 = 0x7137;
/// Results of sessions, after the drawn parameters.
const RESULTS: [&str; 3] = ["r_th", "II at 0 us", "torque of two points over one"];

/// Voltages of a pseudo-participant that are conditioned on.
#[derive(Clone, Copy, PartialEq, Eq)]
enum DataScope {
    /// Both greatest voltages of each table.
    AllTables,
    /// Both greatest voltages of table 7.
    TableSeven,
}

impl DataScope {
    const fn name(self) -> &'static str {
        match self {
            Self::AllTables => "all tables",
            Self::TableSeven => "table 7",
        }
    }
}

/// Calibration at one seed.
pub struct CalibrationStudy {
    declaration: Declaration,
    population: Population,
    participant: Participant,
    seed: u64,
    /// Number of forearms in the reference table.
    forearms: u64,
    as_declared: bool,
}

impl CalibrationStudy {
    /// Creates the study; `None` for seed and number of forearms takes the declared ones.
    ///
    /// # Errors
    /// Returns E621 if the declaration is wrong.
    pub fn new((seed, forearms): (Option<u64>, Option<u64>)) -> Result<Self, TwoPointsError> {
        let declaration = Declaration::load_embedded()?;
        let sizes = declaration.calibration;
        let participants = Participants::load(Some(SIZED))?.all;
        let participant = participants.into_iter().next();
        Ok(Self {
            as_declared: seed.is_none_or(|own| own == sizes.seed)
                && forearms.is_none_or(|own| own == sizes.forearms),
            seed: seed.unwrap_or(sizes.seed),
            forearms: forearms.unwrap_or(sizes.forearms),
            participant: participant.ok_or_else(|| TwoPointsError::Nobody(SIZED.to_owned()))?,
            population: Population::load_embedded()?,
            declaration,
        })
    }

    const fn prior(&self) -> Prior<'_> {
        Prior {
            declaration: &self.declaration,
            population: &self.population,
            participant: &self.participant,
            mechanism: Mechanism::Default,
            seed: self.seed,
        }
    }

    /// Returns the names of all quantities whose ranks are judged.
    fn quantities(&self) -> Vec<String> {
        let prior = self.prior();
        let fields = prior.fields().map(str::to_owned);
        fields.chain(RESULTS.map(str::to_owned)).collect()
    }

    /// Returns the ranks of each quantity over the pseudo-participants that can be judged, and the
    /// number of those that cannot.
    fn ranks(&self, forearms: &[ReferenceForearm], scope: DataScope) -> (Vec<Vec<f64>>, usize) {
        let mut ranks = vec![Vec::new(); self.quantities().len()];
        let mut undecided = 0;
        // One truth of each forearm, because its sessions have their parameters in common.
        let mut random = Random::new(self.seed ^ NOISE);
        let mut truths: Vec<Truth> = forearms
            .iter()
            .filter_map(|own| {
                let mut own = truths(own);
                (!own.is_empty()).then(|| own.swap_remove(random.below(own.len() as u64) as usize))
            })
            .collect();
        random.shuffle(&mut truths);
        let pseudo = usize::try_from(self.declaration.calibration.pseudo).unwrap_or(usize::MAX);
        for (number, truth) in truths.iter().take(pseudo).enumerate() {
            let stream = word(self.seed ^ NOISE, number as u64);
            let steps = i64::from(self.declaration.noise_steps);
            let noisy = |place: usize, most: i32| {
                let part = unit(stream, place as u64) * (2 * steps + 1) as f64;
                most + (part as i64 - steps) as i32
            };
            let [seven, two, three] = truth.sessions.map(|own| own.most);
            let data: Vec<i32> = [seven, two, three]
                .concat()
                .into_iter()
                .enumerate()
                .map(|(place, most)| noisy(place, most))
                .collect();
            let accepted = forearms
                .iter()
                .filter_map(|own| self.accept(own, (&data, scope)));
            let accepted: Vec<AcceptedReference<'_>> = accepted.collect();
            let others = accepted.iter().filter(|own| own.index != truth.index);
            let weights: Vec<f64> = others.map(AcceptedReference::weight).collect();
            if WeightSummary::of(&weights).effective < FEWEST {
                undecided += 1;
                continue;
            }
            let own = self.truth(truth);
            for (quantity, (ranks, truth)) in ranks.iter_mut().zip(own).enumerate() {
                let values: Vec<(f64, f64)> = accepted
                    .iter()
                    .flat_map(|accepted| self.values(accepted, quantity))
                    .collect();
                let part = unit(stream, 100 + quantity as u64);
                ranks.extend(truth.and_then(|truth| rank(truth, &values, part)));
            }
        }
        (ranks, undecided)
    }

    /// Returns the values of a pseudo-participant, by quantity.
    fn truth(&self, truth: &Truth) -> Vec<Option<f64>> {
        let drawn = self.prior();
        let drawn = drawn.values(truth.index, Table::Seven, truth.session);
        let results = truth.sessions.map(|own| own.result);
        drawn.into_iter().map(Some).chain(results).collect()
    }

    /// Returns the sessions of a forearm that meet the data; `None` if no set of them does.
    fn accept<'a>(
        &self,
        forearm: &'a ReferenceForearm,
        (data, scope): (&[i32], DataScope),
    ) -> Option<AcceptedReference<'a>> {
        let steps = i32::try_from(self.declaration.noise_steps).unwrap_or(i32::MAX);
        let meets = |session: &ReferenceSession, first: usize| {
            let own = session.most.iter().zip(&data[first..]);
            own.into_iter()
                .all(|(most, data)| (most - data).abs() <= steps)
        };
        let mut sets = Vec::new();
        let solved = forearm.solved.iter();
        let solved =
            solved.filter(|own| is_below(&own.seven, Table::Seven) && meets(&own.seven, 0));
        for solved in solved {
            let [two, three] = [(0, 2), (1, 4)].map(|(table, first): (usize, usize)| {
                let own = solved.others[table].iter().flatten();
                let own = own.filter(|own| is_below(own, Table::UNSOLVED[table]));
                let is_free = scope == DataScope::TableSeven;
                own.filter(|own| is_free || meets(own, first))
                    .collect::<Vec<_>>()
            });
            if !two.is_empty() && !three.is_empty() {
                sets.push(AcceptedSet { solved, two, three });
            }
        }
        let index = forearm.index;
        (!sets.is_empty()).then(|| AcceptedReference {
            index,
            sets,
            share: 1.0 / truths(forearm).len() as f64,
        })
    }

    /// Returns the values of a quantity in the accepted sessions of a forearm, with their weights.
    fn values(&self, accepted: &AcceptedReference<'_>, quantity: usize) -> Vec<(f64, f64)> {
        let drawn = self.prior().fields().count();
        let of_set = |set: &AcceptedSet<'_>| -> Vec<(f64, f64)> {
            let weight = accepted.share * set.count();
            let of_sessions = |sessions: &[&ReferenceSession]| {
                let share = weight / sessions.len() as f64;
                let values = sessions.iter().filter_map(|own| own.result);
                values.map(|value| (value, share)).collect()
            };
            match quantity.checked_sub(drawn) {
                None => {
                    let number = set.solved.session;
                    let values = self.prior().values(accepted.index, Table::Seven, number);
                    vec![(values[quantity], weight)]
                }
                Some(0) => of_sessions(&[&set.solved.seven]),
                Some(1) => of_sessions(&set.two),
                Some(_) => of_sessions(&set.three),
            }
        };
        accepted.sets.iter().flat_map(of_set).collect()
    }

    fn rows(&self, forearms: &[ReferenceForearm], scope: DataScope) -> (Vec<Row>, Sheet) {
        let (ranks, undecided) = self.ranks(forearms, scope);
        let judged = ranks.first().map_or(0, Vec::len);
        let row = |id: &str, quantity: &str, value: f64| {
            let of = scope.name();
            let (id, quantity) = (format!("{of}/{id}"), format!("{of}: {quantity}"));
            number(id, quantity, "", value, judged)
        };
        let mut rows = vec![
            row("judged", "pseudo-participants, judged", judged as f64),
            row(
                "undecided",
                "with fewer than 4 effective forearms",
                undecided as f64,
            ),
        ];
        let (mut outside, mut plots) = (0, Vec::new());
        let mut bands: BTreeMap<usize, f64> = BTreeMap::new();
        for (name, ranks) in self.quantities().into_iter().zip(&ranks) {
            let count = ranks.len();
            let limit = *bands.entry(count).or_insert_with(|| band(count, self.seed));
            let deviations = deviations(ranks);
            let most = match ranks.is_empty() {
                true => f64::NAN,
                false => largest(&deviations),
            };
            outside += usize::from(most > limit);
            rows.push(Row {
                low: Some(0.0),
                high: Some(limit),
                n: ranks.len(),
                ..row(
                    &format!("{name}/deviation"),
                    &format!("{name}, deviation"),
                    most,
                )
            });
            plots.push(plot(name, &deviations, limit));
        }
        rows.push(row(
            "outside",
            "quantities outside their band",
            outside as f64,
        ));
        let caption = format!(
            "Conditioned on the greatest voltages of {}. Standard deviations by which more ranks \
             lie below a place than of uniform ranks, and the band within which uniform ranks stay \
             at all places in 95 % of cases.",
            scope.name()
        );
        let plots = Plots {
            beside: 4,
            series: vec!["ranks".to_owned(), "95 % band".to_owned()],
            plots,
        };
        let title = format!("Ranks of the truth, {}", scope.name());
        let figure = Sheet::figure("Calibration", &title, caption, plots);
        (rows, figure)
    }
}

fn plot(title: String, deviations: &[f64], limit: f64) -> Plot {
    let most = 1.1 * largest(deviations).max(limit);
    let edge = |value: f64| Curve::line(1, [[0.0, value], [1.0, value]]);
    let points = places().zip(deviations).map(|(place, own)| [place, *own]);
    Plot {
        title,
        x: SheetAxis::linear("rank", [0.0, 1.0]),
        y: SheetAxis::linear("deviation", [-most, most]),
        curves: vec![edge(-limit), edge(limit), Curve::line(0, points)],
        ..Plot::default()
    }
}

/// Sessions of table 7 with sessions of the other tables that meet the data.
struct AcceptedSet<'a> {
    solved: &'a SolvedReference,
    two: Vec<&'a ReferenceSession>,
    three: Vec<&'a ReferenceSession>,
}

impl AcceptedSet<'_> {
    /// Returns the number of sets of three sessions.
    fn count(&self) -> f64 {
        (self.two.len() * self.three.len()) as f64
    }
}

/// A forearm of the reference table with the sessions that meet the data.
struct AcceptedReference<'a> {
    index: u64,
    sets: Vec<AcceptedSet<'a>>,
    /// Chance of each set of sessions of the forearm to be its truth.
    share: f64,
}

impl AcceptedReference<'_> {
    fn weight(&self) -> f64 {
        self.share * self.sets.iter().map(AcceptedSet::count).sum::<f64>()
    }
}

/// A pseudo-participant.
struct Truth {
    /// Number of the forearm.
    index: u64,
    /// Number of the session of table 7.
    session: u64,
    /// Sessions of tables 7, 2 and 3.
    sessions: [ReferenceSession; 3],
}

/// Returns whether both greatest voltages lie below the end of the search.
fn is_below(session: &ReferenceSession, table: Table) -> bool {
    let last = (table.end_v() / STEP_V).floor() as i32;
    session.most.iter().all(|most| *most < last)
}

/// Returns all sets of sessions of a forearm whose greatest voltages lie below the end of the search.
fn truths(forearm: &ReferenceForearm) -> Vec<Truth> {
    let mut truths = Vec::new();
    for solved in &forearm.solved {
        if !is_below(&solved.seven, Table::Seven) {
            continue;
        }
        let [two, three] = [0, 1].map(|place: usize| {
            let own = solved.others[place].iter().flatten();
            own.filter(move |own| is_below(own, Table::UNSOLVED[place]))
        });
        for second in two {
            truths.extend(three.clone().map(|third| Truth {
                index: forearm.index,
                session: solved.session,
                sessions: [solved.seven, *second, *third],
            }));
        }
    }
    truths
}

impl laboratory::Study for CalibrationStudy {
    type Unit = ReferenceForearm;

    fn metadata(&self) -> StudyIdentity<'_> {
        StudyIdentity {
            name: CALIBRATION,
            arguments: String::new(),
            declaration: ("hamana-participants.toml", DECLARED),
            seed: self.seed,
            draws: self.forearms,
        }
    }

    fn compute(
        &self,
        index: u64,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> anyhow::Result<Option<ReferenceForearm>> {
        if !goes_on() {
            return Ok(None);
        }
        Ok(Some(self.prior().reference_forearm(index)?))
    }

    fn outcome(
        &self,
        units: &[ReferenceForearm],
        cut_short: Option<String>,
    ) -> anyhow::Result<Outcome> {
        let [all, seven] = [DataScope::AllTables, DataScope::TableSeven];
        let (mut rows, figure) = self.rows(units, all);
        let (more, other) = self.rows(units, seven);
        rows.extend(more);
        Ok(Outcome {
            name: CALIBRATION.to_owned(),
            title: "Calibration of the conditioned participants".to_owned(),
            seed: self.seed,
            simulated: Some(true),
            cut_short,
            declared: Preregistration {
                asked: CALIBRATION.to_owned(),
                command: Some(format!(
                    "experiment {CALIBRATION} --draws {}",
                    self.forearms
                )),
                device: None,
                sha256: laboratory::Study::hashes(self),
                source: self.declaration.source.clone(),
                draws: self.forearms,
                drawn: Some("forearms".to_owned()),
                as_declared: self.as_declared,
            },
            conditions: Vec::new(),
            rows,
            shares: Vec::new(),
            decides: Vec::new(),
            sheets: vec![figure, other],
            notes: vec![SIMULATED.to_owned()],
        })
    }

    fn files(&self, _: &[ReferenceForearm]) -> anyhow::Result<Vec<(String, String)>> {
        Ok(Vec::new())
    }

    fn progress_text(&self, done: u64) -> String {
        format!("{done} of {} forearms", self.forearms)
    }
}
