//! An estimate of device time from the answers' time stamps.

use firmware::units::{Micros, us};

/// Device time against host time. The exchange with the shortest round trip
/// since the last refresh decides.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clock {
    best: Option<Exchange>,
    line: Option<Line>,
}

/// A straight line through all exchanges: device time less host time, over host
/// time.
#[derive(Clone, Copy, Debug, Default)]
struct Line {
    first: Exchange,
    shortest_us: u64,
    /// Device less host at the last exchange, µs modulo 2^32.
    last: u32,
    /// The same, less what it was at first, µs, not wrapped.
    gained_us: i64,
    count: f64,
    mean_s: f64,
    mean_us: f64,
    /// Sums of squares and products of what differs from the means.
    ss: f64,
    su: f64,
    uu: f64,
}

/// What a [`Clock`] says of a whole session.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Fit {
    /// Exchanges.
    pub exchanges: u64,
    /// Shortest round trip, µs.
    pub round_trip_us: u64,
    /// Device time less host time at the first exchange, µs modulo 2^32.
    pub offset_us: u32,
    /// Rate of the device's clock less the host's, parts per million; `None` for
    /// exchanges within less than a second.
    pub drift_ppm: Option<f64>,
    /// Root mean square of what the line leaves, µs.
    pub residual_us: f64,
}

impl Line {
    fn new(first: Exchange) -> Self {
        Self {
            first,
            shortest_us: first.round_trip_us,
            last: first.difference(),
            ..Self::default()
        }
    }

    /// Welford's update: the sums stay exact enough for days.
    fn add(&mut self, exchange: Exchange) {
        // Wrapping on purpose: between two exchanges little is gained or lost.
        let step = exchange.difference().wrapping_sub(self.last) as i32;
        self.last = exchange.difference();
        self.gained_us += i64::from(step);
        self.shortest_us = self.shortest_us.min(exchange.round_trip_us);
        let seconds = exchange.host_us.saturating_sub(self.first.host_us) as f64 * 1e-6;
        let gained = self.gained_us as f64;
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
        // µs gained per second is parts per million.
        let drift_ppm = spans_a_second.then(|| self.su / self.ss);
        let explained = drift_ppm.map_or(0.0, |drift| drift * self.su);
        Fit {
            exchanges: self.count as u64,
            round_trip_us: self.shortest_us,
            offset_us: self.first.difference(),
            drift_ppm,
            residual_us: ((self.uu - explained).max(0.0) / self.count).sqrt(),
        }
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Exchange {
    round_trip_us: u64,
    host_us: u64,
    device: Micros,
}

impl Exchange {
    /// Device time less host time, µs modulo 2^32.
    fn difference(&self) -> u32 {
        self.device.get().wrapping_sub(self.host_us as u32)
    }
}

/// A better exchange is forgotten after this long, so that drift is followed.
const KEEP_US: u64 = 10_000_000;

impl Clock {
    /// A request sent at `sent_us` was answered by `received_us` and stamped
    /// `device` in between.
    pub fn observe(&mut self, sent_us: u64, received_us: u64, device: Micros) {
        let round_trip_us = received_us.saturating_sub(sent_us);
        let exchange = Exchange {
            round_trip_us,
            host_us: sent_us + round_trip_us / 2,
            device,
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

    /// A straight line through all exchanges; `None` before the first.
    #[must_use]
    pub fn fit(&self) -> Option<Fit> {
        self.line.as_ref().map(Line::fit)
    }

    /// Device time at host time `host_us`; `None` before the first answer.
    #[must_use]
    pub fn device_at(&self, host_us: u64) -> Option<Micros> {
        // Wrapping on purpose: device time is modulo 2^32.
        self.best
            .map(|best| best.device + us(host_us.wrapping_sub(best.host_us) as u32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drift_and_offset_are_found_across_the_wrap() {
        let mut clock = Clock::default();
        assert_eq!(clock.fit(), None);
        // 40 ppm fast, 1 s before its wrap at first; round trips of 300 µs and more.
        for i in 0..1_000u64 {
            let host_us = 10_000 * i;
            let device = (u32::MAX - 999_999).wrapping_add((host_us + host_us / 25_000) as u32);
            let half = 150 + i % 7;
            let middle = host_us + 1_000;
            clock.observe(middle - half, middle + half, Micros::new(device));
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
        clock.observe(1_000, 3_000, Micros::new(u32::MAX));
        assert_eq!(clock.device_at(2_010), Some(Micros::new(9)));
        clock.observe(10_000, 10_200, Micros::new(8_000));
        clock.observe(20_000, 29_000, Micros::new(50_000));
        assert_eq!(clock.device_at(10_100), Some(Micros::new(8_000)));
    }
}
