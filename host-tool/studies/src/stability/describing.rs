//! Describing function of the device's own control law, measured on its code, and the limit cycle
//! that it predicts with a linearised finger (Gelb & Vander Velde 1968, chapters 2–3: quasi-linear
//! stability of a limit cycle).

use super::finger::{PULSE_PERIOD_US, angle};
use firmware::control::{Effort, Joint, JointSpec, JointState};
use firmware::units::Micros;
use hal_sim::body::FingerSpec;
use hal_sim::body::wearer::recruitment;
use std::f64::consts::TAU;
use std::sync::OnceLock;

type Complex = num_complex::Complex<f64>;

/// Returns the amplitudes of the measured angle at which a law is tested, °: from the device's
/// resolution to most of the joint's range, each 1.3 times the one before.
fn amplitudes() -> impl Iterator<Item = f64> {
    (0..27).map(|n| 0.05 * 1.3f64.powi(n))
}

/// Returns the periods at which a law is tested, ms: from three pulse periods to more than any
/// limit cycle of the map has. All are even, so that a whole number of law periods fits.
fn periods() -> impl Iterator<Item = u32> {
    (0..30).map(|n| 2 * (30.0 * 1.13f64.powi(n)) as u32)
}

/// Number of periods after which a law has settled and its response is recorded.
const SETTLING: u32 = 3;
/// Number of periods for which the response of a law is recorded.
const LOOKED_AT: u32 = 2;
/// Angle around which the measured angle oscillates, °: the middle of the joint's range. Only the
/// error matters to the law.
const MIDDLE_DEG: f64 = 50.0;

/// Responses of a control law to sinusoidal measured angles.
pub(super) struct Efforts {
    /// Responses, first by amplitude, then by period.
    answers: Vec<Vec<Answer>>,
}

/// Responses of a joint's law that are measured when they are first needed.
pub(super) struct LazyEfforts {
    joint: JointSpec,
    efforts: OnceLock<Option<Efforts>>,
}

impl LazyEfforts {
    pub(super) const fn new(joint: JointSpec) -> Self {
        Self {
            joint,
            efforts: OnceLock::new(),
        }
    }

    pub(super) const fn joint(&self) -> &JointSpec {
        &self.joint
    }

    /// Returns the responses, or `None` if the device refuses the joint.
    pub(super) fn get(&self) -> Option<&Efforts> {
        let measure = || {
            let is_valid = Joint::with_full_gain(&self.joint).is_ok();
            is_valid.then(|| Efforts::measure(&self.joint))
        };
        self.efforts.get_or_init(measure).as_ref()
    }
}

/// Efforts of the law in each millisecond of whole periods, with their mean subtracted.
struct Answer {
    amplitude_deg: f64,
    period_ms: u32,
    efforts: Vec<f64>,
}

/// Describing function N of law and recruitment, N·m/rad, around the effort with which a finger
/// holds its angle. Rows are by amplitude, °; entries are by period, ms.
pub(super) struct DescribingFunction {
    rows: Vec<(f64, Vec<(f64, Complex)>)>,
}

impl Efforts {
    /// Measures the response of the joint's law to every amplitude and period.
    pub(super) fn measure(joint: &JointSpec) -> Self {
        let range_v = joint.flexors.first().map_or(1.0, |point| {
            f64::from(point.max.get() - point.threshold.get()) * 1e-3
        });
        let joint = Joint::with_full_gain(joint).expect("a valid joint");
        let answer = |a, period| Answer::of(&joint, range_v, a, period);
        Self {
            answers: amplitudes()
                .map(|a| periods().map(|period| answer(a, period)).collect())
                .collect(),
        }
    }

    /// Returns the describing function around the effort with which `plant` holds its angle. The
    /// delay of the plant does not affect it.
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
    /// Records the response. `range_v` converts an effort in volts into a fraction of the flexor's
    /// range, for both muscles.
    fn of(joint: &Joint, range_v: f64, amplitude_deg: f64, period_ms: u32) -> Self {
        let mut state = JointState::default();
        let zero = Micros::new(0);
        let taken = joint.accept_setpoint(&mut state, zero, zero, angle(MIDDLE_DEG), None);
        taken.expect("the middle of the range");
        let mut efforts = Vec::new();
        for ms in 0..(SETTLING + LOOKED_AT) * period_ms {
            let now = Micros::new(ms * 1000);
            let turn = TAU * f64::from(ms) / f64::from(period_ms);
            let seen = angle(MIDDLE_DEG + amplitude_deg * libm::cos(turn));
            let taken = joint.accept_measurement(&mut state, now, now, seen);
            taken.expect("measurements come in order");
            let orders = joint.tick(&mut state, now, None).expect("a fresh angle");
            let effort = match orders.effort {
                Effort::AboveThreshold(volts) => volts.to_num::<f64>() / range_v,
                Effort::Fraction(u) => u.to_num(),
            };
            if ms >= SETTLING * period_ms {
                efforts.push(effort);
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

    /// Returns the first harmonic of the torque divided by the error, N·m/rad, with its phase.
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
    /// Returns the predicted amplitude of the true angle in the finger's limit cycle, °; 0 if there
    /// is none. If there are several limit cycles, it is the largest stable one, above whose
    /// amplitude the loop's gain is below 1.
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
                let part = libm::log(gain) / libm::log(gain / below.max(1e-9));
                a * libm::pow(next / a, part)
            }
        };
        amplitude / plant.sensor(TAU / period * 1e3).norm()
    }

    /// Returns the ratio of the true angle's standard deviation to that of a white sensor noise of
    /// `noise_deg`, which is sampled every `frame_s` and held. The loop is linearised by the
    /// describing function for a sine with the same standard deviation. At frequencies below the
    /// tested ones the angle is assumed to follow the noise.
    pub(super) fn noise_gain(&self, plant: &Plant, noise_deg: f64, frame_s: f64) -> f64 {
        let wanted = noise_deg * std::f64::consts::SQRT_2;
        let off = |a: f64| libm::log(a / wanted).abs();
        let nearest = self
            .rows
            .iter()
            .min_by(|a, b| off(a.0).total_cmp(&off(b.0)));
        let Some((_, row)) = nearest else { return 0.0 };
        // Power density of held noise of variance 1 times the squared gain, by frequency, Hz.
        let density = |(period_ms, n): &(f64, Complex)| {
            let frequency = 1e3 / period_ms;
            let jw = Complex::new(0.0, TAU * frequency);
            let half = std::f64::consts::PI * frequency * frame_s;
            let held = if half > 0.0 {
                libm::sin(half) / half
            } else {
                1.0
            };
            let open = n * plant.frequency_response(TAU * frequency) * (-jw * frame_s / 2.0).exp();
            let closed = open / (Complex::new(1.0, 0.0) + open);
            let truly = closed / plant.sensor(TAU * frequency);
            (frequency, 2.0 * frame_s * held * held * truly.norm_sqr())
        };
        let mut points: Vec<(f64, f64)> = row.iter().map(density).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let slowest = points.first().map_or(0.0, |(frequency, _)| *frequency);
        let between = |pair: &[(f64, f64)]| (pair[1].0 - pair[0].0) * (pair[0].1 + pair[1].1) / 2.0;
        let variance = 2.0 * frame_s * slowest + points.windows(2).map(between).sum::<f64>();
        variance.sqrt()
    }
}

/// Returns the largest gain of the loop at a frequency where its phase passes −180°, and the period
/// of that frequency, ms. The gain is 0 if the phase never passes −180°.
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
    /// Effort with which the finger holds the angle.
    effort: f64,
    /// Stiffness of the joint, N·m/rad; it includes the flexor's loss of torque when it shortens.
    stiffness: f64,
    /// Time constant with which the force follows a change of recruitment, s.
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
            effort: libm::log1p(share * libm::expm1(curvature)) / curvature,
            stiffness: spec.stiffness_nm_per_rad
                + whole * spec.torque_loss / (high - low).to_radians(),
            lag_s: m.tau1_s + m.tau2_s * x,
            spec: spec.clone(),
        }
    }

    /// Returns the effort with which the finger holds the angle, as a fraction of the range.
    pub(super) fn effort(&self) -> f64 {
        self.effort
    }

    /// Returns the time constant with which the force follows a change of recruitment, s.
    pub(super) fn lag_s(&self) -> f64 {
        self.lag_s
    }

    /// Returns the steady torque at an effort, N·m. Efforts above 0 recruit the flexor, efforts
    /// below 0 the extensor.
    fn torque(&self, effort: f64) -> f64 {
        let s = &self.spec;
        let share = recruitment(effort.abs(), 0.0, 1.0, s.recruitment_curvature);
        if effort > 0.0 {
            s.flexor_torque_nm * (1.0 - s.torque_loss * self.progress) * share
        } else {
            -s.extensor_torque_nm * (1.0 - s.torque_loss * (1.0 - self.progress)) * share
        }
    }

    /// Returns the frequency response from the requested torque to the measured angle. It consists
    /// of the hold between pulses, the delay, the muscle, the joint and the sensor.
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
