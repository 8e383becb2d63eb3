//! Memory layout that a DfuSe device describes in the name of an alternate setting (UM0424
//! section 4.3), such as `@Internal Flash  /0x08000000/04*016Kg,01*064Kg,07*128Kg`.

use crate::chip::{Chip, Sector};
use thiserror::Error;

/// Longest accepted name in bytes: a USB string descriptor holds at most 126 UTF-16 units, each
/// of which takes up to three bytes.
const MAX_NAME: usize = 378;
/// Most accepted sectors, several times what any STM32 has.
const MAX_SECTORS: u32 = 4096;

/// Run of equal sectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Segment {
    /// Address of the first byte.
    pub address: u32,
    /// Number of sectors, at least 1.
    pub count: u32,
    /// Size of one sector in bytes, at least 1.
    pub size: u32,
    /// Whether the sectors can be read.
    pub readable: bool,
    /// Whether the sectors can be erased one by one.
    pub erasable: bool,
    /// Whether the sectors can be written.
    pub writable: bool,
}

/// Parsed memory layout.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// Name of the memory without surrounding spaces, such as `Internal Flash`.
    pub name: String,
    /// Segments in the order of the description; at least one.
    pub segments: Vec<Segment>,
}

/// Failure to read a memory layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum LayoutError {
    /// The name does not start with `@` or has no address part.
    #[error("the name of the alternate setting describes no DfuSe memory")]
    NotDfuse,
    /// The name is longer than a USB string.
    #[error("the memory layout has {length} bytes; a USB string has at most {MAX_NAME}")]
    TooLong {
        /// Length in bytes.
        length: usize,
    },
    /// A part of the description cannot be read.
    #[error("the memory layout has an invalid {field} in part {part}")]
    Invalid {
        /// Unreadable field.
        field: &'static str,
        /// Number of the part between `/`, from 1.
        part: usize,
    },
    /// The described memory exceeds 32-bit addresses or has too many sectors.
    #[error("the memory layout exceeds the 32-bit address space or {MAX_SECTORS} sectors")]
    TooLarge,
}

impl Layout {
    /// Reads the description.
    ///
    /// # Errors
    /// [`LayoutError`] names the part that cannot be read. No input panics.
    pub fn parse(text: &str) -> Result<Self, LayoutError> {
        if text.len() > MAX_NAME {
            return Err(LayoutError::TooLong { length: text.len() });
        }
        let mut parts = text
            .strip_prefix('@')
            .ok_or(LayoutError::NotDfuse)?
            .split('/');
        let name = parts.next().unwrap_or_default().trim().to_owned();
        let mut segments = Vec::new();
        let mut sectors = 0_u32;
        let mut part = 2;
        while let Some(address) = parts.next() {
            let mut address = hexadecimal(address).ok_or(LayoutError::Invalid {
                field: "address",
                part,
            })?;
            let list = parts.next().ok_or(LayoutError::Invalid {
                field: "sector list",
                part: part + 1,
            })?;
            for entry in list.split(',') {
                let segment = segment(entry, address).ok_or(LayoutError::Invalid {
                    field: "sector entry",
                    part: part + 1,
                })?;
                sectors = sectors.saturating_add(segment.count);
                let end = segment
                    .count
                    .checked_mul(segment.size)
                    .and_then(|bytes| address.checked_add(bytes));
                match end {
                    Some(end) if sectors <= MAX_SECTORS => address = end,
                    _ => return Err(LayoutError::TooLarge),
                }
                segments.push(segment);
            }
            part += 2;
        }
        if segments.is_empty() {
            return Err(LayoutError::NotDfuse);
        }
        Ok(Self { name, segments })
    }

    /// Sectors of all segments, numbered from 0; the number saturates at 255.
    #[must_use]
    pub fn sectors(&self) -> Vec<Sector> {
        let mut sectors = Vec::new();
        for segment in &self.segments {
            for index in 0..segment.count {
                let offset = index.saturating_mul(segment.size);
                sectors.push(Sector {
                    number: u8::try_from(sectors.len()).unwrap_or(u8::MAX),
                    address: segment.address.saturating_add(offset),
                    size: segment.size,
                });
            }
        }
        sectors
    }

    /// Whether the layout is exactly the flash of `chip`, with every sector readable, erasable
    /// and writable.
    #[must_use]
    pub fn is_flash_of(&self, chip: &Chip) -> bool {
        let usable = |segment: &Segment| segment.readable && segment.erasable && segment.writable;
        self.segments.iter().all(usable) && chip.sectors().eq(self.sectors())
    }
}

/// Reads `0x08000000`.
fn hexadecimal(text: &str) -> Option<u32> {
    let digits = text.trim();
    let digits = digits
        .strip_prefix("0x")
        .or_else(|| digits.strip_prefix("0X"))?;
    let valid = digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    valid.then(|| u32::from_str_radix(digits, 16).ok())?
}

/// Reads a decimal number without a sign.
fn decimal(text: &str) -> Option<u32> {
    let valid = text.bytes().all(|byte| byte.is_ascii_digit());
    valid.then(|| text.parse().ok())?
}

/// Reads one entry such as `04*016Kg`: count, size, unit (`B` or a space for bytes, `K`, `M`) and
/// a letter whose low three bits say readable (1), erasable (2) and writable (4).
fn segment(entry: &str, address: u32) -> Option<Segment> {
    let (count, rest) = entry.trim().split_once('*')?;
    let count = decimal(count).filter(|&count| count > 0)?;
    let access = rest.chars().next_back().filter(char::is_ascii_lowercase)?;
    let rest = rest.strip_suffix(access)?;
    let (digits, unit) = match rest.chars().next_back()? {
        'K' => (rest.strip_suffix('K')?, 1 << 10),
        'M' => (rest.strip_suffix('M')?, 1 << 20),
        'B' => (rest.strip_suffix('B')?, 1),
        ' ' => (rest.strip_suffix(' ')?, 1),
        _ => (rest, 1),
    };
    let size = decimal(digits)?.checked_mul(unit)?;
    let bits = u32::from(access) & 7;
    (size > 0).then_some(Segment {
        address,
        count,
        size,
        readable: bits & 1 != 0,
        erasable: bits & 2 != 0,
        writable: bits & 4 != 0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::STM32F405;
    use hal_sim::random::Sequence;

    const F405: &str = "@Internal Flash  /0x08000000/04*016Kg,01*064Kg,07*128Kg";

    #[test]
    fn reads_the_layouts_of_the_f405() {
        let flash = Layout::parse(F405).unwrap();
        assert_eq!(flash.name, "Internal Flash");
        assert!(flash.is_flash_of(&STM32F405));
        assert_eq!(flash.sectors().len(), 12);
        for (text, size) in [
            ("@Option Bytes  /0x1FFFC000/01*016 e", 16),
            ("@OTP Memory /0x1FFF7800/01*512 e,01*016 e", 528),
            ("@Device Feature/0xFFFF0000/01*004 e", 4),
        ] {
            let layout = Layout::parse(text).unwrap();
            let bytes: u32 = layout.sectors().iter().map(|sector| sector.size).sum();
            assert_eq!(bytes, size, "{text}");
            assert!(!layout.is_flash_of(&STM32F405));
        }
    }

    #[test]
    fn other_chips_do_not_match() {
        for text in [
            "@Internal Flash  /0x08000000/04*016Kg,01*064Kg,03*128Kg",
            "@Internal Flash  /0x08000000/04*016Kg,01*064Kg,07*128Ka",
            "@Internal Flash  /0x08000000/512*002Kg",
            "@Internal Flash  /0x08000000/04*016Kg,01*064Kg,07*128Kg,04*016Kg,01*064Kg,07*128Kg",
            "@Internal Flash  /0x08010000/04*016Kg,01*064Kg,07*128Kg",
        ] {
            assert!(!Layout::parse(text).unwrap().is_flash_of(&STM32F405));
        }
        let twice = "@Flash /0x08000000/02*016Kg/0x08100000/01*1Mg";
        assert_eq!(
            Layout::parse(twice).unwrap().segments[1].address,
            0x0810_0000
        );
    }

    #[test]
    fn hostile_names_are_errors() {
        use LayoutError::{Invalid, NotDfuse, TooLarge, TooLong};
        let invalid = |field, part| Invalid { field, part };
        for (text, error) in [
            ("", NotDfuse),
            ("@", NotDfuse),
            ("@é/", invalid("address", 2)),
            ("Internal Flash", NotDfuse),
            ("@F/0x08000000", invalid("sector list", 3)),
            ("@F/0x08000000/", invalid("sector entry", 3)),
            ("@F/0x+8000000/1*1Kg", invalid("address", 2)),
            ("@F/0x0800000000/1*1Kg", invalid("address", 2)),
            ("@F/0x08000000/0*1Kg", invalid("sector entry", 3)),
            ("@F/0x08000000/1*0Kg", invalid("sector entry", 3)),
            ("@F/0x08000000/+1*1Kg", invalid("sector entry", 3)),
            ("@F/0x08000000/1*1K\u{e9}", invalid("sector entry", 3)),
            ("@F/0x08000000/1*5000Mg", invalid("sector entry", 3)),
            ("@F/0xFFFFFFFF/1*1Kg", TooLarge),
            ("@F/0x08000000/4294967295*1 g", TooLarge),
            ("@F/0x08000000/4097*1 g", TooLarge),
        ] {
            assert_eq!(Layout::parse(text), Err(error), "{text}");
        }
        let long = format!("@{}", "x".repeat(400));
        assert_eq!(Layout::parse(&long), Err(TooLong { length: 401 }));
    }

    #[test]
    fn mutated_names_never_panic() {
        let mut random = Sequence::new(1);
        for _ in 0..20_000 {
            let mut text: Vec<char> = F405.chars().collect();
            for _ in 0..=random.below(4) {
                let at = random.below(text.len() as u64) as usize;
                text[at] = *[
                    '\0',
                    '/',
                    '*',
                    ',',
                    'K',
                    'g',
                    '9',
                    '\u{1F600}',
                    ' ',
                    '@',
                    'x',
                ]
                .get(random.below(11) as usize)
                .unwrap();
            }
            let text: String = text.into_iter().collect();
            if let Ok(layout) = Layout::parse(&text) {
                assert!(layout.sectors().len() <= MAX_SECTORS as usize);
            }
        }
    }
}
