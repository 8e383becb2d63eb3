//! One plant of a campaign: a finger, and the link between it and the device.

use hal_sim::body::RandomFingerSpec;
use hal_sim::body::random_finger::Draws;

/// Frames of the host's glove per second (Hamana 2022 §II-B).
pub const FRAME_HZ: f64 = 90.0;

/// Properties of the link that carries setpoints and measurements.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Line {
    /// Largest delay of the glove's sampling after the stated time, µs.
    pub sampling_jitter_us: f64,
    /// Shortest transport time to the device, µs.
    pub transport_us: f64,
    /// Largest additional transport time, µs.
    pub transport_jitter_us: f64,
    /// Part of the setpoints that is lost; no measurement is lost.
    pub loss: f64,
}

impl Line {
    /// On time, without loss, 2 ms of transport.
    pub const NOMINAL: Self = Self {
        sampling_jitter_us: 0.0,
        transport_us: 2000.0,
        transport_jitter_us: 0.0,
        loss: 0.0,
    };

    /// Generates a random link, uniform: samples up to 2 ms late, 1 to 4 ms of transport, up to 8
    /// ms more, up to 54 % of the setpoints lost (the worst link of our earlier study).
    fn random(draws: &mut Draws) -> Self {
        Self {
            sampling_jitter_us: draws.uniform(0.0, 2000.0),
            transport_us: draws.uniform(1000.0, 4000.0),
            transport_jitter_us: draws.uniform(0.0, 8000.0),
            loss: draws.uniform(0.0, 0.54),
        }
    }
}

/// A wearer and a link. The same values give a bit-identical trial.
#[derive(Clone, PartialEq, Debug)]
pub struct Plant {
    /// The simulated finger.
    pub finger: RandomFingerSpec,
    /// The link between finger and device.
    pub line: Line,
    /// Seed of noise, jitter and losses.
    pub seed: u64,
}

impl Plant {
    /// Returns the wearer of the nominal file with a perfect link.
    pub fn nominal(seed: u64) -> Self {
        Self {
            finger: RandomFingerSpec::nominal(),
            line: Line::NOMINAL,
            seed,
        }
    }

    /// Returns plant `index` of campaign `seed`; see [`RandomFingerSpec::random`].
    pub fn random(seed: u64, index: u64) -> Self {
        Self {
            finger: RandomFingerSpec::random(seed, index),
            line: Line::random(&mut Draws::new(seed, index, 1)),
            seed: Draws::new(seed, index, 2).uniform(0.0, 4e15) as u64,
        }
    }
}
