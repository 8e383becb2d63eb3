//! Power consumption of muscles, from published heat rates.

use super::geometry::mass_kg;
use std::f64::consts::FRAC_PI_2;

/// Heat of activation of slow and fast fibres, W/kg (Bhargava 2004, after Hatze and Buys).
const ACTIVATION_W_PER_KG: [f64; 2] = [40.0, 133.0];
/// Heat of maintaining force, of slow and fast fibres at optimal length, W/kg (the same source).
const MAINTENANCE_W_PER_KG: [f64; 2] = [74.0, 111.0];
/// Heat of shortening per force and speed, without a force–velocity curve: 0.16 of the isometric
/// force and 0.18 of the force (the same source).
const SHORTENING: f64 = 0.34;

/// Returns the power that a muscle consumes, W. It has three parts: voluntary activation (0 to 1),
/// which recruits slow fibres first; the share that pulses keep active, which recruits slow and
/// fast fibres alike (Gregory and Bickel 2005); and pulling with `force_n` while the muscle
/// shortens with `shortening_m_s`. Lengthening neither consumes nor returns power.
pub(super) fn power_w(
    muscle: usize,
    (strength, fast_part): (f64, f64),
    (by_will, by_pulses): (f64, f64),
    (force_n, shortening_m_s): (f64, f64),
) -> f64 {
    let slow_part = 1.0 - fast_part;
    let will = FRAC_PI_2 * by_will.clamp(0.0, 1.0);
    let slow = slow_part * (libm::sin(will) + by_pulses);
    let fast = fast_part * (1.0 - libm::cos(will) + by_pulses);
    let heat = slow * (ACTIVATION_W_PER_KG[0] + MAINTENANCE_W_PER_KG[0])
        + fast * (ACTIVATION_W_PER_KG[1] + MAINTENANCE_W_PER_KG[1]);
    mass_kg(muscle, strength) * heat + (1.0 + SHORTENING) * force_n * shortening_m_s.max(0.0)
}
