//! The samples of a trial in memory, compressed: a day at a hundred rows per second takes tens of
//! megabytes, whereas one [`Sample`] per row would take gigabytes.

mod decode;
#[cfg(test)]
mod tests;

pub use decode::{Iter, MapEach, Reader};

use super::{DeviceState, Run, Sample};
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
    cells: Vec<PreviousValue>,
    shape: Shape,
    /// Largest number of values in the lists of a row.
    longest_row: usize,
    /// All samples uncompressed, for readers that follow [`Samples::decode_ahead`]; empty otherwise.
    decoded: Vec<Sample>,
}

type Cell = Option<f64>;

/// A value of the previous row, from which the next value at its place is encoded or decoded.
#[derive(Clone, Copy, Default)]
struct PreviousValue {
    cell: Cell,
    /// The value in millionths; 0 if it is missing or not a whole number of millionths.
    millionths: i64,
}

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
        self.decoded = Vec::new();
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
        let is_reshaped = shape != self.shape || self.count == 0;
        let state = STATES.iter().position(|state| *state == sample.state);
        let mut head = (state.unwrap_or(0) as u8) << STATE_SHIFT;
        head |= (LIMITING * u8::from(sample.limiting)) | (RESHAPED * u8::from(is_reshaped));
        self.bytes.push(head);
        if is_reshaped {
            for length in shape {
                push_varint(&mut self.bytes, length as u64);
            }
            self.longest_row = self.longest_row.max(shape.iter().sum());
            self.cells.clear();
            let count = SINGLE + shape.iter().sum::<usize>();
            self.cells.resize(count, PreviousValue::default());
            self.shape = shape;
        }
        let mask_at = self.bytes.len();
        self.bytes.resize(mask_at + self.cells.len().div_ceil(8), 0);
        let bits = |cell: Cell| cell.map(f64::to_bits);
        let values = singles.iter().chain(lists.into_iter().flatten());
        for (place, (&now, before)) in values.zip(&mut self.cells).enumerate() {
            if bits(now) != bits(before.cell) {
                self.bytes[mask_at + place / 8] |= 1 << (place % 8);
                *before = push_cell(&mut self.bytes, now, before.millionths);
            }
        }
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

    /// Returns an iterator over all samples, oldest first. It allocates the lists of each sample;
    /// [`Self::reader`] and [`Self::map_each`] allocate none.
    #[must_use]
    pub fn iter(&self) -> Iter<'_> {
        Iter::new(self.reader())
    }

    /// Returns a reader that decodes one sample after the other in place.
    #[must_use]
    pub fn reader(&self) -> Reader<'_> {
        Reader::new(&self.bytes, self.count, &self.decoded)
    }

    /// Decodes all samples once for all later readers, if they take at most `bytes` of memory
    /// uncompressed. Returns the bytes that they take; 0 if they stay compressed.
    pub fn decode_ahead(&mut self, bytes: usize) -> usize {
        // Every row is as long as the longest at most.
        let longest = self.longest_row;
        let row = size_of::<Sample>() + longest * size_of::<Cell>();
        let needed = self.count.saturating_mul(row);
        if needed > bytes {
            return 0;
        }
        if self.decoded.is_empty() {
            self.decoded = self.iter().collect();
        }
        needed
    }

    /// Returns an iterator over the result of `read` for each sample, oldest first. Every sample is
    /// decoded in place.
    pub fn map_each<T, F: FnMut(&Sample) -> T>(&self, read: F) -> MapEach<'_, F> {
        MapEach::new(self.reader(), read)
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

/// Memory that the decoded samples of a run may take, bytes: those of about 8 minutes with ten
/// muscles at 100 rows per second.
const DECODED_BYTES: usize = 1 << 25;

impl Run {
    /// Decodes the samples of short trials, so that metrics and report, which read them some thirty
    /// times, do not decode them each time. The samples of longer trials stay compressed.
    pub fn decode_ahead(&mut self) {
        let mut left = DECODED_BYTES;
        for trial in &mut self.trials {
            left -= trial.samples.decode_ahead(left);
        }
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

/// Encodes the changed value `now` and returns it as the next row needs it; `before` is the value at
/// the same place of the previous row, in millionths.
fn push_cell(bytes: &mut Vec<u8>, now: Cell, before: i64) -> PreviousValue {
    let of_cell = |millionths| PreviousValue {
        cell: now,
        millionths,
    };
    let Some(value) = now else {
        push_varint(bytes, NOTHING);
        return of_cell(0);
    };
    let Some(millionths) = millionths(value) else {
        push_varint(bytes, RAW);
        bytes.extend_from_slice(&value.to_le_bytes());
        return of_cell(0);
    };
    let difference = millionths - before;
    let zigzag = (difference << 1 ^ difference >> 63).cast_unsigned();
    push_varint(bytes, DIFFERENCE + zigzag);
    of_cell(millionths)
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
