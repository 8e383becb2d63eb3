//! Builds the result of all studies for `result.json` and its page.

use super::comparisons::{rows, shares, whole_device_row};
use super::deciding::Sensitivity;
use super::declaration::{DECLARED, Study};
use super::error::LiftError;
use super::figures::{activations, bars, hands, tests};
use super::replication::{Replication, person};
use crate::laboratory::{Outcome, Preregistration};
use host_core::record::sha256;

/// Name of the study in commands.
pub const NAME: &str = "buatier";
/// Note in every result that the wearers are simulated.
const SIMULATED: &str =
    "Simulated: random wearers with mostly assumed parameters; no evidence about people.";
const MEANING: &str = "Each result is a median with the 5th and 95th percentile: of the studies' \
                       means, or of the wearers where stimulation is described.";
const PROXY: &str = "Metabolic proxy: heat of activation, maintenance and shortening, and work of \
                     shortening, of sixteen arm muscles (Bhargava 2004), divided by the duration \
                     of lifts and returns and by body mass. VO2 and VCO2 cannot be simulated, so \
                     equation 5 has no value here. The proxy does not include heart, breathing \
                     and trunk.";
const PRINTED: &str = "The paper states +20.5 % for assist, but its means give 23.9 % of assist \
                       or 31 % of none. Its +35.73 % for resist is relative to resist (55 % of \
                       none). It shows the means of none for error and smoothness in a figure \
                       only.";
const MODEL: &str = "The paper does not state the quartics, the scale of k, I0, masses, target \
                     heights, filter order or the thresholds of SPARC: all of them are assumed. \
                     Without co-contraction, static optimisation leaves the posterior deltoid \
                     idle and the triceps almost idle, because nothing pulls the arms up. The \
                     stimulation in the drop phase therefore depends on the assumed \
                     co-contraction.";

/// Information about the run that only the command knows.
#[derive(Clone, Debug)]
pub struct RunInfo {
    /// Seed of the draws.
    pub seed: u64,
    /// Requested number of studies.
    pub draws: u64,
    /// Arguments that repeat the result on a terminal.
    pub command: String,
    /// Description of the missing part; `None` for a complete result.
    pub cut_short: Option<String>,
}

/// Builds the study's result: figures, tables, rows, shares and notes.
///
/// # Errors
/// Fails if a participant for the figures cannot be simulated.
pub fn outcome(
    study: &Study,
    replications: &[Replication],
    decides: Option<&Sensitivity>,
    run_info: RunInfo,
) -> Result<Outcome, LiftError> {
    let mut sheets = vec![hands(study, &person(study, run_info.seed, (0, 0))?)?];
    sheets.extend(activations(study)?);
    if !replications.is_empty() {
        sheets.push(bars(study, replications));
        sheets.push(tests(study, replications));
    }
    sheets.extend(decides.map(|decision| decision.sheet(study)));
    let mut all_rows = rows(study, replications);
    all_rows.push(whole_device_row(study, run_info.seed)?);
    let statements = [SIMULATED, MEANING, PROXY, PRINTED, MODEL].map(str::to_owned);
    let decided = decides
        .map(|decision| decision.notes(study))
        .unwrap_or_default();
    Ok(Outcome {
        name: NAME.to_owned(),
        title: study.title.clone(),
        seed: run_info.seed,
        simulated: Some(true),
        cut_short: run_info.cut_short,
        declared: Preregistration {
            asked: NAME.to_owned(),
            command: Some(run_info.command),
            device: None,
            sha256: [("study.toml".to_owned(), sha256(DECLARED.as_bytes()))].into(),
            source: study.source.clone(),
            draws: run_info.draws,
            drawn: None,
            as_declared: (run_info.seed, run_info.draws) == (study.seed, study.studies),
        },
        conditions: Vec::new(),
        rows: all_rows,
        shares: shares(study, replications),
        decides: Vec::new(),
        sheets,
        notes: statements.into_iter().chain(decided).collect(),
    })
}
