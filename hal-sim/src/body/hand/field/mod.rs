//! Electric potential in fat and muscle below a pad on the skin that carries a current,
//! quasi-static.
//!
//! Let a current density vary over the skin as exp(i·k·u) with u = x·cos θ + y·sin θ. The potential
//! is A·exp(−k·z) + B·exp(k·z) in fat and C·exp(−k·g·(z − h)) in muscle, with
//! g² = (s_l·cos² θ + s_t·sin² θ) / s_t. The given current flows through the skin, −s_f ∂φ/∂z. At
//! the boundary, depth h, φ and the current are continuous: −s_f ∂φ/∂z = −s_t ∂φ/∂z. Then, with
//! r = (s_f − s_t·g) / (s_f + s_t·g), which depends on θ only, B·exp(k·h) = r·A·exp(−k·h) and
//! A = 1 / (s_f·k·(1 − r·exp(−2·k·h))). This geometric series turns the integral over k into a sum
//! of images, each 1/(s − i·u). Per ampere into a point at the origin, taking real parts and θ from
//! 0 to π:
//!
//! - in muscle 1/π² ∫ dθ / (s_f + s_t·g) Σ rⁿ / ((2n+1)·h + g·(z−h) − i·u);
//! - in fat 1/(2π²·s_f) ∫ dθ Σ rⁿ [1/(2n·h + z − i·u) + r/((2n+2)·h − z − i·u)].
//!
//! For the uniform current of a pad, the mean over the pad replaces 1/(s − i·u) (`profile`);
//! derivatives are those of each term. One part has no depth that makes the integral over θ smooth:
//! the mean potential under pads on a half-space of fat (n = 0, z = 0). It is computed in the plane
//! of the skin (`surface`).

mod directions;
mod pad;
mod profile;
mod surface;
#[cfg(test)]
mod tests;
mod tissue;

use directions::{Direction, Directions, Resolution};
use num_complex::Complex64;
pub use pad::{InvalidPad, Pad, Shape};
use profile::Profile;
use std::f64::consts::PI;
pub use tissue::{InvalidTissue, Tissue};

/// Resolution with errors below 1e-5, as the tests of this module measure against a resolution
/// twice as fine.
const RESOLUTION: Resolution = Resolution {
    exponent: 16.0,
    images: 1e-6,
    doublings: 6,
};

/// Resolution for many places and many wearers: errors below a hundredth of the largest value
/// nearby.
const COARSE: Resolution = Resolution {
    exponent: 5.0,
    images: 1e-3,
    doublings: RESOLUTION.doublings,
};

/// Potential and its derivatives at a point, per ampere into a pad.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Transfer {
    /// Potential relative to a distant point, V/A.
    pub potential: f64,
    /// Slope along the fibres, ∂/∂x, V/A/m.
    pub gradient: f64,
    /// Second derivative along the fibres, ∂²/∂x², V/A/m²: the quantity that excites a nerve along
    /// x.
    pub curvature: f64,
    /// Slopes around the forearm and with depth, [∂/∂y, ∂/∂z], V/A/m. At the boundary of fat and
    /// muscle, the slope in muscle.
    pub across: [f64; 2],
}

/// Field solver for one tissue, with the sums prepared.
#[derive(Debug, Clone)]
pub struct Field {
    tissue: Tissue,
    directions: Directions,
}

/// Part of the potential in one direction whose images lie at increasing depth.
struct Wave {
    strength: f64,
    /// Depth of the first image, m; each further image adds 2·h.
    depth: f64,
    /// Derivative of the depth with respect to z.
    slope: f64,
}

impl Field {
    /// Prepares the sums for a tissue, which takes one or two milliseconds.
    ///
    /// # Errors
    /// Returns [`InvalidTissue`] with the field that is out of range.
    pub fn new(tissue: Tissue) -> Result<Self, InvalidTissue> {
        Self::with_resolution(tissue, RESOLUTION)
    }

    /// Prepares less accurate sums that are several times as fast: errors below a hundredth of the
    /// largest value nearby.
    ///
    /// # Errors
    /// Returns [`InvalidTissue`] with the field that is out of range.
    pub fn coarse(tissue: Tissue) -> Result<Self, InvalidTissue> {
        Self::with_resolution(tissue, COARSE)
    }

    fn with_resolution(tissue: Tissue, resolution: Resolution) -> Result<Self, InvalidTissue> {
        tissue.validate()?;
        Ok(Self {
            tissue,
            directions: Directions::new(&tissue, resolution),
        })
    }

    /// Returns the tissue that the solver was created for.
    pub fn tissue(&self) -> &Tissue {
        &self.tissue
    }

    /// Returns the potential and its derivatives at `at_m`, per ampere that enters through `pad`
    /// and leaves at a distant point. The coordinates are x along the fibres, y around the forearm
    /// and z the depth below the skin, m, above zero.
    ///
    /// In muscle, below at least 2 mm of fat and within 0.3 m of the pad, the error is below 1e-5
    /// of the potential, of the length of the slope vector and of the largest curvature at that
    /// depth; 1e-4 at the ends of a tissue's ranges. In fat, errors grow towards the skin: at 1 mm
    /// and 0.3 m to 0.2 % of the slopes.
    pub fn transfer(&self, pad: &Pad, at_m: [f64; 3]) -> Transfer {
        let [x, y, z] = at_m;
        let fat = self.tissue.fat_m;
        let directions = self.directions.sufficient_directions(
            z.min(fat),
            (z - fat).max(0.0),
            pad.farthest_m(x, y),
        );
        let mut sum = Transfer::default();
        for direction in directions {
            let u = (x - pad.x_m) * direction.cos + (y - pad.y_m) * direction.sin;
            let profile = Profile::new(pad.shape, direction.cos, direction.sin);
            for wave in self.waves(direction, z).iter().flatten() {
                self.add(&mut sum, direction, wave, (&profile, u));
            }
        }
        let scale = 1.0 / (PI * directions.len() as f64);
        Transfer {
            potential: scale * sum.potential,
            gradient: scale * sum.gradient,
            curvature: scale * sum.curvature,
            across: sum.across.map(|value| scale * value),
        }
    }

    /// Returns the mean potential under `b` per ampere that enters through `a` and leaves at a
    /// distant point, Ω. The value is symmetric in `a` and `b`; for a pad with itself it is the
    /// spreading resistance. Skin and gel are not included. Errors are below 1e-5 for at least 2 mm
    /// of fat and pads that do not overlap, or are the same.
    pub fn resistance(&self, a: &Pad, b: &Pad) -> f64 {
        // The mean is taken over the smaller pad, because the potential of the larger one varies
        // less.
        let (a, b) = if a.area_m2() < b.area_m2() {
            (b, a)
        } else {
            (a, b)
        };
        let fat = &self.tissue;
        let first = 2.0 * fat.fat_m;
        let across = a.farthest_m(b.x_m, b.y_m) + b.farthest_m(b.x_m, b.y_m);
        let directions = self.directions.sufficient_directions(first, 0.0, across);
        let [x, y] = [b.x_m - a.x_m, b.y_m - a.y_m];
        let images = directions.iter().map(|direction| {
            let [from, to] =
                [a, b].map(|pad| Profile::new(pad.shape, direction.cos, direction.sin));
            let u = x * direction.cos + y * direction.sin;
            let image = |(n, weight): (usize, &f64)| {
                let w = Complex64::new(first * (n + 1) as f64, -u);
                weight * to.mean_with(&from, w)
            };
            direction.reflection * direction.weights.iter().enumerate().map(image).sum::<f64>()
        });
        let images = images.sum::<f64>() / directions.len() as f64;
        (0.5 * surface::mean_inverse_distance(a, b) + images) / (PI * fat.fat_s_per_m)
    }

    /// Returns the waves that reach depth `z`: from the skin and, in fat, from the boundary with
    /// muscle.
    fn waves(&self, direction: &Direction, z: f64) -> [Option<Wave>; 2] {
        let tissue = &self.tissue;
        let (fat, in_fat) = (tissue.fat_m, 0.5 / tissue.fat_s_per_m);
        let wave = |strength, depth, slope| {
            Some(Wave {
                strength,
                depth,
                slope,
            })
        };
        if z < fat {
            let up = direction.reflection * in_fat;
            return [wave(in_fat, z, 1.0), wave(up, 2.0 * fat - z, -1.0)];
        }
        let decay = direction.decay;
        let strength = 1.0 / (tissue.fat_s_per_m + tissue.across_s_per_m * decay);
        [wave(strength, fat + decay * (z - fat), decay), None]
    }

    /// Adds all images of a wave, at `u` along the direction from the middle of the pad.
    fn add(&self, sum: &mut Transfer, to: &Direction, wave: &Wave, (pad, u): (&Profile, f64)) {
        let mut total = [Complex64::default(); 3];
        let mut w = Complex64::new(wave.depth, -u);
        for &weight in &to.weights {
            for (total, mean) in total.iter_mut().zip(pad.means(w)) {
                *total += weight * mean;
            }
            w.re += 2.0 * self.tissue.fat_m;
        }
        let [mean, slope, bend] = total.map(|complex| wave.strength * complex);
        sum.potential += mean.re;
        sum.gradient += to.cos * slope.im;
        sum.curvature -= to.cos * to.cos * bend.re;
        sum.across[0] += to.sin * slope.im;
        sum.across[1] += wave.slope * slope.re;
    }
}
