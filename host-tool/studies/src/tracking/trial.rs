//! One closed-loop trial of 30 s with a driver and a plant.

use super::TrackingError;
use super::driver::Driver;
use super::plant::{FRAME_HZ, Line, Plant};
use super::wearer::Volts;
use firmware::units::{Micros, us};
use hal_sim::body::random_finger::Draws;
use hal_sim::body::{Body, Drive, Pulse, RandomFinger};
use std::collections::VecDeque;

/// Length of a simulated trial, ms.
pub const TRIAL_MS: usize = 30_000;
/// Start of the scored part of a trial, ms.
pub const SCORED_FROM_MS: usize = 10_000;
/// Start of the part of a trial in which ripple is measured, ms. The last disturbance is 3 s
/// earlier.
pub const RIPPLE_FROM_MS: usize = 27_000;
/// Pulse period, ms: 50 Hz (Hamana 2022 §II-D).
pub const PULSE_EVERY_MS: usize = 20;
/// Width of every pulse, µs.
pub(crate) const PULSE_US: u32 = 200;
/// Device time at which a trial starts. It is 15 s before the 32-bit counter of microseconds wraps,
/// so that every trial contains a wrap.
const START: Micros = Micros::new(u32::MAX - 15_000_000);

/// Returns the device time at the time `at_us` of a trial.
pub(crate) fn device_time(at_us: u64) -> Micros {
    START + us(at_us as u32)
}

/// A frame on its way from host to device.
#[derive(Clone, Copy, Debug)]
struct Frame {
    due_us: u64,
    at_us: u64,
    setpoint: Option<f64>,
    measured: f64,
}

/// Source of the frames of a trial, with the delays and losses of the link.
#[derive(Debug)]
pub(crate) struct Frames {
    line: Line,
    luck: Draws,
    taken: u64,
    sample_us: f64,
    under_way: VecDeque<Frame>,
}

impl Frames {
    pub(crate) fn new(line: Line, seed: u64) -> Self {
        let mut frames = Self {
            line,
            luck: Draws::new(seed, 0, 4),
            taken: 0,
            sample_us: 0.0,
            under_way: VecDeque::with_capacity(4),
        };
        frames.sample_us = frames.next_sample_us();
        frames
    }

    /// Returns the true time at which the next frame is sampled, µs.
    fn next_sample_us(&mut self) -> f64 {
        let nominal_us = self.taken as f64 * 1e6 / FRAME_HZ;
        nominal_us + self.luck.uniform(0.0, self.line.sampling_jitter_us)
    }

    /// Samples a frame if its time has come. The frame states the time at which it should have been
    /// sampled.
    pub(crate) fn take(&mut self, now_us: u64, wanted: &[f64], sensed_deg: f64) {
        if self.sample_us > now_us as f64 {
            return;
        }
        let at_us = (self.taken as f64 * 1e6 / FRAME_HZ) as u64;
        let ms = (at_us / 1000) as usize;
        let way = self.line.transport_us + self.luck.uniform(0.0, self.line.transport_jitter_us);
        // The first setpoint always arrives; without it nothing is stimulated.
        let is_lost = self.luck.uniform(0.0, 1.0) < self.line.loss && self.taken > 0;
        self.under_way.push_back(Frame {
            due_us: now_us + way as u64,
            at_us,
            setpoint: wanted.get(ms).copied().filter(|_| !is_lost),
            measured: sensed_deg,
        });
        self.taken += 1;
        self.sample_us = self.next_sample_us();
    }

    /// Passes the frames that have arrived by `now_us` to the driver, in order.
    pub(crate) fn deliver(&mut self, now_us: u64, driver: &mut dyn Driver) {
        let now = device_time(now_us);
        while let Some(frame) = self.under_way.front().copied() {
            if frame.due_us > now_us {
                break;
            }
            self.under_way.pop_front();
            let at = device_time(frame.at_us);
            if let Some(degrees) = frame.setpoint {
                driver.setpoint(now, at, degrees);
            }
            driver.measurement(now, at, frame.measured);
        }
    }
}

/// Plays a pulse with these amplitudes on the finger; a channel with 0 V gets none.
pub(super) fn pulse(finger: &mut RandomFinger, now_us: u64, volts: Volts) {
    for (channel, v) in volts.into_iter().enumerate() {
        if v > 0.0 {
            finger.pulse(&Pulse {
                t_us: now_us + 100,
                channel,
                drive: Drive::Volts(v),
                width_us: PULSE_US,
                conducted: true,
            });
        }
    }
}

/// Raw result of a trial.
#[derive(Clone, PartialEq, Debug)]
pub struct Attempt {
    /// True angle after each millisecond, °.
    pub angles: Vec<f32>,
    /// Reason why the device refused or stopped; `None` if it did not.
    pub refused: Option<String>,
}

/// Runs a trial in which `driver` makes the plant's finger follow the reference `wanted`, one angle
/// per millisecond.
///
/// # Errors
/// Returns [`TrackingError::Plant`] if the plant's finger is invalid.
pub fn run(
    plant: &Plant,
    driver: &mut dyn Driver,
    wanted: &[f64],
) -> Result<Attempt, TrackingError> {
    let mut finger = RandomFinger::new(plant.finger.clone(), plant.seed)?;
    let mut frames = Frames::new(plant.line, plant.seed);
    let mut angles = Vec::with_capacity(wanted.len());
    for ms in 0..wanted.len() {
        let now_us = ms as u64 * 1000;
        frames.take(now_us, wanted, finger.sensed_deg());
        frames.deliver(now_us, driver);
        let volts = driver.tick(device_time(now_us));
        if ms % PULSE_EVERY_MS == 0 {
            pulse(&mut finger, now_us, volts);
        }
        finger.advance(now_us + 1000);
        angles.push(finger.angle_deg() as f32);
    }
    Ok(Attempt {
        angles,
        refused: driver.refused().map(str::to_owned),
    })
}

/// Returns the RMSE between angles and a reference over the scored part of a trial, °.
pub fn rmse(angles: &[f32], target: &[f64]) -> f64 {
    let scored = angles.iter().zip(target).skip(SCORED_FROM_MS);
    let (sum, n) = scored.fold((0.0, 0u32), |(sum, n), (a, t)| {
        (sum + (f64::from(*a) - t).powi(2), n + 1)
    });
    (sum / f64::from(n.max(1))).sqrt()
}
