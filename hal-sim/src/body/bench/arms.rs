//! Moment arms and lengths of the muscles across the elbow, from two published sources that are
//! kept apart, because the effect of the angle on a torque depends on the source.
//!
//! Angles are flexion, degrees, 0 with the arm straight. Harris measured the *included* angle
//! between forearm and upper arm: 180° less flexion, so that his 75°, 90° and 105° are 105°, 90°
//! and 75° here.

use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Flexion at which the two fits of Rankin & Neptune (of a moment arm, and of a length whose slope
/// is the moment arm) agree within a millimetre, degrees.
pub const FITTED_DEG: RangeInclusive<f64> = 0.0..=100.0;

/// Range of flexion outside which a moment arm is refused, degrees: 105° plus an error of 5°. From
/// 100° on, the two fits diverge: 1.2 mm at 105°, 4.4 mm at 120°.
pub const LIMIT_DEG: RangeInclusive<f64> = 0.0..=110.0;

/// A muscle across the elbow or near it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Muscle {
    /// Long head of the triceps, which crosses the shoulder too.
    TricepsLong,
    /// Lateral head of the triceps.
    TricepsLateral,
    /// Medial head of the triceps, under the other two.
    TricepsMedial,
    /// Both heads of the biceps.
    Biceps,
    /// Brachialis, under the biceps.
    Brachialis,
    /// Deltoid, above the arm; does not cross the elbow.
    Deltoid,
}

/// Every muscle, the heads of the triceps first.
pub const MUSCLES: [Muscle; 6] = [
    Muscle::TricepsLong,
    Muscle::TricepsLateral,
    Muscle::TricepsMedial,
    Muscle::Biceps,
    Muscle::Brachialis,
    Muscle::Deltoid,
];

/// Publication from which moment arms are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Rankin & Neptune 2012 (10.1016/j.jbiomech.2012.03.010), second-hand: the coefficients in the
    /// repository `anmuller/CusToM`. Those of the long head have 15 digits, which suggests a refit
    /// by that repository. The biceps is missing there; its moment arm is that of
    /// [`Self::MuscleArms`].
    RankinNeptune,
    /// The page MuscleArms of biomed.bas.bg, with one polynomial for the whole triceps.
    MuscleArms,
}

/// Every source of moment arms, in the order of the enum.
pub const SOURCES: [Source; 2] = [Source::RankinNeptune, Source::MuscleArms];

/// An angle, degrees, outside the range of both sources.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("flexion is {0}°; allowed: 0 to 110°, where moment arms are known")]
pub struct BeyondFit(pub f64);

/// Polynomial of Rankin & Neptune's form RRN1, Σ aᵢqⁱ with q in rad; the value is in metres.
type Quartic = [f64; 5];

const TRICEPS_ARM: Quartic = [-0.0202999, -0.0215606, 0.0356484, -0.0178502, 0.0026245];
const TRICEPS_LONG_ARM: Quartic = [
    -0.020165081,
    -0.022691141,
    0.038332749,
    -0.020226156,
    0.003321056,
];
const TRICEPS_MEDIAL_LENGTH: Quartic = [0.154222, 0.0207285, 0.00882432, -0.00864625, 0.00225989];
const TRICEPS_LATERAL_LENGTH: Quartic = [0.166594, 0.0207285, 0.00882427, -0.00864619, 0.00225988];
const BRACHIALIS_ARM: Quartic = [0.00984873, 0.010163, -0.0239557, 0.0290329, -0.00924344];
const BRACHIALIS_LENGTH: Quartic = [0.146058, -0.0120401, 0.00359539, -0.00501862, 0.000960102];

/// Polynomial of MuscleArms in rad; the value is in cm, extension negative.
type Quintic = [f64; 6];

const TRI: Quintic = [-2.365, -1.015, 1.92, -1.035, 0.257, -0.0262];
const BIC: Quintic = [1.963, -1.44, 3.031, 0.887, -1.418, 0.285];
const BRA: Quintic = [1.554, 0.0813, -1.689, 3.523, -1.811, 0.276];

fn polynomial(coefficients: &[f64], q: f64) -> f64 {
    let terms = coefficients.iter().rev();
    terms.fold(0.0, |sum, coefficient| sum * q + coefficient)
}

/// Returns the moment arm about the elbow, m, flexion positive: negative for the triceps, 0 for the
/// deltoid.
///
/// # Errors
/// Returns [`BeyondFit`] if the angle is outside [`LIMIT_DEG`].
pub fn arm_m(source: Source, muscle: Muscle, flexion_deg: f64) -> Result<f64, BeyondFit> {
    if !LIMIT_DEG.contains(&flexion_deg) {
        return Err(BeyondFit(flexion_deg));
    }
    let q = flexion_deg.to_radians();
    Ok(match (source, muscle) {
        (_, Muscle::Deltoid) => 0.0,
        (_, Muscle::Biceps) => 1e-2 * polynomial(&BIC, q),
        (Source::RankinNeptune, Muscle::TricepsLong) => polynomial(&TRICEPS_LONG_ARM, q),
        (Source::RankinNeptune, Muscle::Brachialis) => polynomial(&BRACHIALIS_ARM, q),
        (Source::RankinNeptune, _) => polynomial(&TRICEPS_ARM, q),
        (Source::MuscleArms, Muscle::Brachialis) => 1e-2 * polynomial(&BRA, q),
        (Source::MuscleArms, _) => 1e-2 * polynomial(&TRI, q),
    })
}

/// Returns the musculotendon length, m, or `None` for a muscle whose length Rankin & Neptune do not
/// give here, such as one that also crosses the shoulder.
///
/// # Errors
/// Returns [`BeyondFit`] if the angle is outside [`LIMIT_DEG`].
pub fn length_m(muscle: Muscle, flexion_deg: f64) -> Result<Option<f64>, BeyondFit> {
    if !LIMIT_DEG.contains(&flexion_deg) {
        return Err(BeyondFit(flexion_deg));
    }
    let length = match muscle {
        Muscle::TricepsLateral => &TRICEPS_LATERAL_LENGTH,
        Muscle::TricepsMedial => &TRICEPS_MEDIAL_LENGTH,
        Muscle::Brachialis => &BRACHIALIS_LENGTH,
        _ => return Ok(None),
    };
    Ok(Some(polynomial(length, flexion_deg.to_radians())))
}

/// Returns the elongation of a muscle from 90° to this flexion, m. It comes from the musculotendon
/// length if one is available, else from the moment arm, −∫ arm dq, by Simpson's rule, which is
/// accurate enough for these polynomials (tested).
///
/// # Errors
/// Returns [`BeyondFit`] if an angle is outside [`LIMIT_DEG`].
pub fn elongation_m(source: Source, muscle: Muscle, flexion_deg: f64) -> Result<f64, BeyondFit> {
    if let (Some(now), Some(then)) = (length_m(muscle, flexion_deg)?, length_m(muscle, 90.0)?) {
        return Ok(now - then);
    }
    let width_deg = (flexion_deg - 90.0) / f64::from(PIECES);
    let mut sum = 0.0;
    for piece in 0..=PIECES {
        let weight = match piece {
            0 | PIECES => 1.0,
            odd if odd % 2 == 1 => 4.0,
            _ => 2.0,
        };
        let at_deg = (90.0 + f64::from(piece) * width_deg).clamp(0.0, 110.0);
        sum += weight * arm_m(source, muscle, at_deg)?;
    }
    Ok(-sum * width_deg.to_radians() / 3.0)
}

/// Number of intervals of Simpson's rule; even.
const PIECES: u32 = 8;

#[cfg(test)]
mod tests {
    use super::*;

    fn mm(source: Source, muscle: Muscle) -> [f64; 3] {
        [75.0, 90.0, 105.0].map(|deg| 1e3 * arm_m(source, muscle, deg).unwrap())
    }

    fn is_near(found: [f64; 3], expected: [f64; 3], by: f64) {
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() <= by, "{found} for {expected}");
        }
    }

    /// Values computed by hand from the printed coefficients, correct to their last digit.
    #[test]
    fn both_sources_say_what_is_printed() {
        use Muscle::*;
        is_near(
            mm(Source::RankinNeptune, TricepsMedial),
            [-19.8, -19.4, -20.4],
            0.06,
        );
        is_near(
            mm(Source::RankinNeptune, TricepsLateral),
            [-19.8, -19.4, -20.4],
            0.06,
        );
        is_near(
            mm(Source::MuscleArms, TricepsLong),
            [-20.7, -19.2, -17.9],
            0.06,
        );
        is_near(mm(Source::MuscleArms, Biceps), [41.9, 47.1, 48.6], 0.06);
        assert_eq!(
            mm(Source::RankinNeptune, Biceps),
            mm(Source::MuscleArms, Biceps)
        );
        assert_eq!(mm(Source::MuscleArms, Deltoid), [0.0; 3]);
    }

    /// The sources disagree about the sign of the effect of 15° of flexion.
    #[test]
    fn the_sources_part_in_sign() {
        let [_, at90, at105] = mm(Source::RankinNeptune, Muscle::TricepsMedial);
        assert!(at105 / at90 > 1.04);
        let [_, at90, at105] = mm(Source::MuscleArms, Muscle::TricepsMedial);
        assert!(at105 / at90 < 0.95);
    }

    /// Rankin & Neptune's moment arm and the slope of their length are separate fits. They agree
    /// within half a millimetre up to 90° and differ by more than a millimetre at 105°.
    #[test]
    fn the_fits_part_beyond_a_hundred_degrees() {
        let slope = |deg: f64| {
            let at = |deg| length_m(Muscle::TricepsMedial, deg).unwrap().unwrap();
            -(at(deg + 0.05) - at(deg - 0.05)) / 0.1_f64.to_radians()
        };
        let apart = |deg| {
            let arm = arm_m(Source::RankinNeptune, Muscle::TricepsMedial, deg).unwrap();
            1e3 * (arm - slope(deg)).abs()
        };
        assert!((1..18).all(|index| apart(5.0 * f64::from(index)) < 0.5));
        assert!(apart(100.0) < 1.0);
        assert!((1.1..1.4).contains(&apart(105.0)), "{}", apart(105.0));
    }

    #[test]
    fn what_is_not_known_is_refused() {
        for deg in [-0.1, 110.1, f64::NAN] {
            assert!(arm_m(Source::MuscleArms, Muscle::Biceps, deg).is_err());
            assert!(length_m(Muscle::Brachialis, deg).is_err());
        }
        assert_eq!(length_m(Muscle::TricepsLong, 90.0), Ok(None));
    }

    /// If a length exists, the integral of the moment arm agrees with it within the difference of
    /// the fits; otherwise the elongation equals the integral of the polynomial.
    #[test]
    fn lengths_follow_from_arms() {
        let integral = |q: f64| {
            let powers = (1..).map(|power| q.powi(power) / f64::from(power));
            BIC.iter()
                .zip(powers)
                .map(|(a, p)| 1e-2 * a * p)
                .sum::<f64>()
        };
        let exact = integral(90_f64.to_radians()) - integral(75_f64.to_radians());
        let found = elongation_m(Source::MuscleArms, Muscle::Biceps, 75.0).unwrap();
        assert!((found - exact).abs() < 1e-8, "{found} for {exact}");
        // In flexion, the triceps is longer and the brachialis shorter.
        for source in SOURCES {
            for muscle in [Muscle::TricepsLong, Muscle::TricepsMedial] {
                assert!(elongation_m(source, muscle, 105.0).unwrap() > 0.004);
            }
            assert!(elongation_m(source, Muscle::Brachialis, 105.0).unwrap() < -0.004);
        }
    }
}
