//! Specification of a muscle's force by the host, and its checks.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::range::{OutOfRange, Range};

/// Parameters of one muscle, as a host sends them. Table 4 of Lee 2020 lists those of ten subjects
/// (with τ2 of K06 misprinted: 176 ms, not 17.6).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct CalciumForceSpec {
    /// Force scaling factor A at [`super::Gain::FULL`], mN/s: 100…10,000,000.
    pub a_mn_per_s: u32,
    /// Calcium level K of half activation, millionths: 2,000…5,000,000.
    pub k_micro: u32,
    /// Time constant τc of the decay of calcium, µs: 5,000…100,000.
    pub tau_c_us: u32,
    /// Time constant τ1 of the decay of force without calcium, µs: 2,000…200,000, and more than
    /// 2,000 with a τ2 below 1.4 ms or a τ2/K of 100 s or more.
    pub tau1_us: u32,
    /// Time τ2 that full activation adds to τ1, µs: 1,000…1,000,000.
    pub tau2_us: u32,
}

/// Longest τc that a train allows, over the train's period: 1/ln(24/(24 − n)) in thousandths,
/// rounded down, for bursts of n = 1…8 pulses.
const PERIODS_PER_TAU: [u32; 8] = [23_496, 11_492, 7_488, 5_484, 4_280, 3_476, 2_899, 2_466];

impl CalciumForceSpec {
    /// Range of [`Self::a_mn_per_s`].
    pub const A_MN_PER_S: Range = Range::new("a_mn_per_s", 100, 10_000_000);
    /// Range of [`Self::k_micro`].
    pub const K_MICRO: Range = Range::new("k_micro", 2_000, 5_000_000);
    /// Range of [`Self::tau_c_us`].
    pub const TAU_C_US: Range = Range::new("tau_c_us", 5_000, 100_000);
    /// Range of [`Self::tau1_us`].
    pub const TAU1_US: Range = Range::new("tau1_us", 2_000, 200_000);
    /// Range of [`Self::tau2_us`].
    pub const TAU2_US: Range = Range::new("tau2_us", 1_000, 1_000_000);

    /// Checks that C stays below 24, where the fixed-point format ends, under a train of bursts of
    /// `burst_count` pulses (1…8) every `period_us` (at least 5000).
    ///
    /// If the pulses of a burst count as simultaneous at its start, C settles at n/(1 − e^(−T/τc)),
    /// so τc may be at most T/ln(24/(24 − n)). Single pulses pass at any rate.
    ///
    /// # Errors
    /// Returns [`OutOfRange`] for `tau_c_us` with the longest τc that this train allows.
    pub fn check_train(&self, burst_count: u8, period_us: u32) -> Result<(), OutOfRange> {
        let place = usize::from(burst_count.max(1)).saturating_sub(1);
        let thousandths = PERIODS_PER_TAU.get(place).copied().unwrap_or(0);
        let longest_us = u64::from(period_us).saturating_mul(thousandths.into()) / 1_000;
        let longest_us = u32::try_from(longest_us).unwrap_or(u32::MAX);
        Self::TAU_C_US
            .with_max_at_most(longest_us)
            .check(self.tau_c_us)
    }

    /// Checks each parameter against its documented range.
    pub(super) fn check(&self) -> Result<(), OutOfRange> {
        Self::A_MN_PER_S.check(self.a_mn_per_s)?;
        Self::K_MICRO.check(self.k_micro)?;
        Self::TAU_C_US.check(self.tau_c_us)?;
        Self::TAU2_US.check(self.tau2_us)?;
        let tau1 = Self::TAU1_US.with_min_at_least(self.shortest_tau1_us());
        tau1.check(self.tau1_us)
    }

    /// Returns the shortest τ1 of a muscle with this K and τ2, µs. With a shorter τ1 the force may
    /// be more than 0.02 % off. If K·τ1/(τ1 + τ2) is below 2·10^-5 pulses, the fixed-point format
    /// has too few levels of calcium where τ falls from τ2 to τ1. If 25 τ1 + 15 τ2 is below 70 ms,
    /// even a segment of one tick is too long.
    fn shortest_tau1_us(&self) -> u32 {
        // K is 2,000 millionths or more, so the quotient is below 2·10^7/1980.
        let k = self.k_micro.saturating_sub(20).max(1);
        let least = self.tau2_us.saturating_mul(20).div_ceil(k);
        let segment = 70_000u32.saturating_sub(self.tau2_us.saturating_mul(15));
        let least = least.max(segment.div_ceil(25));
        least.max(Self::TAU1_US.min.cast_unsigned())
    }
}
