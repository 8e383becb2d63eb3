//! Reads the declaration `hamana-participants.toml` and refuses what cannot be conditioned on.

use crate::hamana2022::TwoPointsError;
use crate::laboratory::Range;
use serde::Deserialize;

/// Text of the declaration `host-tool/experiments/hamana-participants.toml`.
pub const DECLARED: &str = include_str!("../../../../experiments/hamana-participants.toml");

/// Content of the declaration: prior, tolerances and sizes of the conditioning.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Declaration {
    /// Heading of the report page.
    pub title: String,
    /// Paper and sections that print the data.
    pub source: String,
    /// Seed of all draws.
    pub seed: u64,
    /// Number of forearms of each participant.
    pub draws: u64,
    /// Number of forearms of each participant under each change of the model.
    pub mechanism_draws: u64,
    /// Seed of the repetition.
    pub again: u64,
    /// Number of sessions of table 7 on each forearm.
    pub solved_sessions: u64,
    /// Number of sessions of table 7 that are chosen among those that meet it, with whose thresholds
    /// the other tables are judged.
    pub chosen_sessions: u64,
    /// Number of sessions of each of tables 2 and 3 for each chosen session of table 7.
    pub sessions: u64,
    /// Probability of meeting table 7 from which on every forearm is kept; a less likely one is kept
    /// by a chance in proportion.
    pub kept_from: f64,
    /// Number of search steps by which a found voltage may differ from the printed one.
    pub noise_steps: u32,
    /// Part of the places on the forearm that a session tries, above 0 and at most 1.
    pub tried: f64,
    /// The second, separate condition.
    pub strict: Strict,
    /// Numbers of replications by which the claims are judged.
    pub replications: Replications,
    /// Calibration of the procedure.
    pub calibration: Calibration,
    /// Single changes of the model that are judged.
    #[serde(rename = "mechanism")]
    pub mechanisms: Vec<NamedChange>,
    /// Statements of the paper, each counted once.
    #[serde(rename = "claim")]
    pub claims: Vec<PaperClaim>,
    /// Further measurements that could tell the mechanisms apart.
    #[serde(rename = "measurement")]
    pub measurements: Vec<FurtherMeasurement>,
    /// Ranges that are drawn once for each forearm.
    #[serde(rename = "person")]
    pub person: Vec<Range>,
    /// Ranges that are drawn anew for each session.
    #[serde(rename = "session")]
    pub session: Vec<Range>,
}

/// Second condition (Hamana 2022, III-C2): at its greatest voltage one point alone flexes the index
/// finger of this participant fully.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Strict {
    /// Name of the participant.
    pub participant: String,
    /// Smallest angle that counts as fully flexed, °.
    pub flexed_deg: f64,
}

/// Numbers of replications: one forearm of each participant in each.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Replications {
    /// Of experiments 1 to 3 and posture.
    pub patterns: u64,
    /// Of experiment 4 and the hold.
    pub control: u64,
}

/// Sizes of the calibration of the procedure.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Seed of the reference table.
    pub seed: u64,
    /// Number of pseudo-participants.
    pub pseudo: u64,
    /// Number of forearms in the reference table.
    pub forearms: u64,
}

/// Name and description of a single change of the model.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedChange {
    pub name: String,
    /// The change, and why it may be so.
    pub says: String,
}

/// What a claim of the paper has to do with the conditioning.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ClaimKind {
    /// It follows from the data of the conditioning, at least in part, and confirms nothing.
    Check,
    /// It did not enter the conditioning.
    Untouched,
}

/// Statement of the paper that is judged in replications.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperClaim {
    /// Identifier in results.
    pub id: String,
    /// The claim as a sentence, with the statistic that decides it.
    pub says: String,
    /// Section, table or figure.
    pub source: String,
    pub kind: ClaimKind,
}

/// A further measurement on a volunteer.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FurtherMeasurement {
    /// Identifier in results.
    pub id: String,
    pub says: String,
    /// Standard deviation of the measurement's noise; of the logarithm if `logarithm` is set.
    pub noise: f64,
    /// Whether the outcome is judged on a logarithmic scale.
    #[serde(default)]
    pub logarithm: bool,
}

impl Declaration {
    /// Parses the declaration that is part of the program.
    ///
    /// # Errors
    /// Returns E621 as [`Self::parse`] does.
    pub fn load_embedded() -> Result<Self, TwoPointsError> {
        Self::parse(DECLARED)
    }

    /// Parses a declaration.
    ///
    /// # Errors
    /// Returns E621 with all mistakes if the text cannot be parsed, a tolerance is 0, a number of
    /// sessions is 0, or a range is empty.
    pub fn parse(text: &str) -> Result<Self, TwoPointsError> {
        let declaration: Self =
            toml::from_str(text).map_err(|e| TwoPointsError::Declaration(e.to_string()))?;
        let mistakes = declaration.mistakes();
        match mistakes.is_empty() {
            true => Ok(declaration),
            false => Err(TwoPointsError::Declaration(mistakes.join("; "))),
        }
    }

    fn mistakes(&self) -> Vec<String> {
        let mut mistakes = Vec::new();
        if self.noise_steps == 0 {
            mistakes.push(
                "noise_steps is 0, and a search that cannot err accepts no forearm; allowed: 1 or \
                 more"
                    .to_owned(),
            );
        }
        if !(self.tried > 0.0 && self.tried <= 1.0) {
            mistakes.push(format!(
                "tried is {}; allowed: above 0, at most 1",
                self.tried
            ));
        }
        if !(self.kept_from > 0.0 && self.kept_from <= 1.0) {
            let kept_from = self.kept_from;
            mistakes.push(format!(
                "kept_from is {kept_from}; allowed: above 0, at most 1"
            ));
        }
        let counts = [
            ("draws", self.draws),
            ("mechanism_draws", self.mechanism_draws),
            ("solved_sessions", self.solved_sessions),
            ("chosen_sessions", self.chosen_sessions),
            ("sessions", self.sessions),
        ];
        let empty = counts.into_iter().filter(|(_, count)| *count == 0);
        mistakes.extend(empty.map(|(name, _)| format!("{name} is 0; allowed: 1 or more")));
        for range in self.person.iter().chain(&self.session) {
            let Range {
                field, low, high, ..
            } = range;
            if !(low <= high && low.is_finite() && high.is_finite()) {
                mistakes.push(format!("{field} has no values from {low} to {high}"));
            } else if range.logarithm && *low <= 0.0 {
                mistakes.push(format!(
                    "{field} begins at {low}, but a range on a logarithmic scale begins above 0"
                ));
            }
        }
        mistakes
    }
}
