//! Moves a reference force around a circle and recruits either 200 times a second or 20 times with
//! the currents held in between, to find the cost of the paper's slow updates.

use super::calibrate::pulses;
use super::declaration::Study;
use super::device::{Device, Method, force_on_circle};
use super::error::EndpointError;
use super::metrics::{Target, align};
use super::participant::{DIRECTIONS, Participant};
use hal_sim::body::arm::{Arm, ELECTRODES};
use serde::{Deserialize, Serialize};

/// Recruitment rates, Hz: the device's own, and the paper's.
pub const RATES_HZ: [u64; 2] = [200, 20];
/// Time over which a force is averaged, ms. The force is that of the arm without the sensor's noise
/// and the drift of the hold, which are as large as the reference force and the same at both rates.
const BIN_MS: u64 = 50;

/// Accuracy of the force at the hand at one recruitment rate, while the reference force goes around
/// circles.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct WalkResult {
    /// Recruitments per second.
    pub rate_hz: u64,
    /// Magnitude of the reference force, N.
    pub wanted_n: f64,
    /// Root mean square of the error's magnitude, as a fraction of `wanted_n`.
    pub part: f64,
}

/// Moves the reference force once around a circle in each of three planes and computes the error of
/// the force at the hand. The reference force has half the size of the force that can be reached in
/// the weakest direction.
///
/// # Errors
/// Returns E706 if a force or a weight is not finite.
pub fn walk(
    study: &Study,
    person: &mut Participant,
    device: &Device,
    rate_hz: u64,
) -> Result<WalkResult, EndpointError> {
    let reaches = DIRECTIONS.map(|directions| device.reachable_n(directions));
    let least = reaches.into_iter().filter(|reach| *reach > 0.0);
    let wanted_n = 0.5 * least.reduce(f64::min).unwrap_or(0.0);
    let mut targets = Vec::new();
    for plane in 0..3 {
        targets.extend(circle(study, person, (device, rate_hz), plane, wanted_n)?);
        person.pause(study.protocol.rest_s);
    }
    align(&mut targets);
    let off = |target: &Target| -> f64 {
        let parts = target.wanted_n.iter().zip(target.measured);
        parts.map(|(wanted, given)| (given - wanted).powi(2)).sum()
    };
    let mean = targets.iter().map(off).sum::<f64>() / targets.len().max(1) as f64;
    Ok(WalkResult {
        rate_hz,
        wanted_n,
        part: mean.sqrt() / wanted_n.max(f64::MIN_POSITIVE),
    })
}

/// Moves the reference force once around the circle in one plane. Returns the reference force at
/// the middle of each bin of [`BIN_MS`], and the mean force over the bin.
fn circle(
    study: &Study,
    person: &mut Participant,
    (device, rate_hz): (&Device, u64),
    plane: usize,
    size_n: f64,
) -> Result<Vec<Target>, EndpointError> {
    let turn_s = study.walk.turn_s;
    let wanted = |t_us: u64| {
        let angle = t_us as f64 * 1e-6 / turn_s * std::f64::consts::TAU;
        force_on_circle(plane, angle, size_n)
    };
    let every_us = 1_000_000 / rate_hz;
    let mut wrong = None;
    let mut currents = |t_us: u64| {
        let asked = device.forces_n(Method::Nearest, wanted(t_us - t_us % every_us));
        match asked {
            Ok(forces) => device.currents_ma(&forces),
            Err(error) => {
                wrong = Some(error);
                [0.0; ELECTRODES]
            }
        }
    };
    let mut bins: Vec<[f64; 6]> = Vec::new();
    let mut ms = 0;
    let mut add = |arm: &Arm| {
        if ms % BIN_MS == 0 {
            bins.push([0.0; 6]);
        }
        ms += 1;
        if let Some(bin) = bins.last_mut() {
            for (sum, value) in bin.iter_mut().zip(arm.wrench()) {
                *sum += value / BIN_MS as f64;
            }
        }
    };
    let train = (turn_s, study.protocol.frequency_hz, study.protocol.width_us);
    person.now_us = pulses(
        &mut person.arm,
        person.now_us,
        &mut currents,
        train,
        &mut add,
    );
    if let Some(error) = wrong {
        return Err(error);
    }
    let target = |(at, bin): (usize, [f64; 6])| Target {
        command: at,
        wanted_n: wanted(1_000 * (BIN_MS * at as u64 + BIN_MS / 2)),
        measured: bin,
        currents_ma: [0.0; ELECTRODES],
        is_beyond: false,
    };
    Ok(bins.into_iter().enumerate().map(target).collect())
}
