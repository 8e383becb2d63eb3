//! The image's own record ([`crate::board::image`]), and its checksum.

use crate::board::image::{BOARD_KIND, BREADBOARD_KIND, COMMIT_AT, LENGTH, MAGIC, OFFSET};
use crate::board::wiring::{BOARD, BOARD_NAME};
use crate::link::{SCHEMA, VERSION};

/// Last word of the image (memory.x): the CRC of all words before it, written after linking.
/// Without it the image fails the self-test.
#[used]
#[unsafe(link_section = ".image_sum")]
pub static IMAGE_SUM: u32 = u32::MAX;

unsafe extern "C" {
    /// Start of the image: the vector table, where the linker put it.
    pub static __vector_table: u32;
}

/// The record as it lies in flash.
#[repr(C)]
struct Words {
    magic: [u8; 8],
    board: [u8; BOARD_NAME],
    version: [u8; 3],
    kind: u8,
    crystal_hz: u32,
    schema: u64,
    origin: *const u32,
    sum_at: *const u32,
    commit: [u8; 8],
    reserved: [u8; 8],
}

// SAFETY: nothing writes the record, and the program never follows its two addresses.
unsafe impl Sync for Words {}

const _: () = assert!(size_of::<Words>() == LENGTH && OFFSET.is_multiple_of(8));
const _: () = assert!(core::mem::offset_of!(Words, commit) == COMMIT_AT);

#[used]
#[unsafe(link_section = ".image_record")]
static RECORD: Words = Words {
    magic: MAGIC,
    board: {
        let (name, mut board, mut n) = (BOARD.name.as_bytes(), [0; BOARD_NAME], 0);
        while n < name.len() {
            board[n] = name[n]; // `wiring::check` limits the length
            n += 1;
        }
        board
    },
    version: VERSION,
    kind: if BOARD.breadboard.is_some() {
        BREADBOARD_KIND
    } else {
        BOARD_KIND
    },
    crystal_hz: BOARD.clocks.crystal_hz,
    schema: SCHEMA,
    origin: &raw const __vector_table,
    sum_at: &raw const IMAGE_SUM,
    commit: [0; 8],
    reserved: [0; 8],
};
