//! The directions to sum over, and what each does to a wave.

use super::tissue::Tissue;
use std::f64::consts::PI;

/// Images at the end of each direction's that stand for all that follow (Euler's
/// transformation of their alternating sum, to this many differences).
const DIFFERENCES: usize = 4;

/// Directions per half turn: these, doubled over and over.
const FEWEST: [usize; 4] = [16, 20, 24, 28];

/// How finely to sum.
#[derive(Debug, Clone, Copy)]
pub(super) struct Resolution {
    /// The midpoint rule's error falls as exp(−this).
    pub exponent: f64,
    /// What the images left out are to the first, at most.
    pub images: f64,
    /// How often the fewest directions may be doubled.
    pub doublings: u32,
}

/// A direction in the skin's plane.
#[derive(Debug, Clone)]
pub(super) struct Direction {
    pub cos: f64,
    pub sin: f64,
    /// Decay in muscle over that in fat ([`Tissue::decay`]).
    pub decay: f64,
    /// [`Tissue::reflection`].
    pub reflection: f64,
    /// Of each image; Σ weight·f(n) is Σ reflectionⁿ·f(n) over all n.
    pub weights: Vec<f64>,
}

/// Sets of directions, each finer than the one before.
#[derive(Debug, Clone)]
pub(super) struct Directions {
    sets: Vec<Vec<Direction>>,
    exponent: f64,
    /// Along over across.
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

    /// Enough directions for a potential at `muscle_m` of muscle below a depth of
    /// `fat_m` (counted from its nearest image) and `across_m` to the side of its
    /// farthest source; the finest set where none is enough.
    ///
    /// The integrand is periodic, so the midpoint rule with N nodes errs by
    /// exp(−2·N·d), d the distance from the real axis to its first singularity.
    /// Those are poles where w = s − i·u is zero: sinh d = s / distance for an
    /// isotropic tissue; and the root of the decay, tan² θ = −contrast.
    pub fn sufficient_directions(&self, fat_m: f64, muscle_m: f64, across_m: f64) -> &[Direction] {
        let slowest = self.contrast.sqrt().min(1.0);
        let bend = (self.contrast - 1.0).abs().sqrt() * muscle_m;
        let pole = ((fat_m + slowest * muscle_m) / across_m.hypot(bend)).asinh();
        let contrast = self.contrast.min(1.0 / self.contrast);
        let root = contrast.sqrt().atanh();
        let count = 0.5 * self.exponent / pole.min(root);
        let enough = |set: &&Vec<Direction>| set.len() as f64 >= count;
        let set = self.sets.iter().find(enough).or(self.sets.last());
        set.map_or(&[], Vec::as_slice)
    }
}

fn direction(tissue: &Tissue, angle: f64, images: usize) -> Direction {
    let (sin, cos) = angle.sin_cos();
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

/// How many images, for what is left out to be below `tolerance` of the first: for
/// f(n) = 1/(2n + 1), the slowest there is, Euler's transformation from n on leaves
/// out about rⁿ/(1 − r)·(r/(1 − r))^j times f's j-th difference.
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
        // (E − 1)^order by binomial coefficients, from E^order down.
        let mut binomial = 1.0;
        for i in 0..=order {
            tail[order - i] += factor * binomial;
            binomial *= -((order - i) as f64) / (i + 1) as f64;
        }
        factor *= reflection / (1.0 - reflection);
    }
    weights
}
