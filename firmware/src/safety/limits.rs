//! Hard limits: compile-time constants, each with its source. A wearer's limits can only be
//! tighter.
//!
//! IEC 60601-2-10 is quoted second-hand (from a survey of stimulator design, not from the
//! standard's own text): check before relying on it.

use crate::units::MicroAmps;

/// Largest current on any channel. Project limit (design, "Safety"): the largest figure that IEC
/// 60601-2-10 allows at any rate, second-hand.
pub const MAX_CURRENT: MicroAmps = MicroAmps::new(100_000);

/// Largest charge of one phase, nC. Project limit (design, "Safety").
pub const MAX_PHASE_CHARGE_NC: u32 = 40_000;

/// Largest rms current of one channel: 50 mA up to 400 Hz (IEC 60601-2-10, second-hand).
pub const MAX_RMS: MicroAmps = MicroAmps::new(50_000);

/// Largest sum of currents of one sign through the common return, at any microsecond. Project
/// limit, because no known standard gives one: two channels at their largest current. If the
/// return electrode is twice as large, its peak density is that of one channel.
pub const MAX_SUM: MicroAmps = MicroAmps::new(200_000);

/// Largest rms current of all channels together. The common return is an electrode like any other,
/// so [`MAX_RMS`] holds for it.
pub const MAX_SUM_RMS: MicroAmps = MAX_RMS;

/// Largest rms current density under an electrode, µA/mm²: 2 mA/cm², beyond which IEC 60601-2-10
/// requires the operator's attention (second-hand: Enraf-Nonius, Endomed 484, instructions for
/// use, page 47, which asks for less current under electrodes smaller than the 25 cm² that 50 mA
/// rms need).
pub const MAX_DENSITY_UA_MM2: u32 = 20;

/// Largest energy of one pulse into 500 Ω, µJ (IEC 60601-2-10, second-hand).
pub const MAX_PULSE_ENERGY_UJ: u64 = 300_000;

/// Current limiter of a voltage-controlled stage (Hamana 2022, II-A).
pub const VOLTAGE_STAGE_LIMITER: MicroAmps = MicroAmps::new(20_000);

/// Longest stimulation since power came up, s: a day. Project limit.
pub const MAX_SESSION_S: u32 = 86_400;

/// Largest charge through a channel since power came up, mC: [`MAX_RMS`] for [`MAX_SESSION_S`], so
/// that only a wearer's limit is ever reached. No source is known that limits the charge of a day.
pub const MAX_DOSE_MC: u32 = MAX_RMS.get() / 1000 * MAX_SESSION_S;

/// Longest fall of the amplitude when stimulation ends, ms.
pub const MAX_FALL_MS: u16 = 100;

/// Furthest time of a timed setpoint after the start of the window that accepts it, µs. Queued
/// setpoints are dropped when the host falls silent, and no host needs to look further ahead.
pub const AHEAD_US: u32 = 1_000_000;

/// Time for which an armed device waits for a start, µs.
pub const ARM_EXPIRY_US: u32 = 10_000_000;

/// Length of the grounding after a fault is acknowledged, µs.
pub const RECOVERY_GROUND_US: u32 = 100_000;

// 100 mA for two phases of 500 µs into 500 Ω: 1e5² µA² · 500 Ω · 1e-3 s
// = 5000 µJ. No allowed setting reaches the energy limit.
const _: () = {
    let current = MAX_CURRENT.get() as u64;
    let joules_e18 = current * current * 500 * 2 * 500; // µA²·Ω·µs = 1e-18 J
    assert!(joules_e18 / 1_000_000_000_000 < MAX_PULSE_ENERGY_UJ);
};
