//! Amplitude and pulse width, which are only ever changed together.

use crate::pulse::{CHANNELS, bits};
use crate::units::Amplitude;
use core::hash::{Hash, Hasher};

/// What the pulses of a burst are made of.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Stimulus {
    /// In the stage's thousandths.
    pub amplitude: Amplitude,
    /// Of each phase, µs; 0 for the train's own.
    pub width_us: u16,
}

impl Stimulus {
    /// Of the train's own width.
    #[must_use]
    pub const fn own(amplitude: Amplitude) -> Self {
        Self {
            amplitude,
            width_us: 0,
        }
    }
}

/// In one word, for it is summed with every burst: a bit that changes in either changes
/// the word.
impl Hash for Stimulus {
    #[inline]
    fn hash<H: Hasher>(&self, state: &mut H) {
        state.write_u32(self.amplitude.get() ^ u32::from(self.width_us).rotate_left(22));
    }
}

/// What a host orders of several channels at once.
#[derive(Clone, Copy, Hash, Debug)]
pub struct Stimuli {
    /// Bit i is channel i.
    pub mask: u16,
    /// One per bit set, lowest channel first, and nothing behind them.
    pub values: [Amplitude; CHANNELS],
    /// Widths of a phase in the same order, µs; 0 for the train's own.
    pub widths: [u16; CHANNELS],
}

impl Stimuli {
    /// The channels, rising, each with its amplitude and width.
    pub fn channels(&self) -> impl Iterator<Item = (u8, Stimulus)> + Clone {
        let channels = bits(self.mask.into()).map(|channel| channel as u8); // below 16
        let stimuli = self
            .values
            .iter()
            .zip(&self.widths)
            .map(|(&amplitude, &width_us)| Stimulus {
                amplitude,
                width_us,
            });
        channels.zip(stimuli)
    }
}
