//! A forearm under an array of ten electrodes, held in a frame that measures the force of each of
//! its movements. Searches for thresholds, limits and stimulation points are tested on it.
//!
//! Everything is assumed and randomly generated from a seed: the muscles that each point reaches,
//! their strengths, and the largest pulse that the wearer tolerates. Recruitment is that of the
//! test rigs: fibres with distributed thresholds and a smallest one, so that force rises gradually
//! from zero.

use super::bench::{InvalidBench, Pool, Sensor, SensorSpec, StrengthDuration};
use super::muscle::{Muscle, Parameters, SUBJECTS, Step};
use super::{Body, CHANNELS, Load, Pulse};
use crate::random::{Random, word};

/// Movements that the frame measures, each with its own load cell.
pub const MOVEMENTS: [&str; 6] = [
    "wrist extension",
    "wrist flexion",
    "index extension",
    "middle finger flexion",
    "thumb abduction",
    "ulnar deviation",
];

/// Time step of muscles and instrument, µs.
const STEP_US: u64 = 1_000;

/// Strength-duration relation of all fibres. Currents refer to 400 µs, the pulse width of Lee 2020.
/// The chronaxie is assumed.
const STRENGTH: StrengthDuration = StrengthDuration {
    chronaxie_us: 200.0,
    reference_us: 400.0,
};

/// Most frequent threshold of a muscle's fibres, divided by the smallest one. Assumed.
const MIDDLE: f64 = 1.5;
/// Standard deviation of a muscle's fibre thresholds, divided by the smallest one. Assumed.
const SPREAD: f64 = 0.25;

/// Random stream from which the tissue under the electrodes is generated.
const DRAWN: u64 = 0x0a44;

/// Time for which a painful pulse is felt, µs.
const FELT_US: u64 = 100_000;

/// Smallest force of a movement that an observer sees, N. Assumed.
const VISIBLE_N: f64 = 0.5;

/// A muscle that an electrode can stimulate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Index in [`MOVEMENTS`] of the movement that the muscle causes.
    pub movement: usize,
    /// Thresholds of the muscle's fibres, mA at 400 µs.
    pub pool: Pool,
    /// Force when all fibres are stimulated by a long train at 30 Hz, N.
    pub full_n: f64,
}

/// The tissue under one electrode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// The muscle below the electrode, and its neighbour.
    pub reaches: [Reach; 2],
    /// The strongest pulse that the wearer tolerates, mA at 400 µs.
    pub bears_ma: f64,
}

/// The forearm in its frame. The simulation is deterministic: pulses and seed determine every
/// value.
#[derive(Debug, Clone)]
pub struct Array {
    points: [Point; CHANNELS],
    loads: [Load; CHANNELS],
    /// The two muscles of each point.
    muscles: [[Muscle; 2]; CHANNELS],
    steps: [Step; CHANNELS],
    /// Time of the last pulse that was stronger than the wearer tolerates, µs.
    hurt_us: Option<u64>,
    /// Sensor of the summed force of the load cells.
    sensor: Sensor,
    tick: u64,
}

impl Array {
    /// Creates a rested forearm, randomly generated from `seed`, with this sensor. The first fibres
    /// of the nearest muscle respond at 6 to 11 mA (motor thresholds of Lee 2020: 7 to 12 mA),
    /// those of its neighbour at 1.3 to 1.7 times as much. The wearer tolerates 1.5 to 2.2 times
    /// the smallest threshold.
    ///
    /// # Errors
    /// Returns the name of the first field of `sensor` whose value is invalid.
    pub fn new(seed: u64, sensor: SensorSpec) -> Result<Self, InvalidBench> {
        let mut random = Random::new(word(seed, DRAWN));
        let mut points = Vec::new();
        for _ in 0..CHANNELS {
            points.push(random_point(&mut random)?);
        }
        let points = points.try_into().map_err(|_| InvalidBench("points"))?;
        let dynamics: [Parameters; CHANNELS] =
            SUBJECTS.map(|parameters| parameters.normalised_at(30.0));
        Ok(Self {
            points,
            loads: [Load::NOMINAL; CHANNELS],
            muscles: dynamics.map(|parameters| [Muscle::new(parameters); 2]),
            steps: dynamics.map(|parameters| Step::new(&parameters, STEP_US as f64 * 1e-6)),
            hurt_us: None,
            sensor: Sensor::new(sensor, seed)?,
            tick: 0,
        })
    }

    /// Returns the true tissue under each electrode.
    #[must_use]
    pub const fn points(&self) -> &[Point; CHANNELS] {
        &self.points
    }

    /// Returns the force of each of [`MOVEMENTS`] now, N, without noise.
    #[must_use]
    pub fn forces_n(&self) -> [f64; MOVEMENTS.len()] {
        let mut forces = [0.0; MOVEMENTS.len()];
        for (point, muscles) in self.points.iter().zip(&self.muscles) {
            for (reach, muscle) in point.reaches.iter().zip(muscles) {
                forces[reach.movement] += reach.full_n * muscle.force();
            }
        }
        forces
    }
}

fn random_point(random: &mut Random) -> Result<Point, InvalidBench> {
    let movements = MOVEMENTS.len() as u64;
    let own = random.below(movements);
    let other = (own + 1 + random.below(movements - 1)) % movements;
    let lowest = random.between(6.0, 11.0);
    let farther = random.between(1.3, 1.7);
    let mut reach = |movement: u64, lowest: f64| {
        let pool = Pool::new(lowest, MIDDLE * lowest, SPREAD * lowest)?;
        Ok(Reach {
            movement: movement as usize,
            pool,
            full_n: random.between(10.0, 30.0),
        })
    };
    let reaches = [reach(own, lowest)?, reach(other, lowest * farther)?];
    let bears_ma = lowest * random.between(1.5, 2.2);
    Ok(Point { reaches, bears_ma })
}

impl Body for Array {
    fn pulse(&mut self, pulse: &Pulse) {
        let Some(point) = self.points.get(pulse.channel) else {
            return;
        };
        let ma = self.loads[pulse.channel].current_ma(pulse.drive);
        let ma = STRENGTH.equivalent_ma(ma, pulse.width_us.into());
        if ma <= 0.0 {
            return;
        }
        if ma > point.bears_ma {
            self.hurt_us = Some(pulse.t_us);
        }
        for (reach, muscle) in point.reaches.iter().zip(&mut self.muscles[pulse.channel]) {
            muscle.pulse(reach.pool.share(ma));
        }
    }

    /// Advances in whole steps of 1 ms. A pulse acts from the next step on.
    fn advance(&mut self, to_us: u64) -> bool {
        let before = self.tick;
        while (self.tick + 1) * STEP_US <= to_us {
            for (muscles, step) in self.muscles.iter_mut().zip(&self.steps) {
                for muscle in muscles {
                    muscle.step(step);
                }
            }
            self.sensor.sample(self.forces_n().iter().sum());
            self.tick += 1;
        }
        self.tick != before
    }

    fn angle_deg(&self) -> f64 {
        0.0
    }

    fn sensed_deg(&self) -> f64 {
        0.0
    }

    fn instrument_n(&self) -> Option<f64> {
        Some(self.sensor.reading_n())
    }

    fn visible_movements(&self) -> Vec<&'static str> {
        let forces = self.forces_n();
        let largest = forces.iter().copied().fold(VISIBLE_N, f64::max);
        let named = MOVEMENTS.into_iter().zip(forces);
        named
            .filter(|(_, force)| *force >= VISIBLE_N && *force >= 0.2 * largest)
            .map(|(name, _)| name)
            .collect()
    }

    fn is_complaining(&self) -> bool {
        let now_us = self.tick * STEP_US;
        self.hurt_us.is_some_and(|at| now_us < at + FELT_US)
    }

    fn loads(&self) -> &[Load; CHANNELS] {
        &self.loads
    }

    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.loads
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Drive;

    /// Returns the forearm after one second of pulses at 30 Hz on `channel`.
    fn after(mut body: Array, channel: usize, ma: f64) -> Array {
        for pulse in 0..30 {
            let t_us = pulse * 33_333;
            body.advance(t_us);
            body.pulse(&Pulse {
                t_us,
                channel,
                drive: Drive::Milliamps(ma),
                width_us: 400,
                conducted: false,
            });
        }
        body.advance(1_000_000);
        body
    }

    #[test]
    fn a_point_moves_what_lies_under_it_and_its_neighbour_later() {
        let body = Array::new(3, SensorSpec::default()).unwrap();
        for (channel, point) in body.points().iter().enumerate() {
            let [near, far] = point.reaches;
            let weak = after(body.clone(), channel, near.pool.lowest() * 1.25);
            assert_eq!(
                weak.visible_movements(),
                [MOVEMENTS[near.movement]],
                "{channel}"
            );
            let strong = after(body.clone(), channel, far.pool.lowest() * 2.0);
            assert!(
                strong
                    .visible_movements()
                    .contains(&MOVEMENTS[far.movement])
            );
            assert!(strong.is_complaining() == (far.pool.lowest() * 2.0 > point.bears_ma));
            let none = after(body.clone(), channel, near.pool.lowest() * 0.99);
            assert_eq!(none.forces_n(), [0.0; MOVEMENTS.len()]);
        }
    }

    #[test]
    fn an_electrode_that_is_off_moves_nothing() {
        let mut body = Array::new(3, SensorSpec::default()).unwrap();
        body.loads_mut()[4] = Load::Open;
        let body = after(body, 4, 30.0);
        assert_eq!(body.forces_n(), [0.0; MOVEMENTS.len()]);
        assert!(!body.is_complaining());
    }
}
