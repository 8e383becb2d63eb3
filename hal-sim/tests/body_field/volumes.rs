//! Fat and muscle under a pad, solved by finite volumes, without image charges or Fourier
//! integrals.
//!
//! The grid covers a quarter of the tissue, x and y from zero. Planes of symmetry replace the rest:
//! across one of them the pad's mirror image draws the same current, so that the potential is zero
//! there; across the other lies the other half of the pad.

use hal_sim::body::hand::field::{Pad, Shape, Tissue};

/// Boundary condition far from the pad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Border {
    /// No current passes.
    Insulated,
    /// The potential is zero.
    Grounded,
}

/// Boundaries of the cells in one direction, from zero on, m.
#[derive(Debug, Clone)]
pub struct Edges(Vec<f64>);

/// Potentials of the cells of a solved quarter, V.
pub struct Solved {
    edges: [Edges; 3],
    pub potentials: Vec<f64>,
    /// Mean potential at the skin under the pad.
    pub under_pad: f64,
}

impl Edges {
    /// Creates a whole number of cells of size `step` up to `even` m, then cells that grow by the
    /// factor `growth` until `end` is passed.
    pub fn graded(step: f64, even: f64, growth: f64, end: f64) -> Self {
        let count = (even / step).round() as usize;
        let mut edges: Vec<f64> = (0..=count).map(|i| i as f64 * step).collect();
        let mut wide = step;
        while edges[edges.len() - 1] < end {
            wide *= growth;
            edges.push(edges[edges.len() - 1] + wide);
        }
        Self(edges)
    }

    pub fn cells(&self) -> usize {
        self.0.len() - 1
    }

    pub fn width(&self, i: usize) -> f64 {
        self.0[i + 1] - self.0[i]
    }

    pub fn middle(&self, i: usize) -> f64 {
        0.5 * (self.0[i + 1] + self.0[i])
    }
}

impl Solved {
    fn cell(&self, [i, j, k]: [usize; 3]) -> usize {
        let [x, y, _] = &self.edges;
        (k * y.cells() + j) * x.cells() + i
    }

    pub fn edges(&self) -> &[Edges; 3] {
        &self.edges
    }

    /// Returns the potential of a cell and its first and second derivative by x, from the parabola
    /// through the cell and its two neighbours.
    pub fn along(&self, [i, j, k]: [usize; 3]) -> [f64; 3] {
        let near = [i - 1, i, i + 1];
        let v = near.map(|i| self.potentials[self.cell([i, j, k])]);
        let x = near.map(|i| self.edges[0].middle(i));
        let (before, after) = (x[1] - x[0], x[2] - x[1]);
        let (left, right) = ((v[1] - v[0]) / before, (v[2] - v[1]) / after);
        let slope = (left * after + right * before) / (before + after);
        [v[1], slope, 2.0 * (right - left) / (before + after)]
    }
}

/// Linear system with one row per cell: the diagonal, and the conductances to the preceding
/// neighbours in x, y and z.
struct System {
    strides: [usize; 3],
    own: Vec<f64>,
    before: [Vec<f64>; 3],
    current: Vec<f64>,
}

/// Solves for one ampere into `pad`, whose mirror image lies across zero of the axis `mirror` (0
/// for x, 1 for y) and whose centre is at zero of the other axis. `far` is the boundary condition
/// at the ends and below.
pub fn solve(tissue: &Tissue, pad: &Pad, edges: [Edges; 3], mirror: usize, far: Border) -> Solved {
    let covered = covered(pad, &edges);
    let system = system(tissue, &edges, mirror, far, &covered);
    let potentials = system.solve();
    let top = edges[2].middle(0);
    let layer = edges[0].cells() * edges[1].cells();
    let total: f64 = covered.iter().sum();
    // The skin is half a cell above the centre of the first cell; in between the current flows
    // straight down.
    let drop = top / (tissue.fat_s_per_m * pad.area_m2());
    let under = (0..layer).map(|i| covered[i] / total * potentials[i]);
    let under_pad = under.sum::<f64>() + drop;
    Solved {
        edges,
        potentials,
        under_pad,
    }
}

/// Returns the area of each skin cell that lies under the pad, m².
fn covered(pad: &Pad, edges: &[Edges; 3]) -> Vec<f64> {
    const PARTS: usize = 20;
    let is_under = |x: f64, y: f64| match pad.shape {
        Shape::Round { diameter_m } => x.hypot(y) < 0.5 * diameter_m,
        Shape::Rectangle { along_m, around_m } => {
            x.abs() < 0.5 * along_m && y.abs() < 0.5 * around_m
        }
    };
    let [x, y, _] = edges;
    let part = |edges: &Edges, i: usize, p: usize| {
        edges.0[i] + edges.width(i) * (p as f64 + 0.5) / PARTS as f64
    };
    let mut covered = Vec::new();
    for j in 0..y.cells() {
        for i in 0..x.cells() {
            let inside = (0..PARTS * PARTS).filter(|p| {
                let dx = part(x, i, p % PARTS) - pad.x_m;
                is_under(dx, part(y, j, p / PARTS) - pad.y_m)
            });
            let share = inside.count() as f64 / (PARTS * PARTS) as f64;
            covered.push(share * x.width(i) * y.width(j));
        }
    }
    covered
}

fn system(
    tissue: &Tissue,
    edges: &[Edges; 3],
    mirror: usize,
    far: Border,
    covered: &[f64],
) -> System {
    let counts = [0, 1, 2].map(|axis: usize| edges[axis].cells());
    let strides = [1, counts[0], counts[0] * counts[1]];
    let cells = counts[0] * counts[1] * counts[2];
    // The plane of symmetry through the pad leaves half of its ampere in this quarter.
    let total: f64 = covered.iter().sum();
    let mut current: Vec<f64> = covered.iter().map(|value| 0.5 * value / total).collect();
    current.resize(cells, 0.0);
    let (mut own, mut before) = (vec![0.0; cells], [0, 1, 2].map(|_| vec![0.0; cells]));
    for (cell, axis) in (0..cells).flat_map(|cell| [0, 1, 2].map(|axis| (cell, axis))) {
        let place = [0, 1, 2].map(|axis: usize| cell / strides[axis] % counts[axis]);
        let resistance = half(tissue, edges, place, axis);
        if place[axis] > 0 {
            let mut other = place;
            other[axis] -= 1;
            let g = 1.0 / (resistance + half(tissue, edges, other, axis));
            before[axis][cell] = g;
            own[cell] += g;
            own[cell - strides[axis]] += g;
        } else if axis == mirror {
            own[cell] += 1.0 / resistance;
        }
        if place[axis] + 1 == counts[axis] && far == Border::Grounded {
            own[cell] += 1.0 / resistance;
        }
    }
    System {
        strides,
        own,
        before,
        current,
    }
}

/// Returns the resistance from the centre of a cell to its boundary along an axis, Ω.
fn half(tissue: &Tissue, edges: &[Edges; 3], place: [usize; 3], axis: usize) -> f64 {
    let widths = [0, 1, 2].map(|axis: usize| edges[axis].width(place[axis]));
    let area: f64 = widths.iter().product::<f64>() / widths[axis];
    let in_fat = edges[2].middle(place[2]) < tissue.fat_m;
    let s_per_m = match (in_fat, axis) {
        (true, _) => tissue.fat_s_per_m,
        (false, 0) => tissue.along_s_per_m,
        (false, _) => tissue.across_s_per_m,
    };
    0.5 * widths[axis] / (s_per_m * area)
}

impl System {
    /// Solves the system by conjugate gradients with an incomplete Cholesky preconditioner, to
    /// 1e-9.
    fn solve(&self) -> Vec<f64> {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let pivots = self.pivots();
        let mut x = vec![0.0; self.own.len()];
        let mut rest = self.current.clone();
        let mut step = self.preconditioned(&rest, &pivots);
        let mut size = dot(&rest, &step);
        let end = size * 1e-18;
        while size > end {
            let image = self.times(&step);
            let far = size / dot(&step, &image);
            for i in 0..x.len() {
                x[i] += far * step[i];
                rest[i] -= far * image[i];
            }
            let next = self.preconditioned(&rest, &pivots);
            let new = dot(&rest, &next);
            for (step, next) in step.iter_mut().zip(&next) {
                *step = next + new / size * *step;
            }
            size = new;
        }
        x
    }

    fn times(&self, v: &[f64]) -> Vec<f64> {
        let mut out: Vec<f64> = self.own.iter().zip(v).map(|(a, b)| a * b).collect();
        for (stride, before) in self.strides.iter().zip(&self.before) {
            for i in *stride..v.len() {
                out[i] -= before[i] * v[i - stride];
                out[i - stride] -= before[i] * v[i];
            }
        }
        out
    }

    /// Returns the pivots of the modified incomplete factorisation, which moves most of the dropped
    /// fill-in to the diagonal.
    fn pivots(&self) -> Vec<f64> {
        const KEPT: f64 = 0.97;
        let mut pivots = self.own.clone();
        for i in 0..pivots.len() {
            let neighbours = self.strides.iter().zip(&self.before);
            // Conductances to the following neighbours, all divided by this pivot.
            let behind = neighbours.map(|(stride, before)| before.get(i + stride).unwrap_or(&0.0));
            let behind: f64 = behind.sum();
            for (stride, before) in self.strides.iter().zip(&self.before) {
                if let Some(g) = before.get(i + stride) {
                    pivots[i + stride] -= g * (g + KEPT * (behind - g)) / pivots[i];
                }
            }
        }
        pivots
    }

    fn preconditioned(&self, v: &[f64], pivots: &[f64]) -> Vec<f64> {
        let mut out = v.to_vec();
        for i in 0..v.len() {
            for (stride, before) in self.strides.iter().zip(&self.before) {
                if i >= *stride {
                    out[i] += before[i] * out[i - stride];
                }
            }
            out[i] /= pivots[i];
        }
        for i in (0..v.len()).rev() {
            for (stride, before) in self.strides.iter().zip(&self.before) {
                if i + stride < v.len() {
                    out[i] += before[i + stride] * out[i + stride] / pivots[i];
                }
            }
        }
        out
    }
}
