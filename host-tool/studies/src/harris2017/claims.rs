//! Judges whether a claim of the paper holds for a random wearer, and which parameters decide it.

use super::declared::RampsDeclaration;
use super::error::RampsError;
use super::found::{DrawResult, TestMeasurements};
use super::person::is_triceps;
use super::test::Stimulation;
use crate::laboratory::{DecidingClaim, DrawClaim, Share};
use host_core::statistics;

/// Range of co-contraction in the paper, as a fraction of the triceps' torque (section 3.4).
const CO_CONTRACTION: [f64; 2] = [0.25, 0.5];

/// Returns whether claim `id` holds for this wearer, or `None` if that cannot be judged.
///
/// # Errors
/// Returns E690 if there is no claim `id`.
pub fn holds(
    declared: &RampsDeclaration,
    found: &DrawResult,
    id: &str,
) -> Result<Option<bool>, RampsError> {
    let judged = &declared.judged;
    let measurements = || found.ramps(true).chain(found.ramps(false));
    let most = |of_current| {
        let peaks = found
            .ramps(of_current)
            .map(|measurement| measurement.peak_nm);
        peaks.fold(0.0, f64::max)
    };
    Ok(match id {
        "rises" => Some(measurements().all(|measurement| measurement.rises)),
        "width-reaches-more" => Some(most(false) > most(true)),
        "current-more-linear" => {
            let mean_linearity = |of_current| mean(found.ramps(of_current));
            mean_linearity(true)
                .zip(mean_linearity(false))
                .map(|(current, width)| current > width)
        }
        "35-most-linear" => most_linear(found),
        "width-recruits-others" => Some(
            found
                .ramps(false)
                .any(|measurement| measurement.has_others(judged)),
        ),
        "current-isolated" => Some(
            !found
                .ramps(true)
                .any(|measurement| measurement.has_others(judged)),
        ),
        "triceps-first" => {
            Some(measurements().all(|measurement| measurement.first.is_none_or(is_triceps)))
        }
        "angle-alike" => Some(found.departs < judged.same_within),
        "biceps-a-quarter-to-half" => co_contraction(declared, found)
            .map(|part| (CO_CONTRACTION[0]..=CO_CONTRACTION[1]).contains(&part)),
        "width-equals-current" => {
            let [first, second] = &found.beyond;
            let apart = first.torque_nm / second.torque_nm - 1.0;
            apart.is_finite().then(|| apart.abs() < judged.same_within)
        }
        _ => {
            return Err(RampsError::Declaration(format!(
                "no rule judges the claim `{id}`"
            )));
        }
    })
}

/// Returns the mean R² of the measurements that have one.
fn mean<'m>(measurements: impl Iterator<Item = &'m TestMeasurements>) -> Option<f64> {
    statistics::mean(measurements.filter_map(|measurement| measurement.linearity))
}

/// Returns whether 35 µs has a higher mean R² than both other widths.
fn most_linear(found: &DrawResult) -> Option<bool> {
    let mean_linearity = |width_us: u32| {
        let own = move |measurement: &&TestMeasurements| {
            measurement.test.stimulation == Stimulation::Current(width_us)
        };
        mean(found.ramps(true).filter(own))
    };
    let (middle, short, long) = (
        mean_linearity(35)?,
        mean_linearity(25)?,
        mean_linearity(45)?,
    );
    Some(middle > short && middle > long)
}

/// Returns the largest torque of the biceps divided by that of the triceps in the current ramp at
/// 35 µs, both at the middle angle; `None` if the torque of the triceps is not detected.
#[must_use]
pub fn co_contraction(declared: &RampsDeclaration, found: &DrawResult) -> Option<f64> {
    let middle_deg = *declared.protocol.angles_deg.get(1)?;
    let biceps = found.find_test(Stimulation::Biceps, middle_deg)?.peak_nm;
    let triceps = found
        .find_test(Stimulation::Current(35), middle_deg)?
        .peak_nm;
    (triceps > declared.judged.detected_nm).then(|| biceps / triceps)
}

/// Computes for each claim the share of these wearers for whom it holds.
///
/// # Errors
/// Returns E690 if a declared claim has no rule.
pub fn shares(
    declared: &RampsDeclaration,
    results: &[DrawResult],
) -> Result<Vec<Share>, RampsError> {
    let share = |claim: &DrawClaim| Ok(claim.share(&verdicts(declared, results, &claim.id)?));
    declared.claims.iter().map(share).collect()
}

/// Finds for each claim the random parameters that decide it.
///
/// # Errors
/// Returns E690 if a declared claim has no rule.
pub fn deciding_factors(
    declared: &RampsDeclaration,
    results: &[DrawResult],
) -> Result<Vec<DecidingClaim>, RampsError> {
    let drawn: Vec<&[f64]> = results.iter().map(|result| &*result.person.drawn).collect();
    let deciding_claim = |claim: &DrawClaim| {
        let verdicts = verdicts(declared, results, &claim.id)?;
        Ok(claim.deciding_fields(&declared.ranges, &verdicts, &drawn))
    };
    declared.claims.iter().map(deciding_claim).collect()
}

fn verdicts(
    declared: &RampsDeclaration,
    results: &[DrawResult],
    id: &str,
) -> Result<Vec<Option<bool>>, RampsError> {
    results
        .iter()
        .map(|result| holds(declared, result, id))
        .collect()
}
