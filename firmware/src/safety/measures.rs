//! The two measures of a stimulus that may not rise too fast: amplitude and charge.

use super::Stimulus;
use crate::units::Amplitude;

/// An amplitude, and the amplitude that has the same charge at the train's own width. Both are
/// limited, so that a width cannot do what an amplitude may not.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Measures(pub(super) [Amplitude; 2]);

impl Measures {
    /// Returns the measures of `stimulus` on a train whose own width is `own_us`, rounded up.
    pub(super) fn of(stimulus: Stimulus, own_us: u16) -> Self {
        let charge = charge(stimulus);
        let alike = charge.div_ceil(u32::from(own_us).max(1));
        Self([stimulus.amplitude, Amplitude::new(alike)])
    }

    /// Does the same as [`Self::of`] but rounds down: for the measures from which a rise starts.
    pub(super) fn rounded_down(stimulus: Stimulus, own_us: u16) -> Self {
        let alike = charge(stimulus).checked_div(own_us.into()).unwrap_or(0);
        Self([stimulus.amplitude, Amplitude::new(alike)])
    }

    /// Returns measures with `amplitude` for both values.
    pub(super) const fn uniform(amplitude: Amplitude) -> Self {
        Self([amplitude; 2])
    }

    /// Returns the smaller amplitude, and the smaller amplitude by charge, of the two.
    pub(super) fn min(self, other: Self) -> Self {
        let ([a, b], [c, d]) = (self.0, other.0);
        Self([a.min(c), b.min(d)])
    }

    /// Returns both values raised by `by`, saturating.
    pub(super) fn plus(self, by: Amplitude) -> Self {
        let above = |a: Amplitude| Amplitude::new(a.get().saturating_add(by.get()));
        Self(self.0.map(above))
    }

    /// Returns whether at least one of the two values exceeds that of `other`.
    pub(super) fn is_above(self, other: Self) -> bool {
        let ([a, b], [c, d]) = (self.0, other.0);
        a > c || b > d
    }

    /// Returns the largest amplitude at `width_us` that exceeds neither value, rounded down.
    pub(super) fn amplitude_at(self, width_us: u16, own_us: u16) -> Amplitude {
        let [amplitude, alike] = self.0;
        if width_us == own_us {
            return amplitude.min(alike); // as mostly
        }
        // A saturated value is far above every limit.
        let charge = alike.get().saturating_mul(own_us.into());
        let by_charge = charge.checked_div(width_us.into()).unwrap_or(0);
        amplitude.min(Amplitude::new(by_charge))
    }
}

/// Returns the charge of one phase, in thousandths · µs, at most 150 000 · 500.
fn charge(stimulus: Stimulus) -> u32 {
    stimulus
        .amplitude
        .get()
        .saturating_mul(stimulus.width_us.into())
}
