//! Trip levels of the banks' comparators. This hardware limits currents independently of the
//! program; at arming it is set to the currents that the channels may have (docs/reference/hardware.md, The
//! banks' comparators).

use super::Setup;
use crate::board::wiring::BOARD;
use crate::pulse::{BANKS, CHANNELS, gcd};
use crate::units::DacCode;

/// The current limit at a level of code 65 535, µA. Comparators trip at 1.25 times the limit.
const FULL_SCALE_UA: u32 = BOARD.stages.trip_full_scale_ua;

/// Lower bound of the limits, µA, for which a comparator trips at 1 mA. Smaller limits and banks
/// without a channel get this level, because below it a comparator may trip by its own offset.
const LEAST_UA: u32 = 800;

/// Returns the bank of `channel`, which is below [`CHANNELS`].
const fn bank(channel: usize) -> usize {
    BOARD.stages.banks[channel % CHANNELS] as usize
}

/// Returns the code of each bank's trip level, which follows from the largest current limit among
/// its channels.
#[must_use]
pub fn trip_levels(setup: &Setup) -> [DacCode; BANKS] {
    let mut limits = [LEAST_UA; BANKS];
    for (channel, config) in setup.channels.iter().enumerate() {
        if let (Some(config), Some(limit)) = (config, limits.get_mut(bank(channel))) {
            *limit = config.max_current.get().max(*limit);
        }
    }
    limits.map(code)
}

/// Returns the code for `limit_ua`, rounded up.
const fn code(limit_ua: u32) -> DacCode {
    // 65 535 / 100 000 = 13 107 / 20 000: at most 1.4e9, and a quotient of 65 535.
    const SHARED: u32 = gcd(65_535, FULL_SCALE_UA);
    const CODES: u32 = 65_535 / SHARED;
    const _: () = assert!(FULL_SCALE_UA.checked_mul(CODES).is_some());
    let limit_ua = if limit_ua < FULL_SCALE_UA {
        limit_ua
    } else {
        FULL_SCALE_UA
    };
    DacCode::new((limit_ua * CODES).div_ceil(FULL_SCALE_UA / SHARED) as u16)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Code times 125 mA / 65 535 is 1.25 times the limit, or less than one code above.
    #[test]
    fn a_level_is_1_25_times_the_limit() {
        for ua in [800, 1_000, 5_000, 19_999, 20_000, 99_999, 100_000] {
            let trips_ua = f64::from(code(ua).get()) / 65_535.0 * 125_000.0;
            let above = trips_ua - 1.25 * f64::from(ua);
            assert!((-1e-9..125_000.0 / 65_535.0).contains(&above), "{ua}");
        }
        assert_eq!(code(150_000).get(), 65_535);
    }
}
