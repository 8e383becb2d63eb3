//! Muscles of the forearm as pools of motor units, and the positions of their nerves.

use crate::random::standard_normal;

/// A muscle, or the part of a muscle that moves one digit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pool {
    /// Flexor pollicis longus, which flexes the thumb.
    Thumb,
    /// Flexor digitorum superficialis of the index finger, its proximal belly.
    Index,
    /// Flexor digitorum superficialis of the index finger, its distal belly. The index finger's
    /// part has two bellies, in series on one tendon.
    IndexDistal,
    /// Flexor digitorum superficialis of the middle finger.
    Middle,
    /// Flexor digitorum superficialis of the ring finger.
    Ring,
    /// Flexor digitorum superficialis of the little finger.
    Little,
    /// Extensor indicis, which extends the index finger.
    ExtensorIndicis,
    /// Extensors of the wrist, which move no finger here.
    Wrist,
}

/// Every pool, in the order of the enum.
pub const POOLS: [Pool; 8] = [
    Pool::Thumb,
    Pool::Index,
    Pool::IndexDistal,
    Pool::Middle,
    Pool::Ring,
    Pool::Little,
    Pool::ExtensorIndicis,
    Pool::Wrist,
];

/// Number of digits, thumb first.
pub const DIGITS: usize = 5;

impl Pool {
    /// Returns the digit that the pool flexes, counted from the thumb, or `None`.
    #[must_use]
    pub const fn flexed_digit(self) -> Option<usize> {
        match self {
            Self::Thumb => Some(0),
            Self::Index | Self::IndexDistal => Some(1),
            Self::Middle => Some(2),
            Self::Ring => Some(3),
            Self::Little => Some(4),
            Self::ExtensorIndicis | Self::Wrist => None,
        }
    }

    /// Returns mean and spread of the positions of the nerve's branches: along the forearm as a
    /// share of its length from the elbow, around it as a share of its circumference from the
    /// palmar midline (positive towards the thumb), and below the fat, m.
    ///
    /// The values are assumed. Order and neighbourhood follow anatomy (Hodde 2019's abstract: the
    /// index finger's fascicles are deep, with a small area close to the skin); the numbers are
    /// ours, and every wearer varies randomly about them ([`Place::randomized`]).
    #[must_use]
    pub const fn place(self) -> Place {
        let (middle, spread) = match self {
            Self::Thumb => ([0.58, 0.10, 0.009], [0.08, 0.020, 0.002]),
            Self::Index => ([0.40, 0.03, 0.011], [0.06, 0.020, 0.002]),
            Self::IndexDistal => ([0.66, 0.02, 0.006], [0.06, 0.020, 0.002]),
            Self::Middle => ([0.48, -0.02, 0.006], [0.08, 0.020, 0.002]),
            Self::Ring => ([0.46, -0.07, 0.006], [0.08, 0.020, 0.002]),
            Self::Little => ([0.64, -0.09, 0.008], [0.07, 0.020, 0.002]),
            Self::ExtensorIndicis => ([0.72, 0.45, 0.006], [0.05, 0.015, 0.002]),
            Self::Wrist => ([0.35, 0.36, 0.005], [0.08, 0.030, 0.002]),
        };
        Place { middle, spread }
    }
}

/// Distribution of the positions of a pool's nerve branches; see [`Pool::place`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Mean position, in the coordinates of [`Pool::place`].
    pub middle: [f64; 3],
    /// Standard deviation of each coordinate.
    pub spread: [f64; 3],
}

/// Standard deviation of a wearer's mean positions about [`Pool::place`], in its coordinates.
/// Assumed.
const BETWEEN_WEARERS: [f64; 3] = [0.04, 0.015, 0.0015];

/// Smallest depth of a nerve below the fat, m.
const LEAST_DEPTH_M: f64 = 0.001;

impl Place {
    /// Returns the distribution for wearer `seed`; `index` is the number of the pool.
    #[must_use]
    pub fn randomized(self, seed: u64, index: u64) -> Self {
        let mut place = self;
        for (axis, middle) in place.middle.iter_mut().enumerate() {
            let turn = standard_normal(seed, 3 * index + axis as u64);
            *middle += BETWEEN_WEARERS[axis] * turn.clamp(-2.0, 2.0);
        }
        place
    }

    /// Returns the position of unit `number` in a forearm of this length and circumference, m:
    /// along from the elbow, around from the palmar midline, below the fat.
    #[must_use]
    pub fn unit(&self, seed: u64, number: u64, forearm_m: f64, around_m: f64) -> [f64; 3] {
        let at = |axis: usize| {
            let turn = standard_normal(seed, 3 * number + axis as u64);
            self.middle[axis] + self.spread[axis] * turn.clamp(-2.5, 2.5)
        };
        [
            at(0) * forearm_m,
            at(1) * around_m,
            at(2).max(LEAST_DEPTH_M),
        ]
    }
}
