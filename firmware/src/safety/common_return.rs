//! Total current of all channels through the common return, the electrode through which all their
//! currents flow back.

use super::{Channel, Sums};
use crate::pulse::{CHANNELS, Train, TrainSpec, gcd};
use crate::units::MicroAmps;

/// Largest number of phases of one sign in a burst.
const MOST_PULSES: usize = TrainSpec::BURST_COUNT.max as usize;

impl Sums {
    /// Returns the peak and rms current of these channels together. The peak is exact if all trains
    /// have one period and start from the common epoch. The rms, the root of the sum of squares, is
    /// then exact too, unless phases of one sign overlap.
    ///
    /// For other trains the sums are never too low. Phases count as overlapping wherever the
    /// greatest common divisor of their periods allows it. Phases of one sign always count as
    /// overlapping if a train is triggered, takes lists or may change its rate, or if it has bursts
    /// whose period does not divide that of the other train. So do second phases whose beginning
    /// shifts with a variable width; first phases count with their largest width. For two channels
    /// that overlap, the product of their rms currents bounds the mean of their product (Cauchy and
    /// Schwarz).
    ///
    /// The computation needs no search over time: it checks a few thousand distances at most.
    #[must_use]
    pub fn of(channels: &[Option<Channel>; CHANNELS]) -> Self {
        let used = || channels.iter().flatten();
        // At most (5e4)² each: a channel keeps `limits::MAX_RMS`.
        let mut squares = [0; CHANNELS];
        for (square, channel) in squares.iter_mut().zip(used()) {
            *square = channel.mean_square(channel.current().get());
        }
        let (mut peak, mut square) = (0, 0);
        for (place, (channel, own)) in used().zip(squares).enumerate() {
            square += own; // at most 10 · 10 · 5e4² in all
            for is_cathodic in [true, false] {
                peak = peak.max(channel.peak_with(used(), is_cathodic));
            }
            for (other, its) in used().zip(squares).skip(place + 1) {
                square += if channel.can_coincide_with(other) {
                    2 * u64::from(square_root_rounded_up(own * its)) // of at most 6.25e18
                } else {
                    0
                };
            }
        }
        Self {
            peak: MicroAmps::new(peak),
            rms: MicroAmps::new(square_root_rounded_up(square)),
        }
    }

    /// Updates the sums after a measured load has shown that `channel` drives the current of `now`.
    /// The whole difference is added, because searching again for overlapping pulses takes too long
    /// for a refill. The result is never too low: at any instant no more current can be added, and
    /// the rms of a sum is at most the sum of the rms values (Minkowski).
    pub(super) fn add(&mut self, channel: &Channel, now: &Channel) {
        let more = now.current().get().saturating_sub(channel.current().get());
        // At most 20 mA each: the limiter of a voltage stage.
        self.peak = MicroAmps::new(self.peak.get() + more);
        self.rms = MicroAmps::new(self.rms.get() + now.rms_at(more));
    }
}

impl Channel {
    fn current(&self) -> MicroAmps {
        self.stage.current(self.limit)
    }

    /// Returns the rms current at the channel's limit and highest rate, rounded up.
    #[must_use]
    pub fn rms(&self) -> MicroAmps {
        MicroAmps::new(self.rms_at(self.current().get()))
    }

    /// Returns the rms current at the channel's highest rate, µA, rounded up, if its phases have
    /// the amplitude `ua` (at most 1e5 µA).
    #[inline(never)]
    fn rms_at(&self, ua: u32) -> u32 {
        square_root_rounded_up(self.mean_square(ua))
    }

    /// Returns the mean square current at the channel's highest rate, µA², if its phases have the
    /// amplitude `ua` (µA).
    fn mean_square(&self, ua: u32) -> u64 {
        let ua = u64::from(ua);
        let square = ua * ua * u64::from(self.train.burst_driven_us(self.judged_width_us));
        square.div_ceil(self.min_period_us.max(1).into())
    }

    /// Returns the largest current of one sign through the common return, µA, at the start of any
    /// of this channel's phases of that sign.
    fn peak_with<'c>(&self, channels: impl Iterator<Item = &'c Self>, is_cathodic: bool) -> u32 {
        let Some(lag) = PhaseDelay::of(&self.train, is_cathodic) else {
            return 0;
        };
        let mut sums = [self.current().get(); MOST_PULSES];
        for other in channels.filter(|other| !core::ptr::eq(*other, self)) {
            let ua = other.current().get();
            let apart = PulseSpacing::of(self, other, is_cathodic);
            for (pulse, sum) in (0u8..).zip(&mut sums) {
                let is_met = apart.is_driven_at(self.train.pulse_offset_us(pulse) + lag.us);
                *sum += if is_met { ua } else { 0 }; // at most 10 · 1e5
            }
        }
        let pulses = sums.iter().take(self.train.spec().burst_count.into());
        pulses.copied().max().unwrap_or(0)
    }

    /// Returns whether a phase of this channel can overlap a phase of `other` with the same sign.
    fn can_coincide_with(&self, other: &Self) -> bool {
        let begins_in = |a: &Self, b: &Self, is_cathodic| {
            let Some(lag) = PhaseDelay::of(&a.train, is_cathodic) else {
                return false;
            };
            let apart = PulseSpacing::of(a, b, is_cathodic);
            let mut pulses = 0..a.train.spec().burst_count;
            pulses.any(|pulse| apart.is_driven_at(a.train.pulse_offset_us(pulse) + lag.us))
        };
        let either = |is_cathodic| {
            begins_in(self, other, is_cathodic) || begins_in(other, self, is_cathodic)
        };
        either(true) || either(false)
    }

    /// Returns whether every pulse of the channel has a fixed time after the common epoch: its
    /// period cannot change, and it has neither a trigger nor lists.
    pub(super) const fn is_steady(&self) -> bool {
        let spec = self.train.spec();
        self.min_period_us == self.max_period_us && spec.trigger.is_none() && !spec.lists
    }
}

/// Times at which another channel drives one sign, relative to a burst of this channel.
#[derive(Clone, Copy, Debug)]
enum PulseSpacing {
    Never,
    /// The other channel may drive that sign at any time.
    Anywhen,
    Known {
        /// Greatest common divisor of the two periods, µs. Distances between pulses of the two
        /// channels are known up to multiples of it.
        every_us: u32,
        /// Time from the other channel's first phase of that sign to the burst, µs, up to multiples
        /// of `every_us`.
        since_us: u32,
        width_us: u32,
        interval_us: u32,
        count: u32,
    },
}

impl PulseSpacing {
    /// Returns the times of `other` relative to a burst of `own`.
    fn of(own: &Channel, other: &Channel, is_cathodic: bool) -> Self {
        let Some(lag) = PhaseDelay::of(&other.train, is_cathodic) else {
            return Self::Never;
        };
        let varies =
            lag.varies || PhaseDelay::of(&own.train, is_cathodic).is_some_and(|l| l.varies);
        let (spec, from) = (other.train.spec(), own.train.spec().offset_us);
        let every_us = gcd(own.train.spec().period_us, spec.period_us).max(1);
        let is_single = spec.burst_count == 1;
        let is_known = own.is_steady() && other.is_steady() && !varies;
        if !is_known || !(is_single || every_us == spec.period_us) {
            return Self::Anywhen;
        }
        // All below 2^23.
        let first = (spec.offset_us + lag.us) % every_us;
        Self::Known {
            every_us,
            since_us: from % every_us + every_us - first,
            width_us: other.train.widest_us().into(),
            interval_us: spec.burst_interval_us.into(),
            count: spec.burst_count.into(),
        }
    }

    /// Returns whether the other channel drives that sign `after_us` after the burst's start.
    fn is_driven_at(self, after_us: u32) -> bool {
        match self {
            Self::Never => false,
            Self::Anywhen => true,
            Self::Known {
                every_us,
                since_us,
                width_us,
                interval_us,
                count,
            } => {
                // every_us >= 1; the sum stays below 2^24.
                let since = since_us.saturating_add(after_us).checked_rem(every_us);
                let since = since.unwrap_or(0);
                let pulse = since.checked_div(interval_us).unwrap_or(0);
                let pulse = pulse.min(count.saturating_sub(1));
                since - pulse * interval_us < width_us
            }
        }
    }
}

/// Delay from a pulse's start to the phase of one sign.
#[derive(Clone, Copy, Debug)]
struct PhaseDelay {
    /// Delay at the train's own width, µs.
    us: u32,
    /// Whether another width would change the delay.
    varies: bool,
}

impl PhaseDelay {
    /// Returns the delay of the phase of this sign; `None` if the pulse has no such phase.
    fn of(train: &Train, is_cathodic: bool) -> Option<Self> {
        let spec = train.spec();
        if spec.shape.cathodic_first() == is_cathodic {
            return Some(Self {
                us: 0,
                varies: false,
            });
        }
        let second = Self {
            us: u32::from(spec.width_us) + u32::from(train.gap_us()),
            varies: train.has_live_width(),
        };
        spec.shape.is_biphasic().then_some(second)
    }
}

/// Returns the square root, rounded up; at most 1e6 here.
const fn square_root_rounded_up(square: u64) -> u32 {
    let root = square.isqrt();
    (root + (root * root < square) as u64) as u32
}
