//! Test rig of Lee 2020 for a wrist (figures 4 and 5): one pair of electrodes over four extensor
//! muscles, the hand fixed to a torque sensor.

use super::InvalidBench;
use super::generator::{Generator, Kind, Muscular};
use super::recruitment::{Pool, StrengthDuration};
use super::sensor::{SAMPLE_US, Sensor, SensorSpec};
use crate::body::muscle::SUBJECTS;
use crate::body::{Body, CHANNELS, Load, Pulse};
use crate::random::word;
use std::collections::VecDeque;

/// Values of Lee 2020, table 2, for K01 to K10: the motor threshold I_MT in mA, and the forces
/// F(I_MT) and F(1.5·I_MT) in N at 20, 30 and 40 Hz.
pub const PRINTED: [(f64, [[f64; 2]; 3]); 10] = [
    (8.0, [[1.47, 8.95], [1.68, 12.8], [2.16, 15.6]]),
    (12.0, [[1.69, 5.31], [2.10, 6.61], [2.48, 7.66]]),
    (10.0, [[8.57, 23.7], [10.8, 26.7], [11.0, 28.0]]),
    (9.0, [[3.77, 16.9], [5.21, 21.7], [5.82, 25.3]]),
    (10.0, [[4.45, 13.6], [4.77, 15.3], [5.13, 15.6]]),
    (8.0, [[2.80, 14.9], [4.13, 18.3], [4.69, 19.9]]),
    (10.0, [[2.45, 7.67], [2.80, 11.6], [2.94, 11.7]]),
    (8.0, [[3.69, 13.5], [5.81, 16.1], [6.93, 17.0]]),
    (7.0, [[4.03, 8.69], [5.79, 11.8], [5.42, 12.8]]),
    (7.0, [[2.45, 5.61], [3.43, 6.92], [3.88, 8.24]]),
];

/// Smallest threshold of a fibre, divided by the printed I_MT. Assumed: see [`WristSpec::subject`].
const LOWEST: f64 = 0.8;
/// Standard deviation of the fibre thresholds, divided by the printed I_MT. Assumed: see
/// [`WristSpec::subject`].
const SPREAD: f64 = 0.25;

/// Parameters of a wrist in the test rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WristSpec {
    /// Channel whose electrodes are over the extensors, 0 to 9.
    pub channel: usize,
    /// Distribution of the fibres' thresholds, mA at the reference width.
    pub pool: Pool,
    /// Strength-duration relation of the fibres.
    pub strength: StrengthDuration,
    /// Strength at which the generator's A holds, mA at the reference width; above the smallest
    /// threshold of the pool.
    pub reference_ma: f64,
    /// Model that turns pulses into force.
    pub generator: Generator,
    /// Torque sensor and its lever.
    pub sensor: SensorSpec,
    /// Resistance of the electrodes, Ω; above 0.
    pub load_ohm: f64,
}

impl WristSpec {
    /// Returns subject `index` (0 to 9; K01 to K10) of Lee 2020. The dynamics are those of table 4,
    /// whose A was fitted at I_5 = 1.5·I_MT. The pool is chosen so that the ratio of F(I_MT) to
    /// F(1.5·I_MT) is the one of table 2 (geometric mean over the pulse rates).
    ///
    /// At the printed I_MT, force is 1.5 to 11 N: a hundred times the 0.015 N that Lee's search in
    /// steps of 0.5 mA took as the threshold. No pool whose force rises from zero gives both. Here
    /// the forces are as printed, and the smallest threshold is 0.8·I_MT (assumed, with a spread of
    /// 0.25·I_MT), so that a search by force finds a lower threshold than the printed one. A
    /// chronaxie of 200 µs is assumed; the paper uses a single width.
    ///
    /// # Errors
    /// Fails if there is no such subject.
    pub fn subject(index: usize) -> Result<Self, InvalidBench> {
        let (Some((i_mt, forces)), Some(parameters)) = (PRINTED.get(index), SUBJECTS.get(index))
        else {
            return Err(InvalidBench("index"));
        };
        let ratio: f64 = forces.iter().map(|[weak, strong]| weak / strong).product();
        let shape = (LOWEST * i_mt, SPREAD * i_mt);
        let range = (*i_mt, 1.5 * i_mt);
        Ok(Self {
            channel: 0,
            pool: Pool::from_ratio(shape, range, libm::cbrt(ratio))?,
            strength: StrengthDuration {
                chronaxie_us: 200.0,
                reference_us: 400.0,
            },
            reference_ma: range.1,
            generator: Generator {
                parameters: *parameters,
                foreign: None,
            },
            sensor: SensorSpec::default(),
            load_ohm: 1_000.0,
        })
    }

    /// Checks every field.
    ///
    /// # Errors
    /// Returns the name of the first field whose value is out of range.
    pub fn validate(&self) -> Result<(), InvalidBench> {
        self.sensor.validate()?;
        self.generator.validate()?;
        let positive = |v: f64| v.is_finite() && v > 0.0;
        let rules = [
            ("channel", self.channel < CHANNELS),
            ("chronaxie_us", positive(self.strength.chronaxie_us)),
            ("reference_us", positive(self.strength.reference_us)),
            ("reference_ma", self.pool.share(self.reference_ma) > 0.0),
            ("load_ohm", positive(self.load_ohm)),
        ];
        match rules.into_iter().find(|(_, holds)| !holds) {
            Some((field, _)) => Err(InvalidBench(field)),
            None => Ok(()),
        }
    }

    /// Returns the recruitment by a pulse, relative to the recruitment at which A was measured.
    #[must_use]
    pub fn recruited(&self, current_ma: f64, width_us: f64) -> f64 {
        let strength = self.strength.equivalent_ma(current_ma, width_us);
        self.pool.share(strength) / self.pool.share(self.reference_ma)
    }
}

/// A wrist in the test rig, over time. The simulation is deterministic: pulses and seed determine
/// every value.
#[derive(Debug, Clone, PartialEq)]
pub struct Wrist {
    spec: WristSpec,
    muscle: Muscular,
    sensor: Sensor,
    loads: [Load; CHANNELS],
    /// Pending pulses: time at which each takes effect, µs, and its relative recruitment.
    under_way: VecDeque<(u64, f64)>,
    /// Number of samples that the sensor has taken, one per millisecond.
    tick: u64,
}

impl Wrist {
    /// Creates a wrist at rest. `seed` determines noise and drift.
    ///
    /// # Errors
    /// Returns the name of the first field of `spec` whose value is out of range.
    pub fn new(spec: WristSpec, seed: u64) -> Result<Self, InvalidBench> {
        spec.validate()?;
        let wander = 0.1 * spec.generator.size(Kind::SensorDrift);
        let sensor = SensorSpec {
            wander_n_per_sqrt_s: spec.sensor.wander_n_per_sqrt_s + wander,
            ..spec.sensor
        };
        Ok(Self {
            muscle: Muscular::new(spec.generator, seed)?,
            sensor: Sensor::new(sensor, word(seed, 1))?,
            loads: [Load::Ohms(spec.load_ohm); CHANNELS],
            under_way: VecDeque::with_capacity(16),
            tick: 0,
            spec,
        })
    }

    /// Returns the specification from which the wrist was created.
    #[must_use]
    pub const fn spec(&self) -> &WristSpec {
        &self.spec
    }

    /// Returns the true force of the muscles now, N.
    #[must_use]
    pub fn force_n(&self) -> f64 {
        self.muscle.force_n()
    }

    /// Returns the number of samples that the sensor has taken, one at the end of each millisecond.
    #[must_use]
    pub const fn samples(&self) -> u64 {
        self.tick
    }

    fn latency_us(&self) -> u64 {
        (25_000.0 * self.spec.generator.size(Kind::Latency)).round() as u64
    }

    /// Simulates the next millisecond, split at every pulse in it.
    fn step(&mut self) {
        let (from_us, to_us) = (self.tick * SAMPLE_US, (self.tick + 1) * SAMPLE_US);
        let mut now_us = from_us;
        while let Some((due_us, recruited)) = self.under_way.front().copied() {
            if due_us >= to_us {
                break;
            }
            self.under_way.pop_front();
            self.pass(due_us.saturating_sub(now_us));
            now_us = now_us.max(due_us);
            self.muscle.pulse(recruited);
        }
        self.pass(to_us - now_us);
        self.muscle.tick();
        self.sensor.sample(self.muscle.force_n());
        self.tick += 1;
    }

    fn pass(&mut self, us: u64) {
        match us {
            0 => (),
            SAMPLE_US => self.muscle.pass(1e-3),
            _ => self.muscle.pass(us as f64 * 1e-6),
        }
    }
}

impl Body for Wrist {
    fn pulse(&mut self, pulse: &Pulse) {
        if pulse.channel != self.spec.channel {
            return;
        }
        let Some(load) = self.loads.get(pulse.channel) else {
            return;
        };
        let recruited = (self.spec).recruited(load.current_ma(pulse.drive), pulse.width_us.into());
        // Below every threshold no fibre is excited, and earlier activation relaxes undisturbed.
        if recruited > 0.0 {
            let due_us = pulse.t_us + self.latency_us();
            self.under_way.push_back((due_us, recruited));
        }
    }

    fn advance(&mut self, to_us: u64) -> bool {
        let before = self.tick;
        while (self.tick + 1) * SAMPLE_US <= to_us {
            self.step();
        }
        self.tick != before
    }

    /// Returns 0, because the hand is fixed.
    fn angle_deg(&self) -> f64 {
        0.0
    }

    fn sensed_deg(&self) -> f64 {
        0.0
    }

    fn instrument_n(&self) -> Option<f64> {
        Some(self.sensor.reading_n())
    }

    fn loads(&self) -> &[Load; CHANNELS] {
        &self.loads
    }

    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.loads
    }
}
