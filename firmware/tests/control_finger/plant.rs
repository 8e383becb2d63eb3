//! Model of a finger in f64 for closing the loop: muscle delay, calcium–force dynamics, joint and
//! glove. Its torques were calibrated to table 8 of Hamana 2022, so agreement with that table is no
//! evidence. The torque of two points, 0.484 N·m, is assumed, not measured.

use std::collections::VecDeque;
use std::f64::consts::TAU;

pub const STEP_S: f64 = 0.0005;
/// Pulse rate (Hamana 2022 §II-D).
const PULSE_HZ: f64 = 50.0;

/// Parameters of one wearer's finger, in SI units unless the name says otherwise.
#[derive(Clone, Copy, Debug)]
pub struct Finger {
    pub inertia: f64,
    pub stiffness: f64,
    pub damping: f64,
    pub rest_deg: f64,
    pub flexor_nm: f64,
    pub extensor_nm: f64,
    /// Torque of both points of a conducted pair; assumed.
    pub two_points_nm: f64,
    /// Constant c of the recruitment (e^(c·x) − 1)/(e^c − 1) between threshold and maximum.
    pub curvature: f64,
    pub delay_s: f64,
    /// Factor on both contraction time constants.
    pub slowness: f64,
    pub sensor_lag_s: f64,
    pub noise_deg: f64,
}

impl Finger {
    pub const NOMINAL: Self = Self {
        inertia: 4e-5,
        stiffness: 0.12,
        damping: 0.018,
        rest_deg: 5.0,
        flexor_nm: 0.22,
        extensor_nm: 0.15,
        two_points_nm: 0.484,
        curvature: 1.2,
        delay_s: 0.025,
        slowness: 1.0,
        sensor_lag_s: 0.010,
        noise_deg: 0.3,
    };

    /// Generates a random wearer with uniform distributions: gains, stiffness, damping and slowness
    /// ±30 %, delay 20…35 ms, curvature 0.2…2.2. Two points pull 0.34…0.63 N·m, in proportion to
    /// one point.
    pub fn generate(random: &mut Random) -> Self {
        let mut around = |x: f64| x * (0.7 + 0.6 * random.uniform());
        let n = Self::NOMINAL;
        let mut f = Self {
            stiffness: around(n.stiffness),
            damping: around(n.damping),
            flexor_nm: around(n.flexor_nm),
            extensor_nm: around(n.extensor_nm),
            slowness: around(n.slowness),
            ..n
        };
        f.two_points_nm *= f.flexor_nm / n.flexor_nm;
        f.delay_s = 0.020 + 0.015 * random.uniform();
        f.curvature = 0.2 + 2.0 * random.uniform();
        f
    }

    fn recruitment(&self, amplitude: f64) -> f64 {
        (self.curvature * amplitude.clamp(0.0, 1.0)).exp_m1() / self.curvature.exp_m1()
    }

    const fn max_torque_nm(&self, two_point: bool) -> f64 {
        match two_point {
            true => self.two_points_nm,
            false => self.flexor_nm,
        }
    }

    /// Returns the largest angle that the flexor can hold, in degrees: k(θ − rest) = T(θ).
    pub fn reach_deg(&self, two_point: bool) -> f64 {
        let full = self.max_torque_nm(two_point);
        let k = self.stiffness.to_radians();
        ((full + k * self.rest_deg) / (k + full * 0.0025)).min(100.0)
    }
}

/// Calcium–force dynamics with the means of Lee 2020 table 4 and K06's τ2 = 176 ms, scaled so that
/// steady stimulation at 50 Hz and full recruitment gives 1.
struct Muscle {
    calcium: f64,
    force: f64,
    recruited: f64,
    slowness: f64,
}

impl Muscle {
    const K: f64 = 0.1833;
    const TAU_C: f64 = 0.02119;
    const TAU_1: f64 = 0.0286;
    const TAU_2: f64 = 0.13054;

    fn new(slowness: f64) -> Self {
        Self {
            calcium: 0.0,
            force: 0.0,
            recruited: 0.0,
            slowness,
        }
    }

    fn pulse(&mut self, recruited: f64) {
        self.recruited = recruited;
        self.calcium += 1.0;
    }

    fn step(&mut self) {
        self.calcium *= (-STEP_S / Self::TAU_C).exp();
        let x = self.calcium / (Self::K + self.calcium);
        let tau = (Self::TAU_1 + Self::TAU_2 * x) * self.slowness;
        // 0.8309 is the mean of x over a period at 50 Hz. The steady force is near x·(τ1 + τ2·x),
        // with both factors taken at that mean.
        let mean = 0.8309;
        let full = mean * (Self::TAU_1 + Self::TAU_2 * mean) * self.slowness;
        self.force += STEP_S * (x * self.recruited / full - self.force / tau);
    }
}

/// State of a moving finger.
pub struct Body {
    finger: Finger,
    flexor: Muscle,
    extensor: Muscle,
    torque: VecDeque<f64>,
    angle: f64,
    velocity: f64,
    seen: f64,
    to_pulse: f64,
    random: Random,
}

impl Body {
    pub fn new(finger: Finger, seed: u64) -> Self {
        Self {
            finger,
            flexor: Muscle::new(finger.slowness),
            extensor: Muscle::new(finger.slowness),
            torque: vec![0.0; (finger.delay_s / STEP_S) as usize].into(),
            angle: finger.rest_deg.to_radians(),
            velocity: 0.0,
            seen: finger.rest_deg,
            to_pulse: 0.0,
            random: Random(seed),
        }
    }

    pub fn angle_deg(&self) -> f64 {
        self.angle.to_degrees()
    }

    /// Returns the glove's reading: delayed, noisy, and rounded to tenths of a degree.
    pub fn glove_deg(&mut self) -> f64 {
        ((self.seen + self.finger.noise_deg * self.random.normal()) * 10.0).round() / 10.0
    }

    /// Advances by [`STEP_S`]. The next pulse uses these amplitudes, from 0 at threshold to 1 at
    /// maximum.
    pub fn step(&mut self, flexor: f64, extensor: f64, two_point: bool) {
        self.to_pulse -= STEP_S;
        if self.to_pulse <= 0.0 {
            self.to_pulse += 1.0 / PULSE_HZ;
            self.flexor.pulse(self.finger.recruitment(flexor));
            self.extensor.pulse(self.finger.recruitment(extensor));
        }
        self.flexor.step();
        self.extensor.step();
        let f = &self.finger;
        // Each muscle loses 25 % of its force as it shortens over the range of motion.
        let bent = 0.25 * self.angle.to_degrees() / 100.0;
        let active = f.max_torque_nm(two_point) * (1.0 - bent) * self.flexor.force
            - f.extensor_nm * (0.75 + bent) * self.extensor.force;
        self.torque.push_back(active);
        let active = self.torque.pop_front().unwrap_or(0.0);
        let spring = f.stiffness * (self.angle - f.rest_deg.to_radians());
        // The damping is integrated implicitly because it is stiff: I/B = 2 ms.
        self.velocity = (self.velocity + STEP_S / f.inertia * (active - spring))
            / (1.0 + STEP_S * f.damping / f.inertia);
        self.angle += STEP_S * self.velocity;
        let stop = 100_f64.to_radians();
        if self.angle < 0.0 || self.angle > stop {
            self.angle = self.angle.clamp(0.0, stop);
            self.velocity = 0.0;
        }
        self.seen += STEP_S / f.sensor_lag_s * (self.angle_deg() - self.seen);
    }
}

/// SplitMix64 generator.
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Returns a uniformly distributed number in 0…1.
    pub fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}
