//! Range of deviations under the clock that makes it smallest.
//!
//! The clock of the analyser is unknown, so a board is within a range if there is one straight
//! clock under which all of its edges are. A fitted clock would not do: it reduces the mean of the
//! deviations instead of their range, and would reject boards that are within it.

/// Number of steps of the search: each reduces the interval of slopes to 62 %, so that these reach
/// the resolution of the numbers.
const STEPS: usize = 80;

/// Reduction of the interval per step of a golden-section search.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Smallest range of deviations, with the edges at its ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    /// Latest less earliest deviation, nanoseconds.
    pub width: f64,
    /// Index of the earliest edge.
    pub earliest: usize,
    /// Index of the latest edge.
    pub latest: usize,
}

/// Returns the smallest range over all straight clocks of points of time and deviation. `None`
/// without points.
pub(super) fn smallest_range(points: &[(f64, f64)]) -> Option<Range> {
    let first = points.iter().fold(f64::INFINITY, |a, p| a.min(p.0));
    let last = points.iter().fold(f64::NEG_INFINITY, |a, p| a.max(p.0));
    let middle = (first + last) / 2.0;
    let half = ((last - first) / 2.0).max(1.0);
    let at = |slope: f64| range_at(points, |(x, y)| y - slope * (x - middle) / half);
    // The range is a convex function of the slope. A slope beyond the range at 0 makes the range
    // of the first and the last edge larger than that.
    let bound = at(0.0)?.width;
    let (mut low, mut high) = (-bound, bound);
    for _ in 0..STEPS {
        let step = GOLDEN * (high - low);
        let (left, right) = (high - step, low + step);
        if at(left)?.width <= at(right)?.width {
            high = right;
        } else {
            low = left;
        }
    }
    at((low + high) / 2.0)
}

fn range_at(points: &[(f64, f64)], deviation: impl Fn((f64, f64)) -> f64) -> Option<Range> {
    let mut ends: Option<((f64, usize), (f64, usize))> = None;
    for (index, &point) in points.iter().enumerate() {
        let now = (deviation(point), index);
        let (least, most) = ends.unwrap_or((now, now));
        ends = Some((
            if now.0 < least.0 { now } else { least },
            if now.0 > most.0 { now } else { most },
        ));
    }
    ends.map(|((least, earliest), (most, latest))| Range {
        width: most - least,
        earliest,
        latest,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_error_does_not_widen_the_range() {
        let points: Vec<(f64, f64)> = (0..101)
            .map(|n| {
                let x = f64::from(n) * 1e6;
                (5e9 + x, 3e-5 * x + f64::from(n * 37 % 101) - 50.0)
            })
            .collect();
        let range = smallest_range(&points).unwrap_or(Range {
            width: 0.0,
            earliest: 0,
            latest: 0,
        });
        assert!((99.0..=100.0).contains(&range.width), "{range:?}");
        assert!(smallest_range(&[]).is_none());
        let one = smallest_range(&[(1.0, 7.0)]).map(|range| range.width);
        assert_eq!(one, Some(0.0));
    }

    #[test]
    fn half_of_the_edges_late_is_the_whole_range() {
        // Least squares would tilt the clock and see more than 100 ns.
        let points: Vec<(f64, f64)> = (0..100)
            .map(|n| (f64::from(n), if n < 50 { 0.0 } else { 100.0 }))
            .collect();
        let range = smallest_range(&points).map_or(0.0, |range| range.width);
        assert!((90.0..=100.0).contains(&range), "{range}");
    }
}
