//! Amplitude and pulse width, which always change together.

use crate::pulse::{CHANNELS, bit_positions};
use crate::units::Amplitude;
use core::hash::{Hash, Hasher};

/// Amplitude and pulse width of all pulses of a burst.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Stimulus {
    /// Amplitude in the stage's thousandths (µA or mV).
    pub amplitude: Amplitude,
    /// Width of each phase, µs; 0 stands for the train's own width.
    pub width_us: u16,
}

impl Stimulus {
    /// Returns a stimulus with the train's own width.
    #[must_use]
    pub const fn with_own_width(amplitude: Amplitude) -> Self {
        Self {
            amplitude,
            width_us: 0,
        }
    }
}

/// Hashes one word, because the checksum over it is computed at every burst. A bit flip in either
/// value changes the word.
impl Hash for Stimulus {
    #[inline]
    fn hash<H: Hasher>(&self, state: &mut H) {
        state.write_u32(self.amplitude.get() ^ u32::from(self.width_us).rotate_left(22));
    }
}

/// Amplitudes and widths that a host sets for several channels at once.
#[derive(Clone, Copy, Hash, Debug)]
pub struct Stimuli {
    /// Channels for which the host sets an amplitude; bit i is channel i.
    pub mask: u16,
    /// One amplitude for each bit set in `mask`, lowest channel first; entries behind them are
    /// unused.
    pub values: [Amplitude; CHANNELS],
    /// Widths of a phase in the same order, µs; 0 stands for the train's own width.
    pub widths: [u16; CHANNELS],
}

impl Stimuli {
    /// Returns the channels in rising order, each with its amplitude and width.
    pub fn channels(&self) -> impl Iterator<Item = (u8, Stimulus)> + Clone {
        let channels = bit_positions(self.mask.into()).map(|channel| channel as u8); // below 16
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
