//! The buffer of bytes for a host that is slow to read.

/// Capacity of the buffer in bytes.
pub(super) const ROOM: usize = 2048;

/// A ring buffer that is filled and emptied in runs, which takes a fraction of the time of single
/// bytes.
#[derive(Clone, Debug)]
pub(super) struct Outbox {
    bytes: [u8; ROOM],
    /// Position of the oldest byte, below [`ROOM`].
    first: usize,
    /// Number of bytes that wait, at most [`ROOM`].
    len: usize,
}

impl Outbox {
    /// Returns an empty buffer.
    pub(super) const fn new() -> Self {
        Self {
            bytes: [0; ROOM],
            first: 0,
            len: 0,
        }
    }

    /// Returns the number of bytes that wait.
    pub(super) const fn len(&self) -> usize {
        self.len
    }

    /// Appends as many of `bytes` as fit.
    pub(super) fn push(&mut self, mut bytes: &[u8]) {
        // First up to the ring's end, then from its start. Both positions are below twice ROOM.
        for _ in 0..2 {
            let start = (self.first + self.len) % ROOM;
            let end = (start + ROOM - self.len).min(ROOM);
            let copied = copy(bytes, self.bytes.get_mut(start..end));
            self.len += copied; // within the room left
            bytes = bytes.get(copied..).unwrap_or_default();
        }
    }

    /// Moves the oldest bytes into `buffer`, and returns their number.
    pub(super) fn pop(&mut self, buffer: &mut [u8]) -> usize {
        let mut taken = 0;
        for _ in 0..2 {
            let end = (self.first + self.len).min(ROOM); // below twice ROOM
            let run = self.bytes.get(self.first..end).unwrap_or_default();
            let copied = copy(run, buffer.get_mut(taken..));
            self.first = (self.first + copied) % ROOM;
            self.len -= copied; // at most the run
            taken += copied; // at most the buffer
        }
        taken
    }
}

/// Copies the bytes that fit, and returns their number.
fn copy(from: &[u8], to: Option<&mut [u8]>) -> usize {
    let to = to.unwrap_or_default();
    let count = from.len().min(to.len());
    if let (Some(from), Some(to)) = (from.get(..count), to.get_mut(..count)) {
        to.copy_from_slice(from); // of one length
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;

    #[test]
    fn it_is_a_queue_wherever_the_ring_ends() {
        let (mut outbox, mut queue) = (Outbox::new(), VecDeque::<u8>::new());
        let mut buffer = [0; 700];
        for round in 0..2_000_usize {
            let frame: [u8; 391] = core::array::from_fn(|n| (n + round) as u8);
            let frame = &frame[..round * 37 % 392];
            if outbox.len() + frame.len() <= ROOM {
                outbox.push(frame);
                queue.extend(frame);
            }
            let count = outbox.pop(&mut buffer[..round * 53 % 500]);
            assert_eq!(count, queue.len().min(round * 53 % 500));
            assert!(buffer[..count].iter().copied().eq(queue.drain(..count)));
            assert_eq!(outbox.len(), queue.len());
        }
    }

    #[test]
    fn more_than_fits_is_cut() {
        let mut outbox = Outbox::new();
        for _ in 0..3 {
            outbox.push(&[7; 1_000]);
        }
        assert_eq!(outbox.len(), ROOM);
    }
}
