//! Angles of the digits that flexors bend, as the data glove of Hamana 2022 measures them, and the
//! individuation index of the index finger.

use super::pools::DIGITS;

/// Index of the index finger among the digits.
pub const INDEX: usize = 1;

/// Smallest and largest angle that the glove measures, °: of the thumb's CMC joint and the fingers'
/// PIP joints (Hamana 2022, II-C).
pub const RANGES_DEG: [[f64; 2]; DIGITS] = [
    [-40.0, 5.0],
    [0.0, 100.0],
    [0.0, 100.0],
    [0.0, 100.0],
    [0.0, 100.0],
];

/// Angles of the digits of a relaxed hand, thumb first, °. Assumed.
pub const REST_DEG: [f64; DIGITS] = [-25.0, 10.0, 10.0, 10.0, 10.0];

/// Share of a flexor's torque that is lost by shortening over the whole range. Assumed, as for the
/// finger of `body::finger`.
pub const LOST: f64 = 0.25;

/// Smallest movement of a finger that an observer sees, °.
pub const VISIBLE_DEG: f64 = 5.0;

/// Individuation index above which the index finger counts as moving alone (Hamana 2022, III-A2).
pub const SELECTIVE: f64 = 0.8;

/// Force at which the wrist counts as barely extended, as a fraction of the full force of its
/// extensors. Assumed.
pub const WRIST_BARELY_EXTENDED: f64 = 0.1;

/// Names of the flexion of each digit, thumb first.
const FLEXIONS: [&str; DIGITS] = [
    "thumb flexion",
    INDEX_FLEXION,
    "middle finger flexion",
    "ring finger flexion",
    "little finger flexion",
];
/// Name of the movement of the index finger's flexors.
pub const INDEX_FLEXION: &str = "index flexion";
/// Name of the movement of the index finger's extensor.
pub const INDEX_EXTENSION: &str = "index extension";
/// Name of the movement of the wrist's extensors.
const WRIST_EXTENSION: &str = "wrist extension";

/// Returns the names of the movements that an observer sees in a hand with these angles, thumb
/// first, and this force of the wrist's extensors, as a fraction of their full force. The other
/// digits are named only if the index finger does not move alone ([`SELECTIVE`]), which is the
/// paper's rule.
#[must_use]
pub fn visible_movements(angles_deg: &[f64; DIGITS], wrist: f64) -> Vec<&'static str> {
    let bent = |digit: usize| angles_deg[digit] - REST_DEG[digit];
    let is_alone = bent(INDEX) >= VISIBLE_DEG
        && individuation(&normalised(angles_deg)).is_some_and(|index| index > SELECTIVE);
    let mut names = Vec::new();
    for (digit, name) in FLEXIONS.into_iter().enumerate() {
        if bent(digit) >= VISIBLE_DEG && (digit == INDEX || !is_alone) {
            names.push(name);
        }
    }
    if -bent(INDEX) >= VISIBLE_DEG {
        names.push(INDEX_EXTENSION);
    }
    if wrist > WRIST_BARELY_EXTENDED {
        names.push(WRIST_EXTENSION);
    }
    names
}

/// Isometric torques of the muscles of a hand, N·m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Torques {
    /// Torque of the flexors of each digit, thumb first.
    pub flexors_nm: [f64; DIGITS],
    /// Torque of the extensor of the index finger.
    pub extensor_nm: f64,
}

impl Torques {
    /// Returns the extension torque on `digit`, N·m; 0 for every digit but the index finger.
    const fn extension_nm(&self, digit: usize) -> f64 {
        if digit == INDEX {
            self.extensor_nm
        } else {
            0.0
        }
    }

    /// Returns the net torque on `digit` at `progress` of its range (0 at the low stop, 1 at the
    /// high one), N·m. A muscle loses torque as it shortens.
    #[must_use]
    pub fn net_nm(&self, digit: usize, progress: f64) -> f64 {
        self.flexors_nm[digit] * (1.0 - LOST * progress)
            - self.extension_nm(digit) * (1.0 - LOST * (1.0 - progress))
    }

    /// Returns the angles at which free digits come to rest against a spring of this stiffness, °.
    #[must_use]
    pub fn angles_deg(&self, stiffness_nm_per_rad: f64) -> [f64; DIGITS] {
        std::array::from_fn(|digit| {
            let [low, high] = RANGES_DEG[digit];
            let rest = REST_DEG[digit];
            // The equation stiffness · (θ - rest) = net torque is linear in θ.
            let stiffness = stiffness_nm_per_rad.to_radians();
            let slope = (self.flexors_nm[digit] + self.extension_nm(digit)) * LOST / (high - low);
            let at_rest = self.net_nm(digit, (rest - low) / (high - low));
            (rest + at_rest / (stiffness + slope)).clamp(low, high)
        })
    }
}

/// Returns the flexion of each digit from rest, as a share of the range that the glove can measure
/// (Hamana 2022, equation 2).
#[must_use]
pub fn normalised(angles_deg: &[f64; DIGITS]) -> [f64; DIGITS] {
    std::array::from_fn(|digit| {
        let rest = REST_DEG[digit];
        (angles_deg[digit] - rest) / (RANGES_DEG[digit][1] - rest)
    })
}

/// Returns the individuation index of the index finger (Hamana 2022, equation 1), or `None` if the
/// paper would leave the trial out: the index finger did not move, or the index is negative.
#[must_use]
pub fn individuation(normalised: &[f64; DIGITS]) -> Option<f64> {
    let index = normalised[INDEX].abs();
    let others = normalised.iter().map(|part| part.abs()).sum::<f64>() - index;
    let individuation = 1.0 - 0.25 * others / index;
    (individuation >= 0.0).then_some(individuation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_digit_balances_torque_and_stiffness() {
        let flexed = Torques {
            flexors_nm: [0.0, 0.05, 0.5, 0.0, 0.0],
            extensor_nm: 0.0,
        };
        let angles = flexed.angles_deg(0.12);
        assert_eq!(angles[0], REST_DEG[0]);
        let bent = (angles[INDEX] - 10.0).to_radians();
        let torque = 0.05 * (1.0 - LOST * angles[INDEX] / 100.0);
        assert!((0.12 * bent - torque).abs() < 1e-12, "{angles:?}");
        assert_eq!(angles[2], 100.0, "its stop");
        let opposed = Torques {
            extensor_nm: 0.08,
            ..flexed
        };
        let angle = opposed.angles_deg(0.12)[INDEX];
        let spring = 0.12 * (angle - 10.0).to_radians();
        assert!((spring - opposed.net_nm(INDEX, angle / 100.0)).abs() < 1e-12);
        assert!(angle < 10.0 && angle > 0.0, "{angle}");
    }

    #[test]
    fn the_individuation_index_is_that_of_equation_1() {
        let index = |parts: [f64; DIGITS]| individuation(&parts);
        assert_eq!(index([0.0, 0.7, 0.0, 0.0, 0.0]), Some(1.0));
        let shared = index([0.2, 0.5, 0.2, 0.2, 0.2]).unwrap();
        assert!((shared - 0.6).abs() < 1e-12, "{shared}");
        assert_eq!(index([0.5, 0.1, 0.0, 0.0, 0.0]), None, "negative");
        assert_eq!(index([0.0; DIGITS]), None, "not calculable");
    }

    #[test]
    fn an_observer_sees_what_moves_and_the_rule_of_the_paper() {
        let at = |index: f64, middle: f64| [REST_DEG[0], index, middle, REST_DEG[3], REST_DEG[4]];
        assert!(visible_movements(&REST_DEG, 0.0).is_empty());
        assert!(visible_movements(&at(14.9, 10.0), 0.1).is_empty());
        assert_eq!(visible_movements(&at(15.0, 10.0), 0.0), [FLEXIONS[1]]);
        // Individuation 1 - 0.25 · 20/40, which is above 0.8.
        assert_eq!(visible_movements(&at(50.0, 30.0), 0.0), FLEXIONS[1..2]);
        assert_eq!(visible_movements(&at(30.0, 30.0), 0.0), FLEXIONS[1..3]);
        assert_eq!(visible_movements(&at(10.0, 30.0), 0.0), FLEXIONS[2..3]);
        let extended = visible_movements(&at(4.0, 10.0), 0.2);
        assert_eq!(extended, [INDEX_EXTENSION, WRIST_EXTENSION]);
    }

    #[test]
    fn normalised_angles_end_at_what_the_glove_measures() {
        assert_eq!(normalised(&REST_DEG), [0.0; DIGITS]);
        assert_eq!(
            normalised(&[5.0, 100.0, 100.0, 100.0, 100.0]),
            [1.0; DIGITS]
        );
    }
}
