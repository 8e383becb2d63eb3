//! Analyses fifteen force records: peaks, the exponential, fits of the model, and their agreement.

use super::declaration::Declaration;
use super::error::LeeError;
use super::protocol::{Session, peak_n};
use host_core::identify::{
    Agreement, Constants, Exponential, Fit, ForceFit, ForceRecord, Response, Weighting, agreement,
    moving_average, responses, simulate_record,
};
use serde::{Deserialize, Serialize};

/// Period of the paper's 30 Hz, s: 166 steps of 0.2 ms, since only this period reproduces its table
/// 7.
const PAPER_30_HZ_S: f64 = 0.0332;

/// Results of fifteen trains: five amplitudes at three frequencies each.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TrainAnalysis {
    /// The amplitudes I1 to I5, mA.
    pub amplitudes: Vec<f64>,
    /// Peak force above rest, by amplitude and frequency, N: the largest mean over 40 ms.
    pub peaks_n: Vec<[f64; 3]>,
    /// Fit of equation 5 for each frequency; `None` if too few forces were measured.
    pub exponentials: [Option<(Exponential, Agreement)>; 3],
    /// Fits to the three trains at I5: the statistically optimal one, and the one of the paper.
    pub fits: [ForceFit; 2],
    /// Agreement between model and record for each amplitude, averaged over frequencies. At I5 the
    /// model is as fitted; at the other amplitudes its constant A is scaled by equation 6.
    pub agreements: Vec<Agreement>,
    /// Response of the fitted model by amplitude and frequency, with the paper's period for 30 Hz.
    pub responses: Vec<[Option<Response>; 3]>,
    /// Rise time T_RT of the measured force, from 10 to 90 % of its peak, by amplitude and
    /// frequency, s.
    pub measured_t_rt_s: Vec<[Option<f64>; 3]>,
}

/// # Errors
/// Fails if a record is invalid or cannot be fitted.
pub fn run_analysis(session: &Session, declared: &Declaration) -> Result<TrainAnalysis, LeeError> {
    let amplitudes = session.amplitudes.0.clone();
    let peaks_n: Vec<[f64; 3]> = session
        .records
        .iter()
        .map(|record| record.each_ref().map(peak_n))
        .collect();
    let exponentials: [_; 3] = std::array::from_fn(|f| exponential(&amplitudes, &peaks_n, f));
    let last = session.records.last().map_or(&[][..], |record| &record[..]);
    let fit = |weighting| Fit { weighting };
    let best = fit(Weighting::Whitened).fit_records(last)?;
    let averaged_fit = fit(Weighting::Averaged).fit_from(last, best.constants)?;
    let fits = [best, averaged_fit];
    // The paper continues with its own estimate.
    let constants = fits[1].constants;
    let reference_ma = amplitudes.last().copied().unwrap_or_default();
    let gain = |ma: f64, f: usize| match &exponentials[f] {
        _ if ma == reference_ma => 1.0,
        Some((exponential, _)) => exponential.gain(ma, reference_ma),
        None => 0.0,
    };
    let pairs = || amplitudes.iter().zip(&session.records);
    let agree = |(ma, records): (&f64, &[ForceRecord; 3])| {
        let agreements: [Agreement; 3] =
            std::array::from_fn(|f| record_agreement(constants, gain(*ma, f), &records[f]));
        mean(&agreements)
    };
    let times = |f: usize| {
        let own = period_s(declared.trains.frequencies_hz[f]);
        let gains: Vec<f64> = amplitudes.iter().map(|ma| gain(*ma, f)).collect();
        responses(constants, (own, 1.0), &gains)
    };
    let by_frequency = [times(0), times(1), times(2)];
    let of_amplitude = |i: usize| by_frequency.each_ref().map(|responses| responses[i]);
    let measured = |records: &[ForceRecord; 3]| records.each_ref().map(t_rt_s);
    Ok(TrainAnalysis {
        agreements: pairs().map(agree).collect(),
        responses: (0..amplitudes.len()).map(of_amplitude).collect(),
        measured_t_rt_s: session.records.iter().map(measured).collect(),
        peaks_n,
        exponentials,
        fits,
        amplitudes,
    })
}

/// Returns the pulse period of the paper's numerical integration, s.
pub(super) fn period_s(frequency_hz: u32) -> f64 {
    match frequency_hz {
        30 => PAPER_30_HZ_S,
        other => 1.0 / f64::from(other),
    }
}

fn exponential(
    amplitudes: &[f64],
    peaks_n: &[[f64; 3]],
    f: usize,
) -> Option<(Exponential, Agreement)> {
    let points: Vec<(f64, f64)> = amplitudes
        .iter()
        .copied()
        .zip(peaks_n.iter().map(|peak_n| peak_n[f]))
        .collect();
    let own = Exponential::fit(&points)?;
    let estimated: Vec<f64> = points.iter().map(|(ma, _)| own.at(*ma)).collect();
    let measured: Vec<f64> = points.iter().map(|(_, n)| *n).collect();
    Some((own, agreement(&estimated, &measured)))
}

/// Returns how well the modelled force agrees with the measured force above rest, both averaged
/// over 40 ms.
fn record_agreement(constants: Constants, gain: f64, record: &ForceRecord) -> Agreement {
    let own = ForceRecord {
        gain,
        ..record.clone()
    };
    let (force, _) = simulate_record(constants, &own);
    agreement(
        &moving_average(&force),
        &moving_average(&record.relative_to_rest()),
    )
}

fn mean(agreements: &[Agreement; 3]) -> Agreement {
    let over = |quantity: fn(&Agreement) -> f64| agreements.iter().map(quantity).sum::<f64>() / 3.0;
    Agreement {
        r2: over(|agreement| agreement.r2),
        rmse_n: over(|agreement| agreement.rmse_n),
        nrmse_percent: over(|agreement| agreement.nrmse_percent),
    }
}

/// Returns the time from 10 to 90 % of the peak of the averaged record during the train, s.
fn t_rt_s(record: &ForceRecord) -> Option<f64> {
    let last = *record.pulses_us.last()? as usize / 1_000;
    let forces_n = moving_average(&record.relative_to_rest());
    let train = forces_n.get(..last.min(forces_n.len()))?;
    Some(Response::from_force(train, 1e-3)?.t_rt_s())
}
