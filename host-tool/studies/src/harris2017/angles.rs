//! Computes how ±15° change the torque of the triceps, by each cause alone and together, and how
//! well a study of two participants can detect that.

use super::declared::RampsDeclaration;
use super::error::RampsError;
use super::person::{BEYOND, RampsWearer, Setting, is_triceps};
use super::test::Stimulation;
use hal_sim::body::bench::arms::{Source, arm_m};
use hal_sim::body::bench::elbow::{TRICEPS, fibre_length, force_length};
use hal_sim::random;
use host_core::statistics::repeated_measures;

/// Causes that make a torque depend on the angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AngleDependence {
    /// Source of the moment arms; `None` if they do not depend on the angle.
    pub arms: Option<Source>,
    /// Whether the force depends on the fibre length.
    pub length: bool,
}

/// Compared combinations of causes with their names: each cause alone, then moment arms together
/// with the fibre length.
pub const DEPENDS: [(&str, AngleDependence); 5] = [
    (
        "moment arms, Rankin & Neptune",
        AngleDependence::new(Some(Source::RankinNeptune), false),
    ),
    (
        "moment arms, MuscleArms",
        AngleDependence::new(Some(Source::MuscleArms), false),
    ),
    ("force-length alone", AngleDependence::new(None, true)),
    (
        "Rankin & Neptune with force-length",
        AngleDependence::new(Some(Source::RankinNeptune), true),
    ),
    (
        "MuscleArms with force-length",
        AngleDependence::new(Some(Source::MuscleArms), true),
    ),
];

impl AngleDependence {
    const fn new(arms: Option<Source>, length: bool) -> Self {
        Self { arms, length }
    }
}

/// Returns the relative change of the triceps' torque from 90° to `included_deg` if all of its
/// heads are excited equally.
///
/// # Errors
/// Returns E691 if no source covers the angle.
pub fn relative_torque_change(
    person: &RampsWearer,
    depends: AngleDependence,
    included_deg: f64,
) -> Result<f64, RampsError> {
    let torque = |included_deg: f64| -> Result<f64, RampsError> {
        let flexion_deg = 180.0 - included_deg;
        let mut nm = 0.0;
        for head in person
            .muscles
            .iter()
            .filter(|stimulation| is_triceps(stimulation.muscle))
        {
            let arm_m = match depends.arms {
                Some(source) => arm_m(source, head.muscle, flexion_deg),
                None => arm_m(Source::RankinNeptune, head.muscle, 90.0),
            };
            let length = fibre_length(head.muscle, head.length_at_90, flexion_deg);
            let left = match depends.length {
                true => force_length(length.map_err(|_| BEYOND)?),
                false => 1.0,
            };
            nm -= head.force_n * left * arm_m.map_err(|_| BEYOND)?;
        }
        Ok(nm)
    };
    Ok(torque(included_deg)? / torque(90.0)? - 1.0)
}

/// Returns the largest relative difference of a wearer's true torque at the end of a current ramp
/// from that at 90°, over all angles and pulse widths.
///
/// # Errors
/// Returns E691 if no source covers an angle.
pub fn torque_deviation(
    declared: &RampsDeclaration,
    person: &RampsWearer,
) -> Result<f64, RampsError> {
    let protocol = &declared.protocol;
    let mut most = 0.0_f64;
    for &width_us in &protocol.current_ramp_widths_us {
        let pulse = Stimulation::Current(width_us).pulse_at(protocol, protocol.ramp_s);
        let torque = |deg: f64| -> Result<f64, RampsError> {
            let spec = person.rig_spec(Setting::exact(deg));
            let parts = person.steady(&spec, TRICEPS, pulse)?;
            Ok(parts.iter().map(|(_, nm, _)| nm).sum())
        };
        let middle_nm = torque(90.0)?;
        for &deg in &protocol.angles_deg {
            most = most.max((torque(deg)? / middle_nm - 1.0).abs());
        }
    }
    Ok(most)
}

/// Returns whether the angle has a significant effect in rows of one torque per angle, by an
/// analysis of variance with repeated measures. Returns `None` if the analysis is impossible.
#[must_use]
pub fn is_significant(rows: &[Vec<f64>], level: f64) -> Option<bool> {
    // Rows differ in strength far more than angles do, so each row is divided by its own mean.
    let relative = rows.iter().filter_map(|row| {
        let mean = row.iter().sum::<f64>() / row.len() as f64;
        (mean > 0.0).then(|| row.iter().map(|row| row / mean).collect())
    });
    let relative: Vec<Vec<f64>> = relative.collect();
    let tested = repeated_measures(&relative).ok()?;
    Some(tested.effect.p < level)
}

/// Number of simulated experiments for each effect size.
const TRIED: u64 = 400;
/// Number of rows in the paper's test: the current ramps of two participants, and the width ramps
/// of the first.
pub const ROWS: u64 = 9;

/// Returns the share of simulated experiments that detect an effect of the angle. Each has [`ROWS`]
/// ramps with one contraction at each of three angles, whose standard deviation is `noise`. The
/// torque falls by the fraction `effect` to one side and rises by as much to the other.
#[must_use]
pub fn detection_power(effect: f64, noise: f64, level: f64, seed: u64) -> f64 {
    let is_found = |experiment: &u64| {
        let stream = random::word(seed, *experiment);
        let row = |row: u64| {
            let at = |nth: u64| libm::exp(noise * random::standard_normal(stream, 3 * row + nth));
            vec![(1.0 - effect) * at(0), at(1), (1.0 + effect) * at(2)]
        };
        let rows: Vec<Vec<f64>> = (0..ROWS).map(row).collect();
        is_significant(&rows, level) == Some(true)
    };
    (0..TRIED).filter(is_found).count() as f64 / TRIED as f64
}

/// Returns the smallest effect that at least four of five simulated experiments detect, as a
/// fraction in steps of 0.01; `None` if it is above 0.5.
#[must_use]
pub fn least_found(noise: f64, level: f64, seed: u64) -> Option<f64> {
    let effects = (1..=50).map(|percent| 1e-2 * f64::from(percent));
    let mut enough = effects.filter(|effect| detection_power(*effect, noise, level, seed) >= 0.8);
    enough.next()
}
