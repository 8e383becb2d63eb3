//! The field in muscle, compared with finite volumes.

use super::volumes::{Border, Edges, Solved, solve};
use super::{DISC, SMALL, pad};
use hal_sim::body::hand::field::{Field, Pad, Tissue};

/// Largest errors of potential, gradient and curvature at one depth, each relative to the largest
/// value at that depth, from every other cell within 80 mm of the centre.
struct DepthErrors {
    depth_m: f64,
    errors: [f64; 3],
}

/// `pad` and its mirror image, through which the current returns, on the other side of x = 0 or,
/// with `is_across`, of y = 0.
struct Setting {
    pad: Pad,
    is_across: bool,
    step_m: f64,
    growth: f64,
    end_m: f64,
}

impl Setting {
    fn solve(&self, tissue: &Tissue, far: Border) -> Solved {
        let even = self.pad.x_m.max(self.pad.y_m) + 0.02;
        let long = Edges::graded(self.step_m, even, self.growth, self.end_m);
        let short = Edges::graded(self.step_m, 0.02, self.growth, self.end_m);
        // A whole number of cells in fat, each about 0.6 of a step.
        let deep = tissue.fat_m / (1.6 * tissue.fat_m / self.step_m).round();
        let deep = Edges::graded(deep, 4.0 * tissue.fat_m, self.growth, self.end_m);
        let (edges, mirror) = if self.is_across {
            ([short, long, deep], 1)
        } else {
            ([long, short, deep], 0)
        };
        solve(tissue, &self.pad, edges, mirror, far)
    }

    fn mirror(&self) -> Pad {
        let Pad { x_m, y_m, shape } = self.pad;
        pad(-x_m, -y_m, shape)
    }

    fn compare(&self, field: &Field, solved: &Solved, depth_m: f64) -> DepthErrors {
        let [x, y, z] = solved.edges();
        let near = |edges: &Edges, end: f64| {
            (1..edges.cells())
                .take_while(|i| edges.middle(*i) < end)
                .count()
        };
        let k = near(z, depth_m) + 1;
        let (mut largest, mut errors) = ([0.0f64; 3], [0.0f64; 3]);
        let (along, around) = (near(x, 0.08), near(y, 0.08));
        let every = |i| (0..around).step_by(2).map(move |j| (i, j));
        for (i, j) in (1..along).step_by(2).flat_map(every) {
            let at = [x.middle(i), y.middle(j), z.middle(k)];
            let [forth, back] = [self.pad, self.mirror()].map(|pad| field.transfer(&pad, at));
            let known = [
                forth.potential - back.potential,
                forth.gradient - back.gradient,
                forth.curvature - back.curvature,
            ];
            let found = solved.along([i, j, k]);
            for n in 0..3 {
                largest[n] = largest[n].max(known[n].abs());
                errors[n] = errors[n].max((known[n] - found[n]).abs());
            }
        }
        DepthErrors {
            depth_m: z.middle(k),
            errors: [0, 1, 2].map(|n: usize| errors[n] / largest[n]),
        }
    }

    /// Compares with finite volumes whose far boundaries are insulated and grounded; the exact
    /// solution lies between them.
    fn check(&self, tissue: Tissue, limits: [f64; 3]) {
        let field = Field::new(tissue).unwrap();
        let resistance = |to: &Pad| field.resistance(&self.pad, to);
        let known = resistance(&self.pad) - resistance(&self.mirror());
        for far in [Border::Insulated, Border::Grounded] {
            let solved = self.solve(&tissue, far);
            let error = (solved.under_pad / known - 1.0).abs();
            println!(
                "{} cells, {far:?}: under the pad {error:.1e}",
                solved.potentials.len()
            );
            assert!(error < limits[0], "{far:?} {} {known}", solved.under_pad);
            for depth in [4.5e-3, 7e-3, 1.2e-2, 2.5e-2] {
                let DepthErrors { depth_m, errors } = self.compare(&field, &solved, depth);
                println!("{depth_m:.4} m: {errors:.4?}");
                for (error, limit) in errors.into_iter().zip(limits) {
                    assert!(error < limit, "{far:?} {depth_m} {errors:?}");
                }
            }
        }
    }
}

/// Error limits for coarse cells. They cause an error of curvature of 3 % just below the fat and
/// where cells have grown, and half of that at half the size; the finer test limits it to 2 %.
const COARSE: [f64; 3] = [0.02, 0.02, 0.05];

fn coarse(pad: Pad) -> Setting {
    Setting {
        pad,
        is_across: pad.y_m > pad.x_m,
        step_m: 1.5e-3,
        growth: 1.15,
        end_m: 0.4,
    }
}

#[test]
fn finite_volumes_agree_for_discs_along_the_fibres() {
    coarse(pad(0.024, 0.0, DISC)).check(Tissue::default(), COARSE);
}

#[test]
fn finite_volumes_agree_for_discs_around_the_forearm() {
    coarse(pad(0.0, 0.02, DISC)).check(Tissue::default(), COARSE);
}

/// Cell size whose multiples are 7.5, 10 and 30 mm, the sides of the rectangle.
const ALIGNED_M: f64 = 1.25e-3;

#[test]
fn finite_volumes_agree_for_rectangles() {
    let setting = Setting {
        step_m: ALIGNED_M,
        ..coarse(pad(0.02, 0.0, SMALL))
    };
    setting.check(Tissue::default(), COARSE);
}

#[test]
#[ignore = "a minute: the same in cells of 1 mm and a box of 0.8 m, with curvature"]
fn finer_finite_volumes_agree_in_curvature_too() {
    let cases = [
        (pad(0.024, 0.0, DISC), 1e-3),
        (pad(0.0, 0.02, DISC), 1e-3),
        (pad(0.02, 0.0, SMALL), 0.5 * ALIGNED_M),
    ];
    for (pad, step_m) in cases {
        let fine = Setting {
            step_m,
            growth: 1.1,
            end_m: 0.8,
            ..coarse(pad)
        };
        fine.check(Tissue::default(), [0.02; 3]);
    }
}
