//! Errors of the shipped model over all inputs that the device accepts, not only Lee's ten muscles:
//! parameters uniform in their logarithms, and every corner of their ranges; trains of 1…200 Hz
//! whose pulses deviate by up to 45 % of a period.
//!
//! Muscles that the device refuses because of τ1 are judged with the shortest τ1 that it accepts
//! for their other parameters.
//!
//! A only scales the force and is always the largest possible: the 15 µN resolution of
//! [`CalciumForce::force`](firmware::muscle::CalciumForce::force) is then below 1e-6 of full scale,
//! so that no error here comes from rounding the output.

use super::cases::{Case, Random, jittered_train};
use super::{WANTED_PCT, errors};
use firmware::muscle::{CalciumForce, CalciumForceSpec};
use firmware::range::Range;
use hal_sim::body::muscle::Parameters;
use methods::muscle::Setting;
use rayon::prelude::*;

/// Pulse rates of the trains at the corners, Hz; the first is a single twitch, because a train lasts
/// 1 s. Random muscles get a rate between the first and the last, uniform in the logarithm.
const RATES_HZ: [f64; 6] = [1.0, 5.0, 20.0, 50.0, 100.0, 200.0];
/// Ranges of the model's parameters that the device accepts, except that of A.
const RANGES: [Range; 4] = [
    CalciumForceSpec::K_MICRO,
    CalciumForceSpec::TAU_C_US,
    CalciumForceSpec::TAU1_US,
    CalciumForceSpec::TAU2_US,
];

/// One muscle under one train, and the error of the shipped model on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Constants of the muscle, with τ1 lengthened if the device refuses the muscle otherwise.
    pub spec: CalciumForceSpec,
    /// Pulse rate of the train, Hz.
    pub rate_hz: f64,
    /// Largest error, % of the peak force of this train.
    pub error_pct: f64,
}

/// Errors of the shipped model on all trains, each list sorted from the largest error down.
#[derive(Clone, Debug)]
pub struct RangeErrors {
    /// Errors of the muscles at the corners of the parameter ranges, one for each corner and each
    /// of six pulse rates.
    pub corners: Vec<Place>,
    /// Errors of the randomly generated muscles.
    pub drawn: Vec<Place>,
    /// Number of trains in both lists whose muscle the device refuses; they are judged with a
    /// longer τ1.
    pub refused: usize,
}

/// Returns the share of `places` whose error exceeds [`WANTED_PCT`], %. `places` must be sorted
/// from the largest error down.
pub fn above_pct(places: &[Place]) -> f64 {
    let above = places.partition_point(|p| p.error_pct > WANTED_PCT);
    above as f64 / places.len().max(1) as f64 * 100.0
}

/// Judges the shipped model at all corners of the parameter ranges, each at six pulse rates, and
/// on `draws` random muscles. `seed` must not be 0.
pub fn study(seed: u32, draws: usize) -> RangeErrors {
    let mut random = Random(seed);
    let corners = (0..1 << RANGES.len()).flat_map(|corner: usize| {
        let at = |n: usize, range: &Range| ends(range)[corner >> n & 1];
        RATES_HZ.map(|rate_hz| (values(at), rate_hz))
    });
    let corners: Vec<_> = corners.map(|(v, hz)| train(v, hz, &mut random)).collect();
    let rates_hz = [RATES_HZ[0], RATES_HZ[5]];
    let drawn = (0..draws).map(|_| random_train(&mut random, rates_hz));
    let drawn: Vec<_> = drawn.collect();
    let refused = corners.iter().chain(&drawn);
    let refused = refused.filter(|(spec, ..)| CalciumForce::new(*spec).is_err());
    RangeErrors {
        refused: refused.count(),
        corners: judge(&corners),
        drawn: judge(&drawn),
    }
}

/// Generates a muscle and a train, each parameter and the rate uniform in its logarithm. The muscle
/// may be one that the device refuses.
pub(super) fn random_train(random: &mut Random, rates_hz: [f64; 2]) -> Train {
    let mut even = |[low, high]: [f64; 2]| low * libm::pow(high / low, random.unit_value());
    let drawn = values(|_, range| even(ends(range).map(f64::from)) as u32);
    let rate_hz = even(rates_hz);
    train(drawn, rate_hz, random)
}

const fn ends(range: &Range) -> [u32; 2] {
    [range.min.cast_unsigned(), range.max.cast_unsigned()]
}

/// Returns one value for each of [`RANGES`], which `choice` chooses from the index and the range.
fn values(mut choice: impl FnMut(usize, &Range) -> u32) -> [u32; 4] {
    let mut values = [0; 4];
    for (n, (value, range)) in values.iter_mut().zip(&RANGES).enumerate() {
        *value = choice(n, range);
    }
    values
}

/// A muscle, its pulse rate in Hz and its pulse times in µs.
pub(super) type Train = (CalciumForceSpec, f64, Vec<u32>);

fn train([k, tau_c, tau1, tau2]: [u32; 4], rate_hz: f64, random: &mut Random) -> Train {
    let spec = CalciumForceSpec {
        a_mn_per_s: ends(&CalciumForceSpec::A_MN_PER_S)[1],
        k_micro: k,
        tau_c_us: tau_c,
        tau1_us: tau1,
        tau2_us: tau2,
    };
    // A train lasts 1 s: at lower rates it is a single twitch.
    (spec, rate_hz, jittered_train(rate_hz.max(1.0), random))
}

/// Lengthens τ1 to the shortest that the device accepts, if it refuses the muscle.
fn with_valid_tau1(spec: CalciumForceSpec) -> CalciumForceSpec {
    match CalciumForce::new(spec) {
        Err(refused) if refused.field == CalciumForceSpec::TAU1_US.field => CalciumForceSpec {
            tau1_us: refused.min.cast_unsigned(),
            ..spec
        },
        _ => spec,
    }
}

/// Computes the true force of a train. The τ1 of a muscle that the device refuses is lengthened.
pub(super) fn case((spec, _, pulses_us): &Train) -> Case {
    let spec = with_valid_tau1(*spec);
    let parameters = Parameters {
        a_n_per_s: f64::from(spec.a_mn_per_s) * 1e-3,
        k: f64::from(spec.k_micro) * 1e-6,
        tau_c_s: f64::from(spec.tau_c_us) * 1e-6,
        tau1_s: f64::from(spec.tau1_us) * 1e-6,
        tau2_s: f64::from(spec.tau2_us) * 1e-6,
    };
    Case::new(&parameters, pulses_us.clone())
}

fn judge(trains: &[Train]) -> Vec<Place> {
    let judge = |train: &Train| {
        let case = case(train);
        Place {
            spec: case.spec,
            rate_hz: train.1,
            error_pct: errors::case_error_pct(&case, Setting::SHIPPED, 1000),
        }
    };
    let mut places: Vec<Place> = trains.par_iter().map(judge).collect();
    places.sort_by(|a, b| b.error_pct.total_cmp(&a.error_pct));
    places
}
