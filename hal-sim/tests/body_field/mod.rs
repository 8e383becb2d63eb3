//! The field under pads, compared with exact solutions for simpler tissues.

mod settings;
mod volumes;

use hal_sim::body::hand::field::{Field, InvalidPad, InvalidTissue, Pad, Shape, Tissue};
use std::f64::consts::PI;

const DISC: Shape = Shape::Round { diameter_m: 0.025 };
const SMALL: Shape = Shape::Rectangle {
    along_m: 0.02,
    around_m: 0.015,
};
const LARGE: Shape = Shape::Rectangle {
    along_m: 0.04,
    around_m: 0.09,
};
/// Pad so small that it acts as a point: at 4 mm its size changes 1/r by less than 1e-8.
const POINT: Shape = Shape::Round { diameter_m: 1e-6 };

const fn pad(x_m: f64, y_m: f64, shape: Shape) -> Pad {
    Pad { x_m, y_m, shape }
}

/// Returns places beside and below a pad at the origin, at a depth of `top` m or more.
fn places(top: f64) -> Vec<[f64; 3]> {
    let mut places = Vec::new();
    for x in [0.0, 0.007, -0.012] {
        for y in [0.0, -0.004, 0.01] {
            places.extend([0.0, 1e-3, 8e-3, 3e-2].map(|below| [x, y, top + below]));
        }
    }
    places
}

fn length(v: [f64; 3]) -> f64 {
    v.map(|v| v * v).iter().sum::<f64>().sqrt()
}

/// Returns evenly distributed points of a pad, relative to its centre.
fn points(shape: Shape, count: u32) -> Vec<[f64; 2]> {
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(count);
    let pairs = (0..count * count).map(|n| [at(n / count), at(n % count)]);
    let place = |[a, b]: [f64; 2]| match shape {
        Shape::Round { diameter_m } => {
            let (sin, cos) = (2.0 * PI * b).sin_cos();
            let radius = 0.5 * diameter_m * a.sqrt();
            [radius * cos, radius * sin]
        }
        Shape::Rectangle { along_m, around_m } => [(a - 0.5) * along_m, (b - 0.5) * around_m],
    };
    pairs.map(place).collect()
}

/// Returns the derivative of the potential with depth at a place, from three values at distances of
/// `step`.
fn onward(field: &Field, pad: &Pad, [x, y, z]: [f64; 3], step: f64) -> f64 {
    let v = [0.0, 1.0, 2.0].map(|n| field.transfer(pad, [x, y, z + n * step]).potential);
    (4.0 * v[1] - 3.0 * v[0] - v[2]) / (2.0 * step)
}

#[test]
fn potential_and_current_go_on_from_fat_to_muscle() {
    let tissue = Tissue::default();
    let field = Field::new(tissue).unwrap();
    let h = tissue.fat_m;
    for shape in [POINT, DISC, SMALL, LARGE] {
        let pad = pad(0.002, 0.001, shape);
        for [x, y, _] in places(h) {
            let [above, below] = [h * (1.0 - 1e-12), h].map(|z| field.transfer(&pad, [x, y, z]));
            assert!((above.potential / below.potential - 1.0).abs() < 1e-5);
            let largest = length([above.gradient, above.across[0], above.across[1]]);
            assert!((above.across[0] - below.across[0]).abs() < 1e-5 * largest);
            assert!((above.gradient - below.gradient).abs() < 1e-5 * largest);
            let step = 1e-5;
            let slopes = [
                onward(&field, &pad, [x, y, h * (1.0 - 1e-12)], -step),
                onward(&field, &pad, [x, y, h], step),
            ];
            let [fat, muscle] = [tissue.fat_s_per_m, tissue.across_s_per_m];
            assert!((fat * slopes[0] - muscle * slopes[1]).abs() < 1e-4 * fat * largest);
        }
    }
}

#[test]
fn current_enters_under_the_pad_and_nowhere_else() {
    let tissue = Tissue::default();
    let field = Field::new(tissue).unwrap();
    for shape in [DISC, SMALL] {
        let pad = pad(0.0, 0.0, shape);
        let density = |x: f64, y: f64| {
            let step = 2e-4;
            let v = [1.0, 2.0, 3.0, 4.0].map(|n| field.transfer(&pad, [x, y, n * step]).potential);
            // Derivative at the skin, from a parabola through three depths.
            let slope = (8.0 * v[1] - 5.0 * v[0] - 3.0 * v[2]) / (2.0 * step);
            -tissue.fat_s_per_m * slope * pad.area_m2()
        };
        for (x, y) in [(0.0, 0.0), (0.005, 0.002), (-0.003, 0.004)] {
            assert!((density(x, y) - 1.0).abs() < 1e-3);
        }
        for (x, y) in [(0.018, 0.0), (0.003, 0.017), (-0.04, 0.01)] {
            assert!(density(x, y).abs() < 1e-3);
        }
    }
}

/// Returns the first and second derivative of the potential along an axis, by fourth-order
/// differences.
fn derivatives(field: &Field, pad: &Pad, at: [f64; 3], axis: usize) -> [f64; 2] {
    let step = 3e-4;
    let v = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|n| {
        let mut at = at;
        at[axis] += n * step;
        field.transfer(pad, at).potential
    });
    let first = (8.0 * (v[3] - v[1]) - (v[4] - v[0])) / (12.0 * step);
    let second = 16.0 * (v[3] + v[1]) - (v[4] + v[0]) - 30.0 * v[2];
    [first, second / (12.0 * step * step)]
}

#[test]
fn no_current_is_lost_and_slopes_are_those_of_the_potential() {
    let tissue = Tissue::default();
    let field = Field::new(tissue).unwrap();
    let in_fat = [[0.02, 0.01, 2e-3], [0.0, 0.0, 3e-3]];
    for (shape, at) in [DISC, SMALL, LARGE].into_iter().flat_map(|shape| {
        let positions = places(5e-3).into_iter().chain(in_fat);
        positions.map(move |at| (shape, at))
    }) {
        let pad = pad(0.002, 0.001, shape);
        let here = field.transfer(&pad, at);
        let differences = [0, 1, 2].map(|axis| derivatives(&field, &pad, at, axis));
        let slopes = [here.gradient, here.across[0], here.across[1]];
        for (slope, [difference, _]) in slopes.into_iter().zip(differences) {
            assert!(
                (slope - difference).abs() < 1e-3 * length(slopes),
                "{pad:?} {at:?}"
            );
        }
        let bends = differences.map(|difference| difference[1]);
        let largest = bends.map(f64::abs).into_iter().fold(0.0, f64::max);
        assert!(
            (here.curvature - bends[0]).abs() < 1e-3 * largest,
            "{pad:?} {at:?}"
        );
        let along = if at[2] < tissue.fat_m {
            1.0
        } else {
            tissue.along_s_per_m / tissue.across_s_per_m
        };
        let lost = along * bends[0] + bends[1] + bends[2];
        assert!(
            lost.abs() < 1e-3 * largest,
            "{pad:?} {at:?} {lost} {largest}"
        );
    }
}

#[test]
fn an_even_tissue_resists_a_disc_as_is_known() {
    // 8/(3π²·s·a) for the mean potential.
    let tissue = Tissue {
        fat_s_per_m: 0.2,
        along_s_per_m: 0.2,
        across_s_per_m: 0.2,
        ..Tissue::default()
    };
    let field = Field::new(tissue).unwrap();
    let disc = pad(0.01, 0.02, DISC);
    let known = 8.0 / (3.0 * PI * PI * 0.2 * 0.0125);
    assert!((field.resistance(&disc, &disc) / known - 1.0).abs() < 1e-5);
}

#[test]
fn resistance_is_the_mean_potential_under_either_pad() {
    let field = Field::new(Tissue::default()).unwrap();
    for (a, b) in [(DISC, SMALL), (SMALL, SMALL), (LARGE, DISC), (DISC, DISC)] {
        let [a, b] = [pad(-0.03, 0.01, a), pad(0.025, -0.005, b)];
        let known = field.resistance(&a, &b);
        assert!((field.resistance(&b, &a) / known - 1.0).abs() < 1e-9);
        for (from, to) in [(&a, &b), (&b, &a)] {
            let points = points(to.shape, 20);
            // Beside a pad the potential hardly varies over so small a depth.
            let at = |[x, y]: &[f64; 2]| [to.x_m + x, to.y_m + y, 2e-4];
            let potentials = points
                .iter()
                .map(|point| field.transfer(from, at(point)).potential);
            let mean = potentials.sum::<f64>() / points.len() as f64;
            assert!(
                (mean / known - 1.0).abs() < 5e-4,
                "{a:?} {b:?} {mean} {known}"
            );
        }
    }
}

#[test]
fn pads_overlap_where_both_are() {
    let cases = [
        (DISC, DISC, [0.0249, 0.0], true),
        (DISC, DISC, [0.0251, 0.0], false),
        (DISC, DISC, [0.018, 0.018], false),
        (DISC, DISC, [0.017, 0.017], true),
        (SMALL, SMALL, [0.0199, 0.0149], true),
        (SMALL, SMALL, [0.0199, 0.0151], false),
        (SMALL, SMALL, [0.0201, 0.0], false),
        (SMALL, SMALL, [0.02, 0.0], false),
        (LARGE, SMALL, [0.0299, 0.0524], true),
        (LARGE, SMALL, [0.0, 0.0526], false),
        (LARGE, DISC, [0.0324, 0.045], true),
        (LARGE, DISC, [0.0326, 0.0], false),
        // Beyond a corner: in neither direction by more than the disc's radius.
        (LARGE, DISC, [0.029, 0.054], false),
        (LARGE, DISC, [0.028, 0.053], true),
        (LARGE, POINT, [0.0, 0.0], true),
    ];
    for (a, b, [x, y], overlap) in cases {
        let [a, b] = [pad(0.1, -0.2, a), pad(0.1 + x, -0.2 - y, b)];
        assert_eq!(
            [a.overlaps(&b), b.overlaps(&a)],
            [overlap; 2],
            "{a:?} {b:?}"
        );
    }
    assert!((pad(1.0, 1.0, DISC).area_m2() - PI * 0.0125 * 0.0125).abs() < 1e-12);
    assert!((pad(1.0, 1.0, LARGE).area_m2() - 0.0036).abs() < 1e-12);
}

#[test]
fn a_number_out_of_range_is_named() {
    let usual = Tissue::default();
    assert_eq!(usual.validate(), Ok(()));
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        #[rustfmt::skip]
        let tissues = [
            (Tissue { fat_m: bad, ..usual }, "fat_m"),
            (Tissue { fat_s_per_m: bad, ..usual }, "fat_s_per_m"),
            (Tissue { along_s_per_m: bad, ..usual }, "along_s_per_m"),
            (Tissue { across_s_per_m: bad, ..usual }, "across_s_per_m"),
        ];
        for (tissue, field) in tissues {
            assert_eq!(Field::new(tissue).map(drop), Err(InvalidTissue(field)));
        }
        let round = Shape::Round { diameter_m: bad };
        assert_eq!(
            pad(0.0, 0.0, round).validate(),
            Err(InvalidPad("diameter_m"))
        );
        let [along, around] = [(bad, 0.01), (0.01, bad)]
            .map(|(along_m, around_m)| Shape::Rectangle { along_m, around_m });
        assert_eq!(pad(0.0, 0.0, along).validate(), Err(InvalidPad("along_m")));
        assert_eq!(
            pad(0.0, 0.0, around).validate(),
            Err(InvalidPad("around_m"))
        );
    }
    let contrast = Tissue {
        across_s_per_m: 1e-3,
        ..usual
    };
    assert_eq!(contrast.validate(), Err(InvalidTissue("across_s_per_m")));
    let fat = Tissue {
        fat_s_per_m: 0.9,
        ..usual
    };
    assert_eq!(fat.validate(), Err(InvalidTissue("fat_s_per_m")));
    assert_eq!(pad(f64::NAN, 0.0, DISC).validate(), Err(InvalidPad("x_m")));
    assert_eq!(pad(0.0, f64::NAN, DISC).validate(), Err(InvalidPad("y_m")));
}
