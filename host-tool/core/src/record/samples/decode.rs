//! Decodes compressed samples, row by row. Only one row is in memory uncompressed.

use super::{
    Cell, DIFFERENCE, LIMITING, NOTHING, RAW, RESHAPED, SINGLE, STATE_SHIFT, STATES, Shape,
};
use crate::record::Sample;

/// Reader that decodes one sample after the other into the same place. A row stores only the values
/// that changed, so that a value which stays costs nothing.
#[derive(Clone)]
pub struct Reader<'a> {
    bytes: &'a [u8],
    left: usize,
    /// The values of the previous row, in millionths.
    known: Vec<i64>,
    shape: Shape,
    /// List and index of each value that is in a list, in the order of the row.
    slots: Vec<(u8, u32)>,
    sample: Sample,
    /// Samples that are decoded already; empty if there are none.
    decoded: &'a [Sample],
}

impl<'a> Reader<'a> {
    /// Reads `count` rows that [`super::Samples::push`] wrote to `bytes`; takes them from `decoded`
    /// unless that is empty.
    pub(super) fn new(bytes: &'a [u8], count: usize, decoded: &'a [Sample]) -> Self {
        Self {
            bytes,
            left: count,
            known: Vec::new(),
            shape: Shape::default(),
            slots: Vec::new(),
            sample: Sample::default(),
            decoded,
        }
    }

    /// Returns the next sample; `None` after the last one.
    pub fn next_sample(&mut self) -> Option<&Sample> {
        self.left = self.left.checked_sub(1)?;
        if let Some((next, rest)) = self.decoded.split_first() {
            self.decoded = rest;
            return Some(next);
        }
        self.decode_row();
        Some(&self.sample)
    }

    /// Decodes the next row into `self.sample`.
    fn decode_row(&mut self) {
        let head = self.byte();
        if head & RESHAPED != 0 {
            self.reshape();
        }
        self.sample.limiting = head & LIMITING != 0;
        self.sample.state = STATES[usize::from(head >> STATE_SHIFT)];
        let (mask, rest) = self.bytes.split_at(self.known.len().div_ceil(8));
        self.bytes = rest;
        // Most values stay from row to row, so this visits set bits only.
        for (first, &byte) in (0..).step_by(8).zip(mask) {
            let mut changed = byte;
            while changed != 0 {
                let place = first + changed.trailing_zeros() as usize;
                changed &= changed - 1;
                let (cell, millionths) = self.value(self.known[place]);
                self.known[place] = millionths;
                self.put(place, cell);
            }
        }
    }

    /// Reads the lengths of the lists, and forgets the values of earlier rows.
    fn reshape(&mut self) {
        self.shape = std::array::from_fn(|_| self.varint() as usize);
        self.known.clear();
        let count = SINGLE + self.shape.iter().sum::<usize>();
        self.known.resize(count, 0);
        self.slots.clear();
        self.sample = Sample::default();
        for (list, &length) in (0u8..).zip(&self.shape) {
            *self.sample.list(list) = vec![None; length];
            self.slots.extend((0..length as u32).map(|at| (list, at)));
        }
    }

    /// Stores a decoded value in the sample.
    fn put(&mut self, place: usize, cell: Cell) {
        let sample = &mut self.sample;
        match place {
            0 => sample.t_s = cell.unwrap_or_default(),
            1 => sample.target_deg = cell,
            2 => sample.measured_deg = cell,
            3 => sample.true_deg = cell,
            4 => sample.effort = cell,
            5 => sample.hand_made = cell,
            6 => sample.held = cell,
            _ => {
                let (list, at) = self.slots[place - SINGLE];
                sample.list(list)[at as usize] = cell;
            }
        }
    }

    /// Returns the next byte; 0 at the end of the data, which is not reached because
    /// [`super::Samples::push`] writes complete rows.
    fn byte(&mut self) -> u8 {
        let (first, rest) = self.bytes.split_first().unwrap_or((&0, &[]));
        self.bytes = rest;
        *first
    }

    fn varint(&mut self) -> u64 {
        // Most numbers have one or two bytes.
        match *self.bytes {
            [low, ref rest @ ..] if low & 0x80 == 0 => {
                self.bytes = rest;
                u64::from(low)
            }
            [low, high, ref rest @ ..] if high & 0x80 == 0 => {
                self.bytes = rest;
                u64::from(low & 0x7F) | u64::from(high) << 7
            }
            _ => self.long_varint(),
        }
    }

    fn long_varint(&mut self) -> u64 {
        let (mut value, mut shift) = (0, 0);
        loop {
            let byte = self.byte();
            value |= u64::from(byte & 0x7F) << shift;
            shift += 7;
            if byte & 0x80 == 0 {
                return value;
            }
        }
    }

    /// Decodes a changed value, and returns it as it is and in millionths; 0 if it is missing or
    /// not a whole number of millionths. `before` is the value at the same place of the previous
    /// row, in millionths.
    fn value(&mut self, before: i64) -> (Cell, i64) {
        match self.varint() {
            NOTHING => (None, 0),
            RAW => {
                let bytes: [u8; 8] = std::array::from_fn(|_| self.byte());
                (Some(f64::from_le_bytes(bytes)), 0)
            }
            code => {
                let zigzag = code - DIFFERENCE;
                let difference = (zigzag >> 1).cast_signed() ^ -(zigzag & 1).cast_signed();
                let millionths = before + difference;
                (Some(millionths as f64 / 1e6), millionths)
            }
        }
    }
}

impl Sample {
    /// Returns the list with this index, in the order of the lengths in [`Shape`].
    fn list(&mut self, index: u8) -> &mut Vec<Cell> {
        match index {
            0 => &mut self.amplitudes,
            1 => &mut self.widths_us,
            2 => &mut self.forces_n,
            3 => &mut self.wanted_n,
            4 => &mut self.rates_hz,
            5 => &mut self.below_n,
            6 => &mut self.above_n,
            7 => &mut self.hand_n,
            8 => &mut self.hand_true_n,
            9 => &mut self.joint_deg,
            _ => &mut self.phase,
        }
    }
}

/// Iterator over samples that decodes one sample at a time and copies it.
#[derive(Clone)]
pub struct Iter<'a> {
    reader: Reader<'a>,
}

impl<'a> Iter<'a> {
    pub(super) fn new(reader: Reader<'a>) -> Self {
        Self { reader }
    }
}

impl Iterator for Iter<'_> {
    type Item = Sample;

    fn next(&mut self) -> Option<Sample> {
        self.reader.next_sample().cloned()
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.reader.left, Some(self.reader.left))
    }
}

impl ExactSizeIterator for Iter<'_> {}

/// Iterator over a result for each sample, which [`super::Samples::map_each`] returns.
#[derive(Clone)]
pub struct MapEach<'a, F> {
    reader: Reader<'a>,
    read: F,
}

impl<'a, F> MapEach<'a, F> {
    pub(super) fn new(reader: Reader<'a>, read: F) -> Self {
        Self { reader, read }
    }
}

impl<T, F: FnMut(&Sample) -> T> Iterator for MapEach<'_, F> {
    type Item = T;

    fn next(&mut self) -> Option<T> {
        self.reader.next_sample().map(&mut self.read)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.reader.left, Some(self.reader.left))
    }
}

impl<T, F: FnMut(&Sample) -> T> ExactSizeIterator for MapEach<'_, F> {}
