//! How a number of a result is printed, on pages and terminals alike.

/// A t of more than this is not printed, in size. It is a mean difference over its standard
/// error, so beyond a hundred it says how little the differences vary, as simulated indices do
/// that are all near 1, and no longer how large they are. Ours, by convention.
const LARGEST_T: f64 = 100.0;

/// What is said of a page or table that leaves a t out.
pub const LARGE_T: &str = "A t beyond ±100 is not printed: it is a mean difference over its \
                           standard error, and the differences of such a test hardly vary \
                           (simulated numbers near an end of their range, all alike). It says \
                           nothing of how large a difference is.";

/// Three digits that count.
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

/// What stands in place of a t statistic that is too large to mean anything; nothing for
/// another quantity or a smaller t.
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

/// The same as a place along an axis: at the end of what is printed.
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
