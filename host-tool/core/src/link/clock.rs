//! Extends device time to 64 bits, and estimates it from the answers' time stamps.

use firmware::units::Micros;

/// Relation of device time to host time, estimated from pairs of request and answer. The pair with
/// the shortest round trip determines it, until 10 s have passed and a newer pair replaces it.
///
/// A device stamps its messages with 32 bits, which wrap after 71.6 minutes. This type, and nothing
/// else on the host, extends a stamp to 64 bits, which do not wrap. All code beyond the link uses
/// the 64-bit times.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clock {
    best: Option<Exchange>,
    line: Option<Line>,
    /// Latest stamp: the host time at which it arrived, and its device time in 64 bits, µs.
    last: Option<(u64, u64)>,
}

/// Returns the stamp by which the device knows the 64-bit device time `device_us`: its lower 32
/// bits.
#[must_use]
pub const fn stamp(device_us: u64) -> Micros {
    Micros::new(device_us as u32)
}

/// Least-squares line through all pairs of request and answer: device time minus host time, as a
/// function of host time.
#[derive(Clone, Copy, Debug, Default)]
struct Line {
    first: Exchange,
    shortest_us: u64,
    count: f64,
    mean_s: f64,
    mean_us: f64,
    /// Running sum of the squared deviations of host time from its mean, s².
    ss: f64,
    /// Running sum of the products of both deviations, s·µs.
    su: f64,
    /// Running sum of the squared deviations of the time difference from its mean, µs².
    uu: f64,
}

/// Fit of the device's clock against the host's clock over a whole session.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Fit {
    /// Number of pairs of request and answer in the fit.
    pub exchanges: u64,
    /// Shortest time from a request to its answer, µs.
    pub round_trip_us: u64,
    /// Device time minus host time at the first exchange, µs modulo 2^32.
    pub offset_us: u32,
    /// Rate of the device's clock minus the host's, parts per million; `None` if the exchanges lie
    /// within less than a second.
    pub drift_ppm: Option<f64>,
    /// Root mean square of the residuals of the line, µs.
    pub residual_us: f64,
}

impl Line {
    fn new(first: Exchange) -> Self {
        Self {
            first,
            shortest_us: first.round_trip_us,
            ..Self::default()
        }
    }

    /// Adds a pair of request and answer by Welford's update, whose sums stay exact enough for
    /// days.
    fn add(&mut self, exchange: Exchange) {
        self.shortest_us = self.shortest_us.min(exchange.round_trip_us);
        let seconds = exchange.host_us.saturating_sub(self.first.host_us) as f64 * 1e-6;
        let gained = (exchange.difference() - self.first.difference()) as f64;
        self.count += 1.0;
        let (ds, du) = (seconds - self.mean_s, gained - self.mean_us);
        self.mean_s += ds / self.count;
        self.mean_us += du / self.count;
        self.ss += ds * (seconds - self.mean_s);
        self.su += ds * (gained - self.mean_us);
        self.uu += du * (gained - self.mean_us);
    }

    fn fit(&self) -> Fit {
        let spans_a_second = self.ss > 0.0 && self.mean_s > 0.5;
        // A gain of one µs per second is one part per million.
        let drift_ppm = spans_a_second.then(|| self.su / self.ss);
        let explained = drift_ppm.map_or(0.0, |drift| drift * self.su);
        Fit {
            exchanges: self.count as u64,
            round_trip_us: self.shortest_us,
            offset_us: self.first.difference() as u32, // modulo 2^32
            drift_ppm,
            residual_us: ((self.uu - explained).max(0.0) / self.count).sqrt(),
        }
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Exchange {
    round_trip_us: u64,
    host_us: u64,
    device_us: u64,
}

impl Exchange {
    /// Returns device time minus host time, µs.
    const fn difference(&self) -> i64 {
        self.device_us.cast_signed() - self.host_us.cast_signed()
    }
}

/// Time after which the exchange with the shortest round trip is replaced by a newer one, µs, so
/// that the estimate follows the drift of the clocks.
const KEEP_US: u64 = 10_000_000;

impl Clock {
    /// Extends the stamp `at`, which arrived at host time `host_us`, to a device time of 64 bits,
    /// µs. Of all times with these lower 32 bits, chooses the one nearest to the expected device
    /// time: the previous device time plus the host time since then, however long the device was
    /// silent. The first stamp becomes the time nearest to host time, so that device time equals
    /// host time in a simulated world. The result is never below 0.
    pub fn unwrap_stamp(&mut self, host_us: u64, at: Micros) -> u64 {
        let expected_us = self.last.map_or(host_us, |(host, device)| {
            device.saturating_add(host_us.saturating_sub(host))
        });
        let ahead_us = at.get().wrapping_sub(expected_us as u32).cast_signed();
        let nearest = expected_us.checked_add_signed(ahead_us.into());
        let device_us = nearest.unwrap_or_else(|| at.get().into());
        self.last = Some((host_us, device_us));
        device_us
    }

    /// Adds a pair of request and answer: the request was sent at host time `sent_us`, the answer
    /// arrived by `received_us`, and the device stamped it `device_us` in between.
    pub fn add_exchange(&mut self, sent_us: u64, received_us: u64, device_us: u64) {
        let round_trip_us = received_us.saturating_sub(sent_us);
        let exchange = Exchange {
            round_trip_us,
            host_us: sent_us + round_trip_us / 2,
            device_us,
        };
        let line = self.line.get_or_insert_with(|| Line::new(exchange));
        line.add(exchange);
        let keep = self.best.is_some_and(|best| {
            best.round_trip_us <= round_trip_us
                && received_us.saturating_sub(best.host_us) < KEEP_US
        });
        if !keep {
            self.best = Some(exchange);
        }
    }

    /// Returns the straight line through all pairs of request and answer; `None` before the first.
    #[must_use]
    pub fn fit(&self) -> Option<Fit> {
        self.line.as_ref().map(Line::fit)
    }

    /// Estimates the device time at host time `host_us`, both in µs; `None` before the first
    /// answer.
    #[must_use]
    pub fn device_at(&self, host_us: u64) -> Option<u64> {
        let since = |best: Exchange| host_us.cast_signed() - best.host_us.cast_signed();
        self.best
            .map(|best| best.device_us.saturating_add_signed(since(best)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drift_and_offset_are_found_across_the_wrap() {
        let mut clock = Clock::default();
        assert_eq!(clock.fit(), None);
        // The device's clock is 40 ppm fast and at first 1 s before its wrap; round trips take 300
        // µs or more.
        for i in 0..1_000u64 {
            let host_us = 10_000 * i;
            let device = (u32::MAX - 999_999).wrapping_add((host_us + host_us / 25_000) as u32);
            let half = 150 + i % 7;
            let middle = host_us + 1_000;
            let device_us = clock.unwrap_stamp(middle + half, Micros::new(device));
            clock.add_exchange(middle - half, middle + half, device_us);
        }
        let fit = clock.fit().unwrap();
        assert_eq!((fit.exchanges, fit.round_trip_us), (1_000, 300));
        assert_eq!(fit.offset_us, u32::MAX - 999_999 - 1_000);
        assert!((fit.drift_ppm.unwrap() - 40.0).abs() < 0.05, "{fit:?}");
        assert!(fit.residual_us < 0.5, "{fit:?}");
    }

    #[test]
    fn the_shortest_round_trip_decides() {
        let mut clock = Clock::default();
        assert_eq!(clock.device_at(0), None);
        clock.add_exchange(1_000, 3_000, u32::MAX.into());
        assert_eq!(clock.device_at(2_010), Some((1 << 32) + 9));
        clock.add_exchange(10_000, 10_200, 8_000);
        clock.add_exchange(20_000, 29_000, 50_000);
        assert_eq!(clock.device_at(10_100), Some(8_000));
    }

    /// Checks that stamps of a device that boots up to `boot_us` before or after its wrap become
    /// the right time, at all distances up to a day and after silence of hours.
    #[test]
    fn stamps_become_the_time_they_were_taken_at() {
        const DAY_US: u64 = 86_400_000_000;
        for boot_us in [0, 7, (1 << 31) + 5, (1 << 32) - 60_000_000, (1 << 32) - 1] {
            for step_us in [
                10_000,
                999_999,
                2_200_000_000,
                4_400_000_000,
                7 * (1 << 32) + 11,
            ] {
                let (mut clock, mut host_us) = (Clock::default(), 0);
                while host_us < DAY_US.min(step_us * 5_000) {
                    // The device's quartz is 100 ppm fast.
                    let device_us = boot_us + host_us + host_us / 10_000;
                    assert_eq!(clock.unwrap_stamp(host_us, stamp(device_us)), device_us);
                    // An earlier stamp may arrive later.
                    let before_us = device_us.saturating_sub(2_500).max(boot_us);
                    assert_eq!(
                        clock.unwrap_stamp(host_us + 20, stamp(before_us)),
                        before_us
                    );
                    host_us += step_us;
                }
            }
        }
        // A simulated world's time is that of its device, also if it starts beyond the wrap.
        let mut clock = Clock::default();
        assert_eq!(
            clock.unwrap_stamp((1 << 32) + 900, Micros::new(700)),
            (1 << 32) + 700
        );
    }
}
