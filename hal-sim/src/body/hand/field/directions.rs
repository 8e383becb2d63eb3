//! Directions over which the field is summed, and their effect on a wave.

use super::tissue::Tissue;
use std::f64::consts::PI;

/// Number of images at the end of each direction's series that replace all further ones (Euler's
/// transformation of the alternating sum, up to this order of differences).
const DIFFERENCES: usize = 4;

/// Smallest numbers of directions per half turn; larger sets double them repeatedly.
const FEWEST: [usize; 4] = [16, 20, 24, 28];

/// Accuracy of the sums.
#[derive(Debug, Clone, Copy)]
pub(super) struct Resolution {
    /// Exponent x of the error of the midpoint rule, which falls as exp(−x).
    pub exponent: f64,
    /// Largest ratio of the omitted images to the first.
    pub images: f64,
    /// Largest number of times that the smallest sets of directions are doubled.
    pub doublings: u32,
}

/// A direction in the plane of the skin.
#[derive(Debug, Clone)]
pub(super) struct Direction {
    pub cos: f64,
    pub sin: f64,
    /// Decay in muscle over that in fat ([`Tissue::decay`]).
    pub decay: f64,
    /// Reflection at the boundary, [`Tissue::reflection`].
    pub reflection: f64,
    /// Weight of each image; Σ weight·f(n) approximates Σ reflectionⁿ·f(n) over all n.
    pub weights: Vec<f64>,
}

/// Sets of directions, ordered by the number of directions in them.
#[derive(Debug, Clone)]
pub(super) struct Directions {
    sets: Vec<Vec<Direction>>,
    exponent: f64,
    /// Conductivity of muscle along its fibres, divided by that across them.
    contrast: f64,
}

impl Directions {
    pub fn new(tissue: &Tissue, resolution: Resolution) -> Self {
        let ends = [(1.0, 0.0), (0.0, 1.0)];
        let needed = ends.map(|(cos, sin)| {
            let reflection = tissue.reflection(tissue.decay(cos, sin));
            image_count(reflection, resolution.images)
        });
        let images = needed[0].max(needed[1]);
        let counts = (0..=resolution.doublings).flat_map(|i| FEWEST.map(|count| count << i));
        let set = |count| {
            let at = |j| direction(tissue, PI * (j as f64 + 0.5) / count as f64, images);
            (0..count).map(at).collect()
        };
        Self {
            sets: counts.map(set).collect(),
            exponent: resolution.exponent,
            contrast: tissue.along_s_per_m / tissue.across_s_per_m,
        }
    }

    /// Returns the smallest set of directions that suffices for the potential at a point, or the
    /// finest set if none suffices. The path to the point leads through `fat_m` of fat, counted
    /// from the nearest image, and `muscle_m` of muscle; the farthest source is `across_m` to the
    /// side.
    ///
    /// The integrand is periodic, so the midpoint rule with N nodes has an error of exp(−2·N·d),
    /// where d is the distance from the real axis to the first singularity. The singularities are
    /// the poles at w = s − i·u = 0, with sinh d = s / distance for an isotropic tissue, and the
    /// root of the decay, tan² θ = −contrast.
    pub fn sufficient_directions(&self, fat_m: f64, muscle_m: f64, across_m: f64) -> &[Direction] {
        let slowest = self.contrast.sqrt().min(1.0);
        let bend = (self.contrast - 1.0).abs().sqrt() * muscle_m;
        let pole = libm::asinh((fat_m + slowest * muscle_m) / libm::hypot(across_m, bend));
        let contrast = self.contrast.min(1.0 / self.contrast);
        let root = libm::atanh(contrast.sqrt());
        let count = 0.5 * self.exponent / pole.min(root);
        let enough = |set: &&Vec<Direction>| set.len() as f64 >= count;
        let set = self.sets.iter().find(enough).or(self.sets.last());
        set.map_or(&[], Vec::as_slice)
    }
}

fn direction(tissue: &Tissue, angle: f64, images: usize) -> Direction {
    let (sin, cos) = libm::sincos(angle);
    let decay = tissue.decay(cos, sin);
    let reflection = tissue.reflection(decay);
    Direction {
        cos,
        sin,
        decay,
        reflection,
        weights: weights(reflection, images),
    }
}

/// Returns the number of images for which the omitted ones stay below `tolerance` of the first. For
/// f(n) = 1/(2n + 1), the slowest case, Euler's transformation from n on omits about rⁿ/(1 −
/// r)·(r/(1 − r))^j times the j-th difference of f.
fn image_count(reflection: f64, tolerance: f64) -> usize {
    let ratio = reflection / (1.0 - reflection);
    let left = |n: usize| {
        let falls = (1..=DIFFERENCES + 1).map(|j| ratio * j as f64 / (n as f64 + 0.5 + j as f64));
        let first = reflection.powi(n as i32) / (1.0 - reflection) / (2.0 * n as f64 + 1.0);
        (first * falls.product::<f64>()).abs()
    };
    let mut direct = 1;
    while left(direct) > tolerance {
        direct += 1;
    }
    direct + DIFFERENCES + 1
}

fn weights(reflection: f64, images: usize) -> Vec<f64> {
    let direct = images - DIFFERENCES - 1;
    let mut weights: Vec<f64> = (0..images)
        .map(|n| {
            if n < direct {
                reflection.powi(n as i32)
            } else {
                0.0
            }
        })
        .collect();
    let tail = &mut weights[direct..];
    let mut factor = reflection.powi(direct as i32) / (1.0 - reflection);
    for order in 0..=DIFFERENCES {
        // Binomial expansion of (E − 1)^order, from E^order down.
        let mut binomial = 1.0;
        for i in 0..=order {
            tail[order - i] += factor * binomial;
            binomial *= -((order - i) as f64) / (i + 1) as f64;
        }
        factor *= reflection / (1.0 - reflection);
    }
    weights
}
