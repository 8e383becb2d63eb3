//! What all channels together put through the common return: every one of them flows
//! back through the same electrode.

use super::{Channel, Sums};
use crate::pulse::{CHANNELS, Train, TrainSpec, gcd};
use crate::units::MicroAmps;

/// Most phases of one sign in a burst.
const MOST_PULSES: usize = TrainSpec::BURST_COUNT.max as usize;

impl Sums {
    /// Of these channels. Exact for trains of one period from the common epoch, and so
    /// is the root of the sum of squares where no two phases of one sign meet; never too
    /// low for others: phases count as meeting where their periods' greatest common
    /// divisor lets them, and those of triggered trains, of lists, of rates that may change
    /// and of
    /// bursts with another period wherever they have the same sign, as do second phases
    /// whose beginning a live width moves; first ones last as long as they may. Of two
    /// channels that
    /// meet, the product of their rms currents stands for the mean of their product
    /// (Cauchy and Schwarz).
    ///
    /// No search over time: a few thousand distances at most.
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
                square += if channel.meets(other) {
                    2 * u64::from(root_up(own * its)) // of at most 6.25e18
                } else {
                    0
                };
            }
        }
        Self {
            peak: MicroAmps::new(peak),
            rms: MicroAmps::new(root_up(square)),
        }
    }

    /// The same, or more, after `channel` turned out to drive what `now` does: the whole
    /// difference is added, for to search once more where pulses meet is no refill's
    /// work. Never too low: at an instant no more can come to it, and the rms of a sum is
    /// at most the sum of rms (Minkowski).
    pub(super) fn add(&mut self, channel: &Channel, now: &Channel) {
        let more = now.current().get().saturating_sub(channel.current().get());
        // At most 20 mA each: a voltage stage's limiter.
        self.peak = MicroAmps::new(self.peak.get() + more);
        self.rms = MicroAmps::new(self.rms.get() + now.rms_of(more));
    }
}

impl Channel {
    fn current(&self) -> MicroAmps {
        self.stage.current(self.limit)
    }

    /// Rms current at its limit and highest rate, rounded up.
    #[must_use]
    pub fn rms(&self) -> MicroAmps {
        MicroAmps::new(self.rms_of(self.current().get()))
    }

    /// Rms current of phases of `ua`, at most 1e5, at its highest rate, rounded up, µA.
    #[inline(never)]
    fn rms_of(&self, ua: u32) -> u32 {
        root_up(self.mean_square(ua))
    }

    /// Its square, µA².
    fn mean_square(&self, ua: u32) -> u64 {
        let ua = u64::from(ua);
        let square = ua * ua * u64::from(self.train.on_us(self.judged_width_us));
        square.div_ceil(self.min_period_us.max(1).into())
    }

    /// The most that flows at the start of one of its phases of a sign.
    fn peak_with<'c>(&self, channels: impl Iterator<Item = &'c Self>, is_cathodic: bool) -> u32 {
        let Some(lag) = Lag::of(&self.train, is_cathodic) else {
            return 0;
        };
        let mut sums = [self.current().get(); MOST_PULSES];
        for other in channels.filter(|other| !core::ptr::eq(*other, self)) {
            let ua = other.current().get();
            let apart = Apart::of(self, other, is_cathodic);
            for (pulse, sum) in (0u8..).zip(&mut sums) {
                let is_met = apart.is_driven_at(self.train.pulse_offset_us(pulse) + lag.us);
                *sum += if is_met { ua } else { 0 }; // at most 10 · 1e5
            }
        }
        let pulses = sums.iter().take(self.train.spec().burst_count.into());
        pulses.copied().max().unwrap_or(0)
    }

    /// Whether phases of one sign of the two can be driven at the same time.
    fn meets(&self, other: &Self) -> bool {
        let begins_in = |a: &Self, b: &Self, is_cathodic| {
            let Some(lag) = Lag::of(&a.train, is_cathodic) else {
                return false;
            };
            let apart = Apart::of(a, b, is_cathodic);
            let mut pulses = 0..a.train.spec().burst_count;
            pulses.any(|pulse| apart.is_driven_at(a.train.pulse_offset_us(pulse) + lag.us))
        };
        let either = |is_cathodic| {
            begins_in(self, other, is_cathodic) || begins_in(other, self, is_cathodic)
        };
        either(true) || either(false)
    }

    /// Whether its pulses keep their distance from the common epoch.
    pub(super) const fn is_steady(&self) -> bool {
        let spec = self.train.spec();
        self.min_period_us == self.max_period_us && spec.trigger.is_none() && !spec.lists
    }
}

/// When a channel drives one sign, as another's burst sees it.
#[derive(Clone, Copy, Debug)]
enum Apart {
    Never,
    /// It can at any time.
    Anywhen,
    Known {
        /// The distances of the two repeat after this, µs.
        every_us: u32,
        /// From the other channel's first phase of that sign to the burst, µs.
        since_us: u32,
        width_us: u32,
        interval_us: u32,
        count: u32,
    },
}

impl Apart {
    /// `other`, as a burst of `own` sees it.
    fn of(own: &Channel, other: &Channel, is_cathodic: bool) -> Self {
        let Some(lag) = Lag::of(&other.train, is_cathodic) else {
            return Self::Never;
        };
        let varies = lag.varies || Lag::of(&own.train, is_cathodic).is_some_and(|l| l.varies);
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

    /// Whether it drives so long after the burst's start.
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

/// How long after its start a pulse drives one sign.
#[derive(Clone, Copy, Debug)]
struct Lag {
    /// At the train's own width, µs.
    us: u32,
    /// Another width would make it another.
    varies: bool,
}

impl Lag {
    /// Of the phase of this sign, if there is one.
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

/// The square root, rounded up; at most 1e6 here.
const fn root_up(square: u64) -> u32 {
    let root = square.isqrt();
    (root + (root * root < square) as u64) as u32
}
