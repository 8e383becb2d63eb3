//! Describing function of the device's own control law, measured on its code, and the limit cycle
//! that it predicts with a linearised finger (Gelb & Vander Velde 1968, chapters 2–3: quasi-linear
//! stability of a limit cycle).

use super::finger::{PULSE_PERIOD_US, angle};
use firmware::control::{Effort, Joint, JointSpec, JointState};
use firmware::units::Micros;
use hal_sim::body::FingerSpec;
use hal_sim::body::wearer::recruitment;
use std::f64::consts::TAU;

type Complex = num_complex::Complex<f64>;

/// Returns the amplitudes of the measured angle, degrees: from the device's resolution to most of
/// the joint's range, ×1.3 each.
fn amplitudes() -> impl Iterator<Item = f64> {
    (0..27).map(|n| 0.05 * 1.3f64.powi(n))
}

/// Returns the periods, ms: from three pulse periods to longer than any limit cycle here, even so
/// that a whole number of law periods fits.
fn periods() -> impl Iterator<Item = u32> {
    (0..30).map(|n| 2 * (30.0 * 1.13f64.powi(n)) as u32)
}

/// Number of periods that settle unseen, and of periods that are measured.
const SETTLING: u32 = 3;
const LOOKED_AT: u32 = 2;
/// Middle of the joint's range, degrees; the law receives only the error around it.
const MIDDLE_DEG: f64 = 50.0;

/// Responses of a law to sines of the measured angle.
pub(super) struct Efforts {
    /// Responses by amplitude, then by period.
    answers: Vec<Vec<Answer>>,
}

/// Efforts of the law, one for each ms of whole periods, without their mean.
struct Answer {
    amplitude_deg: f64,
    period_ms: u32,
    efforts: Vec<f64>,
}

/// Describing function N of law and recruitment at the angle that a finger holds, N·m/rad, by
/// amplitude, degrees, then by period, ms.
pub(super) struct DescribingFunction {
    rows: Vec<(f64, Vec<(f64, Complex)>)>,
}

impl Efforts {
    /// Drives the joint's law with every amplitude and period.
    pub(super) fn measure(joint: &JointSpec) -> Self {
        let joint = Joint::with_full_gain(joint).expect("a valid joint");
        let answer = |a, period| Answer::of(&joint, a, period);
        Self {
            answers: amplitudes()
                .map(|a| periods().map(|period| answer(a, period)).collect())
                .collect(),
        }
    }

    /// Returns the describing function at the angle that `plant` holds, which does not depend on
    /// the plant's delay.
    pub(super) fn around(&self, plant: &Plant) -> DescribingFunction {
        let row = |row: &Vec<Answer>| {
            let one = |a: &Answer| (f64::from(a.period_ms), a.harmonic(plant));
            (row[0].amplitude_deg, row.iter().map(one).collect())
        };
        DescribingFunction {
            rows: self.answers.iter().map(row).collect(),
        }
    }
}

impl Answer {
    fn of(joint: &Joint, amplitude_deg: f64, period_ms: u32) -> Self {
        let mut state = JointState::default();
        let zero = Micros::new(0);
        let taken = joint.accept_setpoint(&mut state, zero, zero, angle(MIDDLE_DEG), None);
        taken.expect("the middle of the range");
        let mut efforts = Vec::new();
        for ms in 0..(SETTLING + LOOKED_AT) * period_ms {
            let now = Micros::new(ms * 1000);
            let turn = TAU * f64::from(ms) / f64::from(period_ms);
            let seen = angle(MIDDLE_DEG + amplitude_deg * turn.cos());
            let taken = joint.accept_measurement(&mut state, now, now, seen);
            taken.expect("measurements come in order");
            let orders = joint.tick(&mut state, now, None).expect("a fresh angle");
            let (Effort::AboveThreshold(u) | Effort::Fraction(u)) = orders.effort;
            if ms >= SETTLING * period_ms {
                efforts.push(u.to_num::<f64>());
            }
        }
        let mean = efforts.iter().sum::<f64>() / efforts.len() as f64;
        for u in &mut efforts {
            *u -= mean;
        }
        Self {
            amplitude_deg,
            period_ms,
            efforts,
        }
    }

    /// Returns the first harmonic of the torque divided by the error, N·m/rad.
    fn harmonic(&self, plant: &Plant) -> Complex {
        let sum: Complex = (self.efforts.iter().zip(0u32..))
            .map(|(u, ms)| {
                let turn = TAU * f64::from(ms) / f64::from(self.period_ms);
                Complex::from_polar(plant.torque(plant.effort + u), -turn)
            })
            .sum();
        // The error is minus the measured sine.
        let error = -self.amplitude_deg.to_radians();
        sum * (2.0 / self.efforts.len() as f64) / error
    }
}

impl DescribingFunction {
    /// Returns the amplitude of the true angle's limit cycle on this finger, degrees; 0 if there is
    /// none. Of several limit cycles, returns the largest stable one, beyond which the loop's gain
    /// falls below 1.
    pub(super) fn limit_cycle_deg(&self, plant: &Plant) -> f64 {
        let margin = |(a, row): &(f64, Vec<_>)| {
            let (gain, period) = crossing(row, plant);
            (*a, gain, period)
        };
        let margins: Vec<(f64, f64, f64)> = self.rows.iter().map(margin).collect();
        let Some(n) = margins.iter().rposition(|(_, gain, _)| *gain > 1.0) else {
            return 0.0;
        };
        let (a, gain, period) = margins[n];
        let amplitude = match margins.get(n + 1) {
            None => a,
            Some((next, below, _)) => {
                // Linear between the logarithms of amplitude and gain.
                let part = gain.ln() / (gain / below.max(1e-9)).ln();
                a * (next / a).powf(part)
            }
        };
        amplitude / plant.sensor(TAU / period * 1e3).norm()
    }
}

/// Returns the loop's largest gain where its phase passes −180°, and the period there, ms; the gain
/// is 0 if the phase never does.
fn crossing(row: &[(f64, Complex)], plant: &Plant) -> (f64, f64) {
    let gain =
        |(period, n): &(f64, Complex)| (*period, n * plant.frequency_response(TAU / period * 1e3));
    let gains: Vec<(f64, Complex)> = row.iter().map(gain).collect();
    let mut best = (0.0, 1.0);
    for pair in gains.windows(2) {
        let [(from, a), (to, b)] = [pair[0], pair[1]];
        // Skips neighbours between which the negative real axis is not crossed.
        if a.im * b.im > 0.0 || (a.re + b.re) > 0.0 {
            continue;
        }
        let part = a.im / (a.im - b.im);
        let gain = -(a.re + (b.re - a.re) * part);
        if gain > best.0 {
            best = (gain, from + (to - from) * part);
        }
    }
    best
}

/// A finger linearised at the angle that it holds.
pub(super) struct Plant {
    spec: FingerSpec,
    progress: f64,
    /// Effort that holds the angle.
    effort: f64,
    /// Stiffness, including the part from the flexor's shortening, N·m/rad.
    stiffness: f64,
    /// Lag of the force behind a change of recruitment, s.
    lag_s: f64,
}

impl Plant {
    pub(super) fn new(spec: &FingerSpec, target_deg: f64) -> Self {
        let [low, high] = spec.stops_deg;
        let progress = (target_deg - low) / (high - low);
        let needed = spec.stiffness_nm_per_rad * (target_deg - spec.rest_deg).to_radians();
        let full = spec.flexor_torque_nm * (1.0 - spec.torque_loss * progress);
        let share = (needed / full).min(1.0);
        let curvature = spec.recruitment_curvature;
        // The muscle's mean x at this pulse rate: the mean of C over a period is close to τc
        // divided by the period.
        let m = &spec.muscle;
        let mean = m.tau_c_s / (PULSE_PERIOD_US as f64 * 1e-6);
        let x = mean / (mean + m.k);
        let whole = spec.flexor_torque_nm * share;
        Self {
            progress,
            effort: (share * curvature.exp_m1()).ln_1p() / curvature,
            stiffness: spec.stiffness_nm_per_rad
                + whole * spec.torque_loss / (high - low).to_radians(),
            lag_s: m.tau1_s + m.tau2_s * x,
            spec: spec.clone(),
        }
    }

    /// Returns the steady torque of an effort, N·m: recruitment of the flexor above 0, of the
    /// extensor below.
    fn torque(&self, effort: f64) -> f64 {
        let s = &self.spec;
        let share = recruitment(effort.abs(), 0.0, 1.0, s.recruitment_curvature);
        if effort > 0.0 {
            s.flexor_torque_nm * (1.0 - s.torque_loss * self.progress) * share
        } else {
            -s.extensor_torque_nm * (1.0 - s.torque_loss * (1.0 - self.progress)) * share
        }
    }

    /// Returns the response from requested torque to measured angle: hold between pulses, delay,
    /// muscle, joint, sensor.
    fn frequency_response(&self, omega: f64) -> Complex {
        let s = &self.spec;
        let jw = Complex::new(0.0, omega);
        let one = Complex::new(1.0, 0.0);
        let period = PULSE_PERIOD_US as f64 * 1e-6;
        let hold = (one - (-jw * period).exp()) / (jw * period);
        let delay = (-jw * (f64::from(s.electromechanical_delay_us) * 1e-6)).exp();
        let muscle = one / (one + jw * self.lag_s);
        let joint =
            one / (jw * jw * s.inertia_kg_m2 + jw * s.damping_nm_s_per_rad + self.stiffness);
        hold * delay * muscle * joint * self.sensor(omega)
    }

    fn sensor(&self, omega: f64) -> Complex {
        let one = Complex::new(1.0, 0.0);
        one / (one + Complex::new(0.0, omega * self.spec.sensor_lag_s))
    }
}
