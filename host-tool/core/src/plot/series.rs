//! Reduces long signals to a number of points that can be drawn, without losing a peak.

pub use crate::statistics::range;

/// Time and value of a signal.
pub type Point = (f64, f64);

/// Time between two points from which a signal is interrupted, s, because nothing was recorded in
/// between.
const GAP_S: f64 = 0.5;

/// Reduces a signal to at most two points for each of `buckets` groups of consecutive points: those
/// with the smallest and the largest value, in their order. Splits the signal where nothing was
/// recorded, and leaves out values that are not finite.
///
/// The iterator runs over the points twice, and at most one group is in memory.
pub fn shorten(points: impl Iterator<Item = Point> + Clone, buckets: usize) -> Vec<Vec<Point>> {
    let points = points.filter(|(t, value)| t.is_finite() && value.is_finite());
    let mut short = ShortenedSeries::new(points.clone().count(), buckets);
    points.for_each(|point| short.push(point));
    short.finish()
}

/// Reduces `N` signals as [`shorten`] does. Each item of the iterator has one point of each signal;
/// `None` if the signal has none there. The iterator runs twice, however many signals there are.
pub fn shorten_together<const N: usize>(
    rows: impl Iterator<Item = [Option<Point>; N]> + Clone,
    buckets: usize,
) -> [Vec<Vec<Point>>; N] {
    let is_finite = |(t, value): Point| t.is_finite() && value.is_finite();
    let mut counts = [0; N];
    for row in rows.clone() {
        for (count, point) in counts.iter_mut().zip(row) {
            *count += usize::from(point.is_some_and(is_finite));
        }
    }
    let mut short = counts.map(|count| ShortenedSeries::new(count, buckets));
    for row in rows {
        for (short, point) in short.iter_mut().zip(row) {
            point.into_iter().for_each(|point| short.push(point));
        }
    }
    short.map(ShortenedSeries::finish)
}

/// Signal that is reduced as by [`shorten`] while its points arrive one by one.
#[derive(Clone, Debug)]
pub struct ShortenedSeries {
    per_bucket: usize,
    parts: Vec<Vec<Point>>,
    part: Vec<Point>,
    bucket: Vec<Point>,
}

impl ShortenedSeries {
    /// Returns an empty signal that will receive `points` points and reduces them to `buckets`
    /// groups.
    #[must_use]
    pub fn new(points: usize, buckets: usize) -> Self {
        Self {
            per_bucket: points.div_ceil(buckets.max(1)).max(2),
            parts: Vec::new(),
            part: Vec::new(),
            bucket: Vec::new(),
        }
    }

    /// Adds the next point, unless it is not finite.
    pub fn push(&mut self, point: Point) {
        if !(point.0.is_finite() && point.1.is_finite()) {
            return;
        }
        let last: Option<&Point> = self.bucket.last();
        let is_gap = last.is_some_and(|last| point.0 - last.0 > GAP_S);
        if is_gap || self.bucket.len() == self.per_bucket {
            self.part.extend(extremes(&self.bucket));
            self.bucket.clear();
        }
        if is_gap {
            self.parts.push(std::mem::take(&mut self.part));
        }
        self.bucket.push(point);
    }

    /// Returns the parts of the reduced signal, split where nothing was recorded.
    #[must_use]
    pub fn finish(mut self) -> Vec<Vec<Point>> {
        self.part.extend(extremes(&self.bucket));
        self.parts.push(self.part);
        self.parts.retain(|part| !part.is_empty());
        self.parts
    }
}

/// Returns the points with the smallest and the largest value, the earlier one first; only one
/// point if they are the same.
fn extremes(points: &[Point]) -> impl Iterator<Item = Point> {
    let by_value = |a: &&Point, b: &&Point| a.1.total_cmp(&b.1);
    let low = points.iter().min_by(by_value).copied();
    let high = points.iter().max_by(by_value).copied();
    let ordered = low.zip(high).map(|(low, high)| {
        let is_high_first = high.0.total_cmp(&low.0).is_lt();
        let ends = if is_high_first {
            (high, low)
        } else {
            (low, high)
        };
        [Some(ends.0), Some(ends.1).filter(|_| low != high)]
    });
    ordered.into_iter().flatten().flatten()
}

/// Returns a step of 1, 2 or 5 times a power of ten that divides `span` into at most `parts` steps.
pub fn round_step(span: f64, parts: f64) -> f64 {
    let rough = (span / parts).max(1e-9);
    let decade = libm::pow(10f64, libm::log10(rough).floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * decade);
    steps
        .into_iter()
        .find(|step| *step >= rough * (1.0 - 1e-9))
        .unwrap_or(10.0 * decade)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shortening_keeps_every_peak_and_the_gap() {
        let signal = (0..10_000).map(|i| {
            let t = f64::from(i) * 0.01 + if i >= 5000 { 10.0 } else { 0.0 };
            (
                t,
                if i == 1234 {
                    9.0
                } else if i == 8765 {
                    -7.0
                } else {
                    0.0
                },
            )
        });
        let parts = shorten(signal, 100);
        assert_eq!(parts.len(), 2);
        assert!(parts.concat().len() <= 200);
        let low_high = range(parts.concat().iter().map(|point| point.1));
        assert_eq!(low_high, Some((-7.0, 9.0)));
        assert!(parts[0].contains(&(12.34, 9.0)));
    }

    #[test]
    fn steps_are_round() {
        assert_eq!(round_step(30.0, 8.0), 5.0);
        assert_eq!(round_step(2800.0, 10.0), 500.0);
        assert_eq!(round_step(1.0, 5.0), 0.2);
    }
}
