//! What muscles use up, by published heats.

use super::geometry::mass_kg;
use std::f64::consts::FRAC_PI_2;

/// Heat of activation of slow and fast fibres, W/kg (Bhargava 2004, after Hatze and Buys).
const ACTIVATION_W_PER_KG: [f64; 2] = [40.0, 133.0];
/// Of keeping force up (the same, at the fibres' best length).
const MAINTENANCE_W_PER_KG: [f64; 2] = [74.0, 111.0];
/// Heat of shortening per force and speed, with no force–velocity curve: 0.16 of the
/// isometric force and 0.18 of the force (the same).
const SHORTENING: f64 = 0.34;

/// Power that a muscle uses up, W: of activation by will (0 to 1), which takes slow fibres
/// first, of the part that pulses keep busy, which take both alike (Gregory and Bickel
/// 2005), and of pulling with `force_n` while it shortens with `shortening_m_s`. Of
/// lengthening nothing is taken nor given back.
pub(super) fn power_w(
    muscle: usize,
    (strength, fast_part): (f64, f64),
    (by_will, by_pulses): (f64, f64),
    (force_n, shortening_m_s): (f64, f64),
) -> f64 {
    let slow_part = 1.0 - fast_part;
    let will = FRAC_PI_2 * by_will.clamp(0.0, 1.0);
    let slow = slow_part * (will.sin() + by_pulses);
    let fast = fast_part * (1.0 - will.cos() + by_pulses);
    let heat = slow * (ACTIVATION_W_PER_KG[0] + MAINTENANCE_W_PER_KG[0])
        + fast * (ACTIVATION_W_PER_KG[1] + MAINTENANCE_W_PER_KG[1]);
    mass_kg(muscle, strength) * heat + (1.0 + SHORTENING) * force_n * shortening_m_s.max(0.0)
}
