//! Hamana 2022's participants, with many random draws of the properties that the paper leaves open.

use super::departure::Departure;
use super::error::TwoPointsError;
use super::participant::{DEVICE_V, Participant, seed_of};
use super::population::Population;
use super::study::{DrawOutcome, KnownThresholds, PreparedHand, prepare};
use super::voltages::{Voltages, search_extensor};
use hal_sim::body::hand::{FittedHand, Hand, HandSpec};
use hal_sim::random::{standard_normal, word};
use host_core::wearer::{self, builtin_wearer};
use serde::Deserialize;
use std::path::Path;

/// Text of the declaration `host-tool/experiments/hamana-wearers.toml`.
pub const WEARERS: &str = include_str!("../../../experiments/hamana-wearers.toml");

/// Content of the declaration: participants, numbers of draws and trials, and ablations.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Participants {
    /// Seed of all draws.
    pub seed: u64,
    /// Number of draws of each participant.
    pub draws: u64,
    /// Number of trials in experiment 4 with A, with B and with both points.
    pub trials: u64,
    /// Number of trials of the hold with one point and with two.
    pub held: u64,
    /// Participants in the order in which tables list them.
    #[serde(rename = "wearer")]
    pub all: Vec<Participant>,
    /// Ablations that a command can choose.
    #[serde(rename = "departure")]
    pub departures: Vec<Departure>,
    /// Ablation that is applied. The default has no name and changes nothing.
    #[serde(skip)]
    pub departure: Departure,
    /// Names and texts of the files that describe the participants: this declaration and the wearer
    /// files of the paper's four, or the wearer file of another person.
    #[serde(skip)]
    pub files: Vec<(String, String)>,
}

/// Random forearm of a participant after the searches for points and voltages.
#[derive(Clone, Debug)]
pub struct Wearer {
    /// Hand with electrodes, couplings and thresholds after the searches.
    pub hand: Hand,
    /// Thresholds and largest voltages of A and B.
    pub voltages: Voltages,
    /// Threshold and largest voltage of the extensor's point, V; `None` in a session without it.
    pub extensor_v: Option<[f64; 2]>,
}

/// Mixed into the hand's seed for the skin shift and contraction strength of a trial.
const TRIALS: u64 = 0x7121;

/// Reads a participant from the wearer file `file` with this text; all of its thresholds must be
/// known.
fn own(file: &str, text: &str) -> Result<Participant, TwoPointsError> {
    let result =
        Participant::from_wearer(&wearer::Wearer::parse(file, text)?).and_then(|participant| {
            let missing = "the file has no thresholds: measure those of point A, point B and the \
                           extensor's point, and enter them in V as `motor_threshold` of channels \
                           1 to 3 or as `forearm.thresholds_v`";
            participant
                .thresholds_v
                .map_or(Err(missing.to_owned()), |_| Ok(participant))
        });
    result.map_err(|why| TwoPointsError::Wearer(file.to_owned(), why))
}

impl Participants {
    /// Loads the paper's participants for `None` or "all", one of them for a name, or the person of
    /// a wearer file (`.toml`).
    ///
    /// # Errors
    /// Fails if the declaration or a wearer file cannot be read, or if there is no participant of
    /// this name.
    pub fn load(whom: Option<&str>) -> Result<Self, TwoPointsError> {
        let mut read: Self =
            toml::from_str(WEARERS).map_err(|e| TwoPointsError::Declaration(e.to_string()))?;
        let path = whom.map(Path::new);
        if let Some(path) = path.filter(|path| path.extension().is_some_and(|name| name == "toml"))
        {
            let text = wearer::Wearer::text(path)?;
            let participant = own(&path.display().to_string(), &text)?;
            read.all = vec![participant];
            read.files = vec![("wearer".to_owned(), text)];
            return Ok(read);
        }
        read.files
            .push(("wearers.toml".to_owned(), WEARERS.to_owned()));
        for participant in &mut read.all {
            let file = format!("{}.toml", participant.name);
            let text = builtin_wearer(&file).unwrap_or_default();
            let known = Participant::from_wearer(&wearer::Wearer::parse(&file, text)?);
            let known = known.map_err(|why| TwoPointsError::Wearer(file.clone(), why))?;
            let paper = participant.paper.take();
            *participant = Participant { paper, ..known };
            read.files.push((file, text.to_owned()));
        }
        if let Some(name) = whom.filter(|text| *text != "all") {
            read.all.retain(|participant| participant.name == name);
            if read.all.is_empty() {
                return Err(TwoPointsError::Nobody(name.to_owned()));
            }
        }
        Ok(read)
    }

    /// Selects the ablation of this name, if one is given.
    ///
    /// # Errors
    /// Fails if there is no ablation of this name.
    pub fn with_departure(mut self, name: Option<&str>) -> Result<Self, TwoPointsError> {
        let Some(name) = name else { return Ok(self) };
        let found = self
            .departures
            .iter()
            .find(|departure| departure.name == name);
        let Some(departure) = found else {
            let names = self.departures.iter().map(|departure| &*departure.name);
            let names = names.collect::<Vec<_>>().join(", ");
            return Err(TwoPointsError::NoDeparture(name.to_owned(), names));
        };
        self.departure = departure.clone();
        Ok(self)
    }

    /// Describes the ablation for the report page; `None` if no ablation is applied.
    #[must_use]
    pub fn ablation_note(&self) -> Option<String> {
        let Departure { name, says, .. } = &self.departure;
        (!name.is_empty()).then(|| format!("Ablation `{name}` (option --ablation): {says}."))
    }

    /// Generates draw `index` of `participant`, or returns the reason why that is impossible.
    ///
    /// # Errors
    /// Fails if the declaration or a hand is invalid.
    pub fn draw(
        &self,
        participant: &Participant,
        population: &Population,
        (seed, index): (u64, u64),
    ) -> Result<Result<Wearer, &'static str>, TwoPointsError> {
        participant.draw(&self.departure, population, (seed, index))
    }
}

impl Participant {
    /// Generates draw `index` of this participant, or returns the reason why that is impossible.
    ///
    /// # Errors
    /// Fails if the declaration or a hand is invalid.
    fn draw(
        &self,
        departure: &Departure,
        population: &Population,
        (seed, index): (u64, u64),
    ) -> Result<Result<Wearer, &'static str>, TwoPointsError> {
        let own = seed_of(&self.name, seed);
        let person = population.draw_person(own, index)?;
        let spec = HandSpec {
            around_m: self.around_m,
            ..person.spec.clone().with_reach(self.reach_m)
        };
        let drawn = || population.thresholds_v(own, index);
        let [threshold_v, b_v, e_v] = self.thresholds_v.map_or_else(drawn, Ok)?;
        let known = KnownThresholds {
            threshold_v,
            b_v: Some(b_v),
            extensor_v: Some(e_v),
            pads_m: self.pads_m,
            most_v: DEVICE_V,
            first_found: departure.first_found,
        };
        let spec = departure.apply_to(spec);
        let PreparedHand {
            mut hand, voltages, ..
        } = match prepare(&spec, known)? {
            Ok(prepared) => prepared,
            Err(missing) => return Ok(Err(missing_reason(&missing))),
        };
        Ok(match search_extensor(&mut hand, DEVICE_V)? {
            extensor_v @ Some(_) => Ok(Wearer {
                hand,
                voltages,
                extensor_v,
            }),
            None => Err("the extensor's point extends nothing, or the wrist first"),
        })
    }
}

const fn missing_reason(missing: &DrawOutcome) -> &'static str {
    match missing {
        DrawOutcome::NoPoints => "no two selective points",
        DrawOutcome::NoCoupling => "no coupling gives the thresholds",
        DrawOutcome::Held => "the limiter holds a point below its threshold",
        DrawOutcome::NoVoltages => "a point moves nothing, or others too",
        DrawOutcome::Whole(_) => "none",
    }
}

impl Wearer {
    /// Returns the hand as it is in trial `number`: with a small random shift of the skin and
    /// change of the contraction's strength (standard deviations of the population's declaration).
    #[must_use]
    pub fn fit_for_trial(&self, population: &Population, number: u64) -> FittedHand {
        let mut spec = self.hand.spec().clone();
        let seed = word(spec.seed ^ TRIALS, number);
        let normal = |index| standard_normal(seed, index);
        let strength = (1.0 + population.force_noise * normal(0)).max(0.0);
        spec.flexor_nm *= strength;
        spec.extensor_nm *= strength;
        let jitter_m = 1e-3 * population.jitter_mm;
        let [a, b, e, _] = *self.hand.pads();
        FittedHand {
            spec,
            points: [a, b, e],
            factor: self.hand.factor,
            shift_m: [jitter_m * normal(1), jitter_m * normal(2)],
            channels: [0, 1, 2],
            simulated_units: None,
        }
    }
}
