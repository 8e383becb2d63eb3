//! The samples of a trial in memory, compressed: a day at a hundred rows per second takes tens of
//! megabytes, whereas one [`Sample`] per row would take gigabytes.

#[cfg(test)]
mod tests;

use super::{DeviceState, Sample};
use crate::number::millionths;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// Telemetry samples in compressed form, oldest first. A row is stored as its difference from the
/// previous row: one bit per value says whether the value changed. A changed value is stored as a
/// difference in whole millionths, or with all its 64 bits if it is not a whole number of
/// millionths. Reading gives the original values, bit for bit.
#[derive(Clone, Default)]
pub struct Samples {
    bytes: Vec<u8>,
    count: usize,
    last: Option<Sample>,
    /// Values of the latest row, from which the next row is encoded.
    cells: Vec<Cell>,
    shape: Shape,
}

type Cell = Option<f64>;

/// Number of values of a sample that are not in a list.
const SINGLE: usize = 7;
/// Lengths of the lists of a sample.
type Shape = [usize; 11];

/// States of the device; a row stores the index of its state in this list.
const STATES: [DeviceState; 6] = [
    DeviceState::Boot,
    DeviceState::Idle,
    DeviceState::Armed,
    DeviceState::Stimulating,
    DeviceState::Stopping,
    DeviceState::Fault,
];

/// Bit of a row's first byte which says that lengths of lists follow, because they differ from
/// those of the previous row.
const RESHAPED: u8 = 1;
/// Bit of a row's first byte for [`Sample::limiting`].
const LIMITING: u8 = 2;
/// Position of the state's index in a row's first byte.
const STATE_SHIFT: u32 = 2;

/// Code of a changed value that is now missing.
const NOTHING: u64 = 0;
/// Code of a changed value whose 64 bits follow.
const RAW: u64 = 1;
/// Smallest code of a changed value that is stored as a difference. The code minus this number is
/// the zigzag-encoded difference in millionths.
const DIFFERENCE: u64 = 2;

impl Samples {
    /// Appends a row.
    pub fn push(&mut self, sample: Sample) {
        let lists = lists(&sample);
        let shape = lists.map(|list| list.len());
        let singles = [
            Some(sample.t_s),
            sample.target_deg,
            sample.measured_deg,
            sample.true_deg,
            sample.effort,
            sample.hand_made,
            sample.held,
        ];
        let values = lists.into_iter().flatten().copied();
        let cells: Vec<Cell> = singles.into_iter().chain(values).collect();
        let is_reshaped = shape != self.shape || self.count == 0;
        let state = STATES.iter().position(|state| *state == sample.state);
        let mut head = (state.unwrap_or(0) as u8) << STATE_SHIFT;
        head |= (LIMITING * u8::from(sample.limiting)) | (RESHAPED * u8::from(is_reshaped));
        self.bytes.push(head);
        if is_reshaped {
            for length in shape {
                push_varint(&mut self.bytes, length as u64);
            }
            self.cells = vec![None; cells.len()];
            self.shape = shape;
        }
        let bits = |cell: &Cell| cell.map(f64::to_bits);
        let mut pairs = cells.iter().zip(&self.cells);
        let mask_at = self.bytes.len();
        self.bytes.resize(mask_at + cells.len().div_ceil(8), 0);
        for place in 0..cells.len() {
            let Some((now, before)) = pairs.next().filter(|(a, b)| bits(a) != bits(b)) else {
                continue;
            };
            self.bytes[mask_at + place / 8] |= 1 << (place % 8);
            push_cell(&mut self.bytes, *now, *before);
        }
        self.cells = cells;
        self.count += 1;
        self.last = Some(sample);
    }

    /// Returns the number of samples.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.count
    }

    /// Returns whether there are no samples.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns the oldest sample.
    #[must_use]
    pub fn first(&self) -> Option<Sample> {
        self.iter().next()
    }

    /// Returns the latest sample.
    #[must_use]
    pub const fn last(&self) -> Option<&Sample> {
        self.last.as_ref()
    }

    /// Returns an iterator over all samples, oldest first.
    #[must_use]
    pub fn iter(&self) -> Iter<'_> {
        Iter {
            bytes: &self.bytes,
            left: self.count,
            cells: Vec::new(),
            shape: Shape::default(),
        }
    }

    /// Keeps the first `count` samples and drops all later ones.
    pub fn truncate(&mut self, count: usize) {
        if count < self.count {
            *self = self.iter().take(count).collect();
        }
    }

    /// Returns all samples uncompressed.
    #[must_use]
    pub fn to_vec(&self) -> Vec<Sample> {
        self.iter().collect()
    }

    /// Applies `change` to each sample. All samples are in memory uncompressed meanwhile.
    pub fn modify_each(&mut self, change: impl FnMut(&mut Sample)) {
        let mut samples = self.to_vec();
        samples.iter_mut().for_each(change);
        *self = samples.into();
    }
}

/// Returns the lists of a sample, in the order of the lengths in [`Shape`].
fn lists(sample: &Sample) -> [&[Cell]; 11] {
    [
        &sample.amplitudes,
        &sample.widths_us,
        &sample.forces_n,
        &sample.wanted_n,
        &sample.rates_hz,
        &sample.below_n,
        &sample.above_n,
        &sample.hand_n,
        &sample.hand_true_n,
        &sample.joint_deg,
        &sample.phase,
    ]
}

/// Iterator over samples that decodes one sample at a time.
#[derive(Clone)]
pub struct Iter<'a> {
    bytes: &'a [u8],
    left: usize,
    cells: Vec<Cell>,
    shape: Shape,
}

impl Iterator for Iter<'_> {
    type Item = Sample;

    fn next(&mut self) -> Option<Sample> {
        self.left = self.left.checked_sub(1)?;
        let head = self.byte();
        if head & RESHAPED != 0 {
            self.shape = std::array::from_fn(|_| self.varint() as usize);
            self.cells = vec![None; SINGLE + self.shape.iter().sum::<usize>()];
        }
        let (mask, rest) = self.bytes.split_at(self.cells.len().div_ceil(8));
        self.bytes = rest;
        // Most values stay from row to row, so this visits set bits only.
        for (first, &byte) in (0..).step_by(8).zip(mask) {
            let mut changed = byte;
            while changed != 0 {
                let place = first + changed.trailing_zeros() as usize;
                changed &= changed - 1;
                self.cells[place] = self.cell(self.cells[place]);
            }
        }
        Some(self.sample(head))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.left, Some(self.left))
    }
}

impl ExactSizeIterator for Iter<'_> {}

impl Iter<'_> {
    /// Returns the next byte; 0 at the end of the data, which is not reached because
    /// [`Samples::push`] writes complete rows.
    fn byte(&mut self) -> u8 {
        let (first, rest) = self.bytes.split_first().unwrap_or((&0, &[]));
        self.bytes = rest;
        *first
    }

    fn varint(&mut self) -> u64 {
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

    /// Decodes a changed value; `before` is the value at the same place of the previous row.
    fn cell(&mut self, before: Cell) -> Cell {
        match self.varint() {
            NOTHING => None,
            RAW => {
                let bytes: [u8; 8] = std::array::from_fn(|_| self.byte());
                Some(f64::from_le_bytes(bytes))
            }
            code => {
                let zigzag = code - DIFFERENCE;
                let difference = (zigzag >> 1).cast_signed() ^ -(zigzag & 1).cast_signed();
                Some((millionths_or_zero(before) + difference) as f64 / 1e6)
            }
        }
    }

    /// Assembles a sample from the decoded values and the row's first byte `head`.
    fn sample(&self, head: u8) -> Sample {
        let single = |place: usize| self.cells[place];
        let mut lists = &self.cells[SINGLE..];
        let [
            amplitudes,
            widths_us,
            forces_n,
            wanted_n,
            rates_hz,
            below_n,
            above_n,
            hand_n,
            hand_true_n,
            joint_deg,
            phase,
        ] = self.shape.map(|length| {
            let (list, rest) = lists.split_at(length);
            lists = rest;
            list.to_vec()
        });
        Sample {
            t_s: single(0).unwrap_or_default(),
            target_deg: single(1),
            measured_deg: single(2),
            true_deg: single(3),
            effort: single(4),
            limiting: head & LIMITING != 0,
            state: STATES[usize::from(head >> STATE_SHIFT)],
            amplitudes,
            widths_us,
            forces_n,
            wanted_n,
            rates_hz,
            below_n,
            above_n,
            hand_n,
            hand_made: single(5),
            hand_true_n,
            held: single(6),
            joint_deg,
            phase,
        }
    }
}

/// Returns a value in millionths; 0 if it is missing or not a whole number of millionths.
fn millionths_or_zero(cell: Cell) -> i64 {
    cell.and_then(millionths).unwrap_or(0)
}

/// Encodes the changed value `now`; `before` is the value at the same place of the previous row.
fn push_cell(bytes: &mut Vec<u8>, now: Cell, before: Cell) {
    let Some(value) = now else {
        return push_varint(bytes, NOTHING);
    };
    let Some(millionths) = millionths(value) else {
        push_varint(bytes, RAW);
        return bytes.extend_from_slice(&value.to_le_bytes());
    };
    let difference = millionths - millionths_or_zero(before);
    let zigzag = (difference << 1 ^ difference >> 63).cast_unsigned();
    push_varint(bytes, DIFFERENCE + zigzag);
}

/// Appends `value` in groups of seven bits, the lowest first. The top bit of a byte says that more
/// follow.
fn push_varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

impl FromIterator<Sample> for Samples {
    fn from_iter<I: IntoIterator<Item = Sample>>(rows: I) -> Self {
        let mut samples = Self::default();
        rows.into_iter().for_each(|sample| samples.push(sample));
        samples
    }
}

impl From<Vec<Sample>> for Samples {
    fn from(rows: Vec<Sample>) -> Self {
        rows.into_iter().collect()
    }
}

impl<'a> IntoIterator for &'a Samples {
    type Item = Sample;
    type IntoIter = Iter<'a>;

    fn into_iter(self) -> Iter<'a> {
        self.iter()
    }
}

impl PartialEq for Samples {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

impl fmt::Debug for Samples {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self).finish()
    }
}

impl Serialize for Samples {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(self)
    }
}

impl<'de> Deserialize<'de> for Samples {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        Vec::deserialize(from).map(|rows: Vec<Sample>| rows.into())
    }
}
