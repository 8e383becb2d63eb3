//! Force of a muscle over time, in answer to pulses.

use firmware::muscle::{CalciumForce, CalciumForceState, Gain};
use firmware::units::Micros;
use hal_sim::body::muscle::{Parameters, reference};

/// State of the muscle at one time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ResponseRow {
    /// Time since the start, s.
    pub t_s: f64,
    /// C, the normalised amount of the calcium–troponin complex (Lee 2020, eq. 2), without unit.
    pub c: f64,
    /// Force of the whole muscle at this time, N.
    pub force_n: f64,
}

/// Returns the response of the device's own fixed-point model to `pulses_us`, rising times in µs,
/// every `row_us` (a multiple of 1000) up to `duration_us`. The device ticks at 1 kHz and receives
/// the exact µs of each pulse. Pulses that raise C to [`CalciumForce::CALCIUM_END`] are beyond the
/// range of the fixed point.
#[must_use]
pub fn device_response(
    muscle: &CalciumForce,
    pulses_us: &[u64],
    duration_us: u64,
    row_us: u64,
) -> Vec<ResponseRow> {
    let mut state = CalciumForceState::at_rest(Micros::new(0));
    let mut pulses = pulses_us.iter().copied().peekable();
    let mut rows = Vec::new();
    for tick_us in (0..=duration_us).step_by(1000) {
        while let Some(at) = pulses.next_if(|&at| at <= tick_us) {
            muscle.pulse(&mut state, Micros::new(at as u32), Gain::FULL);
        }
        muscle.advance(&mut state, Micros::new(tick_us as u32));
        if tick_us % row_us.max(1) == 0 {
            rows.push(ResponseRow {
                t_s: tick_us as f64 * 1e-6,
                c: muscle.calcium(&state).to_num(),
                force_n: muscle.force(&state).get().to_num(),
            });
        }
    }
    rows
}

/// Returns the response of the high-accuracy reference to pulses at `times_s`, every `row_s` up to
/// `duration_s`.
#[must_use]
pub fn reference_response(
    parameters: &Parameters,
    times_s: &[f64],
    duration_s: f64,
    row_s: f64,
) -> Vec<ResponseRow> {
    let samples = reference::integrate(parameters, times_s, duration_s, row_s);
    let rows = samples.iter().map(|s| ResponseRow {
        t_s: s.t_s,
        c: s.c,
        force_n: s.force_n,
    });
    rows.collect()
}
