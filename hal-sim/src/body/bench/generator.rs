//! Generators of force from pulses: Lee's calcium-force model, alone or with a deviation from it.
//!
//! A method that fits the model is first tested on a simulated limb of the same structure, which
//! proves the method. Tests on limbs of another structure, each with one deviation of known size,
//! then show how far its numbers can be trusted. A size of 1 is of the order known of people where
//! anything is known, and assumed otherwise: each [`Kind`] says which.

use super::InvalidBench;
use crate::body::muscle::{Muscle, Parameters, Step};
use crate::random::{Noise, word};
use serde::{Deserialize, Serialize};

/// Time step of the slow deviations, such as drift and potentiation, s.
const TICK_S: f64 = 1e-3;
/// Pulse rate at which the alternative activation model ([`Kind::Activation`]) has the same mean
/// force as Lee's model, Hz.
const MATCHED_HZ: f64 = 40.0;
/// Pulse rate at which the alternative activation model reaches half of its largest force, Hz.
/// Assumed.
const HALF_HZ: f64 = 30.0;

/// Kind of deviation from the calcium-force model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// Fibres shorten against tendon and straps, and shorter fibres pull less: A falls by 30 % ·
    /// size at the largest force that the model can hold. Assumed.
    Length,
    /// A wanders randomly with a standard deviation of 10 % · size and a time constant of 5 s.
    /// Within a day, stimulated torque is known to vary by 6 to 10 % between contractions.
    MuscleDrift,
    /// The offset of the sensor wanders by 0.1 N/√s · size. Assumed.
    SensorDrift,
    /// A rises by up to 50 % · size with the pulses (each covers 2 % of the remaining rise) and
    /// falls back over 10 s. Assumed.
    Potentiation,
    /// A falls by up to 40 % · size within 0.2 s of activation and recovers as fast, as in fast
    /// motor units. Assumed.
    Sag,
    /// The share `size` of the force comes from twitches of a critically damped second-order
    /// system, summed and saturated (q²/(1 + q²)). Assumed.
    Activation,
    /// Force fluctuates within a contraction with a standard deviation of 10 % · size, correlated
    /// over 40 ms. A size of 1 is as large as the variation that table 4 of Lee 2020 leaves
    /// unexplained.
    Unsteadiness,
    /// Force follows its pulse after 25 ms · size. Lee's model has no such delay; the order of
    /// magnitude is that of the electromechanical delay.
    Latency,
}

impl Kind {
    /// Every kind, in the order of the enum.
    pub const ALL: [Self; 8] = [
        Self::Length,
        Self::MuscleDrift,
        Self::SensorDrift,
        Self::Potentiation,
        Self::Sag,
        Self::Activation,
        Self::Unsteadiness,
        Self::Latency,
    ];

    /// Returns the name that files and messages use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Length => "length",
            Self::MuscleDrift => "muscle-drift",
            Self::SensorDrift => "sensor-drift",
            Self::Potentiation => "potentiation",
            Self::Sag => "sag",
            Self::Activation => "activation",
            Self::Unsteadiness => "unsteadiness",
            Self::Latency => "latency",
        }
    }
}

/// A deviation from the model, and its size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Foreign {
    /// Property of the muscle or the sensor that deviates.
    pub kind: Kind,
    /// Size, 0 (none) to 1.
    pub size: f64,
}

/// Parameters of a muscle's force generation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Generator {
    /// Constants of the calcium-force model, A in N/s.
    pub parameters: Parameters,
    /// Deviation from the model; `None` for the model itself.
    pub foreign: Option<Foreign>,
}

impl Generator {
    /// Checks the parameters and the size of the deviation.
    ///
    /// # Errors
    /// Returns the name of the first field whose value is out of range.
    pub fn validate(&self) -> Result<(), InvalidBench> {
        let positive = |v: &f64| v.is_finite() && *v > 0.0;
        if !self.parameters.all().iter().all(positive) {
            return Err(InvalidBench("parameters"));
        }
        match self.foreign {
            Some(foreign) if !(0.0..=1.0).contains(&foreign.size) => {
                Err(InvalidBench("foreign.size"))
            }
            _ => Ok(()),
        }
    }

    /// Returns the size of this kind of deviation, 0 if the generator has none of this kind.
    #[must_use]
    pub fn size(&self, kind: Kind) -> f64 {
        let own = self.foreign.filter(|foreign| foreign.kind == kind);
        own.map_or(0.0, |foreign| foreign.size)
    }
}

/// Sum of the twitches of the alternative activation model, [`Kind::Activation`].
#[derive(Debug, Clone, Copy, PartialEq)]
struct Twitches {
    tau_s: f64,
    force_n: f64,
    first: f64,
    second: f64,
}

impl Twitches {
    fn new(parameters: Parameters) -> Self {
        let mean_n = parameters.a_n_per_s / parameters.normalised_at(MATCHED_HZ).a_n_per_s;
        let q = MATCHED_HZ / HALF_HZ;
        Self {
            tau_s: 0.5 * (parameters.tau1_s + parameters.tau2_s),
            force_n: mean_n * (1.0 + q * q) / (q * q),
            first: 0.0,
            second: 0.0,
        }
    }

    /// Adds the twitch of one pulse. In a regular train, the mean of the sum q becomes the pulse
    /// rate divided by [`HALF_HZ`].
    fn pulse(&mut self) {
        self.first += 1.0 / (self.tau_s * HALF_HZ);
    }

    /// Advances by `s` seconds with the exact solution of two first-order lags in series.
    fn pass(&mut self, s: f64) {
        let left = libm::exp(-s / self.tau_s);
        self.second = (self.second + self.first * s / self.tau_s) * left;
        self.first *= left;
    }

    fn force_n(&self) -> f64 {
        let square = self.second * self.second;
        self.force_n * square / (1.0 + square)
    }
}

/// A muscle in the test rig, over time. It advances by at most a millisecond at once.
#[derive(Debug, Clone, PartialEq)]
pub struct Muscular {
    generator: Generator,
    muscle: Muscle,
    whole: Step,
    twitches: Option<Twitches>,
    noise: Noise,
    recruited: f64,
    /// Present state of the slow deviation, for example the present potentiation; 0 at rest. Unused
    /// if the generator has no slow deviation.
    state: f64,
    ticks: u64,
}

impl Muscular {
    /// Creates a muscle at rest. `seed` determines its random wander.
    ///
    /// # Errors
    /// Returns the name of the first field of `generator` whose value is out of range.
    pub fn new(generator: Generator, seed: u64) -> Result<Self, InvalidBench> {
        generator.validate()?;
        let parameters = generator.parameters;
        let twitches = generator.size(Kind::Activation) > 0.0;
        Ok(Self {
            generator,
            muscle: Muscle::new(parameters),
            whole: Step::new(&parameters, TICK_S),
            twitches: twitches.then(|| Twitches::new(parameters)),
            noise: Noise::new(word(seed, 0x5a61)),
            recruited: 0.0,
            state: 0.0,
            ticks: 0,
        })
    }

    /// Applies a pulse that recruits this share, relative to the recruitment at which A was
    /// measured; may be above 1.
    pub fn pulse(&mut self, recruited: f64) {
        self.recruited = recruited;
        if let Some(twitches) = &mut self.twitches {
            twitches.pulse();
        }
        if let Some(Foreign {
            kind: Kind::Potentiation,
            ..
        }) = self.generator.foreign
        {
            self.state += 0.02 * (1.0 - self.state);
        }
        let gain = self.gain();
        self.muscle.pulse(recruited * gain);
    }

    /// Advances by `s` seconds, at most a millisecond.
    pub fn pass(&mut self, s: f64) {
        match s == TICK_S {
            true => self.muscle.step(&self.whole),
            false => self.muscle.step(&Step::new(&self.generator.parameters, s)),
        }
        if let Some(twitches) = &mut self.twitches {
            twitches.pass(s);
        }
    }

    /// Ends a millisecond and updates the slow deviation.
    pub fn tick(&mut self) {
        self.ticks += 1;
        let Some(foreign) = self.generator.foreign else {
            return;
        };
        let wander = |state: f64, tau_s: f64| {
            let left = libm::exp(-TICK_S / tau_s);
            left * state + (1.0 - left * left).sqrt() * self.noise.at(self.ticks)
        };
        self.state = match foreign.kind {
            Kind::MuscleDrift => wander(self.state, 5.0),
            Kind::Unsteadiness => wander(self.state, 0.04),
            Kind::Potentiation => self.state * libm::exp(-TICK_S / 10.0),
            Kind::Sag => {
                let c = self.muscle.c();
                let bound = c / (c + self.generator.parameters.k);
                self.state + (bound - self.state) * TICK_S / 0.2
            }
            Kind::Length => self.force_n() / self.max_force_n(),
            _ => return,
        };
        let gain = self.gain();
        self.muscle.rescale(self.recruited * gain);
    }

    /// Returns the factor by which the deviation changes A.
    fn gain(&self) -> f64 {
        let Some(Foreign { kind, size }) = self.generator.foreign else {
            return 1.0;
        };
        let gain = match kind {
            Kind::Length => 1.0 - 0.3 * size * self.state,
            Kind::MuscleDrift => 1.0 + 0.1 * size * self.state,
            Kind::Potentiation => 1.0 + 0.5 * size * self.state,
            Kind::Sag => 1.0 - 0.4 * size * self.state,
            _ => 1.0,
        };
        gain.max(0.0)
    }

    /// Returns the largest force that the model can hold, N: its steady state at complete binding,
    /// C/(C + K) = 1.
    fn max_force_n(&self) -> f64 {
        let p = self.generator.parameters;
        p.a_n_per_s * (p.tau1_s + p.tau2_s)
    }

    /// Returns the present force with all deviations, N.
    #[must_use]
    pub fn force_n(&self) -> f64 {
        let own = self.muscle.force();
        let force = match &self.twitches {
            None => own,
            Some(twitches) => {
                let size = self.generator.size(Kind::Activation);
                (1.0 - size) * own + size * self.recruited * twitches.force_n()
            }
        };
        let unsteady = self.generator.size(Kind::Unsteadiness);
        force * (1.0 + 0.1 * unsteady * self.state * f64::from(unsteady > 0.0))
    }
}
