//! Electrical model of the skin under an electrode.

/// A resistance in series with a resistance parallel to a capacitor. The parallel resistance falls
/// with the current of the electrode, R_p = R_0 / (1 + |I| / I_half). The abstract of Vargas Luna
/// et al. 2015 reports that it falls, mainly with the amplitude of the current; the form is
/// assumed. The ranges are assumed too, for an area A in cm²: R_s 100 to 500 Ω, R_0 · A 2 to 20
/// kΩ·cm², C / A 10 to 50 nF/cm².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Skin {
    /// Series resistance R_s, Ω, above 0.
    pub series_ohm: f64,
    /// Parallel resistance R_0 at zero current, Ω, above 0.
    pub parallel_ohm: f64,
    /// Capacitance C, F, 0 or above; 0 keeps no charge between pieces.
    pub farad: f64,
    /// Current I_half that halves R_0, A, above 0; infinite for a constant R_p.
    pub half_a: f64,
}

impl Skin {
    /// Returns R_p, Ω, at a current of this magnitude, A.
    pub fn parallel_ohm_at(&self, magnitude_a: f64) -> f64 {
        self.parallel_ohm / (1.0 + magnitude_a / self.half_a)
    }

    /// Returns whether R_p is independent of the current.
    pub fn is_linear(&self) -> bool {
        self.half_a == f64::INFINITY
    }

    /// Returns the name of the first field whose value is out of range, and the allowed range, or
    /// `None` if all fields are valid.
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
