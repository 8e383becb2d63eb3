//! One plant of a campaign: a finger, and the line between it and the device.

use hal_sim::body::RandomFingerSpec;
use hal_sim::body::random_finger::Draws;

/// Frames of the host's glove per second (Hamana 2022 §II-B).
pub const FRAME_HZ: f64 = 90.0;

/// What happens to the frames that carry setpoint and measurement.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Line {
    /// How late at most the glove samples after the time it states, µs.
    pub sampling_jitter_us: f64,
    /// Shortest way to the device, µs.
    pub transport_us: f64,
    /// How much longer it takes at most, µs.
    pub transport_jitter_us: f64,
    /// Part of the setpoints that never arrive; measurements all do.
    pub loss: f64,
}

impl Line {
    /// On time, complete, 2 ms long.
    pub const NOMINAL: Self = Self {
        sampling_jitter_us: 0.0,
        transport_us: 2000.0,
        transport_jitter_us: 0.0,
        loss: 0.0,
    };

    /// Evenly: samples up to 2 ms late, 1 to 4 ms on the way, up to 8 ms more,
    /// up to 54 % of the setpoints lost (the worst line of our earlier study).
    fn random(draws: &mut Draws) -> Self {
        Self {
            sampling_jitter_us: draws.uniform(0.0, 2000.0),
            transport_us: draws.uniform(1000.0, 4000.0),
            transport_jitter_us: draws.uniform(0.0, 8000.0),
            loss: draws.uniform(0.0, 0.54),
        }
    }
}

/// A wearer and a line. The same numbers give the same trial to the bit.
#[derive(Clone, PartialEq, Debug)]
pub struct Plant {
    /// The finger.
    pub finger: RandomFingerSpec,
    /// The line.
    pub line: Line,
    /// Decides noise, jitter and which setpoints are lost.
    pub seed: u64,
}

impl Plant {
    /// The wearer of the nominal file, on a sound line.
    pub fn nominal(seed: u64) -> Self {
        Self {
            finger: RandomFingerSpec::nominal(),
            line: Line::NOMINAL,
            seed,
        }
    }

    /// Plant `index` of campaign `seed`; see [`RandomFingerSpec::drawn`].
    pub fn random(seed: u64, index: u64) -> Self {
        Self {
            finger: RandomFingerSpec::random(seed, index),
            line: Line::random(&mut Draws::new(seed, index, 1)),
            seed: Draws::new(seed, index, 2).uniform(0.0, 4e15) as u64,
        }
    }
}
