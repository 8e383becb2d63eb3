//! Membrane of a nerve: a leaky integrator that the field charges, with a threshold and a
//! refractory time after each spike.

/// Time constants of a nerve's membrane: its leak and its refractory periods.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Membrane {
    /// Time constant of the leak, s. Assumed: 100 to 350 µs.
    pub leak_s: f64,
    /// Absolute refractory time after a spike, s (Kopec 1978: 2.5 to 3.0 ms).
    pub absolute_s: f64,
    /// End of the relative refractory time, s after the spike (Kopec 1978: about 5 ms). From
    /// `absolute_s` on, the threshold falls linearly from twice its value to its value (the linear
    /// course is assumed).
    pub relative_s: f64,
}

/// Exponentially decaying drive, `amplitude · exp(-rate · t)`; a rate of 0 makes it constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decay {
    /// Value at the start, in the unit of the quantity that `Rule` selects.
    pub amplitude: f64,
    /// Rate of decay, 1/s.
    pub rate: f64,
}

/// State of one nerve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nerve {
    /// Charge of the membrane, in the unit of the quantity that `Rule` selects.
    pub charged: f64,
    /// Time since the last spike, s.
    pub since_s: f64,
}

impl Nerve {
    /// Uncharged, long after the last spike.
    pub const REST: Self = Self {
        charged: 0.0,
        since_s: f64::INFINITY,
    };
}

impl Membrane {
    /// Returns the factor on the threshold at `since_s` after a spike; infinite during the absolute
    /// refractory time.
    #[must_use]
    pub fn threshold_factor(&self, since_s: f64) -> f64 {
        if since_s < self.absolute_s {
            f64::INFINITY
        } else if since_s < self.relative_s {
            1.0 + (self.relative_s - since_s) / (self.relative_s - self.absolute_s)
        } else {
            1.0
        }
    }

    /// Returns the charge after `t_s` under `terms`, from `charged` at the start: the closed-form
    /// solution of leak · dv/dt = drive - v.
    #[must_use]
    pub fn charge_after(
        &self,
        charged: f64,
        terms: impl IntoIterator<Item = Decay>,
        t_s: f64,
    ) -> f64 {
        let kept = libm::exp(-t_s / self.leak_s);
        let driven = terms.into_iter().map(|term| {
            let apart = 1.0 - term.rate * self.leak_s;
            if apart.abs() < 1e-6 {
                // The term decays at the rate of the leak.
                term.amplitude * t_s / self.leak_s * kept
            } else {
                term.amplitude * (libm::exp(-term.rate * t_s) - kept) / apart
            }
        });
        charged * kept + driven.sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MEMBRANE: Membrane = Membrane {
        leak_s: 200e-6,
        absolute_s: 2.75e-3,
        relative_s: 5e-3,
    };

    /// Compares with the fourth-order Runge-Kutta method in steps of 10 ns.
    #[test]
    fn the_closed_form_solves_the_leak() {
        let terms = [(3.0, 0.0), (-1.0, 2e3), (0.7, 5e3), (2.0, 1e5)]
            .map(|(amplitude, rate)| Decay { amplitude, rate });
        let drive = |t: f64| -> f64 {
            terms
                .iter()
                .map(|x| x.amplitude * libm::exp(-x.rate * t))
                .sum()
        };
        let slope = |t: f64, v: f64| (drive(t) - v) / MEMBRANE.leak_s;
        let (h, mut v) = (1e-8, 0.3);
        for step in 0..20_000 {
            let t = f64::from(step) * h;
            let a = slope(t, v);
            let b = slope(t + h / 2.0, v + h / 2.0 * a);
            let c = slope(t + h / 2.0, v + h / 2.0 * b);
            let d = slope(t + h, v + h * c);
            v += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
        }
        let closed = MEMBRANE.charge_after(0.3, terms, 200e-6);
        assert!((closed - v).abs() < 1e-10, "{closed} {v}");
    }

    /// A term whose rate equals or nearly equals that of the leak.
    #[test]
    fn equal_rates_are_no_pole() {
        let at = |rate: f64| {
            let term = Decay {
                amplitude: 1.0,
                rate,
            };
            MEMBRANE.charge_after(0.0, [term], 300e-6)
        };
        let equal = at(1.0 / MEMBRANE.leak_s);
        for part in [1.0 - 1e-5, 1.0 + 1e-5, 1.0 + 1e-7] {
            assert!((at(part / MEMBRANE.leak_s) - equal).abs() < 1e-5);
        }
    }

    /// Threshold of a rectangular pulse as a function of its width: Lapicque's curve of the leak.
    #[test]
    fn a_short_pulse_needs_more() {
        let reached = |t_s: f64| {
            let term = Decay {
                amplitude: 1.0,
                rate: 0.0,
            };
            MEMBRANE.charge_after(0.0, [term], t_s)
        };
        assert!((reached(200e-6) - (1.0 - libm::exp(-1.0))).abs() < 1e-15);
        assert!(reached(100e-6) < 0.65 * reached(200e-6));
    }

    #[test]
    fn a_nerve_that_spiked_needs_more_for_a_while() {
        assert_eq!(MEMBRANE.threshold_factor(1e-3), f64::INFINITY);
        assert_eq!(MEMBRANE.threshold_factor(2.75e-3), 2.0);
        assert!((MEMBRANE.threshold_factor(3.875e-3) - 1.5).abs() < 1e-12);
        assert_eq!(MEMBRANE.threshold_factor(5e-3), 1.0);
    }
}
