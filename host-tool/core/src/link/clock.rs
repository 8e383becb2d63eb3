//! Extends device time to 64 bits, and estimates it from the answers' time stamps.

use firmware::units::Micros;

/// Relation of device time to host time. The exchange with the shortest round trip since the last
/// refresh determines it.
///
/// A device stamps with 32 bits, which wrap after 71.6 minutes. Here, and nowhere else on the host,
/// a stamp becomes microseconds in 64 bits that do not wrap; everything beyond the link counts with
/// these.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clock {
    best: Option<Exchange>,
    line: Option<Line>,
    /// Arrival of the last stamp in host time, and its device time in 64 bits, µs.
    last: Option<(u64, u64)>,
}

/// Returns the stamp of `device_us` as the device knows it: its lower 32 bits.
#[must_use]
pub const fn stamp(device_us: u64) -> Micros {
    Micros::new(device_us as u32)
}

/// Straight line through all exchanges: device time minus host time, as a function of host time.
#[derive(Clone, Copy, Debug, Default)]
struct Line {
    first: Exchange,
    shortest_us: u64,
    count: f64,
    mean_s: f64,
    mean_us: f64,
    /// Running sums of squares and products of the deviations from the means.
    ss: f64,
    su: f64,
    uu: f64,
}

/// Fit of a [`Clock`] over a whole session.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Fit {
    /// Number of request and answer pairs in the fit.
    pub exchanges: u64,
    /// Shortest round trip, µs.
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

    /// Adds an exchange with Welford's update, which keeps the sums exact enough for days.
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

/// Time after which a better exchange is forgotten, so that the estimate follows drift, µs.
const KEEP_US: u64 = 10_000_000;

impl Clock {
    /// Returns the 64-bit time, µs, of a stamp that arrived at `host_us`. Of all times with these
    /// lower 32 bits, it is the time nearest to where the device must be by the host's clock,
    /// however long the device was silent. The first stamp becomes the time nearest to host time,
    /// so that a simulated device's time is that of its world. The result is never less than 0.
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

    /// Adds an exchange: a request sent at `sent_us`, answered by `received_us`, and stamped
    /// `device_us` in between.
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

    /// Returns the straight line through all exchanges; `None` before the first.
    #[must_use]
    pub fn fit(&self) -> Option<Fit> {
        self.line.as_ref().map(Line::fit)
    }

    /// Returns the device time at host time `host_us`, µs; `None` before the first answer.
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
