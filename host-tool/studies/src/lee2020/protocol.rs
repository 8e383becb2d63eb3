//! Runs the protocol with any stimulator: a threshold search, a placement pulse, and fifteen
//! trains.

use super::declaration::Declaration;
use super::error::LeeError;
use host_core::identify::{
    ForceRecord, ThresholdEstimate, bare_rule, check_rising, moving_average,
};
use serde::{Deserialize, Serialize};

/// Rest before a train that is fitted, in samples of 1 ms.
const BEFORE: usize = 500;
/// Length of the record of a train that is fitted, in samples of 1 ms.
const SAMPLES: usize = 2_500;

/// A train of pulses that lasts one second.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Train {
    /// Current of each pulse, mA.
    pub ma: f64,
    /// Number of pulses in one second, which equals the pulse rate in Hz.
    pub pulses: u32,
    /// Pulse width, µs.
    pub width_us: u32,
    /// Number of samples of rest before the first pulse, one each ms.
    pub before: usize,
    /// Number of samples of the whole record, one each ms.
    pub samples: usize,
}

impl Train {
    /// Returns the pulse period in whole µs, as on a device.
    #[must_use]
    pub const fn period_us(&self) -> u32 {
        (1_000_000 + self.pulses / 2) / self.pulses
    }
}

/// Interface that stimulates a wrist on the test rig and reads its force sensor.
pub trait Stimulator {
    /// Plays a train and returns its record.
    ///
    /// # Errors
    /// Fails if the device does not emit the train.
    fn train(&mut self, train: &Train) -> Result<ForceRecord, LeeError>;
    /// Waits for `s` seconds without stimulation.
    ///
    /// # Errors
    /// Fails if the device is no longer connected.
    fn rest(&mut self, s: f64) -> Result<(), LeeError>;
}

/// Amplitudes I1 to I5, mA, evenly spaced from the motor threshold I_MT to its multiple I_PT. The
/// declaration fixes the factor.
#[derive(Clone, PartialEq, Debug)]
pub struct Amplitudes(pub Vec<f64>);

impl Amplitudes {
    /// Computes the amplitudes from I_MT.
    ///
    /// # Errors
    /// Fails with E642 if the amplitudes do not increase.
    pub fn from_threshold(i_mt_ma: f64, declared: &Declaration) -> Result<Self, LeeError> {
        let trains = &declared.trains;
        check_rising(&[("I_MT", i_mt_ma), ("I_PT", trains.reach * i_mt_ma)])?;
        let last = trains.amplitudes.max(2) - 1;
        let part = |i: usize| i as f64 / last as f64 * (trains.reach - 1.0);
        // A device has steps of a thousandth.
        let at = |i: usize| (1e3 * i_mt_ma * (1.0 + part(i))).round() * 1e-3;
        Ok(Self((0..=last).map(at).collect()))
    }
}

/// Result of a threshold search.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct SearchResult {
    /// Threshold that the detector found; `None` if there is none up to the largest amplitude.
    pub found: Option<ThresholdEstimate>,
    /// Threshold by the paper's bare rule on the same tries: the first amplitude at which a 40 ms
    /// mean exceeds 0.015 N, mA.
    pub bare_ma: Option<f64>,
    /// Largest 40 ms mean of the placement pulse, N.
    pub placement_n: f64,
}

impl SearchResult {
    /// Returns the threshold I_MT that the detector found, mA.
    #[must_use]
    pub fn i_mt_ma(&self) -> Option<f64> {
        self.found.as_ref().map(|result| result.threshold_ma)
    }
}

/// Records of the fifteen trains.
#[derive(Clone, PartialEq, Debug)]
pub struct Session {
    /// The amplitudes I1 to I5, mA.
    pub amplitudes: Amplitudes,
    /// Records by amplitude and frequency, both ascending.
    pub records: Vec<[ForceRecord; 3]>,
}

/// Runs steps 2 and 3 of the protocol: placement pulse and threshold search.
///
/// # Errors
/// Fails if the device does not emit a train.
pub fn search(by: &mut dyn Stimulator, declared: &Declaration) -> Result<SearchResult, LeeError> {
    let (trains, detector) = (&declared.trains, declared.search.detector());
    let layout = detector.layout;
    let placement = by.train(&Train {
        ma: trains.placement_ma,
        pulses: trains.placement_hz,
        width_us: trains.width_us,
        before: layout.before,
        samples: layout.samples,
    })?;
    let mut bare_ma = None;
    let found = detector.search(|ma| {
        let record = by.train(&Train {
            ma,
            pulses: declared.search.frequency_hz,
            width_us: trains.width_us,
            before: layout.before,
            samples: layout.samples,
        })?;
        if bare_ma.is_none() && bare_rule(&record.samples_n, &layout) {
            bare_ma = Some(ma);
        }
        Ok::<_, LeeError>(record.samples_n)
    });
    let found = match found {
        Ok(found) => Some(found),
        Err(LeeError::Identify(host_core::identify::IdentifyError::NoThreshold { .. })) => None,
        Err(other) => return Err(other),
    };
    Ok(SearchResult {
        found,
        bare_ma,
        placement_n: peak_n(&placement),
    })
}

/// Returns the largest 40 ms mean above rest, N.
pub(super) fn peak_n(record: &ForceRecord) -> f64 {
    let forces_n = moving_average(&record.relative_to_rest());
    forces_n.into_iter().fold(0.0, f64::max)
}

/// Runs step 4 of the protocol: the fifteen trains.
///
/// # Errors
/// Fails if the device does not emit a train.
pub fn run_fifteen_trains(
    by: &mut dyn Stimulator,
    amplitudes: Amplitudes,
    declared: &Declaration,
) -> Result<Session, LeeError> {
    let trains = &declared.trains;
    let mut records = Vec::with_capacity(amplitudes.0.len());
    for ma in &amplitudes.0 {
        let mut recording = |pulses: u32| {
            let record = by.train(&Train {
                ma: *ma,
                pulses,
                width_us: trains.width_us,
                before: BEFORE,
                samples: SAMPLES,
            })?;
            let around_s = 1e-3 * (SAMPLES as f64 - 1_000.0);
            by.rest((trains.break_s - around_s).max(0.0))?;
            Ok::<_, LeeError>(record)
        };
        let [low, middle, high] = trains.frequencies_hz;
        records.push([recording(low)?, recording(middle)?, recording(high)?]);
    }
    Ok(Session {
        amplitudes,
        records,
    })
}
