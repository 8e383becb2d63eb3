//! Thresholds and maxima of a wearer, and recruitment as a function of the pulse.

use super::electrode::NOMINAL_LOAD_OHM;

/// A stimulation point and the voltages determined for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// Channel whose electrodes are on this point, 0 to 9.
    pub channel: usize,
    /// Smallest voltage that moves the finger, V into the nominal load at 200 µs.
    pub threshold_v: f64,
    /// Voltage of full recruitment, V; the largest that stays selective.
    pub max_v: f64,
}

/// Participants of Hamana 2022's control experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Participant {
    /// Participant P, with threshold voltages 24, 28 and 14 V.
    P,
    /// Participant Q, with threshold voltages 24, 24 and 16 V.
    Q,
    /// Participant S, with threshold voltages 26, 18 and 18 V.
    S,
}

impl Participant {
    /// Returns threshold and maximum voltage of A, B and the extensor, V (Hamana 2022, table 7).
    pub const fn voltages(self) -> [(f64, f64); 3] {
        match self {
            Self::P => [(24.0, 28.0), (28.0, 36.0), (14.0, 26.0)],
            Self::Q => [(24.0, 32.0), (24.0, 32.0), (16.0, 24.0)],
            Self::S => [(26.0, 32.0), (18.0, 24.0), (18.0, 26.0)],
        }
    }

    /// Returns the thresholds of A and of B while both are pulsed, conducted, V (Hamana 2022, table
    /// 7, last columns, before their rounding to volts: those of P are printed as 20 and 25). A
    /// finger has them only if its specification says so ([`super::finger::Pair`]); [`super::hand`]
    /// computes whether they follow from a forearm.
    pub const fn pair_thresholds_v(self) -> [f64; 2] {
        match self {
            // The value is 19.6; the last digit keeps the numbers of `random_finger` identical to
            // the bit.
            Self::P => [19.599_999_999_999_998, 25.2],
            Self::Q => [22.4, 22.4],
            Self::S => [22.4, 16.8],
        }
    }
}

/// Curvature with which force rises between threshold and maximum: b·(Imax - Imin) of F =
/// a·exp(bI). Mean over subjects of ln(Fmax/Fmin) at 40 Hz in Lee 2020, table 2, where the range is
/// likewise motor threshold to tolerable maximum.
pub const RECRUITMENT_CURVATURE: f64 = 1.2;

/// Pulse width at which the voltages of table 7 were determined, µs (Hamana §II-D).
const REFERENCE_WIDTH_US: f64 = 200.0;

/// Chronaxie that relates other pulse widths to [`REFERENCE_WIDTH_US`], µs. Assumed: the order of
/// magnitude of motor nerve under surface electrodes, not from the papers.
const CHRONAXIE_US: f64 = 200.0;

/// Returns the recruited share of full torque: 0 up to `threshold_v`, 1 from `max_v` on,
/// exponential in between with `curvature` (not zero).
pub fn recruitment(effective_v: f64, threshold_v: f64, max_v: f64, curvature: f64) -> f64 {
    let x = ((effective_v - threshold_v) / (max_v - threshold_v)).clamp(0.0, 1.0);
    libm::expm1(curvature * x) / libm::expm1(curvature)
}

/// Returns the voltage into the nominal load at 200 µs that excites as much as `current_ma` does in
/// `width_us`. Nerves respond to current, and the threshold depends on the width as 1 +
/// chronaxie/width (Weiss).
pub fn effective_voltage(current_ma: f64, width_us: u32) -> f64 {
    let strength = (1.0 + CHRONAXIE_US / REFERENCE_WIDTH_US)
        / (1.0 + CHRONAXIE_US / f64::from(width_us.max(1)));
    1e-3 * current_ma * NOMINAL_LOAD_OHM * strength
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recruitment_runs_from_threshold_to_maximum() {
        let at = |v| recruitment(v, 24.0, 28.0, RECRUITMENT_CURVATURE);
        assert_eq!(at(10.0), 0.0);
        assert_eq!(at(24.0), 0.0);
        assert!((at(28.0) - 1.0).abs() < 1e-15);
        assert_eq!(at(40.0), at(28.0));
        assert!(at(26.0) > 0.3 && at(26.0) < 0.4, "{}", at(26.0));
    }

    #[test]
    fn effective_voltage_is_the_voltage_at_the_reference() {
        assert!((effective_voltage(14.0, 200) - 28.0).abs() < 1e-12);
        assert!(effective_voltage(14.0, 100) < 28.0);
        assert!(effective_voltage(14.0, 400) > 28.0);
        assert_eq!(effective_voltage(0.0, 0), 0.0);
    }
}
