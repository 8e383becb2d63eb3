//! Compares the sums with finer ones, and the closed forms with plain averages.

mod exact;

use super::*;

const FINE: Resolution = Resolution {
    exponent: 2.0 * RESOLUTION.exponent,
    images: 1e-12,
    doublings: RESOLUTION.doublings + 2,
};

const SHAPES: [Shape; 3] = [
    Shape::Round { diameter_m: 0.025 },
    Shape::Rectangle {
        along_m: 0.02,
        around_m: 0.015,
    },
    Shape::Rectangle {
        along_m: 0.04,
        around_m: 0.09,
    },
];

/// Returns both sums for thin, usual and thick fat.
fn pairs() -> [[Field; 2]; 3] {
    [2e-3, 4e-3, 8e-3].map(|fat_m| {
        let tissue = Tissue {
            fat_m,
            ..Tissue::default()
        };
        [RESOLUTION, FINE].map(|resolution| Field::with_resolution(tissue, resolution).unwrap())
    })
}

fn pad(shape: Shape) -> Pad {
    Pad {
        x_m: 0.01,
        y_m: -0.005,
        shape,
    }
}

/// Returns the largest errors at one depth: of the potential relative to itself, of the slopes
/// relative to the length of their vector, of the curvature relative to the largest at that depth.
fn errors([usual, fine]: &[Field; 2], shape: Shape, depth: f64) -> [f64; 3] {
    let (mut worst, mut largest) = ([0.0f64; 3], 0.0f64);
    let pad = pad(shape);
    for distance in [0.0, 0.003, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3] {
        for (sin, cos) in [0.0f64, 0.4, 0.8, 1.2, 1.57].map(libm::sincos) {
            let at = [pad.x_m + distance * cos, pad.y_m + distance * sin, depth];
            let [coarse, exact] = [usual, fine].map(|field| field.transfer(&pad, at));
            let slopes = |t: &Transfer| [t.gradient, t.across[0], t.across[1]];
            let length = slopes(&exact).map(|v| v * v).iter().sum::<f64>().sqrt();
            let off = slopes(&coarse).into_iter().zip(slopes(&exact));
            let off = off.map(|(a, b)| (a - b).abs() / length).fold(0.0, f64::max);
            worst[0] = worst[0].max((coarse.potential / exact.potential - 1.0).abs());
            worst[1] = worst[1].max(off);
            worst[2] = worst[2].max((coarse.curvature - exact.curvature).abs());
            largest = largest.max(exact.curvature.abs());
        }
    }
    worst[2] /= largest;
    worst
}

#[test]
fn twice_the_directions_and_more_images_change_nothing() {
    for fields in pairs() {
        let fat = fields[0].tissue().fat_m;
        for shape in SHAPES {
            for below in [0.0, 1e-3, 3e-3, 1e-2, 3e-2] {
                let errors = errors(&fields, shape, fat + below);
                assert!(
                    errors.iter().all(|error| *error < 1e-5),
                    "{fat} {shape:?} {below} {errors:?}"
                );
            }
        }
    }
}

#[test]
fn nor_do_they_for_tissues_at_the_ends_of_their_ranges() {
    let usual = Tissue::default();
    let [across, fat] = [usual.across_s_per_m, usual.fat_s_per_m];
    for (fat_s_per_m, along_s_per_m) in [
        (9.9 * across, usual.along_s_per_m),
        (1e-6, usual.along_s_per_m),
        (fat, 99.0 * across),
        (0.99 * across, 0.0101 * across),
    ] {
        let tissue = Tissue {
            fat_s_per_m,
            along_s_per_m,
            ..usual
        };
        let fields = [RESOLUTION, FINE]
            .map(|resolution| Field::with_resolution(tissue, resolution).unwrap());
        for below in [0.0, 3e-3, 3e-2] {
            let errors = errors(&fields, SHAPES[0], tissue.fat_m + below);
            assert!(
                errors.iter().all(|error| *error < 1e-4),
                "{tissue:?} {below} {errors:?}"
            );
        }
    }
}

#[test]
fn twice_the_directions_and_more_images_keep_resistances() {
    for [usual, fine] in pairs() {
        for (a, b) in SHAPES.iter().flat_map(|a| SHAPES.map(|b| (*a, b))) {
            for x_m in [0.0, 0.04, 0.1, 0.25] {
                let [a, b] = [Pad { x_m, ..pad(a) }, Pad { x_m: 0.0, ..pad(b) }];
                let [coarse, exact] = [&usual, &fine].map(|field| field.resistance(&a, &b));
                assert!(
                    (coarse / exact - 1.0).abs() < 1e-5,
                    "{a:?} {b:?} {coarse} {exact}"
                );
            }
        }
    }
}

/// Errors are relative to the largest value at that depth, from 1 mm below the fat on.
#[test]
fn the_coarse_sums_are_within_a_hundredth() {
    for [_, fine] in pairs() {
        let coarse = Field::coarse(*fine.tissue()).unwrap();
        for shape in SHAPES {
            for below_fat_m in [0.001, 0.004, 0.012] {
                let depth = fine.tissue().fat_m + below_fat_m;
                let (mut worst, mut largest) = ([0.0f64; 5], [0.0f64; 5]);
                for x in 0..12 {
                    for y in 0..8 {
                        let at = [0.01 * f64::from(x), 0.008 * f64::from(y), depth];
                        let components = |field: &Field| {
                            let transfer = field.transfer(&pad(shape), at);
                            let [dy, dz] = transfer.across;
                            [
                                transfer.potential,
                                transfer.gradient,
                                transfer.curvature,
                                dy,
                                dz,
                            ]
                        };
                        let (values, exact) = (components(&coarse), components(&fine));
                        for n in 0..5 {
                            worst[n] = worst[n].max((values[n] - exact[n]).abs());
                            largest[n] = largest[n].max(exact[n].abs());
                        }
                    }
                }
                for n in 0..5 {
                    let part = worst[n] / largest[n];
                    assert!(part < 0.01, "{n}: {part}, {shape:?}, {below_fat_m} m");
                }
            }
        }
    }
}

/// Returns nodes and weights for a plain mean over a profile.
fn plain(profile: &Profile) -> Vec<(f64, f64)> {
    match *profile {
        Profile::Disc { radius } => {
            let at = |j: u32| {
                let (sin, cos) = libm::sincos(PI * f64::from(j) / 2000.0);
                (radius * cos, sin * sin / 1000.0)
            };
            (0..2000).map(at).collect()
        }
        Profile::Boxes { half } => {
            let nodes = surface::gauss(60);
            let pair = |&(a, u): &(f64, f64)| {
                let product = move |&(b, v): &(f64, f64)| (half[0] * a + half[1] * b, 0.25 * u * v);
                nodes.iter().map(product).collect::<Vec<_>>()
            };
            nodes.iter().flat_map(pair).collect()
        }
    }
}

/// Returns the profiles of all pads, including directions as close to a side as any that is used.
fn profiles() -> Vec<Profile> {
    let angles = [2e-3f64, 0.3, 1.0, 1.568];
    let shape_profiles =
        |shape| angles.map(|angle| Profile::new(shape, libm::cos(angle), libm::sin(angle)));
    SHAPES.into_iter().flat_map(shape_profiles).collect()
}

const PLACES: [(f64, f64); 6] = [
    (0.012, 0.0),
    (0.012, 0.03),
    (0.02, -0.01),
    (0.03, 0.08),
    (0.03, 0.25),
    (0.2, 0.01),
];

#[test]
fn a_profiles_means_are_those_over_its_points() {
    for profile in profiles() {
        for w in PLACES.map(|(s, u)| Complex64::new(s, -u)) {
            let mut means = [Complex64::default(); 3];
            for (t, weight) in plain(&profile) {
                let inverse = (w + Complex64::new(0.0, t)).inv();
                means[0] += weight * inverse;
                means[1] -= weight * inverse * inverse;
                means[2] += 2.0 * weight * inverse * inverse * inverse;
            }
            for (mean, closed) in means.into_iter().zip(profile.means(w)) {
                let error = (closed - mean).norm() / mean.norm();
                assert!(error < 1e-5, "{profile:?} {w} {error}");
            }
        }
    }
}

#[test]
fn the_mean_over_two_profiles_is_that_over_their_points() {
    let with = |a: Profile| profiles().into_iter().map(move |b| (a, b));
    for (a, b) in profiles().into_iter().flat_map(with) {
        for w in PLACES.map(|(s, u)| Complex64::new(s, -u)) {
            let to = |(t, weight): (f64, f64)| weight * a.means(w + Complex64::new(0.0, t))[0].re;
            let mean: f64 = plain(&b).into_iter().map(to).sum();
            let error = (a.mean_with(&b, w) / mean - 1.0).abs();
            // Fourth differences lose digits if the direction is almost parallel to a side of both
            // pads, which holds for few of the directions.
            assert!(error < 1e-4, "{a:?} {b:?} {w} {error}");
        }
    }
}

#[test]
fn a_disc_and_a_square_have_their_known_mean_inverse_distance() {
    let [disc, square] = [
        Shape::Round { diameter_m: 2.0 },
        Shape::Rectangle {
            along_m: 1.0,
            around_m: 1.0,
        },
    ]
    .map(|shape| Pad {
        x_m: 0.3,
        y_m: 0.1,
        shape,
    });
    // For the disc with itself 16/(3π·a), which gives a mean potential of 8/(3π²·s·a); for the
    // square 4/a·(ln(1 + √2) − (√2 − 1)/3).
    let root = 2.0f64.sqrt();
    let known = [
        16.0 / (3.0 * PI),
        4.0 * (libm::log(1.0 + root) - (root - 1.0) / 3.0),
    ];
    for (pad, known) in [disc, square].iter().zip(known) {
        let error = surface::mean_inverse_distance(pad, pad) / known - 1.0;
        assert!(error.abs() < 1e-5, "{pad:?} {error}");
    }
    assert!((surface::inverse_distance(disc.shape, 0.0, 0.0) - 2.0).abs() < 1e-12);
    let sides = surface::inverse_distance(disc.shape, 0.0, 1.0 - 1e-9)
        - surface::inverse_distance(disc.shape, 0.0, 1.0 + 1e-9);
    assert!(sides.abs() < 1e-6);
}

#[test]
fn mean_inverse_distances_are_the_same_both_ways() {
    for (a, b) in SHAPES.iter().flat_map(|a| SHAPES.map(|b| (*a, b))) {
        // The closest two pads touch: half of 40 mm each.
        for [x_m, y_m] in [[0.04, 0.0], [0.035, 0.05], [0.0, 0.2]] {
            let [a, b] =
                [(a, x_m, y_m), (b, 0.0, 0.0)].map(|(shape, x_m, y_m)| Pad { x_m, y_m, shape });
            let ways = [(&a, &b), (&b, &a)].map(|(a, b)| surface::mean_inverse_distance(a, b));
            assert!(
                (ways[0] / ways[1] - 1.0).abs() < 1e-6,
                "{a:?} {b:?} {ways:?}"
            );
        }
    }
}
