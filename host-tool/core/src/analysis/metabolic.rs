//! Metabolic power from gas exchange.

/// Energy of a litre of oxygen, kJ (Péronnet and Massicotte 1991, as used in Buatier de Mongeot's
/// equation 5).
const OXYGEN_KJ_PER_L: f64 = 16.89;
/// Energy of a litre of carbon dioxide given off, kJ, from the same source.
const CARBON_DIOXIDE_KJ_PER_L: f64 = 4.84;

/// Gas exchange at the mouth, ml/s.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GasExchange {
    /// Oxygen taken up, ml/s.
    pub oxygen_ml_per_s: f64,
    /// Carbon dioxide given off, ml/s.
    pub carbon_dioxide_ml_per_s: f64,
}

impl GasExchange {
    /// Returns the metabolic power, W: kJ/l times ml/s are watts.
    #[must_use]
    pub fn power_w(&self) -> f64 {
        OXYGEN_KJ_PER_L * self.oxygen_ml_per_s
            + CARBON_DIOXIDE_KJ_PER_L * self.carbon_dioxide_ml_per_s
    }

    /// Returns the metabolic power above rest per body mass, W/kg: equation 5 for this exchange
    /// minus equation 5 for `rest`, divided by `mass_kg`, which must be above zero.
    #[must_use]
    pub fn net_w_per_kg(&self, rest: &Self, mass_kg: f64) -> f64 {
        (self.power_w() - rest.power_w()) / mass_kg
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks values computed by hand: 10 ml/s and 8 ml/s are 168.9 + 38.72 W; at rest 4 and 3.2
    /// ml/s are 83.048 W.
    #[test]
    fn equation_5_by_hand() {
        let gas_exchange = |oxygen_ml_per_s, carbon_dioxide_ml_per_s| GasExchange {
            oxygen_ml_per_s,
            carbon_dioxide_ml_per_s,
        };
        let (work, rest) = (gas_exchange(10.0, 8.0), gas_exchange(4.0, 3.2));
        assert!((work.power_w() - 207.62).abs() < 1e-9);
        assert!((work.net_w_per_kg(&rest, 50.0) - (207.62 - 83.048) / 50.0).abs() < 1e-12);
    }
}
