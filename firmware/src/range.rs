//! Ranges of fields and the check of values against them.
//!
//! Each [`Range`] stands beside the field that it bounds; hosts use it from there. Refusals on the
//! wire are in `link::Refusal`, and rules between fields have their own error types.

use core::fmt;

/// Allowed values of a field: a closed range in the field's own unit.
///
/// ```
/// use firmware::pulse::TrainSpec;
///
/// let width = TrainSpec::WIDTH_US;
/// assert_eq!((width.field, width.min, width.max), ("width_us", 10, 500));
/// assert!(width.check(200_u16).is_ok());
/// let refused = width.check(501_u16).unwrap_err();
/// assert_eq!(refused.to_string(), "width_us is 501; allowed: 10 to 500");
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Range {
    /// Name of the field as in docs/protocol.md, including its unit.
    pub field: &'static str,
    /// Smallest allowed value.
    pub min: i32,
    /// Largest allowed value.
    pub max: i32,
}

/// A value outside its range.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct OutOfRange {
    /// Name of the field as in docs/protocol.md, including its unit.
    pub field: &'static str,
    /// Refused value, in the field's unit.
    pub value: i64,
    /// Smallest allowed value.
    pub min: i32,
    /// Largest allowed value.
    pub max: i32,
}

impl Range {
    /// Creates a range from `min` to `max`, both allowed.
    #[must_use]
    pub const fn new(field: &'static str, min: i32, max: i32) -> Self {
        Self { field, min, max }
    }

    /// Returns the part of the range that is at least `min`; never a larger range.
    #[must_use]
    pub fn with_min_at_least(self, min: u32) -> Self {
        let min = i32::try_from(min).unwrap_or(i32::MAX).max(self.min);
        Self { min, ..self }
    }

    /// Returns the part of the range that is at most `max`; never a larger range.
    #[must_use]
    pub fn with_max_at_most(self, max: u32) -> Self {
        let max = i32::try_from(max).unwrap_or(i32::MAX).min(self.max);
        Self { max, ..self }
    }

    /// Creates the error for a `value` that is not allowed.
    #[must_use]
    pub fn out_of_range(self, value: impl Into<i64>) -> OutOfRange {
        let Self { field, min, max } = self;
        OutOfRange {
            field,
            value: value.into(),
            min,
            max,
        }
    }

    /// Checks that `value` lies in the range.
    ///
    /// # Errors
    /// Returns [`OutOfRange`] with the field, the value and the range.
    pub fn check(self, value: impl Into<i64>) -> Result<(), OutOfRange> {
        let Self { field, min, max } = self;
        let value = value.into();
        if (i64::from(min)..=i64::from(max)).contains(&value) {
            return Ok(());
        }
        Err(OutOfRange {
            field,
            value,
            min,
            max,
        })
    }
}

impl fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            field,
            value,
            min,
            max,
        } = self;
        write!(f, "{field} is {value}; allowed: {min} to {max}")
    }
}

impl core::error::Error for OutOfRange {}
