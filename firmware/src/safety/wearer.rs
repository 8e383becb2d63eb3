//! The limits that a wearer agreed to. They can only tighten the hard limits.

use super::limits;
use crate::range::{OutOfRange, Range};
use crate::units::MicroAmps;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// The wearer's limits as a host sends them; each can only tighten a hard limit.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize, Schema)]
pub struct WearerSpec {
    /// Largest current on any channel, 100–100 000 µA.
    pub max_current_ua: u32,
    /// Largest charge of one phase, 1–40 000 nC.
    pub max_charge_nc: u32,
    /// Largest rms current of a channel, 10–50 000 µA.
    pub max_rms_ua: u32,
    /// Shortest rise of an amplitude from zero, 1–5000 ms.
    pub rise_ms: u16,
    /// Time of the fall to zero when stimulation ends, 5–100 ms. A grounding after a pulse must be
    /// at least 1.2 ms shorter.
    pub fall_ms: u16,
    /// Host silence that ends stimulation, 20–1000 ms.
    pub host_timeout_ms: u16,
    /// Largest sum of currents of one sign through the common return at any microsecond, 100–200
    /// 000 µA.
    pub max_sum_ua: u32,
    /// Largest rms current of all channels together, 10–50 000 µA; also bounded by the density
    /// [`limits::MAX_DENSITY_UA_MM2`] under the common return.
    pub max_sum_rms_ua: u32,
    /// Area of the common return electrode, 10–40 000 mm². The default is 25 cm², for which the
    /// density limit equals [`limits::MAX_SUM_RMS`].
    pub return_area_mm2: u32,
    /// Whether arming requires the hand-held stop to be closed; opening it then stops. The arm key
    /// alone is not enough.
    pub hand_stop_required: bool,
    /// Fewest bursts of a rise from zero, 1–1000.
    pub rise_bursts: u16,
    /// Longest stimulation since power came up, 1–86 400 s.
    pub max_session_s: u32,
    /// Largest charge through a channel since power came up, 1–4 320 000 mC. One of the two phases
    /// of a pulse counts.
    pub max_dose_mc: u32,
    /// Largest rise of an amplitude that is not zero from one burst to the next, 10–100 000 µA.
    pub max_step_ua: u32,
    /// Largest rise of an amplitude that is not zero within a second, 10–100 000 µA.
    pub max_step_ua_per_s: u32,
}

impl Default for WearerSpec {
    fn default() -> Self {
        Self {
            max_current_ua: limits::MAX_CURRENT.get(),
            max_charge_nc: limits::MAX_PHASE_CHARGE_NC,
            max_rms_ua: limits::MAX_RMS.get(),
            rise_ms: 500,
            fall_ms: 50,
            host_timeout_ms: 100,
            max_sum_ua: limits::MAX_SUM.get(),
            max_sum_rms_ua: limits::MAX_SUM_RMS.get(),
            return_area_mm2: 2_500,
            hand_stop_required: false,
            rise_bursts: 1,
            max_session_s: limits::MAX_SESSION_S,
            max_dose_mc: limits::MAX_DOSE_MC,
            max_step_ua: limits::MAX_CURRENT.get(),
            max_step_ua_per_s: limits::MAX_CURRENT.get(),
        }
    }
}

/// The wearer's limits after [`WearerSpec::validate`] has checked their ranges.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Wearer(WearerSpec);

impl WearerSpec {
    /// Range of [`Self::max_current_ua`].
    pub const MAX_CURRENT_UA: Range =
        Range::new("max_current_ua", 100, limits::MAX_CURRENT.get() as i32);
    /// Range of [`Self::max_charge_nc`].
    pub const MAX_CHARGE_NC: Range =
        Range::new("max_charge_nc", 1, limits::MAX_PHASE_CHARGE_NC as i32);
    /// Range of [`Self::max_rms_ua`].
    pub const MAX_RMS_UA: Range = Range::new("max_rms_ua", 10, limits::MAX_RMS.get() as i32);
    /// Range of [`Self::rise_ms`].
    pub const RISE_MS: Range = Range::new("rise_ms", 1, 5_000);
    /// Range of [`Self::fall_ms`].
    pub const FALL_MS: Range = Range::new("fall_ms", 5, limits::MAX_FALL_MS as i32);
    /// Range of [`Self::host_timeout_ms`].
    pub const HOST_TIMEOUT_MS: Range = Range::new("host_timeout_ms", 20, 1_000);
    /// Range of [`Self::max_sum_ua`].
    pub const MAX_SUM_UA: Range = Range::new("max_sum_ua", 100, limits::MAX_SUM.get() as i32);
    /// Range of [`Self::max_sum_rms_ua`].
    pub const MAX_SUM_RMS_UA: Range =
        Range::new("max_sum_rms_ua", 10, limits::MAX_SUM_RMS.get() as i32);
    /// Range of [`Self::return_area_mm2`].
    pub const RETURN_AREA_MM2: Range = Range::new("return_area_mm2", 10, 40_000);
    /// Range of [`Self::rise_bursts`].
    pub const RISE_BURSTS: Range = Range::new("rise_bursts", 1, 1_000);
    /// Range of [`Self::max_session_s`].
    pub const MAX_SESSION_S: Range = Range::new("max_session_s", 1, limits::MAX_SESSION_S as i32);
    /// Range of [`Self::max_dose_mc`].
    pub const MAX_DOSE_MC: Range = Range::new("max_dose_mc", 1, limits::MAX_DOSE_MC as i32);

    /// Range of [`Self::max_step_ua`]. At its maximum the step limits nothing beyond the current
    /// limit.
    pub const MAX_STEP_UA: Range = Range {
        field: "max_step_ua",
        min: 10,
        ..Self::MAX_CURRENT_UA
    };
    /// Range of [`Self::max_step_ua_per_s`].
    pub const MAX_STEP_UA_PER_S: Range = Range {
        field: "max_step_ua_per_s",
        ..Self::MAX_STEP_UA
    };

    /// Checks that every field is within its range.
    ///
    /// # Errors
    /// Returns the first field outside its range, and the range.
    pub fn validate(&self) -> Result<Wearer, OutOfRange> {
        Self::MAX_CURRENT_UA.check(self.max_current_ua)?;
        Self::MAX_CHARGE_NC.check(self.max_charge_nc)?;
        Self::MAX_RMS_UA.check(self.max_rms_ua)?;
        Self::RISE_MS.check(self.rise_ms)?;
        Self::FALL_MS.check(self.fall_ms)?;
        Self::HOST_TIMEOUT_MS.check(self.host_timeout_ms)?;
        Self::MAX_SUM_UA.check(self.max_sum_ua)?;
        Self::MAX_SUM_RMS_UA.check(self.max_sum_rms_ua)?;
        Self::RETURN_AREA_MM2.check(self.return_area_mm2)?;
        Self::RISE_BURSTS.check(self.rise_bursts)?;
        Self::MAX_SESSION_S.check(self.max_session_s)?;
        Self::MAX_DOSE_MC.check(self.max_dose_mc)?;
        Self::MAX_STEP_UA.check(self.max_step_ua)?;
        Self::MAX_STEP_UA_PER_S.check(self.max_step_ua_per_s)?;
        Ok(Wearer(*self))
    }
}

impl Wearer {
    /// Returns the limits in the form in which the host sent them.
    #[must_use]
    pub const fn spec(&self) -> &WearerSpec {
        &self.0
    }

    /// Returns the largest current on any channel.
    #[must_use]
    pub const fn max_current(&self) -> MicroAmps {
        MicroAmps::new(self.0.max_current_ua)
    }

    /// Returns the largest current, rounded down, for which a phase of `width_us` keeps the charge
    /// limit.
    #[must_use]
    pub const fn max_current_at(&self, width_us: u16) -> MicroAmps {
        let max_pc = self.0.max_charge_nc * 1000; // at most 4e7
        match max_pc.checked_div(width_us as u32) {
            Some(ua) => MicroAmps::new(ua),
            None => MicroAmps::new(max_pc), // of no width
        }
    }

    /// Returns the largest rms current of a channel.
    #[must_use]
    pub const fn max_rms(&self) -> MicroAmps {
        MicroAmps::new(self.0.max_rms_ua)
    }

    /// Returns the largest sum of currents of one sign through the common return.
    #[must_use]
    pub const fn max_sum(&self) -> MicroAmps {
        MicroAmps::new(self.0.max_sum_ua)
    }

    /// Returns the largest rms current through the common return, with its density limit included.
    #[must_use]
    pub fn max_sum_rms(&self) -> MicroAmps {
        // At most 40 000 · 20.
        let dense = self.0.return_area_mm2 * limits::MAX_DENSITY_UA_MM2;
        MicroAmps::new(self.0.max_sum_rms_ua.min(dense))
    }

    /// Returns the shortest rise from zero: its time in µs, and its number of bursts.
    #[must_use]
    pub const fn rise(&self) -> (u32, u16) {
        (self.0.rise_ms as u32 * 1000, self.0.rise_bursts)
    }

    /// Returns the time of the fall to zero in µs.
    #[must_use]
    pub const fn fall_us(&self) -> u32 {
        self.0.fall_ms as u32 * 1000
    }

    /// Returns the host silence that ends stimulation, in µs.
    #[must_use]
    pub const fn host_timeout_us(&self) -> u32 {
        self.0.host_timeout_ms as u32 * 1000
    }
}
