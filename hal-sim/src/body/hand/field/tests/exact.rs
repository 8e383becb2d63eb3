//! Compares the finer sum with tissues whose field has an exact formula.

use super::super::{Field, Pad, Shape, Tissue, Transfer};
use super::FINE;
use std::f64::consts::PI;

/// Approximates a point: the effect of its size on 1/r at 3 mm is below 1e-7.
const POINT: Shape = Shape::Round { diameter_m: 1e-6 };

fn even(fat_m: f64, s_per_m: f64) -> Tissue {
    Tissue {
        fat_m,
        fat_s_per_m: s_per_m,
        along_s_per_m: s_per_m,
        across_s_per_m: s_per_m,
    }
}

/// Returns scale / √(x²/a + y²/b + z²/b) and its derivatives.
fn inverse([x, y, z]: [f64; 3], [a, b]: [f64; 2], scale: f64) -> Transfer {
    let square = x * x / a + (y * y + z * z) / b;
    let potential = scale / square.sqrt();
    Transfer {
        potential,
        gradient: -potential * x / a / square,
        curvature: potential * (3.0 * x * x / a / square - 1.0) / (a * square),
        across: [y, z].map(|v| -potential * v / b / square),
    }
}

fn sum(transfers: impl Iterator<Item = Transfer>) -> Transfer {
    transfers.fold(Transfer::default(), |sum, transfer| Transfer {
        potential: sum.potential + transfer.potential,
        gradient: sum.gradient + transfer.gradient,
        curvature: sum.curvature + transfer.curvature,
        across: [0, 1].map(|i: usize| sum.across[i] + transfer.across[i]),
    })
}

/// Returns the largest error: of the potential relative to itself, of the slopes relative to the
/// length of their vector, of the curvature relative to the potential over the squared distance
/// from the pad.
fn error(transfer: &Transfer, exact: &Transfer, distance: f64) -> f64 {
    let slopes = |t: &Transfer| [t.gradient, t.across[0], t.across[1]];
    let length = slopes(exact).map(|v| v * v).iter().sum::<f64>().sqrt();
    let off = slopes(transfer).into_iter().zip(slopes(exact));
    let off = off.map(|(a, b)| (a - b).abs() / length);
    let bend = (transfer.curvature / exact.potential - exact.curvature / exact.potential).abs();
    let own = (transfer.potential / exact.potential - 1.0).abs();
    off.fold(own.max(bend * distance * distance), f64::max)
}

const fn pad(shape: Shape) -> Pad {
    Pad {
        x_m: 0.0,
        y_m: 0.0,
        shape,
    }
}

/// Returns places beside and below a pad at the origin, at a depth of `top` m and more.
fn places(top: f64) -> Vec<[f64; 3]> {
    let mut places = Vec::new();
    for x in [0.0, 0.007, -0.05] {
        for y in [0.0, -0.004, 0.03] {
            places.extend([0.0, 1e-3, 8e-3, 3e-2].map(|below| [x, y, top + below]));
        }
    }
    places
}

fn length(v: [f64; 3]) -> f64 {
    v.map(|v| v * v).iter().sum::<f64>().sqrt()
}

#[test]
fn a_point_on_one_even_tissue_gives_one_over_two_pi_s_r() {
    let field = Field::with_resolution(even(4e-3, 0.2), FINE).unwrap();
    for at in places(4e-3) {
        let exact = inverse(at, [1.0; 2], 1.0 / (2.0 * PI * 0.2));
        let transfer = field.transfer(&pad(POINT), at);
        let error = error(&transfer, &exact, length(at));
        assert!(error < 1e-6, "{at:?} {error}");
    }
}

#[test]
fn a_point_on_muscle_alone_gives_one_over_r_in_scaled_lengths() {
    // Only a nanometre of fat is left.
    let tissue = Tissue {
        fat_m: 1e-9,
        ..Tissue::default()
    };
    let field = Field::with_resolution(tissue, FINE).unwrap();
    let [along, across] = [tissue.along_s_per_m, tissue.across_s_per_m];
    for at in places(5e-3) {
        let scale = 1.0 / (2.0 * PI * across * along.sqrt());
        let exact = inverse(at, [along, across], scale);
        let transfer = field.transfer(&pad(POINT), at);
        let error = error(&transfer, &exact, length(at));
        assert!(error < 1e-6, "{at:?} {error}");
    }
}

#[test]
fn a_point_on_two_even_layers_has_the_known_images() {
    // Fat with a lower conductivity than muscle, then with a higher one.
    for (fat, muscle) in [(0.03, 0.2), (0.3, 0.1)] {
        let tissue = Tissue {
            fat_s_per_m: fat,
            ..even(3e-3, muscle)
        };
        let field = Field::with_resolution(tissue, FINE).unwrap();
        let r = (fat - muscle) / (fat + muscle);
        for [x, y, z] in places(3e-3) {
            let image = |n: i32| {
                let depth = z + 2.0 * f64::from(n) * tissue.fat_m;
                let scale = (1.0 + r) * r.powi(n) / (2.0 * PI * fat);
                inverse([x, y, depth], [1.0; 2], scale)
            };
            let exact = sum((0..100).map(image));
            let transfer = field.transfer(&pad(POINT), [x, y, z]);
            let error = error(&transfer, &exact, length([x, y, z]));
            assert!(error < 1e-6, "{fat} {x} {y} {z} {error}");
        }
    }
}

/// Returns uniformly spread points of a pad, relative to its middle.
fn points(shape: Shape, count: u32) -> Vec<[f64; 2]> {
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(count);
    let pairs = (0..count * count).map(|n| [at(n / count), at(n % count)]);
    let place = |[a, b]: [f64; 2]| match shape {
        Shape::Round { diameter_m } => {
            let (sin, cos) = libm::sincos(2.0 * PI * b);
            let radius = 0.5 * diameter_m * a.sqrt();
            [radius * cos, radius * sin]
        }
        Shape::Rectangle { along_m, around_m } => [(a - 0.5) * along_m, (b - 0.5) * around_m],
    };
    pairs.map(place).collect()
}

#[test]
fn a_pad_is_the_mean_of_its_points() {
    let field = Field::with_resolution(even(4e-3, 0.2), FINE).unwrap();
    for shape in super::SHAPES {
        let points = points(shape, 200);
        for at in places(5e-3) {
            let scale = 1.0 / (2.0 * PI * 0.2 * points.len() as f64);
            let from = |[x, y]: &[f64; 2]| inverse([at[0] - x, at[1] - y, at[2]], [1.0; 2], scale);
            let exact = sum(points.iter().map(from));
            let transfer = field.transfer(&pad(shape), at);
            let error = error(&transfer, &exact, length(at));
            assert!(error < 2e-4, "{shape:?} {at:?} {error}");
        }
    }
}
