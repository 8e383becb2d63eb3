//! Fatigue of a muscle (Ding et al. 2003), in wearer files and in sessions.

use firmware::muscle::FatigueSpec;

use crate::fields::field::Need::{Or, OrTold};
use crate::fields::field::{Section, field, number_in};
use crate::fields::table::Table;

/// Returns the fields of a `fatigue` table.
#[rustfmt::skip]
pub(crate) fn fatigue() -> Section {
    type F = FatigueSpec;
    let q = F::QUADRICEPS;
    vec![
        field("alpha_a_per_s2", number_in("s⁻²", 3, F::ALPHA_A_MILLI_PER_S2), Or(q.alpha_a_milli_per_s2.into()), "decrease of A per force and time"),
        field("alpha_k_per_n_s", number_in("N⁻¹s⁻¹", 9, F::ALPHA_K_NANO_PER_N_S), OrTold("0.0572 / A in N/s".into()), "increase of K per force and time"),
        field("alpha_tau1_per_n", number_in("N⁻¹", 9, F::ALPHA_TAU1_NANO_PER_N), OrTold("0.0632 / A in N/s".into()), "increase of τ1 per force and time"),
        field("tau_fat_s", number_in("s", 3, F::TAU_FAT_MS), Or(q.tau_fat_ms.into()), "time constant of recovery"),
    ]
}

/// Reads a `fatigue` table. Values that are left out are those of the quadriceps, scaled to the
/// muscle's force scale `a_mn_per_s`.
pub(crate) fn read_fatigue(t: &Table<'_>, a_mn_per_s: u32) -> FatigueSpec {
    let scaled = FatigueSpec::scaled_to(a_mn_per_s);
    FatigueSpec {
        alpha_a_milli_per_s2: t.integer("alpha_a_per_s2"),
        alpha_k_nano_per_n_s: t.integer_or("alpha_k_per_n_s", scaled.alpha_k_nano_per_n_s),
        alpha_tau1_nano_per_n: t.integer_or("alpha_tau1_per_n", scaled.alpha_tau1_nano_per_n),
        tau_fat_ms: t.integer("tau_fat_s"),
    }
}
