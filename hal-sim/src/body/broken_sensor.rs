//! Faults of a joint's angle sensor: the faulty reading as a function of the correct one.

use std::collections::VecDeque;

/// Kind of sensor fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SensorFault {
    /// Every reading repeats the first one after the fault began.
    Stuck,
    /// Every reading is this constant, °.
    Says(f64),
    /// Outlier: readings are off by the first value, °, from the first faulty reading until the
    /// second value, µs, has passed.
    Outlier(f64, u64),
    /// Every reading is off by this constant, °.
    Step(f64),
    /// The error of the readings grows at this rate, °/s.
    Drift(f64),
    /// Readings are delayed by this time, µs; at first the oldest stored reading repeats.
    Delayed(u64),
    /// Readings are mirrored about this angle, °, so that they move in the opposite direction.
    Reversed(f64),
}

/// Angle sensor with a fault. Calls of [`Self::read`] must come with increasing times.
#[derive(Clone, Debug, PartialEq)]
pub struct BrokenSensor {
    fault: SensorFault,
    from_us: u64,
    first: Option<(u64, f64)>,
    said_deg: Option<[f64; 2]>,
    /// Stored readings and their times: those younger than the delay, and the newest that is old
    /// enough.
    earlier: VecDeque<(u64, f64)>,
}

impl BrokenSensor {
    /// Creates a sensor whose fault begins at `from_us`.
    #[must_use]
    pub const fn new(fault: SensorFault, from_us: u64) -> Self {
        Self {
            fault,
            from_us,
            first: None,
            said_deg: None,
            earlier: VecDeque::new(),
        }
    }

    /// Creates a sensor without a fault. It stores all of its readings, so that
    /// [`Self::broken_from`] can derive faulty sensors from it.
    #[must_use]
    pub const fn never_broken() -> Self {
        Self::new(SensorFault::Delayed(u64::MAX), u64::MAX)
    }

    /// Creates a faulty sensor whose past is the readings of this sensor before `at_us`. This
    /// sensor must come from [`Self::never_broken`]. The fault begins at `from_us`, which must not
    /// be earlier than `at_us`.
    #[must_use]
    pub fn broken_from(&self, at_us: u64, fault: SensorFault, from_us: u64) -> Self {
        let mut broken = Self::new(fault, from_us);
        let earlier = self.earlier.iter().take_while(|pair| pair.0 < at_us);
        for &(t_us, deg) in earlier {
            broken.read(t_us, deg);
        }
        broken
    }

    /// Returns the reading at `t_us`, given the correct angle `deg`.
    pub fn read(&mut self, t_us: u64, deg: f64) -> f64 {
        if let SensorFault::Delayed(by_us) = self.fault {
            self.earlier.push_back((t_us, deg));
            while (self.earlier.get(1)).is_some_and(|pair| pair.0.saturating_add(by_us) <= t_us) {
                self.earlier.pop_front();
            }
        }
        if t_us < self.from_us {
            return deg;
        }
        let (first_us, first_deg) = *self.first.get_or_insert((t_us, deg));
        let reading_deg = match self.fault {
            SensorFault::Stuck => first_deg,
            SensorFault::Says(deg) => deg,
            SensorFault::Outlier(off_deg, for_us) if t_us <= first_us + for_us => deg + off_deg,
            SensorFault::Outlier(..) => deg,
            SensorFault::Step(off_deg) => deg + off_deg,
            SensorFault::Drift(deg_per_s) => deg + deg_per_s * (t_us - self.from_us) as f64 * 1e-6,
            SensorFault::Delayed(_) => self.earlier.front().map_or(deg, |pair| pair.1),
            SensorFault::Reversed(about_deg) => 2.0 * about_deg - deg,
        };
        let [low, high] = self.said_deg.unwrap_or([reading_deg; 2]);
        self.said_deg = Some([low.min(reading_deg), high.max(reading_deg)]);
        reading_deg
    }

    /// Returns the smallest and the largest reading since the fault began, °; `None` before.
    #[must_use]
    pub const fn reported_range_deg(&self) -> Option<[f64; 2]> {
        self.said_deg
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns one reading per millisecond of an angle that rises by 1° in each; the fault begins
    /// at 3 ms.
    fn readings(fault: SensorFault) -> [f64; 7] {
        let mut sensor = BrokenSensor::new(fault, 3_000);
        [0u32, 1, 2, 3, 4, 5, 6].map(|ms| sensor.read(u64::from(ms) * 1_000, ms.into()))
    }

    #[test]
    fn each_fault_says_what_it_is_called() {
        for (fault, expected) in [
            (SensorFault::Stuck, [3.0, 3.0, 3.0, 3.0]),
            (SensorFault::Says(-9.0), [-9.0; 4]),
            (SensorFault::Outlier(50.0, 0), [53.0, 4.0, 5.0, 6.0]),
            (SensorFault::Outlier(50.0, 1_000), [53.0, 54.0, 5.0, 6.0]),
            (SensorFault::Step(-10.0), [-7.0, -6.0, -5.0, -4.0]),
            (SensorFault::Drift(2_000.0), [3.0, 6.0, 9.0, 12.0]),
            (SensorFault::Delayed(2_000), [1.0, 2.0, 3.0, 4.0]),
            (SensorFault::Delayed(9_000), [0.0; 4]),
            (SensorFault::Reversed(5.0), [7.0, 6.0, 5.0, 4.0]),
        ] {
            let [a, b, c, broken @ ..] = readings(fault);
            assert_eq!([a, b, c], [0.0, 1.0, 2.0], "{fault:?}");
            assert_eq!(broken, expected, "{fault:?}");
        }
    }

    #[test]
    fn what_a_whole_one_read_is_what_another_read_before_it_broke() {
        let mut intact = BrokenSensor::never_broken();
        let read = |sensor: &mut BrokenSensor, ms: u64| sensor.read(ms * 1_000, ms as f64);
        assert!((0..7).all(|ms| read(&mut intact, ms) == ms as f64));
        assert_eq!(intact.reported_range_deg(), None);
        let fault = SensorFault::Delayed(2_000);
        let mut broken = intact.broken_from(3_000, fault, 4_000);
        let values = [3, 4, 5].map(|ms| read(&mut broken, ms));
        assert_eq!(values, [3.0, 2.0, 3.0]);
    }

    #[test]
    fn the_least_and_the_greatest_count_from_when_it_broke() {
        let mut sensor = BrokenSensor::new(SensorFault::Step(10.0), 2);
        for (t_us, deg) in [(0, -99.0), (1, 99.0)] {
            sensor.read(t_us, deg);
        }
        assert_eq!(sensor.reported_range_deg(), None);
        for (t_us, deg) in [(2, 4.0), (3, 1.0), (4, 7.0)] {
            sensor.read(t_us, deg);
        }
        assert_eq!(sensor.reported_range_deg(), Some([11.0, 17.0]));
    }
}
