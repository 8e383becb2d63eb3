//! Electrode pads on the skin.

/// Shape and size of a pad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A disc, as of a round electrode.
    Round {
        /// Diameter of the disc, m.
        diameter_m: f64,
    },
    /// A rectangle with its sides along and across the fibres.
    Rectangle {
        /// Side along the fibres (x), m.
        along_m: f64,
        /// Side around the forearm (y), m.
        around_m: f64,
    },
}

/// An electrode pad on the skin. Its current is assumed to be uniform over its area, because gel
/// has a much higher resistance than the tissue below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pad {
    /// Position of the middle along the fibres, m.
    pub x_m: f64,
    /// Position of the middle around the forearm, m.
    pub y_m: f64,
    /// Shape and size of the pad around its middle.
    pub shape: Shape,
}

/// Error: the value of a field of a [`Pad`] is out of range. Contains the name of the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("pad: `{0}` is out of range")]
pub struct InvalidPad(pub &'static str);

impl Pad {
    /// Checks that the position is finite and the outline finite and above zero.
    ///
    /// # Errors
    /// Returns [`InvalidPad`] with the first field that is out of range.
    pub fn validate(&self) -> Result<(), InvalidPad> {
        let positive = |v: f64| v.is_finite() && v > 0.0;
        let shape = match self.shape {
            Shape::Round { diameter_m } => [("diameter_m", positive(diameter_m)); 2],
            Shape::Rectangle { along_m, around_m } => [
                ("along_m", positive(along_m)),
                ("around_m", positive(around_m)),
            ],
        };
        let place = [("x_m", self.x_m.is_finite()), ("y_m", self.y_m.is_finite())];
        match place.iter().chain(&shape).find(|(_, holds)| !holds) {
            Some((field, _)) => Err(InvalidPad(field)),
            None => Ok(()),
        }
    }

    /// Returns the area of skin that the pad covers, m².
    pub fn area_m2(&self) -> f64 {
        match self.shape {
            Shape::Round { diameter_m } => 0.25 * std::f64::consts::PI * diameter_m * diameter_m,
            Shape::Rectangle { along_m, around_m } => along_m * around_m,
        }
    }

    /// Returns whether the two pads share an area. Pads that only touch do not overlap.
    pub fn overlaps(&self, other: &Self) -> bool {
        let apart = [self.x_m - other.x_m, self.y_m - other.y_m].map(f64::abs);
        let (a, b) = (self.shape, other.shape);
        let gap = |i: usize| (apart[i] - a.straight()[i] - b.straight()[i]).max(0.0);
        match a.rounding() + b.rounding() {
            0.0 => (0..2).all(|i| apart[i] < a.straight()[i] + b.straight()[i]),
            round => libm::hypot(gap(0), gap(1)) < round,
        }
    }

    /// Returns an upper bound of the distance from (`x_m`, `y_m`) to any point of the pad, m.
    pub(super) fn farthest_m(&self, x_m: f64, y_m: f64) -> f64 {
        let [along, around] = self.shape.straight();
        let corner = libm::hypot(along, around) + self.shape.rounding();
        libm::hypot(x_m - self.x_m, y_m - self.y_m) + corner
    }
}

impl Shape {
    /// Returns half the sides of a rectangle along x and y, m; zero for a disc.
    fn straight(self) -> [f64; 2] {
        match self {
            Self::Round { .. } => [0.0; 2],
            Self::Rectangle { along_m, around_m } => [0.5 * along_m, 0.5 * around_m],
        }
    }

    /// Returns the radius of a disc, m; 0 for a rectangle.
    fn rounding(self) -> f64 {
        match self {
            Self::Round { diameter_m } => 0.5 * diameter_m,
            Self::Rectangle { .. } => 0.0,
        }
    }
}
