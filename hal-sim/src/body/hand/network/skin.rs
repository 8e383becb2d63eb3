//! The skin under an electrode.

/// A resistance in series with a resistance parallel to a capacitor. The parallel one
/// falls with the electrode's current, R_p = R_0 / (1 + |I| / I_half): that it falls,
/// and mainly with the current's amplitude, is in the abstract of Vargas Luna et al.
/// 2015; the form is assumed. So are the ranges, for an area A in cm²: R_s 100 to
/// 500 Ω, R_0 · A 2 to 20 kΩ·cm², C / A 10 to 50 nF/cm².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Skin {
    /// R_s, Ω, above 0.
    pub series_ohm: f64,
    /// R_0, Ω, above 0.
    pub parallel_ohm: f64,
    /// C, F, 0 or above; without a capacitor nothing is remembered.
    pub farad: f64,
    /// I_half, A, above 0: the current that halves R_0. Infinite: R_p is constant.
    pub half_a: f64,
}

impl Skin {
    /// R_p, Ω, at a current of this magnitude, A.
    pub fn parallel_ohm_at(&self, magnitude_a: f64) -> f64 {
        self.parallel_ohm / (1.0 + magnitude_a / self.half_a)
    }

    /// Whether R_p does not depend on the current.
    pub fn is_linear(&self) -> bool {
        self.half_a == f64::INFINITY
    }

    /// The first field that no skin can have, and its range.
    pub(super) fn first_invalid_field(&self) -> Option<(&'static str, &'static str)> {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        let rules = [
            (positive(self.series_ohm), "series_ohm", "finite, above 0"),
            (
                positive(self.parallel_ohm),
                "parallel_ohm",
                "finite, above 0",
            ),
            (
                self.farad.is_finite() && self.farad >= 0.0,
                "farad",
                "finite, 0 or above",
            ),
            (self.half_a > 0.0, "half_a", "above 0"),
        ];
        let wrong = rules.into_iter().find(|rule| !rule.0);
        wrong.map(|(_, field, range)| (field, range))
    }
}
