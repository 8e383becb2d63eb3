//! A serial line in virtual time that loses, corrupts and delays frames.
//!
//! The same seed and the same pushes give the same faults, byte for byte. The line keeps the order
//! of frames, as a serial line does.

use crate::random::Random;
use std::collections::VecDeque;

/// End-of-frame byte of the link. A corruption that creates or destroys one changes how many frames
/// the receiver sees, so these are counted separately.
pub const DELIMITER: u8 = 0;

/// Probabilities and delays of the faults of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    /// Probability that a frame is lost, 0…1.
    pub loss: f64,
    /// Probability that a frame that is not lost has one bit or one byte changed, 0…1.
    pub corruption: f64,
    /// Delay of every frame, µs.
    pub delay_us: u64,
    /// Maximum additional delay as a fraction of `interval_us`; the additional delay of each frame
    /// is uniform from zero to this.
    pub jitter: f64,
    /// Nominal time between frames, µs; 11,111 for a 90 Hz stream.
    pub interval_us: u64,
}

/// Counters of a line, in frames unless noted otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Frames that the sender pushed.
    pub pushed: u64,
    /// Frames that were lost on the line.
    pub lost: u64,
    /// Frames corrupted by one inverted bit.
    pub bit_flips: u64,
    /// Frames corrupted by one replaced byte.
    pub byte_flips: u64,
    /// Frames corrupted by changing a [`DELIMITER`] into another byte (the receiver sees this frame
    /// and the next as one).
    pub delimiters_destroyed: u64,
    /// Frames corrupted by changing another byte into a [`DELIMITER`] (the receiver sees two
    /// frames).
    pub delimiters_made: u64,
    /// Frames delayed by jitter.
    pub jittered: u64,
    /// Frames held back behind an earlier frame, to keep the order.
    pub held_back: u64,
    /// Frames handed to the receiver.
    pub delivered: u64,
    /// Maximum time from push to arrival, µs.
    pub longest_us: u64,
}

impl Counts {
    /// Returns the number of frames that were changed in any way.
    pub fn corrupted(&self) -> u64 {
        self.bit_flips + self.byte_flips
    }
}

/// One direction of a faulty line.
#[derive(Clone, Debug)]
pub struct FaultyLine {
    faults: Faults,
    random: Random,
    queue: VecDeque<(u64, Vec<u8>)>,
    last_arrival_us: u64,
    counts: Counts,
}

impl FaultyLine {
    /// Creates a line with `faults`; equal seeds give equal faults.
    pub fn new(faults: Faults, seed: u64) -> FaultyLine {
        FaultyLine {
            faults,
            random: Random::new(seed),
            queue: VecDeque::new(),
            last_arrival_us: 0,
            counts: Counts::default(),
        }
    }

    /// Sends one frame at `t_us`. Times must not decrease.
    pub fn push(&mut self, t_us: u64, frame: &[u8]) {
        self.counts.pushed += 1;
        // All random numbers are generated for every frame, so that a change of one fault's
        // probability leaves the other faults where they were.
        let [loss, corruption, jitter] = std::array::from_fn(|_| self.random.unit());
        let [which, place, change] = std::array::from_fn(|_| self.random.word());
        if loss < self.faults.loss {
            self.counts.lost += 1;
            return;
        }
        let mut bytes = frame.to_vec();
        if corruption < self.faults.corruption && !bytes.is_empty() {
            self.corrupt(&mut bytes, which, place, change);
        }
        let jitter_us = (jitter * self.faults.jitter * self.faults.interval_us as f64) as u64;
        self.counts.jittered += u64::from(jitter_us > 0);
        let own_us = t_us + self.faults.delay_us + jitter_us;
        let arrival_us = own_us.max(self.last_arrival_us);
        self.counts.held_back += u64::from(arrival_us > own_us);
        self.counts.longest_us = self.counts.longest_us.max(arrival_us - t_us);
        self.last_arrival_us = arrival_us;
        self.queue.push_back((arrival_us, bytes));
    }

    /// Takes the frames that have arrived by `t_us`, with their arrival times, in order. Frames
    /// that the caller does not take stay on the line.
    pub fn pop_until(&mut self, t_us: u64) -> impl Iterator<Item = (u64, Vec<u8>)> {
        std::iter::from_fn(move || {
            let arrived = self.queue.front().is_some_and(|frame| frame.0 <= t_us);
            let frame = self.queue.pop_front_if(|_| arrived)?;
            self.counts.delivered += 1;
            Some(frame)
        })
    }

    /// Returns the arrival time of the next frame, if one is on its way.
    pub fn next_arrival_us(&self) -> Option<u64> {
        self.queue.front().map(|frame| frame.0)
    }

    /// Returns the counters of the line so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    fn corrupt(&mut self, bytes: &mut [u8], which: u64, place: u64, change: u64) {
        let index = (place % bytes.len() as u64) as usize;
        let byte = &mut bytes[index];
        let before = *byte;
        if which & 1 == 0 {
            self.counts.bit_flips += 1;
            *byte ^= 1 << (change % 8);
        } else {
            self.counts.byte_flips += 1;
            *byte ^= 1 + (change % 255) as u8;
        }
        self.counts.delimiters_destroyed += u64::from(before == DELIMITER);
        self.counts.delimiters_made += u64::from(*byte == DELIMITER);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const INTERVAL_US: u64 = 11_111;

    fn run(faults: Faults, seed: u64, frames: u64) -> (FaultyLine, Vec<(u64, Vec<u8>)>) {
        let mut line = FaultyLine::new(faults, seed);
        let mut out = Vec::new();
        for i in 0..frames {
            let t_us = i * INTERVAL_US;
            out.extend(line.pop_until(t_us));
            line.push(t_us, &frame(i));
        }
        out.extend(line.pop_until(u64::MAX));
        (line, out)
    }

    fn frame(i: u64) -> Vec<u8> {
        let mut bytes: Vec<u8> = i.to_le_bytes().iter().map(|b| b | 1).collect();
        bytes.push(DELIMITER);
        bytes
    }

    #[test]
    fn a_perfect_line_changes_nothing() {
        let (line, out) = run(Faults::default(), 1, 100);
        for (i, (t_us, bytes)) in out.iter().enumerate() {
            assert_eq!((*t_us, bytes), (i as u64 * INTERVAL_US, &frame(i as u64)));
        }
        let expected = Counts {
            pushed: 100,
            delivered: 100,
            ..Counts::default()
        };
        assert_eq!(line.counts(), expected);
    }

    #[test]
    fn every_fault_is_counted_exactly() {
        let faults = Faults {
            loss: 0.1,
            corruption: 0.1,
            delay_us: 2_000,
            jitter: 0.3,
            interval_us: INTERVAL_US,
        };
        let (line, out) = run(faults, 7, 10_000);
        let counts = line.counts();
        assert_eq!(counts.pushed, counts.lost + counts.delivered);
        assert_eq!(counts.delivered, out.len() as u64);
        // Frames differ in their low bytes; the time gives the original of each.
        let original = |t_us: u64| frame((t_us - 2_000) / INTERVAL_US);
        let changed = out.iter().filter(|(t, b)| *b != original(*t)).count();
        assert_eq!(changed as u64, counts.corrupted());
        let delimiters = |bytes: &[u8]| bytes.iter().filter(|&&b| b == DELIMITER).count() as u64;
        let seen: u64 = out.iter().map(|(_, bytes)| delimiters(bytes)).sum();
        let expected = counts.delivered + counts.delimiters_made - counts.delimiters_destroyed;
        assert_eq!(seen, expected);
        // Binomial distribution of 10,000 draws at 0.1: standard deviation 30 (28.5 for
        // corruption).
        assert!(counts.lost.abs_diff(1_000) < 120, "{counts:?}");
        assert!(counts.corrupted().abs_diff(900) < 120, "{counts:?}");
        assert!(counts.bit_flips > 0 && counts.byte_flips > 0);
        assert!(counts.longest_us <= 2_000 + 3_333 && counts.longest_us > 2_000 + 3_200);
    }

    #[test]
    fn a_seed_repeats_and_another_differs() {
        let faults = Faults {
            loss: 0.01,
            corruption: 0.01,
            jitter: 0.3,
            interval_us: INTERVAL_US,
            ..Faults::default()
        };
        assert_eq!(run(faults, 3, 1_000).1, run(faults, 3, 1_000).1);
        assert_ne!(run(faults, 3, 1_000).1, run(faults, 4, 1_000).1);
    }

    #[test]
    fn order_is_kept_when_jitter_exceeds_the_interval() {
        let faults = Faults {
            jitter: 5.0,
            interval_us: INTERVAL_US,
            ..Faults::default()
        };
        let (line, out) = run(faults, 5, 1_000);
        assert!(line.counts().held_back > 100);
        assert!(out.is_sorted_by_key(|frame| frame.0));
        let numbers: Vec<Vec<u8>> = (0..1_000).map(frame).collect();
        assert!(out.into_iter().map(|frame| frame.1).eq(numbers));
    }

    #[test]
    fn frames_not_taken_stay() {
        let mut line = FaultyLine::new(Faults::default(), 0);
        line.push(5, b"a");
        line.push(6, b"b");
        assert_eq!(line.next_arrival_us(), Some(5));
        assert_eq!(line.pop_until(4).count(), 0);
        assert_eq!(line.pop_until(9).next(), Some((5, b"a".to_vec())));
        assert_eq!(line.pop_until(9).next(), Some((6, b"b".to_vec())));
        assert_eq!(line.next_arrival_us(), None);
    }
}
