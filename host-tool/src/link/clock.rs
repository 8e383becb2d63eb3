//! An estimate of device time from the answers' time stamps.

use firmware::units::Micros;

/// Device time against host time. The exchange with the shortest round trip
/// since the last refresh decides.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clock {
    best: Option<Exchange>,
}

#[derive(Clone, Copy, Debug)]
struct Exchange {
    round_trip_us: u64,
    host_us: u64,
    device: Micros,
}

/// A better exchange is forgotten after this long, so that drift is followed.
const KEEP_US: u64 = 10_000_000;

impl Clock {
    /// A request sent at `sent_us` was answered by `received_us` and stamped
    /// `device` in between.
    pub fn observe(&mut self, sent_us: u64, received_us: u64, device: Micros) {
        let round_trip_us = received_us.saturating_sub(sent_us);
        let keep = self.best.is_some_and(|best| {
            best.round_trip_us <= round_trip_us
                && received_us.saturating_sub(best.host_us) < KEEP_US
        });
        if !keep {
            let host_us = sent_us + round_trip_us / 2;
            self.best = Some(Exchange {
                round_trip_us,
                host_us,
                device,
            });
        }
    }

    /// Device time at host time `host_us`; `None` before the first answer.
    #[must_use]
    pub fn device_at(&self, host_us: u64) -> Option<Micros> {
        // Wrapping on purpose: device time is modulo 2^32.
        self.best
            .map(|best| best.device.plus(host_us.wrapping_sub(best.host_us) as u32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_round_trip_decides() {
        let mut clock = Clock::default();
        assert_eq!(clock.device_at(0), None);
        clock.observe(1_000, 3_000, Micros(u32::MAX));
        assert_eq!(clock.device_at(2_010), Some(Micros(9)));
        clock.observe(10_000, 10_200, Micros(8_000));
        clock.observe(20_000, 29_000, Micros(50_000));
        assert_eq!(clock.device_at(10_100), Some(Micros(8_000)));
    }
}
