//! Current profile of a pad along one direction, as a plane wave meets it.
//!
//! Projected on a direction, the uniform current of a pad is a density over the distance t from its
//! middle: half an ellipse for a disc, the convolution of two boxes for a rectangle. The mean of
//! 1/(w + i·t) over that density has a closed form for both, so that no points have to be summed
//! over a pad.

use super::pad::Shape;
use num_complex::Complex64;

const I: Complex64 = Complex64::new(0.0, 1.0);

/// Distance, in half-widths of a rectangle, beyond which moments up to the eighth replace the exact
/// formula: the error is below 1e-5, and below 1e-7 for the potential.
const FAR: f64 = 4.0;

/// Density of a pad's current over the distance from its middle along one direction.
#[derive(Debug, Clone, Copy)]
pub(super) enum Profile {
    /// Profile of a disc: half an ellipse.
    Disc {
        /// Radius of the disc, m.
        radius: f64,
    },
    /// Profile of a rectangle: the convolution of two boxes.
    Boxes {
        /// Half the width of each box, m.
        half: [f64; 2],
    },
}

impl Profile {
    /// Computes the profile of `shape` along the direction (`cos`, `sin`).
    pub fn new(shape: Shape, cos: f64, sin: f64) -> Self {
        match shape {
            Shape::Round { diameter_m } => Self::Disc {
                radius: 0.5 * diameter_m,
            },
            Shape::Rectangle { along_m, around_m } => Self::Boxes {
                half: [0.5 * along_m * cos.abs(), 0.5 * around_m * sin.abs()],
            },
        }
    }

    /// Returns the mean of 1/(w + i·t) and its first two derivatives with respect to w, for Re w >
    /// 0.
    #[inline]
    pub fn means(&self, w: Complex64) -> [Complex64; 3] {
        match *self {
            Self::Disc { radius } => disc(w, radius),
            Self::Boxes { half } => boxes(w, half),
        }
    }

    /// Returns the real part of the mean of 1/(w + i·(t + t′)) over the profiles of two pads, Re w
    /// > 0.
    pub fn mean_with(&self, other: &Self, w: Complex64) -> f64 {
        match (*self, *other) {
            (Self::Boxes { half: a }, Self::Boxes { half: b }) => four_boxes(w, [a, b]),
            (Self::Disc { radius }, other) | (other, Self::Disc { radius }) => {
                let mean = |(t, weight): (f64, f64)| weight * other.means(w + I * t)[0].re;
                chords(radius, w.re).map(mean).sum()
            }
        }
    }
}

/// Returns the nodes and weights of the Gauss-Chebyshev rule (second kind) for the mean over half
/// an ellipse of a function that varies over the distance `scale`.
fn chords(radius: f64, scale: f64) -> impl Iterator<Item = (f64, f64)> {
    let count = (8.0 + 4.0 * radius / scale).min(256.0).floor();
    let place = move |j: u32| {
        let (sin, cos) = libm::sincos(std::f64::consts::PI * f64::from(j) / (count + 1.0));
        (radius * cos, 2.0 / (count + 1.0) * sin * sin)
    };
    (1..=count as u32).map(place)
}

/// Returns 2/(w + √(w² + a²)), the Stieltjes transform of Wigner's semicircle, and its first two
/// derivatives.
#[inline]
fn disc(w: Complex64, radius: f64) -> [Complex64; 3] {
    let root = right_root(w * w + radius * radius);
    let inverse = root.inv();
    let mean = 2.0 * (w + root).inv();
    [mean, -mean * inverse, 2.0 * inverse * inverse * inverse]
}

/// Returns the square root with a real part of zero or more.
#[inline]
fn right_root(v: Complex64) -> Complex64 {
    let long = (0.5 * (v.norm_sqr().sqrt() + v.re.abs())).sqrt();
    let short = 0.5 * v.im / long;
    if v.re >= 0.0 {
        Complex64::new(long, short)
    } else {
        Complex64::new(short.abs(), long.copysign(v.im))
    }
}

/// Returns [`Profile::means`] for a rectangle by the exact formula: the second differences of v·ln
/// v, ln v and 1/v, divided by −4·a·b.
#[inline]
fn boxes(w: Complex64, [a, b]: [f64; 2]) -> [Complex64; 3] {
    let (wide, narrow) = (a + b, a - b);
    if w.norm_sqr() > (FAR * wide).powi(2) {
        return far_boxes(w, [a, b]);
    }
    let [outer, inner] = [wide, narrow].map(|t| [w + I * t, w - I * t]);
    let difference = |[over, under]: [Complex64; 2]| ln(over * under.conj() / under.norm_sqr());
    let product = |[over, under]: [Complex64; 2]| over * under;
    let logs = ln(product(outer) / product(inner));
    let spread = wide * difference(outer) - narrow * difference(inner);
    let scale = -0.25 / (a * b);
    let inverse = 2.0 * w * (product(outer).inv() - product(inner).inv());
    [
        scale * (w * logs + I * spread),
        scale * logs,
        scale * inverse,
    ]
}

/// Returns [`Profile::means`] for a rectangle if |w| is large, from its even moments: Σ (−1)^j m₂ⱼ
/// / w^(2j+1).
#[inline]
fn far_boxes(w: Complex64, half: [f64; 2]) -> [Complex64; 3] {
    let [a, b] = half.map(|h| h * h);
    let second = (a + b) / 3.0;
    let fourth = (a * a + b * b) / 5.0 + a * b * (2.0 / 3.0);
    let sixth = (a * a * a + b * b * b) / 7.0 + a * b * (a + b);
    let (squares, product) = (a * a + b * b, a * b);
    let powers = squares * squares - 2.0 * product * product;
    let eighth = powers / 9.0 + product * (4.0 / 3.0 * squares + 2.8 * product);
    let inverse = w.inv();
    let square = inverse * inverse;
    let series = |[c2, c4, c6, c8]: [f64; 4]| {
        let high = c6 * sixth - square * (c8 * eighth);
        1.0 - square * (c2 * second - square * (c4 * fourth - square * high))
    };
    [
        inverse * series([1.0; 4]),
        -square * series([3.0, 5.0, 7.0, 9.0]),
        2.0 * inverse * square * series([6.0, 15.0, 28.0, 45.0]),
    ]
}

/// Returns [`Profile::mean_with`] for two rectangles: the real part of the fourth difference of
/// v³·ln v / 6, divided by 16 times the product of the half-widths.
fn four_boxes(w: Complex64, pads: [[f64; 2]; 2]) -> f64 {
    let [[a, b], [c, d]] = pads;
    let sum: f64 = (0..16u32)
        .map(|signs| {
            let sign = |i: u32| if signs >> i & 1 == 0 { 1.0 } else { -1.0 };
            let v = w + I * (sign(0) * a + sign(1) * b + sign(2) * c + sign(3) * d);
            sign(0) * sign(1) * sign(2) * sign(3) * (v * v * v * ln(v)).re
        })
        .sum();
    sum / (96.0 * a * b * c * d)
}

/// Returns the principal logarithm. For a ratio of two numbers with a positive real part, the angle
/// stays within ±π.
#[inline]
fn ln(v: Complex64) -> Complex64 {
    Complex64::new(0.5 * libm::log(v.norm_sqr()), libm::atan2(v.im, v.re))
}
