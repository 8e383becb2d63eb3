//! Hamana 2022's participants, each drawn many times where the paper leaves them open.

use super::departure::Departure;
use super::error::TwoPointsError;
use super::participant::{DEVICE_V, Participant};
use super::population::Population;
use super::study::{DrawOutcome, KnownThresholds, PreparedHand, prepare};
use super::voltages::{Voltages, search_extensor};
use hal_sim::body::hand::{FittedHand, Hand, HandSpec};
use hal_sim::random::{standard_normal, word};
use host_core::wearer::{self, builtin_wearer};
use serde::Deserialize;
use std::path::Path;

/// `two_points/wearers.toml`.
pub const WEARERS: &str = include_str!("../../../experiments/hamana-wearers.toml");

/// Who takes part in which experiments.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Participants {
    /// Of the draws.
    pub seed: u64,
    /// Replications of the study.
    pub draws: u64,
    /// Of each method of experiment 4.
    pub trials: u64,
    /// Of each method of the hold.
    pub held: u64,
    /// The participants.
    #[serde(rename = "wearer")]
    pub all: Vec<Participant>,
    /// What may be otherwise.
    #[serde(rename = "departure")]
    pub departures: Vec<Departure>,
    /// What is otherwise.
    #[serde(skip)]
    pub departure: Departure,
    /// Name and text of the files that say who they are: this declaration and the wearer
    /// files of the paper's four, or that of whoever is none of them.
    #[serde(skip)]
    pub files: Vec<(String, String)>,
}

/// A participant's forearm, drawn, its searches done.
#[derive(Clone, Debug)]
pub struct Wearer {
    /// With its electrodes on.
    pub hand: Hand,
    /// Of A and B.
    pub voltages: Voltages,
    /// Threshold and greatest of the extensor's point, V.
    pub extensor_v: [f64; 2],
}

/// Of a trial's jitter and strength.
const TRIALS: u64 = 0x7121;

/// Whoever the wearer file `file` of this text describes, all of whose thresholds are
/// known.
fn own(file: &str, text: &str) -> Result<Participant, TwoPointsError> {
    let of = Participant::from_wearer(&wearer::Wearer::parse(file, text)?).and_then(|participant| {
        let missing = "no thresholds are known: measure those of A, B and the extensor's point, \
                       V, as `motor_threshold` of channels 1 to 3 or as `forearm.thresholds_v`";
        participant
            .thresholds_v
            .map_or(Err(missing.to_owned()), |_| Ok(participant))
    });
    of.map_err(|why| TwoPointsError::Wearer(file.to_owned(), why))
}

impl Participants {
    /// The program's own, for nobody or "all"; with a name, that one alone; with a file
    /// (`.toml`), whoever it describes.
    ///
    /// # Errors
    /// They cannot be read, or there is nobody of this name.
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

    /// The same with the departure of this name, if there is one.
    ///
    /// # Errors
    /// There is none of this name.
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

    /// The ablation as a sentence for readers of the page.
    #[must_use]
    pub fn ablation_note(&self) -> Option<String> {
        let Departure { name, says, .. } = &self.departure;
        (!name.is_empty()).then(|| format!("Departure {name}: {says}."))
    }

    /// Draw `index` of `participant`, one of them, or why there is none.
    ///
    /// # Errors
    /// As [`Participant::draw`].
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
    /// Draw `index` of this participant, or why there is none.
    ///
    /// # Errors
    /// The declaration, or a hand that cannot be.
    fn draw(
        &self,
        departure: &Departure,
        population: &Population,
        (seed, index): (u64, u64),
    ) -> Result<Result<Wearer, &'static str>, TwoPointsError> {
        // Each participant's draws are their own.
        let own = self
            .name
            .bytes()
            .fold(seed, |seed, byte| word(seed, byte.into()));
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
            Some(extensor_v) => Ok(Wearer {
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
    /// As they come to trial `number`: the skin has moved a little, the contraction is a
    /// little stronger or weaker (standard deviations of the population's declaration).
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
        }
    }
}
