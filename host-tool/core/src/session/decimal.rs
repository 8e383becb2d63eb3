//! Decimal numbers as written, so that 28.1 V is exactly 28 100 mV.

/// `digits` · 10^`exponent`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Decimal {
    digits: i128,
    exponent: i32,
}

impl Decimal {
    /// A whole number.
    pub(super) const fn of(digits: i128) -> Self {
        Self {
            digits,
            exponent: 0,
        }
    }

    /// Reads a TOML float; `None` if it is not finite or has more than about
    /// 38 digits, which no quantity here needs.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let text = text.replace('_', "");
        let (mantissa, exponent) = match text.split_once(['e', 'E']) {
            Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().ok()?),
            None => (text.as_str(), 0),
        };
        let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
        let fraction = fraction.trim_end_matches('0');
        Some(Self {
            digits: format!("{whole}{fraction}").parse().ok()?,
            exponent: exponent.checked_sub(i32::try_from(fraction.len()).ok()?)?,
        })
    }

    /// The number times 10^`places`, saturating at the ends of `i64`; `None`
    /// if that is not a whole number.
    pub(super) fn scaled(self, places: i32) -> Option<i64> {
        let (mut digits, mut exponent) = (self.digits, self.exponent.saturating_add(places));
        while exponent < 0 && digits != 0 {
            if digits % 10 != 0 {
                return None;
            }
            (digits, exponent) = (digits / 10, exponent + 1);
        }
        while exponent > 0 && digits != 0 && digits.unsigned_abs() < 1 << 64 {
            (digits, exponent) = (digits * 10, exponent - 1);
        }
        Some(digits.clamp(i64::MIN.into(), i64::MAX.into()) as i64)
    }
}

/// `value` · 10^−`places` as people write it.
pub(super) fn in_units(value: i64, places: i32) -> String {
    (value as f64 / 10_f64.powi(places)).to_string()
}

/// "0.5 to 200", of bounds in 10^−`places`.
pub(super) fn between(min: i64, max: i64, places: i32) -> String {
    format!("{} to {}", in_units(min, places), in_units(max, places))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_what_is_meant() {
        let cases = [
            ("28.0", 3, Some(28_000)),
            ("28.1", 3, Some(28_100)),
            ("0.1", 6, Some(100_000)),
            ("1_000.5", 3, Some(1_000_500)),
            ("2.5e1", 0, Some(25)),
            ("2500e-2", 0, Some(25)),
            ("-0.25", 2, Some(-25)),
            ("-0.0", 3, Some(0)),
            ("0.0005", 3, None),
            ("20.00001", 3, None),
            ("1e-300", 3, None),
            ("1e300", 3, Some(i64::MAX)),
            ("-1e300", 3, Some(i64::MIN)),
            ("0e999999", 3, Some(0)),
        ];
        for (text, places, expected) in cases {
            let scaled = Decimal::parse(text).unwrap().scaled(places);
            assert_eq!(scaled, expected, "{text} · 10^{places}");
        }
        for text in ["inf", "-inf", "nan", "+nan"] {
            assert_eq!(Decimal::parse(text), None, "{text}");
        }
    }

    #[test]
    fn every_thousandth_survives() {
        for milli in (0..200_000).step_by(7) {
            let text = format!("{}.{:03}", milli / 1000, milli % 1000);
            assert_eq!(Decimal::parse(&text).unwrap().scaled(3), Some(milli));
            assert_eq!(in_units(milli, 3).parse::<f64>(), text.parse());
        }
    }
}
