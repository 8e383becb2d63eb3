//! Simulated participants: a random arm, its comfortable currents, and the contractions that it
//! performs.

use super::calibrate::pulses;
use super::declaration::Study;
use super::device::{Device, Method};
use super::error::EndpointError;
use super::metrics::Target;
use super::model::{Frame, Model, cursory};
use hal_sim::body::Body;
use hal_sim::body::arm::{Arm, ArmSpec, ELECTRODES};
use hal_sim::random::{self, Random};

/// The six directions in the axes of the simulated arm: backward and forward, down and up, right
/// and left.
pub const DIRECTIONS: [[f64; 3]; 6] = [
    [-1.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 0.0, -1.0],
    [0.0, 0.0, 1.0],
    [0.0, -1.0, 0.0],
    [0.0, 1.0, 0.0],
];
/// Labels of [`DIRECTIONS`] in tables and figures.
pub const DIRECTION_NAMES: [&str; 6] = ["backward", "forward", "down", "up", "right", "left"];
/// Length of the baseline before a contraction, ms. Our choice: the paper prints *immediately
/// before*.
const BASELINE_MS: u64 = 100;
/// Period of the force sensor, ms. Our choice: the paper prints no rate.
const READ_MS: u64 = 10;

/// Simulated participant of the study.
#[derive(Clone, Debug)]
pub struct Participant {
    /// Simulated arm with its electrodes and sensors.
    pub arm: Arm,
    /// Simulated time, µs.
    pub now_us: u64,
    /// Smallest and largest comfortable current of each channel, mA.
    pub ranges_ma: [[f64; 2]; ELECTRODES],
    stream: u64,
}

/// Number of a command, and its reference force, N.
pub type Command = (usize, [f64; 3]);

impl Participant {
    /// Generates participant `index` of `seed`, with the arm in the cuff and comfortable currents.
    ///
    /// # Errors
    /// Returns E716 if the random arm is invalid.
    pub fn random(study: &Study, seed: u64, index: u64) -> Result<Self, EndpointError> {
        let spec = ArmSpec::random(seed, index);
        let stream = random::word(random::word(seed, index), 0xE9D);
        let mut random = Random::new(random::word(stream, 0));
        let comfort = &study.comfort;
        let ranges_ma = std::array::from_fn(|at| {
            let [low, high] = comfort.least;
            let least = spec.threshold_ma[at] * random.between(low, high);
            let [low, high] = comfort.greatest;
            let greatest = spec.max_ma[at] * random.between(low, high);
            [least, greatest.max(least + 1.0)]
        });
        let mut participant = Self {
            arm: Arm::new(spec)?,
            now_us: 0,
            ranges_ma,
            stream,
        };
        participant.pause(1.0);
        Ok(participant)
    }

    /// Returns the model by approximate anatomy with this participant's own lengths and currents.
    /// The gains are not known yet.
    #[must_use]
    pub fn cursory_model(&self) -> Model {
        let frame = Frame {
            stature_m: self.arm.spec().stature_m,
            posture: self.arm.spec().posture,
        };
        Model {
            actions: cursory(),
            gains: [1.0; ELECTRODES],
            ranges_ma: self.ranges_ma,
            frame,
        }
    }

    /// Returns the model with which this participant wears the frame of another: the other's
    /// routing, gains and lengths with this participant's own currents.
    #[must_use]
    pub fn model_wearing(&self, other: &Model) -> Model {
        Model {
            ranges_ma: self.ranges_ma,
            ..other.clone()
        }
    }

    /// Lets this time pass without stimulation, s.
    pub fn pause(&mut self, s: f64) {
        self.now_us += (1e6 * s).round() as u64;
        self.arm.advance(self.now_us);
    }

    /// Returns the commands with all repetitions: six directions at each magnitude, which is a
    /// fraction of the force that `device` can reach. `condition` selects the random order.
    #[must_use]
    pub fn commands(&self, study: &Study, device: &Device, condition: u64) -> Vec<Command> {
        let magnitudes = &study.protocol.magnitudes;
        let mut all = Vec::new();
        for (place, direction) in DIRECTIONS.iter().enumerate() {
            let reach = device.reachable_n(*direction);
            for (size, magnitude) in magnitudes.iter().enumerate() {
                let wanted = direction.map(|direction| direction * magnitude * reach);
                let command = (place * magnitudes.len() + size, wanted);
                all.extend(std::iter::repeat_n(command, study.protocol.repetitions));
            }
        }
        Random::new(random::word(self.stream, 16 + condition)).shuffle(&mut all);
        all
    }

    /// Stimulates every command in turn and returns the measured targets.
    ///
    /// # Errors
    /// Returns E706 if a force or a weight is not finite.
    pub fn stimulate_commands(
        &mut self,
        study: &Study,
        (device, method): (&Device, Method),
        commands: &[Command],
    ) -> Result<Vec<Target>, EndpointError> {
        let one = |(command, wanted_n): &Command| {
            let forces = device.forces_n(method, *wanted_n)?;
            let currents_ma = device.currents_ma(&forces);
            let measured = self.measure_contraction(study, &currents_ma, [0.0; 6]);
            Ok(Target {
                command: *command,
                wanted_n: *wanted_n,
                measured,
                currents_ma,
                is_beyond: device.is_beyond(&forces),
            })
        };
        commands.iter().map(one).collect()
    }

    /// Lets the participant push voluntarily with feedback in each direction, with the full force
    /// that `device` can reach.
    pub fn push_voluntarily(&mut self, study: &Study, device: &Device) -> Vec<Target> {
        let aim = &study.voluntary;
        let mut random = Random::new(random::word(self.stream, 2));
        let mut all = Vec::new();
        for _ in 0..study.protocol.voluntary_repetitions {
            for (place, direction) in DIRECTIONS.iter().enumerate() {
                let wanted_n = direction.map(|value| value * device.reachable_n(*direction));
                let deviate = |random: &mut Random| random::standard_normal(random.word(), 0);
                let size = 1.0 + aim.size * deviate(&mut random);
                let aside = aim.direction_deg.to_radians();
                let reach = super::metrics::size(wanted_n);
                let mut push = [0.0; 6];
                let axes = push.iter_mut().zip(direction).zip(wanted_n);
                for ((push, direction), wanted) in axes {
                    let off = match *direction == 0.0 {
                        true => reach * aside * deviate(&mut random),
                        false => 0.0,
                    };
                    *push = size * (wanted + off);
                }
                let measured = self.measure_contraction(study, &[0.0; ELECTRODES], push);
                all.push(Target {
                    command: place,
                    wanted_n,
                    measured,
                    currents_ma: [0.0; ELECTRODES],
                    is_beyond: false,
                });
            }
        }
        all
    }

    /// Returns the mean wrench over the next [`BASELINE_MS`], without stimulation.
    fn baseline(&mut self) -> [f64; 6] {
        let mut mean = Mean::default();
        for _ in 0..BASELINE_MS / READ_MS {
            self.now_us += 1_000 * READ_MS;
            self.arm.advance(self.now_us);
            mean.add(self.arm.sensed_wrench());
        }
        mean.mean()
    }

    /// Applies these currents and this push for the duration of a contraction, then rests. Returns
    /// the mean wrench of the contraction minus that immediately before it (section 2.6).
    pub(super) fn measure_contraction(
        &mut self,
        study: &Study,
        currents_ma: &[f64; ELECTRODES],
        push: [f64; 6],
    ) -> [f64; 6] {
        let protocol = &study.protocol;
        let train = (
            protocol.contraction_s,
            protocol.frequency_hz,
            protocol.width_us,
        );
        let currents = &mut |_| *currents_ma;
        self.measure_stimulation(study, &mut |arm, now_us, each_ms| {
            arm.set_voluntary_wrench(push);
            pulses(arm, now_us, currents, train, each_ms)
        })
    }

    /// Lets `stimulate` perform a contraction, then rests. Returns the mean wrench of the
    /// contraction minus that immediately before it.
    pub(super) fn measure_stimulation(
        &mut self,
        study: &Study,
        stimulate: Stimulate<'_>,
    ) -> [f64; 6] {
        let before = self.baseline();
        let mut during = Mean::default();
        let mut ms = 0;
        let mut add = |arm: &Arm| {
            ms += 1;
            if ms % READ_MS == 0 {
                during.add(arm.sensed_wrench());
            }
        };
        self.now_us = stimulate(&mut self.arm, self.now_us, &mut add);
        self.arm.set_voluntary_wrench([0.0; 6]);
        let rest = study.protocol.rest_s - 1e-3 * BASELINE_MS as f64;
        self.pause(rest.max(0.0));
        let during = during.mean();
        std::array::from_fn(|axis| during[axis] - before[axis])
    }
}

/// Function that performs a contraction on an arm from a given time on, µs. It calls its last
/// argument after each millisecond and returns the time at the end of the contraction, µs.
pub(super) type Stimulate<'a> = &'a mut dyn FnMut(&mut Arm, u64, &mut dyn FnMut(&Arm)) -> u64;

/// Accumulates the mean of wrenches.
#[derive(Default)]
struct Mean {
    sum: [f64; 6],
    n: u32,
}

impl Mean {
    fn add(&mut self, wrench: [f64; 6]) {
        self.n += 1;
        for (sum, value) in self.sum.iter_mut().zip(wrench) {
            *sum += value;
        }
    }

    fn mean(&self) -> [f64; 6] {
        self.sum.map(|sum| sum / f64::from(self.n.max(1)))
    }
}
