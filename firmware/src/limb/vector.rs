//! Vectors and turns in space.

use super::Number;

/// A vector in space, seen from the thorax: x backward, y to the right, z upward, as
/// the axes of a segment lie while the arm hangs.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Vector<N> {
    /// Backward.
    pub x: N,
    /// To the right.
    pub y: N,
    /// Upward.
    pub z: N,
}

impl<N: Number> Vector<N> {
    /// Nowhere.
    pub const ZERO: Self = Self::new(N::ZERO, N::ZERO, N::ZERO);

    /// Of its components.
    #[must_use]
    pub const fn new(x: N, y: N, z: N) -> Self {
        Self { x, y, z }
    }

    /// From whole µm, in m.
    #[must_use]
    pub fn from_um([x, y, z]: [i32; 3]) -> Self {
        let m = |um| N::ratio(um, 1_000_000);
        Self::new(m(x), m(y), m(z))
    }

    /// Its components.
    #[must_use]
    pub const fn to_array(self) -> [N; 3] {
        [self.x, self.y, self.z]
    }

    /// The sum.
    #[inline]
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }

    /// The way to here from `other`.
    #[inline]
    #[must_use]
    pub fn minus(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }

    /// `factor` times as long.
    #[inline]
    #[must_use]
    pub fn times(self, factor: N) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }

    /// The scalar product.
    #[inline]
    #[must_use]
    pub fn dot(self, other: Self) -> N {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// The vector product.
    #[inline]
    #[must_use]
    pub fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    /// The same direction, one long; of the zero vector zero.
    #[inline]
    #[must_use]
    pub fn direction(self) -> Self {
        self.times(self.dot(self).inverse_root())
    }
}

/// An axis of a segment.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum RotationAxis {
    /// Backward.
    X,
    /// To the right.
    Y,
    /// Upward.
    Z,
}

/// How a segment is turned: where its own axes point.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Rotation<N> {
    /// The segment's backward axis.
    pub x: Vector<N>,
    /// Its axis to the right.
    pub y: Vector<N>,
    /// Its upward axis.
    pub z: Vector<N>,
}

impl<N: Number> Rotation<N> {
    /// Not turned.
    pub const NONE: Self = Self {
        x: Vector::new(N::ONE, N::ZERO, N::ZERO),
        y: Vector::new(N::ZERO, N::ONE, N::ZERO),
        z: Vector::new(N::ZERO, N::ZERO, N::ONE),
    };

    /// What is `v` to the segment, seen from the thorax.
    #[inline]
    #[must_use]
    pub fn apply(&self, v: Vector<N>) -> Vector<N> {
        let xy = self.x.times(v.x).plus(self.y.times(v.y));
        xy.plus(self.z.times(v.z))
    }

    /// One of its axes.
    #[inline]
    #[must_use]
    pub const fn axis(&self, turn: RotationAxis) -> Vector<N> {
        match turn {
            RotationAxis::X => self.x,
            RotationAxis::Y => self.y,
            RotationAxis::Z => self.z,
        }
    }

    /// Turned by an angle in radians about one of its own axes, by the right hand.
    #[inline]
    #[must_use]
    pub fn rotated(self, turn: RotationAxis, radians: N) -> Self {
        let (sine, cosine) = radians.sine_and_cosine();
        let both = |u: Vector<N>, v: Vector<N>| {
            (
                u.times(cosine).plus(v.times(sine)),
                v.times(cosine).minus(u.times(sine)),
            )
        };
        let Self { x, y, z } = self;
        match turn {
            RotationAxis::X => {
                let (y, z) = both(y, z);
                Self { x, y, z }
            }
            RotationAxis::Y => {
                let (z, x) = both(z, x);
                Self { x, y, z }
            }
            RotationAxis::Z => {
                let (x, y) = both(x, y);
                Self { x, y, z }
            }
        }
    }
}
