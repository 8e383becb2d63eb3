//! What makes force of pulses: Lee's calcium-force model, alone or with a departure from it.
//!
//! A method that fits the model is tried on a body of the model's own structure first, which
//! proves the method; then on bodies of another structure, each departure with a size of its
//! own, which says how far its numbers can be believed. Sizes of 1 are of the order that is
//! known of people where anything is, and assumed otherwise: each [`Kind`] says.

use super::InvalidBench;
use crate::body::muscle::{Muscle, Parameters, Step};
use crate::random::{Noise, word};
use serde::{Deserialize, Serialize};

/// Step of the slow parts, s.
const TICK_S: f64 = 1e-3;
/// Frequency at which another activation gives the same mean force, Hz.
const MATCHED_HZ: f64 = 40.0;
/// Frequency at which it is half of all it can, Hz. Assumed.
const HALF_HZ: f64 = 30.0;

/// In what a generator departs from the calcium-force model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// Fibres shorten against tendon and straps, and a shorter fibre pulls less: A falls by
    /// 30 % · size at the force that the model could hold at most. Assumed.
    Length,
    /// A wanders by 10 % · size (standard deviation) over 5 s: 6 to 10 % a contraction are
    /// known of stimulated torque within a day.
    MuscleDrift,
    /// The sensor's offset wanders by 0.1 N/√s · size. Assumed.
    SensorDrift,
    /// A rises by up to 50 % · size as pulses come (2 % of the way a pulse) and falls back
    /// over 10 s. Assumed.
    Potentiation,
    /// A falls by up to 40 % · size with 0.2 s of activation, and comes back as fast, as in
    /// fast units. Assumed.
    Sag,
    /// Twitches of a critically damped second-order system, summed and saturated
    /// (q²/(1 + q²)), in the part `size` of the force. Assumed.
    Activation,
    /// Force is unsteady within a contraction: 10 % · size (standard deviation), correlated
    /// over 40 ms, as large at 1 as what table 4 leaves unexplained.
    Unsteadiness,
    /// Force comes 25 ms · size after its pulse. Lee's model has no such delay; the order is
    /// the electromechanical delay's.
    Latency,
}

impl Kind {
    /// All, in their order.
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

    /// For files and people.
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

/// A departure and how large it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Foreign {
    /// Which.
    pub kind: Kind,
    /// 0 (none) to 1.
    pub size: f64,
}

/// What a muscle is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Generator {
    /// The calcium-force model's constants, A in N/s.
    pub parameters: Parameters,
    /// A departure from it, or none.
    pub foreign: Option<Foreign>,
}

impl Generator {
    /// # Errors
    /// Names the field that no muscle can have.
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

    /// How much of this departure there is, 0 without.
    #[must_use]
    pub fn size(&self, kind: Kind) -> f64 {
        let own = self.foreign.filter(|foreign| foreign.kind == kind);
        own.map_or(0.0, |foreign| foreign.size)
    }
}

/// Twitches of another structure, summed.
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

    /// The mean of q is the frequency over [`HALF_HZ`].
    fn pulse(&mut self) {
        self.first += 1.0 / (self.tau_s * HALF_HZ);
    }

    /// Two lags in a row, exactly.
    fn pass(&mut self, s: f64) {
        let left = (-s / self.tau_s).exp();
        self.second = (self.second + self.first * s / self.tau_s) * left;
        self.first *= left;
    }

    fn force_n(&self) -> f64 {
        let square = self.second * self.second;
        self.force_n * square / (1.0 + square)
    }
}

/// A muscle on the bench, in motion. Time passes in pieces of at most a millisecond.
#[derive(Debug, Clone, PartialEq)]
pub struct Muscular {
    generator: Generator,
    muscle: Muscle,
    whole: Step,
    twitches: Option<Twitches>,
    noise: Noise,
    recruited: f64,
    /// Of the slow parts, whichever there is: 0 at rest.
    state: f64,
    ticks: u64,
}

impl Muscular {
    /// At rest; `seed` decides what wanders.
    ///
    /// # Errors
    /// Names the field that no muscle can have.
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

    /// A pulse that recruits this part of what A was measured with; may be above 1.
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

    /// Lets up to a millisecond pass, s.
    pub fn pass(&mut self, s: f64) {
        match s == TICK_S {
            true => self.muscle.step(&self.whole),
            false => self.muscle.step(&Step::new(&self.generator.parameters, s)),
        }
        if let Some(twitches) = &mut self.twitches {
            twitches.pass(s);
        }
    }

    /// A millisecond is over: what is slow moves on.
    pub fn tick(&mut self) {
        self.ticks += 1;
        let Some(foreign) = self.generator.foreign else {
            return;
        };
        let wander = |state: f64, tau_s: f64| {
            let left = (-TICK_S / tau_s).exp();
            left * state + (1.0 - left * left).sqrt() * self.noise.at(self.ticks)
        };
        self.state = match foreign.kind {
            Kind::MuscleDrift => wander(self.state, 5.0),
            Kind::Unsteadiness => wander(self.state, 0.04),
            Kind::Potentiation => self.state * (-TICK_S / 10.0).exp(),
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

    /// What a departure makes of A.
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

    /// The most that the model could hold, N.
    fn max_force_n(&self) -> f64 {
        let p = self.generator.parameters;
        p.a_n_per_s * (p.tau1_s + p.tau2_s)
    }

    /// Force, N.
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
