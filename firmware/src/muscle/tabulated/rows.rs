//! The rows of the table: H and P of one interval of log C each, by collocation.
//!
//! F is the polynomial of degree 5 that satisfies dF/ds = u − z·F at the five Gauss points of the
//! interval (s from 0 to 1), with
//!
//! ```text
//! u = (h/τm)·x   z = h/τ   x = C/(K + C)   τ = τ1 + τ2·x
//! ```
//!
//! for an interval of h (Hairer, Nørsett & Wanner, Solving ODEs I, II.7). Its error is of the order
//! h¹⁰ at the end and h⁶ in between. A row is solved in f32, whose operations give the same bits on
//! every machine; they take some 4,000 cycles.

use crate::arithmetic::polynomial::horner;
use crate::arithmetic::reciprocal::{inverse, signed_high_rounded};

/// Degree of the polynomials.
const DEGREE: usize = 5;

/// Gauss points of the interval, s in Q32.
pub(super) const POINTS: [u32; DEGREE] = [
    201_477_237,
    991_129_595,
    2_147_483_648,
    3_303_837_701,
    4_093_490_059,
];

/// Coefficients of the Gauss method: the integral from 0 to a point of the polynomial that is 1 at
/// one point and 0 at the others (Hairer, Nørsett & Wanner, II.7, table 7.4 has those of three).
const INTEGRALS: [[f32; DEGREE]; DEGREE] = [
    [
        0.059_231_72,
        -0.019_570_364,
        0.011_254_401,
        -0.005_593_794,
        0.001_588_113,
    ],
    [
        0.128_151_01,
        0.119_657_17,
        -0.024_592_115,
        0.010_318_281,
        -0.002_768_994_4,
    ],
    [
        0.113_776_29,
        0.260_004_65,
        0.142_222_22,
        -0.020_690_316,
        0.004_687_154_5,
    ],
    [
        0.121_232_44,
        0.228_996_06,
        0.309_036_56,
        0.119_657_17,
        -0.009_687_563,
    ],
    [
        0.116_875_33,
        0.244_908_13,
        0.273_190_04,
        0.258_884_7,
        0.059_231_72,
    ],
];

/// Coefficients of t¹…t⁵ of the polynomial whose slope is 1 at one Gauss point and 0 at the others.
const POWERS: [[f32; DEGREE]; DEGREE] = [
    [0.0, 0.0, 1.0, 0.0, 0.0],
    [0.301_168_16, -1.435_388_2, 0.0, 1.435_388_2, -0.301_168_16],
    [
        -0.443_132_3,
        3.554_243_3,
        -6.222_222_3,
        3.554_243_3,
        -0.443_132_3,
    ],
    [-2.077_385_7, 3.495_993_1, 0.0, -3.495_993_1, 2.077_385_7],
    [3.667_944_2, -10.387_944, 13.44, -10.387_944, 3.667_944_2],
];

/// One interval of log C: the powers t⁵…t¹ of H and P, Q31, and the force in the middle.
///
/// H is within 0.55…1.81. Its slope in the middle is −z, and P's is u, both up to 1.18. So that they
/// fit, they are stored with 1 added and subtracted. All sums of the other powers are below 0.9:
/// (e^(z/2) − 1 − z/2)/(1/4) is 0.85. P is negated, as the drive is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Row {
    /// Share of the force in the middle; the last power is 1 − z.
    kept: [i32; DEGREE],
    /// Force of full gain, as a share of A·τm, negated; the last power is 1 − u.
    raised: [i32; DEGREE],
    /// Share of the force at the beginning that is left in the middle, Q31.
    kept_to_middle: i32,
    /// Force in the middle of full gain from the beginning on, negated, Q31.
    raised_to_middle: i32,
    /// Checksum, with which the sum of all words is 0.
    checksum: i32,
}

impl Row {
    /// Placeholder for the rows that a table does not use.
    pub(super) const NONE: Self = Self {
        kept: [0; DEGREE],
        raised: [0; DEGREE],
        kept_to_middle: 0,
        raised_to_middle: 0,
        checksum: 0,
    };

    /// Returns whether the row is as it was solved.
    pub(super) fn is_intact(&self) -> bool {
        self.sum() == 0
    }

    /// Changes a bit, as faulty memory would.
    #[cfg(test)]
    pub(super) const fn corrupt(&mut self) {
        self.kept_to_middle ^= 1 << 9;
    }

    fn sum(&self) -> i32 {
        let words = self.kept.iter().chain(&self.raised);
        let sum = words.fold(self.checksum, |sum, &word| sum.wrapping_add(word));
        let middle = self.kept_to_middle.wrapping_add(self.raised_to_middle);
        sum.wrapping_add(middle)
    }

    /// Returns F in the middle of the interval, Q30, for a muscle that has `force` (Q29) at t and this
    /// drive (Q30). It is within ±1.81.
    #[inline(always)]
    pub(super) fn force_in_middle(&self, force: i32, drive: i32, t: i32) -> i32 {
        // H − 1 and −P in Q31: within −0.45…0.81, as is P. t/2 is t in Q31.
        let kept = signed_high_rounded(horner(&self.kept, t), t).wrapping_sub(t >> 1);
        let raised = signed_high_rounded(horner(&self.raised, t), t).wrapping_sub(t >> 1);
        // Force of an earlier drive alone, within ±2.
        let own = force.wrapping_sub(signed_high_rounded(drive, raised));
        // H/2 in Q32; 2/H in Q29 is below 3.65, so it fits.
        let inverse = inverse((1u32 << 31).wrapping_add_signed(kept)).cast_signed();
        // Q29 · Q29 is twice Q59: below 2^62.
        let middle = i64::from(own).wrapping_mul(i64::from(inverse));
        (middle.wrapping_add(1 << 28) >> 29) as i32
    }

    /// Returns F in the middle of the interval, Q30, from that at its beginning (Q29) and the
    /// drive (Q30).
    #[inline(always)]
    pub(super) fn force_from_begin(&self, begin: i32, drive: i32) -> i32 {
        // `begin` is at most 1, 2^30 here; the sum is at most 1.
        signed_high_rounded(begin << 1, self.kept_to_middle)
            .wrapping_add(signed_high_rounded(drive, self.raised_to_middle))
            << 1
    }

    /// Returns the force in the interval from that in its middle and the drive, both Q30.
    ///
    /// Each coefficient is at most 1.81·1.18 + 1.18, and all sums are below 4.
    #[inline(always)]
    pub(super) fn combine(&self, middle: i32, drive: i32) -> Curve {
        let part = |kept: i32, raised: i32| {
            signed_high_rounded(middle, kept).wrapping_add(signed_high_rounded(drive, raised))
        };
        let [h5, h4, h3, h2, h1] = self.kept;
        let [p5, p4, p3, p2, p1] = self.raised;
        // Q30 to Q29, negated.
        let steep = drive.wrapping_add(middle) >> 1;
        Curve([
            part(h5, p5),
            part(h4, p4),
            part(h3, p3),
            part(h2, p2),
            part(h1, p1).wrapping_sub(steep),
            middle >> 1,
        ])
    }
}

/// Force F over an interval, as a share of A·τm in Q29: a polynomial in t. The highest power comes
/// first, in the order of evaluation.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Curve([i32; DEGREE + 1]);

impl Curve {
    pub(super) const NONE: Self = Self([0; DEGREE + 1]);

    /// Returns F at t (Q32), at least 0.
    #[inline(always)]
    pub(super) fn at(&self, t: i32) -> i32 {
        // Below 4 by the bounds of [`Row::combine`], so no operation wraps.
        let force = horner(&self.0, t);
        force & !(force >> 31)
    }

    /// Returns F at the end of the interval, at least 0.
    #[inline(always)]
    pub(super) fn at_end(&self) -> i32 {
        let Self([first, rest @ ..]) = self;
        let add = |sum: i32, power: &i32| power.wrapping_add(sum >> 1);
        let force = rest.iter().fold(*first, add);
        force & !(force >> 31)
    }
}

/// Solves one interval from u and z at its Gauss points: their slopes K satisfy K + z·(F(0) + A·K) =
/// u, where A integrates from the middle; for H with F(0) = 1 and u = 0, for P with F(0) = 0.
#[inline(never)]
pub(super) fn solve(points: &[(f32, f32); DEGREE]) -> Row {
    let [.., to_middle, _, _] = INTEGRALS;
    // Matrix and both right sides.
    let mut system = [[0.0; DEGREE + 2]; DEGREE];
    let lines = system.iter_mut().zip(points.iter().zip(&INTEGRALS));
    for (index, (line, ((u, z), integrals))) in lines.enumerate() {
        for (value, (to_point, to_middle)) in line.iter_mut().zip(integrals.iter().zip(&to_middle))
        {
            *value = z * (to_point - to_middle);
        }
        line[index] += 1.0; // the index is below 5
        let [.., kept, raised] = line;
        (*kept, *raised) = (-z, *u);
    }
    // Gauss–Jordan elimination. The diagonal leads: z is below 1.2 and each integral below 0.31.
    for index in 0..DEGREE {
        let line = system[index]; // index < 5, here and below
        let inverse = 1.0 / line[index];
        let line = line.map(|value| value * inverse);
        for (row, other) in system.iter_mut().enumerate() {
            if row == index {
                *other = line;
                continue;
            }
            let factor = other[index];
            for (value, of_line) in other.iter_mut().zip(&line) {
                *value -= factor * of_line;
            }
        }
    }
    let kept = powers(&system.map(|[.., kept, _]| kept));
    let raised = powers(&system.map(|[.., raised]| raised));
    let at_begin = |powers: &[f32; DEGREE]| {
        let add = |sum: f32, power: &f32| (sum + power) * -0.5;
        powers.iter().fold(0.0, add)
    };
    let kept_to_middle = 1.0 / (1.0 + at_begin(&kept));
    let raised_to_middle = at_begin(&raised) * kept_to_middle;
    let [h5, h4, h3, h2, h1] = kept;
    let [p5, p4, p3, p2, p1] = raised;
    let mut row = Row {
        kept: [h5, h4, h3, h2, h1 + 1.0].map(to_q31),
        raised: [
            to_q31(-p5),
            to_q31(-p4),
            to_q31(-p3),
            to_q31(-p2),
            one_less(p1),
        ],
        kept_to_middle: to_q31(kept_to_middle),
        raised_to_middle: to_q31(raised_to_middle),
        checksum: 0,
    };
    row.checksum = row.sum().wrapping_neg();
    row
}

/// Returns the powers t⁵…t¹ of the polynomial that has these slopes at the Gauss points.
fn powers(slopes: &[f32; DEGREE]) -> [f32; DEGREE] {
    let [p1, p2, p3, p4, p5] = POWERS.map(|of_slopes| {
        let products = of_slopes.iter().zip(slopes);
        products.fold(0.0, |sum, (of_slope, slope)| sum + of_slope * slope)
    });
    [p5, p4, p3, p2, p1]
}

/// Returns 1 − `value` for a value of 0…2, with the rounding of the value. It is below 1 by 2^-25 or
/// more, so that no sum with the few units of the other powers exceeds 1.
fn one_less(value: f32) -> i32 {
    let less = (1 << 31) - (value * 2_147_483_648.0) as i64; // within ±2^31
    less.min(i64::from(i32::MAX - 63)) as i32
}

/// Converts a number within ±1.
fn to_q31(value: f32) -> i32 {
    (value * 2_147_483_648.0) as i32 // saturates
}

#[cfg(test)]
mod tests {
    use super::super::TablePlan;
    use super::*;
    use crate::muscle::CalciumForceSpec;

    const K01: CalciumForceSpec = CalciumForceSpec {
        a_mn_per_s: 121_900,
        k_micro: 300_000,
        tau_c_us: 20_800,
        tau1_us: 33_100,
        tau2_us: 194_400,
    };

    /// The integrals of a Gauss method are exact for powers up to the fourth, to the rounding of f32.
    #[test]
    fn gauss_integrals_and_powers_are_exact() {
        let points = POINTS.map(|s| f64::from(s) / 4_294_967_296.0);
        for power in 0..DEGREE as i32 {
            for (integrals, end) in INTEGRALS.iter().zip(points) {
                let sum: f64 = (integrals.iter().zip(points))
                    .map(|(integral, s)| f64::from(*integral) * s.powi(power))
                    .sum();
                let exact = end.powi(power + 1) / f64::from(power + 1);
                assert!(
                    (sum - exact).abs() < 5e-8,
                    "s^{power} to {end}: {sum}, {exact}"
                );
            }
            // The slope of t^(power + 1) at the points gives that power back.
            let slopes = points.map(|s| ((s - 0.5).powi(power) * f64::from(power + 1)) as f32);
            let mut found = powers(&slopes);
            found.reverse();
            for (of, value) in found.into_iter().enumerate() {
                let exact = if of as i32 == power { 1.0 } else { 0.0 };
                assert!((value - exact).abs() < 2e-6, "t^{}: {value}", of + 1);
            }
        }
    }

    #[test]
    fn a_row_with_a_changed_bit_is_not_intact() {
        let plan = TablePlan::new(&K01).unwrap().unwrap();
        let (row, _) = plan.solve(3, 4.0);
        assert!(row.is_intact() && Row::NONE.is_intact());
        for bit in 0..32 {
            let mut changed = row;
            changed.raised[2] ^= 1 << bit;
            assert!(!changed.is_intact());
            let mut changed = row;
            changed.kept_to_middle ^= 1 << bit;
            assert!(!changed.is_intact());
        }
    }

    /// The middle of an interval from its beginning, from any place in it, and the end are those of
    /// one and the same force.
    #[test]
    fn a_row_is_one_force_from_everywhere() {
        let plan = TablePlan::new(&K01).unwrap().unwrap();
        let (row, _) = plan.solve(4, 2.0);
        let (drive, begin) = (-700_000_000, 100_000_000);
        let middle = row.force_from_begin(begin, drive);
        let curve = row.combine(middle, drive);
        assert!((curve.at(i32::MIN) - begin).abs() <= 4);
        for t in [-2_000_000_000, -900_000_000, 1, 1_300_000_000, i32::MAX] {
            let again = row.force_in_middle(curve.at(t), drive, t);
            // Roundings of six products in Q29, and again, over an H of 0.55: in Q30.
            assert!((again - middle).abs() <= 44, "{again} {middle}");
        }
        assert!((curve.at_end() - curve.at(i32::MAX)).abs() <= 4);
    }
}
