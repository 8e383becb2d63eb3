//! Formats the numbers of results alike on pages and terminals.

/// Largest magnitude of a t statistic that is printed. A t is a mean difference divided by its
/// standard error. Beyond a hundred it only shows that the differences hardly vary, as with
/// simulated indices near 1, and no longer how large they are. The limit is our convention.
const LARGEST_T: f64 = 100.0;

/// Note for a page or table from which a t statistic was omitted.
pub const LARGE_T: &str = "A t statistic beyond ±100 is not printed. t is a mean difference \
                           divided by its standard error, and in such a test the differences \
                           hardly vary, because the simulated values are close to an end of \
                           their range. It does not show how large a difference is.";

/// Formats a number with three significant digits.
#[must_use]
pub fn digits(value: f64) -> String {
    let places = match value.abs() {
        small if small < 1.0 => 3,
        some if some < 10.0 => 2,
        many if many < 100.0 => 1,
        _ => 0,
    };
    format!("{value:.places$}")
}

/// Returns the text that replaces a t statistic beyond ±100. Returns `None` for other quantities
/// and for a smaller t, which are printed.
#[must_use]
pub fn large_t(quantity: &str, value: f64) -> Option<&'static str> {
    let is_t = quantity.ends_with(", t") || quantity == "t";
    match value {
        _ if !is_t => None,
        large if large > LARGEST_T => Some("> 100"),
        small if small < -LARGEST_T => Some("< −100"),
        _ => None,
    }
}

/// Returns the value at which a quantity is plotted. A t statistic that is too large to be printed
/// is plotted at ±100, all other values where they are.
#[must_use]
pub fn along(quantity: &str, value: f64) -> f64 {
    match large_t(quantity, value) {
        None => value,
        Some(_) => value.clamp(-LARGEST_T, LARGEST_T),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_t_of_thousands_is_not_printed() {
        let t = "conducted against isolated, t";
        assert_eq!(large_t(t, -2236.0), Some("< −100"));
        assert_eq!(large_t(t, 1063.7), Some("> 100"));
        assert_eq!(large_t(t, -22.5), None);
        assert_eq!(large_t("charge", -2236.0), None);
        assert_eq!(along(t, -2236.0), -100.0);
        assert_eq!(along("charge", -2236.0), -2236.0);
    }

    #[test]
    fn three_digits_count() {
        let printed = [0.12345, 5.921, 41.67, 2236.4].map(digits);
        assert_eq!(printed, ["0.123", "5.92", "41.7", "2236"]);
    }
}
