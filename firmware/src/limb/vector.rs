//! Vectors and rotations in space.

use super::Number;

/// A vector in space, in the thorax frame: x backward, y to the right, z upward, as the axes of a
/// segment lie while the arm hangs.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Vector<N> {
    /// Component backward.
    pub x: N,
    /// Component to the right.
    pub y: N,
    /// Component upward.
    pub z: N,
}

impl<N: Number> Vector<N> {
    /// Vector of length zero.
    pub const ZERO: Self = Self::new(N::ZERO, N::ZERO, N::ZERO);

    /// Creates a vector from its components.
    #[must_use]
    pub const fn new(x: N, y: N, z: N) -> Self {
        Self { x, y, z }
    }

    /// Converts whole µm to a vector in m.
    #[must_use]
    pub fn from_um([x, y, z]: [i32; 3]) -> Self {
        let m = |um| N::ratio(um, 1_000_000);
        Self::new(m(x), m(y), m(z))
    }

    /// Returns the components x, y and z.
    #[must_use]
    pub const fn to_array(self) -> [N; 3] {
        [self.x, self.y, self.z]
    }

    /// Returns the sum of both vectors.
    #[inline]
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }

    /// Returns the difference `self` − `other`.
    #[inline]
    #[must_use]
    pub fn minus(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }

    /// Returns the vector scaled by `factor`.
    #[inline]
    #[must_use]
    pub fn times(self, factor: N) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }

    /// Returns the scalar product of `self` and `other`.
    #[inline]
    #[must_use]
    pub fn dot(self, other: Self) -> N {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Returns the vector product `self` × `other`, by the right-hand rule.
    #[inline]
    #[must_use]
    pub fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    /// Returns the unit vector of the same direction; zero for the zero vector.
    #[inline]
    #[must_use]
    pub fn direction(self) -> Self {
        self.times(self.dot(self).inverse_root())
    }
}

/// Axis of a segment about which it rotates.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum RotationAxis {
    /// Axis that points backward.
    X,
    /// Axis that points to the right.
    Y,
    /// Axis that points upward.
    Z,
}

/// Rotation of a segment: the directions of its own axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Rotation<N> {
    /// Direction of the segment's backward axis.
    pub x: Vector<N>,
    /// Direction of the segment's axis to the right.
    pub y: Vector<N>,
    /// Direction of the segment's upward axis.
    pub z: Vector<N>,
}

impl<N: Number> Rotation<N> {
    /// Identity, no rotation.
    pub const NONE: Self = Self {
        x: Vector::new(N::ONE, N::ZERO, N::ZERO),
        y: Vector::new(N::ZERO, N::ONE, N::ZERO),
        z: Vector::new(N::ZERO, N::ZERO, N::ONE),
    };

    /// Converts `v` from the segment's frame to the thorax frame.
    #[inline]
    #[must_use]
    pub fn apply(&self, v: Vector<N>) -> Vector<N> {
        let xy = self.x.times(v.x).plus(self.y.times(v.y));
        xy.plus(self.z.times(v.z))
    }

    /// Returns the direction of one of the segment's axes.
    #[inline]
    #[must_use]
    pub const fn axis(&self, turn: RotationAxis) -> Vector<N> {
        match turn {
            RotationAxis::X => self.x,
            RotationAxis::Y => self.y,
            RotationAxis::Z => self.z,
        }
    }

    /// Returns the rotation after a turn by an angle in radians about one of the segment's own
    /// axes, by the right-hand rule.
    #[inline]
    #[must_use]
    pub fn rotated(self, turn: RotationAxis, radians: N) -> Self {
        let (sine, cosine) = radians.sine_and_cosine();
        let rotated_pair = |u: Vector<N>, v: Vector<N>| {
            (
                u.times(cosine).plus(v.times(sine)),
                v.times(cosine).minus(u.times(sine)),
            )
        };
        let Self { x, y, z } = self;
        match turn {
            RotationAxis::X => {
                let (y, z) = rotated_pair(y, z);
                Self { x, y, z }
            }
            RotationAxis::Y => {
                let (z, x) = rotated_pair(z, x);
                Self { x, y, z }
            }
            RotationAxis::Z => {
                let (x, y) = rotated_pair(x, y);
                Self { x, y, z }
            }
        }
    }
}
