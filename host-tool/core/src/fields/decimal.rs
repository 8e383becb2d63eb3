//! Decimal numbers as they are written in a file, so that 28.1 V is exactly 28 100 mV.

/// Exact decimal number as written in a file: `digits` · 10^`exponent`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Decimal {
    digits: i128,
    exponent: i32,
}

impl Decimal {
    /// Returns the decimal with the value of a whole number.
    pub(crate) const fn from_integer(digits: i128) -> Self {
        Self {
            digits,
            exponent: 0,
        }
    }

    /// Reads a TOML float exactly. Returns `None` if it is not finite or has more than about 38
    /// digits, more than any quantity needs.
    pub(crate) fn parse(text: &str) -> Option<Self> {
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

    /// Returns the number as a float, which may be rounded.
    pub(crate) fn value(self) -> f64 {
        self.digits as f64 * 10_f64.powi(self.exponent)
    }

    /// Returns the number times 10^`places`, saturated at the ends of `i64`, or `None` if the
    /// product is not a whole number.
    pub(crate) fn scaled(self, places: i32) -> Option<i64> {
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

/// Formats `value` · 10^−`places` as a decimal number without trailing zeros, for example "28.1"
/// for 28 100 and 3 places.
pub(crate) fn format_scaled(value: i64, places: i32) -> String {
    (value as f64 / 10_f64.powi(places)).to_string()
}

/// Formats the range from `min` to `max`, which are in 10^−`places`, for example "0.5 to 200".
pub(crate) fn format_range(min: i64, max: i64, places: i32) -> String {
    format!(
        "{} to {}",
        format_scaled(min, places),
        format_scaled(max, places)
    )
}

/// Returns the TOML number in `text` times 10^`power`. The result is the float that is nearest to
/// the exact product, whereas a product of two floats could be off in the last digit. Returns
/// `None` if `text` is not a number.
pub(crate) fn parse_scaled(text: &str, power: i32) -> Option<f64> {
    let text = text.replace('_', "");
    for (prefix, radix) in [("0x", 16), ("0o", 8), ("0b", 2)] {
        if let Some(digits) = text.strip_prefix(prefix) {
            return parse_scaled(
                &i128::from_str_radix(digits, radix).ok()?.to_string(),
                power,
            );
        }
    }
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().ok()?),
        None => (text.as_str(), 0),
    };
    let exponent = exponent.checked_add(power)?;
    format!("{mantissa}e{exponent}").parse().ok()
}

/// Formats `value` · 10^`power` as a TOML number. It has the fewest digits from which
/// [`parse_scaled`], with the opposite power, gives `value` again.
pub(crate) fn format_toml_number(value: f64, power: i32) -> String {
    let text = format!("{value:e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let exponent = exponent.parse::<i32>().unwrap_or_default() + power;
    let sign = if mantissa.starts_with('-') { "-" } else { "" };
    let digits: String = mantissa.chars().filter(char::is_ascii_digit).collect();
    // Number of digits before the point.
    let before = 1 + exponent;
    let count = digits.len() as i32; // at most 17
    match before {
        _ if value == 0.0 => format!("{sign}0.0"),
        1..=15 if count <= before => {
            let zeros = "0".repeat((before - count).unsigned_abs() as usize);
            format!("{sign}{digits}{zeros}.0")
        }
        1..=15 => {
            let (whole, fraction) = digits.split_at(before.unsigned_abs() as usize);
            format!("{sign}{whole}.{fraction}")
        }
        -5..=0 => {
            let zeros = "0".repeat(before.unsigned_abs() as usize);
            format!("{sign}0.{zeros}{digits}")
        }
        _ => format!("{mantissa}e{exponent}"),
    }
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
            assert_eq!(format_scaled(milli, 3).parse::<f64>(), text.parse());
        }
    }

    #[test]
    fn what_is_written_of_a_float_is_read_to_the_bit() {
        let mut random = hal_sim::random::Random::new(7);
        for power in [-9, -6, -3, 0, 3] {
            for count in 0..2_000 {
                let wide = f64::from_bits(random.below(u64::MAX));
                let near = random.below(1_000_000_007) as f64 / 999_983.0;
                let value = if count % 2 == 0 { wide } else { -near };
                if !value.is_finite() || !(1e-290..1e290).contains(&value.abs()) {
                    continue;
                }
                let text = format_toml_number(value, power);
                let again = parse_scaled(&text, -power).unwrap();
                assert_eq!(again.to_bits(), value.to_bits(), "{value:e}: {text}");
                text.parse::<f64>().unwrap();
            }
        }
        for (value, power, text) in [
            (0.0042, 3, "4.2"),
            (2.5e-8, 9, "25.0"),
            (0.02, 3, "20.0"),
            (-0.0003, 3, "-0.3"),
            (0.0, 3, "0.0"),
            (4e-5, 0, "0.00004"),
            (1e-9, 0, "1e-9"),
        ] {
            assert_eq!(format_toml_number(value, power), text);
        }
        assert_eq!(parse_scaled("1_2", -3), Some(0.012));
        assert_eq!(parse_scaled("0xe", -3), Some(0.014));
        assert_eq!(parse_scaled("4.2E1", -3), Some(0.042));
        assert_eq!(parse_scaled("12:00", 0), None);
    }
}
