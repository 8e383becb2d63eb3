//! Placement of labels beside their points, away from other labels, marks and lines.

use super::At;

/// Rectangle that a label occupies: left, top, right and bottom, pixels.
pub(super) type Box4 = [f64; 4];

/// Parts of a panel that are occupied, so that further labels avoid them.
#[derive(Default)]
pub(super) struct OccupiedSpace {
    labels: Vec<Box4>,
    marks: Vec<Box4>,
    lines: Vec<(At, At)>,
}

/// Costs of a position for a label, for each label that it overlaps, for leaving the panel, for
/// each mark and for each line that it overlaps. The position with the lowest sum is chosen.
const COSTS: [f64; 4] = [1000.0, 400.0, 60.0, 25.0];

impl OccupiedSpace {
    pub(super) fn add_mark(&mut self, (x, y): At, radius: f64) {
        self.marks
            .push([x - radius, y - radius, x + radius, y + radius]);
    }

    pub(super) fn add_line(&mut self, points: &[At]) {
        self.lines
            .extend(points.windows(2).map(|pair| (pair[0], pair[1])));
    }

    pub(super) fn add_label(&mut self, label: Box4) {
        self.labels.push(label);
    }

    /// Finds the best of many positions around a point for a label of size (`wide`, `high`), and
    /// marks its space as occupied. Returns the left end of the label, at half its height.
    pub(super) fn place_label(&mut self, (x, y): At, (wide, high): At, bounds: Box4) -> At {
        let mut best = (f64::MAX, (x, y));
        for (ring, distance) in [9.0, 18.0, 30.0, 46.0, 66.0, 90.0].into_iter().enumerate() {
            for n in 0..16u32 {
                let angle = f64::from(n) * std::f64::consts::TAU / 16.0;
                let (dx, dy) = (libm::cos(angle), libm::sin(angle));
                let left = x + dx * distance - wide * (0.5 - dx * 0.5);
                let middle = y + dy * (distance + high * 0.3);
                let label = [left, middle - high / 2.0, left + wide, middle + high / 2.0];
                // A label beside its point reads best; the cost grows with the distance.
                let cost = self.cost(label, bounds) + 5.0 * ring as f64 + 2.0 * dy.abs();
                if cost < best.0 {
                    best = (cost, (left, middle));
                }
            }
        }
        let (left, middle) = best.1;
        self.add_label([left, middle - high / 2.0, left + wide, middle + high / 2.0]);
        best.1
    }

    fn cost(&self, label: Box4, bounds: Box4) -> f64 {
        let hits = |boxes: &[Box4]| boxes.iter().filter(|other| overlap(label, **other)).count();
        let leaves = label[0] < bounds[0]
            || label[1] < bounds[1]
            || label[2] > bounds[2]
            || label[3] > bounds[3];
        let lines = self.lines.iter().filter(|line| crosses(label, **line));
        let counts = [
            hits(&self.labels),
            usize::from(leaves),
            hits(&self.marks),
            lines.count(),
        ];
        let costs = COSTS.iter().zip(counts);
        costs.map(|(cost, count)| cost * count as f64).sum()
    }
}

fn overlap(a: Box4, b: Box4) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// Returns whether a line crosses the rectangle of a label. It tests points of the line that are at
/// most 4 pixels apart.
fn crosses(label: Box4, (from, to): (At, At)) -> bool {
    let length = libm::hypot(to.0 - from.0, to.1 - from.1);
    let steps = (length / 4.0).ceil().max(1.0) as u32;
    (0..=steps).any(|n| {
        let part = f64::from(n) / f64::from(steps);
        let (x, y) = (
            from.0 + (to.0 - from.0) * part,
            from.1 + (to.1 - from.1) * part,
        );
        overlap(label, [x, y, x, y])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_one_point_stand_side_by_side_within_their_panel() {
        let mut taken = OccupiedSpace::default();
        taken.add_mark((50.0, 50.0), 4.0);
        let bounds = [0.0, 0.0, 200.0, 100.0];
        let placed: Vec<At> = (0..4)
            .map(|_| taken.place_label((50.0, 50.0), (60.0, 14.0), bounds))
            .collect();
        for (n, (x, y)) in placed.iter().enumerate() {
            assert!(*x >= 0.0 && x + 60.0 <= 200.0 && (7.0..=93.0).contains(y));
            for (ox, oy) in &placed[..n] {
                assert!((x - ox).abs() >= 60.0 || (y - oy).abs() >= 14.0);
            }
        }
    }
}
