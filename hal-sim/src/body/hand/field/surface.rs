//! Mean of 1/distance for pads on a half-space of uniform, isotropic conductivity.
//!
//! This part of a pad's potential has no depth between the pad and the place where it is evaluated,
//! so the sum over directions does not converge. Within the plane of the skin it has closed forms;
//! a sum over points gives its mean under another pad.

use super::pad::{Pad, Shape};
use std::f64::consts::{PI, TAU};

/// Number of quadrature points per side of a rectangle, and per radius of a disc.
const POINTS: usize = 24;

/// Number of points around a disc, per point of its radius.
const AROUND: usize = 2;

/// Returns the mean of 1/distance between points of `a` and points of `b`, 1/m.
pub(super) fn mean_inverse_distance(a: &Pad, b: &Pad) -> f64 {
    let at = |(weight, [x, y]): (f64, [f64; 2])| {
        weight * inverse_distance(a.shape, b.x_m + x - a.x_m, b.y_m + y - a.y_m)
    };
    points(b.shape).into_iter().map(at).sum()
}

/// Returns quadrature weights, which sum to one, and points relative to the middle of a pad, m, for
/// means of functions that are smooth under it.
fn points(shape: Shape) -> Vec<(f64, [f64; 2])> {
    let nodes = gauss(POINTS);
    let row = |first: &(f64, f64)| {
        let (place, weight) = *first;
        match shape {
            Shape::Round { diameter_m } => {
                let count = AROUND * POINTS;
                let radius = 0.25 * diameter_m * (1.0 + place);
                let weight = 0.5 * weight * (1.0 + place) / count as f64;
                let at = |j| {
                    let (sin, cos) = libm::sincos(TAU * (f64::from(j) + 0.5) / count as f64);
                    (weight, [radius * cos, radius * sin])
                };
                (0..count as u32).map(at).collect::<Vec<_>>()
            }
            Shape::Rectangle { along_m, around_m } => {
                let at = |&(other, factor): &(f64, f64)| {
                    let point = [0.5 * along_m * place, 0.5 * around_m * other];
                    (0.25 * weight * factor, point)
                };
                nodes.iter().map(at).collect()
            }
        }
    };
    nodes.iter().flat_map(row).collect()
}

/// Returns the mean of 1/distance from (`x`, `y`) to the points of a pad about the origin, 1/m.
pub(super) fn inverse_distance(shape: Shape, x: f64, y: f64) -> f64 {
    match shape {
        Shape::Round { diameter_m } => to_disc(0.5 * diameter_m, libm::hypot(x, y)),
        Shape::Rectangle { along_m, around_m } => {
            let [a, b] = [0.5 * along_m, 0.5 * around_m];
            let corner = |sx: f64, sy: f64| sx * sy * to_corner(x + sx * a, y + sy * b);
            let [far, near] = [1.0, -1.0].map(|sx| corner(sx, 1.0) + corner(sx, -1.0));
            (far + near) / (along_m * around_m)
        }
    }
}

/// Returns the mean of 1/distance from a point to a disc in the same plane, 1/m; `distance` is that
/// from the point to the middle of the disc. The elliptic integrals have modulus r/a inside and a/r
/// outside.
fn to_disc(radius: f64, distance: f64) -> f64 {
    let scale = 4.0 / (PI * radius);
    if distance <= radius {
        return scale * elliptic(distance / radius).0;
    }
    let (second, rest) = elliptic(radius / distance);
    scale * distance / radius * (second - rest)
}

/// Returns the complete elliptic integrals of modulus k, 0 to 1: E and (1 − k²)·K, by the
/// arithmetic-geometric mean.
fn elliptic(k: f64) -> (f64, f64) {
    let rest = 1.0 - k * k;
    if rest < 1e-30 {
        return (1.0, 0.0);
    }
    let (mut a, mut b, mut sum, mut power) = (1.0, rest.sqrt(), 0.5 * k * k, 1.0);
    while a - b > 1e-15 * a {
        let half = 0.5 * (a - b);
        sum += power * half * half;
        power *= 2.0;
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    let first = PI / (a + b);
    (first * (1.0 - sum), rest * first)
}

/// Returns a function whose mixed derivative ∂²/∂x∂y is 1/√(x² + y²), so that its values at the
/// corners of a rectangle give the integral over the rectangle.
fn to_corner(x: f64, y: f64) -> f64 {
    let term = |a: f64, b: f64| {
        if a == 0.0 {
            0.0
        } else {
            a * libm::asinh(b / a.abs())
        }
    };
    term(x, y) + term(y, x)
}

/// Returns nodes and weights of the Gauss-Legendre rule on −1 to 1.
pub(super) fn gauss(count: usize) -> Vec<(f64, f64)> {
    let node = |i: usize| {
        let mut x = libm::cos(PI * (i as f64 + 0.75) / (count as f64 + 0.5));
        let mut slope = 0.0;
        // Every Newton step doubles the number of correct digits; six steps suffice.
        for _ in 0..6 {
            let (value, before) = legendre(count, x);
            slope = count as f64 * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..count).map(node).collect()
}

/// Returns the Legendre polynomials of this degree and of the next lower one.
fn legendre(degree: usize, x: f64) -> (f64, f64) {
    let next = |(value, before): (f64, f64), n: usize| {
        let n = n as f64;
        (
            ((2.0 * n + 1.0) * x * value - n * before) / (n + 1.0),
            value,
        )
    };
    (1..degree).fold((x, 1.0), next)
}
