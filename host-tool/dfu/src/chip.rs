//! Flash layout of the chip that is written, and the part of it that a firmware image may use.

use std::ops::Range;

/// One erasable sector of flash.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sector {
    /// Number of the sector as in the reference manual, from 0.
    pub number: u8,
    /// Address of the first byte.
    pub address: u32,
    /// Size in bytes.
    pub size: u32,
}

impl Sector {
    /// Address behind the last byte.
    #[must_use]
    pub const fn end(&self) -> u32 {
        self.address.saturating_add(self.size)
    }

    /// Longest time in milliseconds that erasing this sector may take before the device counts as
    /// hung: twice the data-sheet maximum at 8-bit parallelism plus one second. The ROM selects
    /// the parallelism and does not report it. Source: DS8626 (STM32F405xx), table "Flash memory
    /// programming", x8: 800 ms for 16 KiB, 2400 ms for 64 KiB, 4000 ms for 128 KiB.
    #[must_use]
    pub const fn erase_limit_ms(&self) -> u32 {
        match self.size {
            0..=0x4000 => 1000 + 2 * 800,
            0x4001..=0x1_0000 => 1000 + 2 * 2400,
            _ => 1000 + 2 * 4000,
        }
    }
}

/// Properties of a chip that the flash procedure depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Chip {
    /// Name in messages.
    pub name: &'static str,
    /// Address of the first byte of flash, where the vector table lies.
    pub origin: u32,
    /// Groups of equal sectors in address order: number of sectors and size in bytes.
    pub groups: &'static [(u8, u32)],
    /// Address behind the last byte that firmware may occupy. Nothing is erased or written from
    /// here on.
    pub firmware_end: u32,
    /// Address ranges of RAM in which the initial stack pointer may lie (`start < pointer <= end`).
    pub ram: &'static [(u32, u32)],
}

/// STM32F405 with 1 MiB of flash (RM0090 table 5). The last two sectors hold the board's stage
/// table and are excluded.
pub const STM32F405: Chip = Chip {
    name: "STM32F405",
    origin: 0x0800_0000,
    groups: &[(4, 0x4000), (1, 0x1_0000), (7, 0x2_0000)],
    firmware_end: 0x080C_0000,
    // SRAM1 with SRAM2, and CCM (RM0090 section 2.3.1).
    ram: &[(0x2000_0000, 0x2002_0000), (0x1000_0000, 0x1001_0000)],
};

impl Chip {
    /// Sectors of the whole flash in address order.
    pub fn sectors(&self) -> impl Iterator<Item = Sector> + use<> {
        let mut address = self.origin;
        self.groups
            .iter()
            .flat_map(|&(count, size)| (0..count).map(move |_| size))
            .enumerate()
            .map(move |(index, size)| {
                let sector = Sector {
                    number: u8::try_from(index).unwrap_or(u8::MAX),
                    address,
                    size,
                };
                address = sector.end();
                sector
            })
    }

    /// Addresses that the flash procedure may erase and write.
    #[must_use]
    pub const fn firmware(&self) -> Range<u32> {
        self.origin..self.firmware_end
    }

    /// Whether `pointer` can be the initial stack pointer: a multiple of 4 inside RAM or at its
    /// end.
    #[must_use]
    pub fn is_stack_pointer(&self, pointer: u32) -> bool {
        let inside = |&(start, end): &(u32, u32)| pointer > start && pointer <= end;
        pointer.is_multiple_of(4) && self.ram.iter().any(inside)
    }

    /// Whether the first eight bytes of `flash` start the CPU inside `code`: a stack pointer in
    /// RAM, then an odd (Thumb) reset vector. Flash that fails this test starts no program
    /// without the BOOT0 pin.
    #[must_use]
    pub fn is_vector_table(&self, flash: &[u8], code: &Range<u32>) -> bool {
        let (Some(pointer), Some(reset)) = (word(flash, 0), word(flash, 4)) else {
            return false;
        };
        self.is_stack_pointer(pointer) && reset % 2 == 1 && code.contains(&(reset & !1))
    }
}

/// Little-endian word at byte `offset` of `bytes`; `None` behind the end.
#[must_use]
pub fn word(bytes: &[u8], offset: usize) -> Option<u32> {
    let (four, _) = bytes.get(offset..)?.split_first_chunk::<4>()?;
    Some(u32::from_le_bytes(*four))
}
