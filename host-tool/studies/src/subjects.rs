//! Converts subjects to the device's units, and computes a muscle's forces under pulses.

use firmware::muscle::CalciumForceSpec;
use firmware::units::Micros;
use hal_sim::body::muscle::Parameters;
use methods::muscle::Integrator;

/// Converts a subject's muscle constants to the units of the device, in which the values of Lee's
/// table 4 are whole numbers.
pub fn spec(p: &Parameters) -> CalciumForceSpec {
    let whole = |value: f64, per: f64| (value * per).round() as u32;
    CalciumForceSpec {
        a_mn_per_s: whole(p.a_n_per_s, 1e3),
        k_micro: whole(p.k, 1e6),
        tau_c_us: whole(p.tau_c_s, 1e6),
        tau1_us: whole(p.tau1_s, 1e6),
        tau2_us: whole(p.tau2_s, 1e6),
    }
}

/// Returns the muscle's force at each of `times_us`, N, while it receives pulses at `pulses_us`.
/// Both times are in ascending order.
pub fn forces(
    muscle: &mut dyn Integrator,
    pulses_us: &[u32],
    times_us: impl Iterator<Item = u32>,
) -> impl Iterator<Item = f64> {
    let mut pulses = pulses_us.iter().peekable();
    times_us.map(move |at_us| {
        while let Some(pulse_us) = pulses.next_if(|us| **us <= at_us) {
            muscle.pulse(Micros::new(*pulse_us));
        }
        muscle.advance(Micros::new(at_us));
        muscle.force_n()
    })
}
