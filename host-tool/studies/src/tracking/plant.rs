//! One plant of a campaign: a finger, and the link between it and the device.

use hal_sim::body::RandomFingerSpec;
use hal_sim::body::random_finger::Draws;

/// Number of frames that the host sends per second, each with a setpoint and a measured angle (the
/// rate of the glove in Hamana 2022 §II-B).
pub const FRAME_HZ: f64 = 90.0;

/// Delays and losses of the link that carries setpoints and measurements to the device.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Line {
    /// Largest delay of a measurement after the time that its frame states, µs.
    pub sampling_jitter_us: f64,
    /// Shortest time from host to device, µs.
    pub transport_us: f64,
    /// Largest random addition to that time, µs.
    pub transport_jitter_us: f64,
    /// Part of the setpoints that is lost, 0 to 1; no measurement is lost.
    pub loss: f64,
}

impl Line {
    /// A link without jitter and losses that needs 2 ms.
    pub const NOMINAL: Self = Self {
        sampling_jitter_us: 0.0,
        transport_us: 2000.0,
        transport_jitter_us: 0.0,
        loss: 0.0,
    };

    /// Generates a random link with uniform values: measurements up to 2 ms late, 1 to 4 ms of
    /// transport, up to 8 ms in addition, and up to 54 % of the setpoints lost, as on the worst
    /// link of our earlier study.
    fn random(draws: &mut Draws) -> Self {
        Self {
            sampling_jitter_us: draws.uniform(0.0, 2000.0),
            transport_us: draws.uniform(1000.0, 4000.0),
            transport_jitter_us: draws.uniform(0.0, 8000.0),
            loss: draws.uniform(0.0, 0.54),
        }
    }
}

/// A simulated wearer's finger with its link. The same values give a bit-identical trial.
#[derive(Clone, PartialEq, Debug)]
pub struct Plant {
    pub finger: RandomFingerSpec,
    /// The link between finger and device.
    pub line: Line,
    /// Seed of sensor noise, jitter and losses.
    pub seed: u64,
}

impl Plant {
    /// Returns the nominal wearer's finger with a perfect link.
    pub fn nominal(seed: u64) -> Self {
        Self {
            finger: RandomFingerSpec::nominal(),
            line: Line::NOMINAL,
            seed,
        }
    }

    /// Returns plant `index` of the campaign with this seed: a finger of
    /// [`RandomFingerSpec::random`] with a random link.
    pub fn random(seed: u64, index: u64) -> Self {
        Self {
            finger: RandomFingerSpec::random(seed, index),
            line: Line::random(&mut Draws::new(seed, index, 1)),
            seed: Draws::new(seed, index, 2).uniform(0.0, 4e15) as u64,
        }
    }
}
