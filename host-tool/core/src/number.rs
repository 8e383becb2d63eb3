//! Formats numbers with the fewest digits that read back exactly: the text that `Display` writes,
//! at a fraction of its cost. Used for rows and pictures, which have hundreds of thousands of
//! numbers.

/// Appends `value` to `text`, with the same characters as `Display` writes.
pub fn push(text: &mut Vec<u8>, value: f64) {
    match millionths(value) {
        Some(millionths) => push_millionths(text, millionths),
        None => push_any(text, value),
    }
}

/// Appends a time in seconds with six digits after the point, because devices count whole
/// microseconds. A time that is not a whole number of microseconds is written as [`push`] writes
/// it.
pub fn push_micros(text: &mut Vec<u8>, seconds: f64) {
    let Some(micros) = millionths(seconds) else {
        return push(text, seconds);
    };
    push_millionths(text, micros);
    let zeros = match micros % 1_000_000 {
        0 => {
            text.push(b'.');
            6
        }
        behind => {
            std::iter::successors(Some(behind), |digits| {
                (digits % 10 == 0).then_some(digits / 10)
            })
            .count()
                - 1
        }
    };
    text.extend(std::iter::repeat_n(b'0', zeros));
}

/// Returns `value` in millionths; `None` unless it is a whole number of millionths with at most 15
/// digits. Two different decimals of at most 15 digits never read as the same `f64`. The result
/// without its trailing zeros is therefore the shortest decimal that reads as `value`.
pub(crate) fn millionths(value: f64) -> Option<i64> {
    let scaled = value * 1e6;
    // The comparisons below exclude NaN and values that are too large.
    let nearest = (scaled + 0.5_f64.copysign(scaled)) as i64;
    let is_whole = nearest as f64 / 1e6 == value && nearest.unsigned_abs() < 1_000_000_000_000_000;
    (is_whole && (nearest != 0 || value.is_sign_positive())).then_some(nearest)
}

/// The two ASCII digits of each number from 00 to 99, so that digits are written in pairs.
const PAIRS: [[u8; 2]; 100] = {
    let mut pairs = [[b'0'; 2]; 100];
    let mut n = 0;
    while n < 100 {
        pairs[n] = [b'0' + (n / 10) as u8, b'0' + (n % 10) as u8];
        n += 1;
    }
    pairs
};

fn push_millionths(text: &mut Vec<u8>, millionths: i64) {
    let size = millionths.unsigned_abs();
    let (mut whole, behind) = ((size / 1_000_000) as u32, (size % 1_000_000) as u32);
    // Filled from the last digit to the first: a sign, nine digits before the point, six after it.
    let mut digits = [b'.'; 17];
    let mut start = 10;
    let mut end = start;
    if behind > 0 {
        for (place, pair) in [behind / 10_000, behind / 100 % 100, behind % 100]
            .into_iter()
            .enumerate()
        {
            digits[11 + 2 * place..13 + 2 * place].copy_from_slice(&PAIRS[pair as usize]);
        }
        end = digits.len();
        while digits[end - 1] == b'0' {
            end -= 1;
        }
    }
    while whole >= 10 {
        start -= 2;
        digits[start..start + 2].copy_from_slice(&PAIRS[(whole % 100) as usize]);
        whole /= 100;
    }
    if whole > 0 || start == 10 {
        start -= 1;
        digits[start] = b'0' + whole as u8;
    }
    if millionths < 0 {
        start -= 1;
        digits[start] = b'-';
    }
    text.extend_from_slice(&digits[start..end]);
}

fn push_any(text: &mut Vec<u8>, value: f64) {
    let mut buffer = zmij::Buffer::new();
    let shortest = buffer.format(value);
    if !value.is_finite() || shortest.contains('e') || may_tie(value) {
        // `Display` writes all numbers whose shortest text may be different.
        return text.extend_from_slice(value.to_string().as_bytes());
    }
    let shortest = shortest.strip_suffix(".0").unwrap_or(shortest);
    text.extend_from_slice(shortest.as_bytes());
}

/// Returns whether two shortest decimals may be equally close to `value`, so that two correct
/// algorithms could write different ones. In that case the exact decimal of `value` has one digit
/// more than the shortest and ends in 5.
///
/// An odd integer m of 53 − t bits, divided by 2^k, has the same decimal digits as m·5^k. A tie
/// allows at most 18 digits, so k ≤ 3.4 + 0.43·t. Half a unit of the last shortest digit must lie
/// within half a unit of the last bit, so k ≥ 1.4 + 0.43·t. The bounds in the code are slightly
/// wider.
fn may_tie(value: f64) -> bool {
    let bits = value.to_bits();
    let t = bits.trailing_zeros().min(52) as i32;
    let exponent = (bits >> 52 & 0x7FF) as i32 - 1023;
    let k = 52 - t - exponent;
    (3 * t..=3 * t + 35).contains(&(7 * k))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::random::Random;

    #[test]
    fn times_have_six_digits_behind_the_point() {
        let written = |micros: i64| {
            let mut text = Vec::new();
            push_micros(&mut text, micros as f64 / 1e6);
            String::from_utf8(text).unwrap()
        };
        let texts = [0, 54_502, -1, 10_000, 1_000_000, 85_800_000_000, -2_500_000].map(written);
        let meant = [
            "0.000000",
            "0.054502",
            "-0.000001",
            "0.010000",
            "1.000000",
            "85800.000000",
            "-2.500000",
        ];
        assert_eq!(texts, meant);
        let mut random = Random::new(2);
        for _ in 0..50_000 {
            let micros = (random.word() >> (15 + random.below(49))).cast_signed();
            let (whole, behind) = (micros / 1_000_000, micros % 1_000_000);
            assert_eq!(written(micros), format!("{whole}.{behind:06}"));
            assert_eq!(written(micros).parse(), Ok(micros as f64 / 1e6));
        }
    }

    #[test]
    fn numbers_are_written_as_they_are_displayed() {
        let is_same = |value: f64| {
            let mut written = Vec::new();
            push(&mut written, value);
            assert_eq!(String::from_utf8(written).unwrap(), value.to_string());
        };
        let edges = [
            0.0, -0.0, 1.0, -3.0, 1e15, 1e16, 1e17, 1e300, 1e-4, 1e-5, 1e-7, 5e-324,
        ];
        let odd = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MAX,
            0.1 + 0.2,
        ];
        edges.into_iter().chain(odd).for_each(is_same);
        let mut random = Random::new(1);
        for _ in 0..50_000 {
            is_same(f64::from_bits(random.word()));
            is_same(random.below(1 << 24) as f64 * 1e-3);
            // Whole numbers of millionths, including some of more than 15 digits.
            let millionths = (random.word() >> random.below(64)) as f64;
            is_same(millionths / 1e6);
            is_same(-millionths / 1e6);
            is_same(millionths * 1e-2);
            is_same(random.log_between(1e-9, 1e18));
            // Odd numbers divided by powers of two, some of which are ties.
            let odd = (random.word() >> (11 + random.below(52)) | 1) as f64;
            is_same(odd / libm::exp2(random.below(60) as f64));
        }
    }
}
