//! Finds the memory areas of an image in which bits are flipped.

use super::declaration::{Memory, WrittenStratum};
use super::error::FaultsError;
use firmware::safety::StageWords;
use hal_sim::chip::board::stages::COPIES;
use hal_sim::chip::image::Image;
use std::ops::Range;

/// Addresses of SRAM1, which only the core accesses.
pub(super) const SRAM1: Range<u32> = 0x2000_0000..0x2001_C000;
/// Linker symbol at the end of all variables. The stack may grow down to this address.
const END_OF_VARIABLES: &str = "__sheap";

/// A memory area of the image, and the number of bits to flip in it.
#[derive(Clone, Debug)]
pub(super) struct Stratum {
    pub kind: String,
    pub count: u64,
    pub in_refill: bool,
    pub area: Area,
}

/// Addresses from which the byte to flip is chosen at random.
#[derive(Clone, Debug)]
pub(super) enum Area {
    /// Fixed address ranges; every byte of them is equally likely.
    Bytes(Vec<Range<u32>>),
    /// The used part of the main stack: from the current stack pointer up to this address.
    Live(u32),
}

impl Area {
    /// Returns the number of bytes in the area while the main stack pointer is `msp`.
    fn bytes(&self, msp: u32) -> u64 {
        match self {
            Self::Bytes(ranges) => ranges.iter().map(|range| range.len() as u64).sum(),
            Self::Live(top) => top.saturating_sub(msp).into(),
        }
    }

    /// Returns the address at the fraction `part`, 0 to 1, of the area while the main stack pointer
    /// is `msp`; `None` if the stack is empty.
    pub fn byte(&self, part: f64, msp: u32) -> Option<u32> {
        let bytes = self.bytes(msp);
        let mut number = ((part * bytes as f64) as u64).min(bytes.checked_sub(1)?) as u32;
        match self {
            Self::Live(_) => Some(msp + number),
            Self::Bytes(ranges) => ranges.iter().find_map(|range| {
                let own = range.len() as u32;
                if number < own {
                    return Some(range.start + number);
                }
                number -= own;
                None
            }),
        }
    }

    /// Describes the area in words.
    pub fn in_words(&self) -> String {
        match self {
            Self::Live(top) => format!("the used part of the stack, below {top:#010x}"),
            Self::Bytes(ranges) => {
                let areas = ranges.iter();
                let texts =
                    areas.map(|range| format!("{:#010x} to {:#010x}", range.start, range.end - 1));
                let bytes = self.bytes(0);
                format!("{}, {bytes} bytes", texts.collect::<Vec<_>>().join(", "))
            }
        }
    }
}

/// Locates the configured memory areas in `image`. `deepest` is the lowest stack pointer of its
/// undisturbed run.
///
/// # Errors
/// Fails with E616 if the image lacks a configured variable.
pub(super) fn locate_strata(
    written: &[WrittenStratum],
    image: &Image,
    deepest: u32,
) -> Result<Vec<Stratum>, FaultsError> {
    let missing = |symbol: &str| FaultsError::NoSymbol {
        image: image.path().display().to_string(),
        symbol: symbol.to_owned(),
    };
    let variable = |name: &str| {
        let found = image
            .symbols
            .variable(name)
            .filter(|symbol| symbol.size > 0);
        let found = found.ok_or_else(|| missing(name))?;
        Ok::<_, FaultsError>(found.address..found.address + found.size)
    };
    // The first word of the vector table is the initial stack pointer.
    let top = image
        .flash
        .first_chunk()
        .copied()
        .map_or(0, u32::from_le_bytes);
    let area = |item: &WrittenStratum| {
        Ok::<_, FaultsError>(match item.memory {
            Memory::Variable => Area::Bytes(vec![variable(&item.symbol)?]),
            Memory::LiveStack => Area::Live(top),
            Memory::Stack => Area::Bytes(std::iter::once(deepest.min(top)..top).collect()),
            Memory::Table => {
                let bytes = size_of::<StageWords>() as u32; // a few tens of bytes
                Area::Bytes(COPIES.map(|copy| copy..copy + bytes).into())
            }
            Memory::Rest => {
                let end = image.symbols.find(END_OF_VARIABLES);
                let end = end.ok_or_else(|| missing(END_OF_VARIABLES))?.address;
                let others = written
                    .iter()
                    .filter(|written_stratum| written_stratum.memory == Memory::Variable);
                let others: Result<Vec<_>, _> = others
                    .map(|written_stratum| variable(&written_stratum.symbol))
                    .collect();
                Area::Bytes(subtract_ranges(SRAM1.start..end, others?))
            }
        })
    };
    let stratum = |written_stratum: &WrittenStratum| {
        Ok(Stratum {
            kind: written_stratum.kind.clone(),
            count: written_stratum.count,
            in_refill: written_stratum.in_refill,
            area: area(written_stratum)?,
        })
    };
    written.iter().map(stratum).collect()
}

/// Returns the parts of the range `area` that lie in none of `others`.
fn subtract_ranges(area: Range<u32>, mut others: Vec<Range<u32>>) -> Vec<Range<u32>> {
    others.sort_by_key(|range| range.start);
    let (mut left, mut from) = (Vec::new(), area.start);
    for other in others.into_iter().filter(|range| range.start < area.end) {
        if other.start > from {
            left.push(from..other.start);
        }
        from = from.max(other.end);
    }
    if from < area.end {
        left.push(from..area.end);
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rest_is_what_is_in_no_other() {
        let left = subtract_ranges(0..100, vec![50..60, 10..20, 10..20, 200..300]);
        assert_eq!(left, [0..10, 20..50, 60..100]);
        let area = Area::Bytes(left);
        assert_eq!(area.bytes(0), 80);
        let bytes = [0.0, 0.2, 0.999_999].map(|part| area.byte(part, 0));
        assert_eq!(bytes, [Some(0), Some(26), Some(99)]);
        assert_eq!(Area::Live(100).byte(0.5, 80), Some(90));
        assert_eq!(Area::Live(100).byte(0.5, 100), None);
    }
}
