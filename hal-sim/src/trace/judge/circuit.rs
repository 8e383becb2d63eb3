//! Computes the exact current through load, series capacitor and bleed of one channel while nothing
//! switches.
//!
//! The capacitor with its bleed is in series with the load. Volts and amperes are anodic positive.
//! Two parts of the capacitor's charge are tracked separately, by superposition: that left by
//! truncated pulses, and that present when the latest pulse began.

/// Series capacitor and its bleed resistor.
#[derive(Clone, Copy, Debug)]
struct Series {
    farad: f64,
    bleed_ohm: f64,
}

/// Connection of the stage to the load.
#[derive(Clone, Copy, Debug)]
pub(super) enum Path {
    /// Both leads float, or the electrode is detached.
    Open,
    /// Active electrode tied to the return.
    Grounded { ohm: f64 },
    /// A source behind a current limiter.
    Driven(Source),
}

/// A driving stage and its load.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    /// Direction: +1 anodic, −1 cathodic.
    pub sign: f64,
    pub ohm: f64,
    /// Maximum voltage in the driven direction, V.
    pub volts: f64,
    /// Maximum current in the driven direction, A.
    pub limit_a: f64,
    /// Maximum current in the opposite direction, A: a voltage stage takes back the charge of the
    /// capacitor.
    pub reverse_a: f64,
}

/// Charge and peak current through the electrode.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Flow {
    /// Net charge, C.
    pub charge: f64,
    /// Part of the charge that truncated pulses had left on the capacitor, C.
    pub apart: f64,
    /// Part of the charge that the capacitor held when the latest pulse began, C.
    pub before: f64,
    /// Maximum magnitude of the current, A.
    pub peak: f64,
}

/// Load side of one channel.
#[derive(Clone, Debug)]
pub(super) struct Circuit {
    series: Option<Series>,
    /// Voltage across the capacitor, V.
    volts: f64,
    /// Part of the capacitor's voltage that truncated pulses left, V.
    apart: f64,
    /// Part of the capacitor's voltage that remains from before the latest pulse, V.
    before: f64,
}

impl Circuit {
    /// Creates a discharged circuit from capacitance, F, and bleed, Ω. `None` replaces the
    /// capacitor by a wire.
    pub fn new(series: Option<(f64, f64)>) -> Self {
        let series = series.map(|(farad, bleed_ohm)| Series { farad, bleed_ohm });
        Self {
            series,
            volts: 0.0,
            apart: 0.0,
            before: 0.0,
        }
    }

    /// Begins a pulse: the present charge of the capacitor belongs to earlier pulses.
    pub fn begin_pulse(&mut self) {
        self.before = self.volts;
    }

    /// Returns the charge of complete pulses on the capacitor, C.
    pub fn held_charge(&self) -> f64 {
        let farad = self.series.map_or(0.0, |series| series.farad);
        farad * (self.volts - self.apart)
    }

    /// Returns the share of the capacitor's charge that is left after `seconds` in isolation.
    pub fn kept_share(&self, seconds: f64) -> f64 {
        let tau = self.series.map_or(1.0, |s| s.farad * s.bleed_ohm);
        libm::exp(-seconds / tau)
    }

    /// Records that a truncated pulse left this charge, C, on the capacitor.
    pub fn set_cut_charge(&mut self, charge: f64) {
        if let Some(series) = self.series {
            self.apart += charge / series.farad;
        }
    }

    /// Returns the magnitude of the current at the start of `path`, A.
    pub fn current(&self, path: Path) -> f64 {
        match path {
            Path::Open => 0.0,
            Path::Grounded { ohm } => self.volts.abs() / ohm,
            Path::Driven(source) => {
                let linear = (source.volts - source.sign * self.volts) / source.ohm;
                linear.clamp(-source.reverse_a, source.limit_a).abs()
            }
        }
    }

    /// Advances by `seconds` on `path`, and returns the charge that flowed.
    pub fn advance(&mut self, path: Path, seconds: f64) -> Flow {
        let peak = self.current(path);
        let Some(series) = self.series else {
            return Self::advance_without_capacitor(path, peak, seconds);
        };
        let mut flow = match path {
            Path::Open => self.constant(series, 0.0, seconds),
            Path::Grounded { ohm } => self.relax(series, 0.0, ohm, seconds),
            Path::Driven(source) => self.drive(series, source, seconds),
        };
        flow.peak = peak.max(self.current(path));
        flow
    }

    fn advance_without_capacitor(path: Path, peak: f64, seconds: f64) -> Flow {
        let sign = match path {
            Path::Driven(source) => source.sign,
            Path::Open | Path::Grounded { .. } => 0.0,
        };
        Flow {
            charge: sign * peak * seconds,
            peak: sign.abs() * peak,
            ..Flow::default()
        }
    }

    /// Drives at the limiter until the capacitor's voltage ends the limitation, then as the load
    /// determines. Both parts change the voltage in the same direction, so that there is at most
    /// one crossing.
    fn drive(&mut self, series: Series, source: Source, seconds: f64) -> Flow {
        let Source { sign, ohm, .. } = source;
        let along = sign * self.volts;
        let linear = (source.volts - along) / ohm;
        let mut left = seconds;
        let mut flow = Flow::default();
        let held = linear.clamp(-source.reverse_a, source.limit_a);
        if held != linear {
            let crossing = source.volts - held * ohm;
            let end = held * series.bleed_ohm;
            let ratio = (end - along) / (end - crossing);
            let tau = series.farad * series.bleed_ohm;
            let lasts = if ratio >= 1.0 {
                tau * libm::log(ratio)
            } else {
                f64::MAX
            };
            let limited = lasts.min(seconds);
            flow = self.constant(series, sign * held, limited);
            left -= limited;
        }
        if left > 0.0 {
            let rest = self.relax(series, sign * source.volts, ohm, left);
            flow.charge += rest.charge;
            flow.apart += rest.apart;
            flow.before += rest.before;
        }
        flow
    }

    /// Charges the capacitor, with its bleed, by a constant current.
    fn constant(&mut self, series: Series, ampere: f64, seconds: f64) -> Flow {
        let done = -libm::expm1(-seconds / (series.farad * series.bleed_ohm));
        self.volts += (ampere * series.bleed_ohm - self.volts) * done;
        self.apart -= self.apart * done;
        self.before -= self.before * done;
        Flow {
            charge: ampere * seconds,
            ..Flow::default()
        }
    }

    /// Applies a constant voltage across load and capacitor.
    fn relax(&mut self, series: Series, volts: f64, ohm: f64, seconds: f64) -> Flow {
        let parallel = ohm * series.bleed_ohm / (ohm + series.bleed_ohm);
        let tau = series.farad * parallel;
        let done = -libm::expm1(-seconds / tau);
        let end = volts * series.bleed_ohm / (ohm + series.bleed_ohm);
        // Integral of the capacitor's voltage over the time, V·s.
        let mean = end * seconds + (self.volts - end) * tau * done;
        let flow = Flow {
            charge: (volts * seconds - mean) / ohm,
            apart: -self.apart * tau * done / ohm,
            before: -self.before * tau * done / ohm,
            peak: 0.0,
        };
        self.volts += (end - self.volts) * done;
        self.apart -= self.apart * done;
        self.before -= self.before * done;
        flow
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SERIES: Option<(f64, f64)> = Some((4e-6, 2.4e6));

    fn source(volts: f64, limit_a: f64, reverse_a: f64) -> Source {
        Source {
            sign: 1.0,
            ohm: 2_000.0,
            volts,
            limit_a,
            reverse_a,
        }
    }

    /// Computes the same charge with 100 000 small steps.
    fn stepped(volts: &mut f64, source: Source, seconds: f64) -> f64 {
        let (mut charge, step) = (0.0, seconds / 100_000.0);
        for _ in 0..100_000 {
            let linear = (source.volts - source.sign * *volts) / source.ohm;
            let i = source.sign * linear.clamp(-source.reverse_a, source.limit_a);
            charge += i * step;
            *volts += (i - *volts / 2.4e6) / 4e-6 * step;
        }
        charge
    }

    #[test]
    fn driving_through_both_regimes_is_what_small_steps_give() {
        let cases = [
            (0.0, source(120.0, 0.010, 0.0)),
            (99.0, source(120.0, 0.010, 0.0)),
            (-30.0, source(26.0, 0.020, 0.020)),
            (70.0, source(26.0, 0.020, 0.020)),
            (130.0, source(120.0, 0.010, 0.0)),
            (
                3.0,
                Source {
                    sign: -1.0,
                    ..source(26.0, 0.020, 0.020)
                },
            ),
        ];
        for (begin, source) in cases {
            let mut circuit = Circuit::new(SERIES);
            circuit.volts = begin;
            let flow = circuit.advance(Path::Driven(source), 5e-3);
            let mut volts = begin;
            let charge = stepped(&mut volts, source, 5e-3);
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-4 * b.abs().max(1e-6);
            assert!(
                near(flow.charge, charge),
                "{begin} V: {} {charge}",
                flow.charge
            );
            assert!(
                near(circuit.volts, volts),
                "{begin} V: {} {volts}",
                circuit.volts
            );
        }
    }

    #[test]
    fn what_is_held_and_what_bled_is_what_flowed() {
        let mut circuit = Circuit::new(SERIES);
        let drive = circuit.advance(Path::Driven(source(120.0, 0.010, 0.0)), 400e-6);
        assert!((drive.charge - 4e-6).abs() < 1e-12);
        assert!((circuit.held_charge() - 4e-6).abs() < 1e-9);
        // hardware.md, the series capacitor: 8 ms into 2 kΩ.
        let back = circuit.advance(Path::Grounded { ohm: 2_000.0 }, 8e-3);
        assert!((back.charge + 4e-6 * (1.0 - libm::exp(-1.0))).abs() < 1e-8);
        assert!((circuit.held_charge() - 4e-6 * libm::exp(-1.0)).abs() < 1e-8);
        let isolated = circuit.advance(Path::Open, 9.6);
        assert_eq!(isolated.charge, 0.0);
        assert!((circuit.held_charge() - 4e-6 * libm::exp(-2.0)).abs() < 1e-8);
    }

    #[test]
    fn a_pulse_that_was_cut_is_told_apart() {
        let mut circuit = Circuit::new(SERIES);
        let flow = circuit.advance(Path::Driven(source(120.0, 0.010, 0.0)), 400e-6);
        circuit.set_cut_charge(flow.charge);
        assert!(circuit.held_charge().abs() < 1e-9);
        let back = circuit.advance(Path::Grounded { ohm: 2_000.0 }, 4e-3);
        assert!((back.charge - back.apart).abs() < 1e-9);
        assert!(circuit.held_charge().abs() < 1e-9);
    }
}
