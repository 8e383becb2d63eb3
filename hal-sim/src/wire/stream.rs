//! Timed writes of a host, and functions that corrupt them at chosen places.
//!
//! A [`FaultyLine`](super::faults::FaultyLine) disturbs frames at random and keeps their order;
//! this module disturbs only the chosen writes and need not keep the order.

use super::faults::DELIMITER;

/// Bytes that a host writes at once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Write {
    /// Time of the write, µs.
    pub t_us: u64,
    /// Bytes of the write, which need not be whole frames.
    pub bytes: Vec<u8>,
}

/// Writes in order of time. Writes of equal time keep the order in which they were made.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Stream {
    writes: Vec<Write>,
}

impl Stream {
    /// Creates a stream from `writes`, in any order.
    #[must_use]
    pub fn new(mut writes: Vec<Write>) -> Self {
        writes.sort_by_key(|write| write.t_us);
        Self { writes }
    }

    /// Returns the writes in order of time.
    #[must_use]
    pub fn writes(&self) -> &[Write] {
        &self.writes
    }

    /// Adds a write behind the existing ones of the same time.
    pub fn add(&mut self, t_us: u64, bytes: Vec<u8>) {
        let place = self.writes.partition_point(|write| write.t_us <= t_us);
        self.writes.insert(place, Write { t_us, bytes });
    }

    /// Inverts bits of write `index`, counted from the lowest bit of its first byte. Bits beyond
    /// the end are ignored.
    pub fn flip_bits(&mut self, index: usize, bits: &[usize]) {
        let Some(write) = self.writes.get_mut(index) else {
            return;
        };
        for bit in bits {
            if let Some(byte) = write.bytes.get_mut(bit / 8) {
                *byte ^= 1 << (bit % 8);
            }
        }
    }

    /// Exchanges the bytes of two writes, whose times stay. Indices that do not exist are ignored.
    pub fn swap_writes(&mut self, first: usize, other: usize) {
        if first.max(other) < self.writes.len() && first != other {
            let bytes = std::mem::take(&mut self.writes[first].bytes);
            let bytes = std::mem::replace(&mut self.writes[other].bytes, bytes);
            self.writes[first].bytes = bytes;
        }
    }

    /// Repeats write `index`, `after_us` later.
    pub fn repeat_write(&mut self, index: usize, after_us: u64) {
        if let Some(Write { t_us, bytes }) = self.writes.get(index).cloned() {
            self.add(t_us + after_us, bytes);
        }
    }

    /// Truncates write `index` to its first `length` bytes; the rest arrives `late_us` later, or
    /// never.
    pub fn truncate_write(&mut self, index: usize, length: usize, late_us: Option<u64>) {
        let Some(write) = self.writes.get_mut(index) else {
            return;
        };
        let rest = write.bytes.split_off(length.min(write.bytes.len()));
        let t_us = write.t_us;
        if let Some(late_us) = late_us {
            self.add(t_us + late_us, rest);
        }
    }

    /// Removes the writes of `from_us..until_us`.
    pub fn drop_writes(&mut self, from_us: u64, until_us: u64) {
        self.writes
            .retain(|write| !(from_us..until_us).contains(&write.t_us));
    }

    /// Returns the frames that a receiver reads: the bytes up to and including a [`DELIMITER`],
    /// with the time at which that arrived.
    #[must_use]
    pub fn frames(&self) -> Vec<Write> {
        let (mut frames, mut bytes) = (Vec::new(), Vec::new());
        for write in &self.writes {
            for &byte in &write.bytes {
                bytes.push(byte);
                if byte == DELIMITER {
                    let bytes = std::mem::take(&mut bytes);
                    frames.push(Write {
                        t_us: write.t_us,
                        bytes,
                    });
                }
            }
        }
        frames
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream() -> Stream {
        let write = |k: u8| Write {
            t_us: 10 * u64::from(k),
            bytes: vec![k, 0x80 | k, DELIMITER],
        };
        Stream::new([3, 1, 2].map(write).into())
    }

    /// Returns the writes as pairs of time and bytes.
    fn told(writes: &[Write]) -> Vec<(u64, &[u8])> {
        let entries = writes.iter();
        entries.map(|write| (write.t_us, &*write.bytes)).collect()
    }

    #[test]
    fn writes_are_in_order_and_read_as_frames() {
        let expected: [(u64, &[u8]); 3] =
            [(10, &[1, 129, 0]), (20, &[2, 130, 0]), (30, &[3, 131, 0])];
        assert_eq!(told(stream().writes()), expected);
        assert_eq!(stream().frames(), stream().writes());
    }

    #[test]
    fn a_turned_delimiter_joins_two_frames_and_a_made_one_divides_one() {
        let mut joined = stream();
        joined.flip_bits(0, &[16, 999]);
        assert_eq!(told(&joined.frames())[0], (20, &[1, 129, 1, 2, 130, 0][..]));
        let mut divided = stream();
        divided.flip_bits(0, &[0]);
        let frames = divided.frames();
        assert_eq!(told(&frames)[..2], [(10, &[0][..]), (10, &[129, 0][..])]);
    }

    #[test]
    fn frames_change_places_and_come_twice() {
        let mut exchanged = stream();
        exchanged.swap_writes(0, 2);
        exchanged.swap_writes(1, 7);
        let bytes = |stream: &Stream| -> Vec<u8> {
            let writes = stream.writes().iter();
            writes.map(|write| write.bytes[0]).collect()
        };
        assert_eq!(bytes(&exchanged), [3, 2, 1]);
        let mut twice = stream();
        twice.repeat_write(0, 10);
        assert_eq!(bytes(&twice), [1, 2, 1, 3]);
        assert_eq!(twice.writes()[2].t_us, 20);
    }

    #[test]
    fn the_rest_of_a_cut_frame_comes_late_or_never() {
        let mut lost = stream();
        lost.truncate_write(0, 1, None);
        assert_eq!(told(&lost.frames())[0], (20, &[1, 2, 130, 0][..]));
        let mut late = stream();
        late.truncate_write(0, 1, Some(5));
        assert_eq!(told(&late.frames())[0], (15, &[1, 129, 0][..]));
        let mut behind = stream();
        behind.truncate_write(0, 1, Some(15));
        let read = behind.frames();
        let expected: [(u64, &[u8]); 2] = [(20, &[1, 2, 130, 0]), (25, &[129, 0])];
        assert_eq!(told(&read)[..2], expected);
    }

    #[test]
    fn what_comes_while_nothing_is_heard_is_lost() {
        let mut heard = stream();
        heard.drop_writes(20, 30);
        assert_eq!(heard.frames().len(), 2);
        heard.drop_writes(0, u64::MAX);
        assert_eq!(heard.frames(), []);
    }
}
