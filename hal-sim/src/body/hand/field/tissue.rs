//! Layers of tissue under the skin, and their conductivity.

/// Flat layers under the skin: fat, then muscle of infinite depth. The skin itself and the air are
/// taken as insulating outside the pads. The muscle fibres run along x; y goes around the forearm,
/// z down from the skin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tissue {
    /// Thickness of the fat, including skin, m.
    pub fat_m: f64,
    /// Conductivity of fat, S/m, isotropic; at most ten times that of muscle across its fibres
    /// (√(along·across) where that is less), because beyond that the images decay too slowly.
    pub fat_s_per_m: f64,
    /// Conductivity of muscle along its fibres, S/m.
    pub along_s_per_m: f64,
    /// Conductivity of muscle across its fibres, S/m; within a factor of 100 of the one along them.
    pub across_s_per_m: f64,
}

/// Error: the value of a field of a [`Tissue`] is outside the range in which the solution is valid.
/// Contains the name of the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("tissue: `{0}` is out of range")]
pub struct InvalidTissue(pub &'static str);

impl Default for Tissue {
    /// Returns the conductivities that ASCENT uses (wmglab-duke/ascent,
    /// `config/system/materials.json`): muscle 0.35 and 0.086 S/m, fat 1/30 S/m. Assumed: 4 mm of
    /// fat; forearms have 2 to 8 mm.
    fn default() -> Self {
        Self {
            fat_m: 4e-3,
            fat_s_per_m: 1.0 / 30.0,
            along_s_per_m: 0.35,
            across_s_per_m: 0.086,
        }
    }
}

impl Tissue {
    /// Checks every field.
    ///
    /// # Errors
    /// Returns [`InvalidTissue`] with the first field that is out of range.
    pub fn validate(&self) -> Result<(), InvalidTissue> {
        let positive = |v: f64| v.is_finite() && v > 0.0;
        let contrast = self.along_s_per_m / self.across_s_per_m;
        let least = self.across_s_per_m * contrast.sqrt().min(1.0);
        #[rustfmt::skip]
        let rules = [
            ("fat_m", positive(self.fat_m)),
            ("along_s_per_m", positive(self.along_s_per_m)),
            ("across_s_per_m", positive(self.across_s_per_m) && (0.01..=100.0).contains(&contrast)),
            ("fat_s_per_m", positive(self.fat_s_per_m) && self.fat_s_per_m <= 10.0 * least),
        ];
        match rules.iter().find(|(_, holds)| !holds) {
            Some((field, _)) => Err(InvalidTissue(field)),
            None => Ok(()),
        }
    }

    /// Returns the factor g by which a wave that varies along (`cos`, `sin`) decays faster with
    /// depth in muscle than in fat, where `cos` and `sin` need not form a unit vector: s_l·cos² +
    /// s_t·sin² = s_t·g².
    pub(super) fn decay(&self, cos: f64, sin: f64) -> f64 {
        let contrast = self.along_s_per_m / self.across_s_per_m;
        (contrast * cos * cos + sin * sin).sqrt()
    }

    /// Returns the reflection coefficient, −1 to 1, at the boundary from fat to muscle for a wave
    /// with this [`Self::decay`]. Potential and current are continuous across the boundary.
    pub(super) fn reflection(&self, decay: f64) -> f64 {
        let muscle = self.across_s_per_m * decay;
        (self.fat_s_per_m - muscle) / (self.fat_s_per_m + muscle)
    }
}
