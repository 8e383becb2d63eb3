//! The protocol, whatever stimulates: a search, a placement pulse, fifteen trains.

use super::declaration::Declaration;
use super::error::LeeError;
use host_core::identify::{
    ForceRecord, ThresholdEstimate, bare_rule, check_rising, moving_average,
};
use serde::{Deserialize, Serialize};

/// Rest before a train that is fitted, and all of its record, samples of 1 ms.
const BEFORE: usize = 500;
const SAMPLES: usize = 2_500;

/// A train of pulses.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Train {
    /// Amplitude, mA.
    pub ma: f64,
    /// Pulses; a second long, so that it is the frequency in Hz too.
    pub pulses: u32,
    /// Width, µs.
    pub width_us: u32,
    /// Samples of rest before the first pulse.
    pub before: usize,
    /// Samples in all.
    pub samples: usize,
}

impl Train {
    /// Between two pulses, µs: whole ones, as a device has them.
    #[must_use]
    pub const fn period_us(&self) -> u32 {
        (1_000_000 + self.pulses / 2) / self.pulses
    }
}

/// What stimulates a wrist on the bench and reads its sensor.
pub trait Stimulator {
    /// A train and its record.
    ///
    /// # Errors
    /// The device does not do it.
    fn train(&mut self, train: &Train) -> Result<ForceRecord, LeeError>;
    /// Nothing is stimulated for so long, s.
    ///
    /// # Errors
    /// The device is gone.
    fn rest(&mut self, s: f64) -> Result<(), LeeError>;
}

/// From I_MT to I_PT, evenly, mA.
#[derive(Clone, PartialEq, Debug)]
pub struct Amplitudes(pub Vec<f64>);

impl Amplitudes {
    /// Of this I_MT.
    ///
    /// # Errors
    /// E642: they do not rise.
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

/// What a search came to.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct SearchResult {
    /// By the detector; `None`: no threshold up to the largest amplitude.
    pub found: Option<ThresholdEstimate>,
    /// By the paper's bare rule on the same tries: the first amplitude at which a 40 ms mean
    /// exceeds 0.015 N, mA.
    pub bare_ma: Option<f64>,
    /// Greatest 40 ms mean of the placement pulse, N.
    pub placement_n: f64,
}

impl SearchResult {
    /// I_MT, mA.
    #[must_use]
    pub fn i_mt_ma(&self) -> Option<f64> {
        self.found.as_ref().map(|result| result.threshold_ma)
    }
}

/// Fifteen trains.
#[derive(Clone, PartialEq, Debug)]
pub struct Session {
    /// I1 to I5, mA.
    pub amplitudes: Amplitudes,
    /// By amplitude and frequency, both ascending.
    pub records: Vec<[ForceRecord; 3]>,
}

/// Steps 2 and 3.
///
/// # Errors
/// The device does not do it.
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

/// Greatest 40 ms mean above rest, N.
pub(super) fn peak_n(record: &ForceRecord) -> f64 {
    let all = moving_average(&record.relative_to_rest());
    all.into_iter().fold(0.0, f64::max)
}

/// Step 4.
///
/// # Errors
/// The device does not do it.
pub fn run_fifteen_trains(
    by: &mut dyn Stimulator,
    amplitudes: Amplitudes,
    declared: &Declaration,
) -> Result<Session, LeeError> {
    let trains = &declared.trains;
    let mut records = Vec::with_capacity(amplitudes.0.len());
    for ma in &amplitudes.0 {
        let mut one = |pulses: u32| {
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
        records.push([one(low)?, one(middle)?, one(high)?]);
    }
    Ok(Session {
        amplitudes,
        records,
    })
}
