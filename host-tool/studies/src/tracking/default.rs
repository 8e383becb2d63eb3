//! The default controller in the search: its parameters, and the joint that they make.

use super::candidate::numbers_of;
use super::wearer::{self, Points};
use firmware::control::{JointSpec, LawSpec, ResponseSpec};
use methods::control::Parameter;
use methods::control::parameters::{linear, log};
use std::collections::BTreeMap;

/// Name of the default controller in CSV and JSON.
pub const NAME: &str = "device default";

/// Parameters of the default controller that the search varies. Units and, except for the
/// predictor's time constants, bounds are those of the laws in floating point. Structure, period,
/// extrapolation and b are not searched.
pub const PARAMETERS: [Parameter; 13] = [
    log("lambda_per_s", 1.0, 40.0),
    log("kd_s_per_rad", 0.005, 1.0),
    log("ki_per_rad_s", 0.1, 30.0),
    log("k1", 0.045, 0.5),
    // Without this bound, which is the device's own, a search removes the sign integral.
    log("k2_per_rad", 0.01, 5.0),
    log("cutoff_hz", 1.5, 20.0),
    linear("feed_forward_lead_s", 0.0, 0.3),
    log("smith_gain_rad", 0.1, 5.0),
    log("smith_muscle_s", 0.02, 0.6),
    log("smith_joint_s", 0.02, 0.5),
    linear("smith_delay_s", 0.0, 0.079),
    log("adapt_scale_per_rad_s", 0.01, 60.0),
    log("adapt_damping_per_rad2", 0.001, 3.0),
];

/// Returns the parameters of the shipped default controller, for a wearer of the reference
/// strength.
pub fn shipped() -> BTreeMap<&'static str, f64> {
    let reference = JointSpec {
        law: LawSpec::RECOMMENDED,
        response: Some(ResponseSpec::RECOMMENDED),
        ..wearer::shipped(Points::Two)
    };
    numbers_of(&reference).into_iter().collect()
}

/// Returns the joint with these parameters, rounded to thousandths and scaled by the strength of
/// the nominal wearer as the shipped one is. A missing parameter has its shipped value.
pub fn joint(numbers: &BTreeMap<String, f64>, points: Points) -> JointSpec {
    let shipped = shipped();
    let milli = |name: &str| {
        let number = numbers.get(name).or_else(|| shipped.get(name));
        (number.copied().unwrap_or(0.0) * 1000.0).round() as u32
    };
    let law = LawSpec::Recommended {
        lambda_milli: milli("lambda_per_s"),
        k1_milli: milli("k1"),
        k2_milli: milli("k2_per_rad"),
        b_milli: milli("b_rad_per_s2"),
        k3_milli: milli("kd_s_per_rad"),
        ki_milli: milli("ki_per_rad_s"),
    };
    let response = ResponseSpec {
        gain_mrad: milli("smith_gain_rad") as u16,
        muscle_ms: milli("smith_muscle_s") as u16,
        joint_ms: milli("smith_joint_s") as u16,
        delay_ms: milli("smith_delay_s") as u8,
        scale_milli: milli("adapt_scale_per_rad_s"),
        damping_milli: milli("adapt_damping_per_rad2"),
    };
    let model = wearer::model(points, milli("feed_forward_lead_s") as u16);
    JointSpec {
        law: law.for_wearer(&model),
        cutoff_mhz: milli("cutoff_hz"),
        wearer: Some(model),
        response: Some(response.for_wearer(&model)),
        ..wearer::shipped(points)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_numbers_make_the_shipped_joint() {
        let numbers = shipped().into_iter().map(|(name, x)| (name.to_owned(), x));
        let numbers: BTreeMap<String, f64> = numbers.collect();
        for points in Points::ALL {
            assert_eq!(joint(&numbers, points), wearer::shipped(points));
        }
        assert!(PARAMETERS.iter().all(|p| numbers.contains_key(p.name)));
    }
}
