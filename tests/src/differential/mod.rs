//! Differential test: the same random machine code on the simulated core and under QEMU.
//!
//! `encodings` is the instruction set, `generate` makes cases of it from a seed, `program` puts
//! them into an image with a harness that loads registers, runs a case, and writes every register,
//! flag and the scratch memory to a record. `chip` and `qemu` run the image and return the records.
//! In: a seed. Out: records to compare, and the number of executions of each encoding.
//!
//! QEMU is a reference for results, not for time or faults.

pub mod chip;
pub mod encodings;
mod generate;
mod images;
pub mod program;
pub mod qemu;
mod random;
mod units;

pub use encodings::Encodings;
pub use images::{ImageInstructions, find_instructions};
pub use program::{Program, RECORD_WORDS};

/// Returns the name of a word in a record.
#[must_use]
pub fn record_word_name(word: usize) -> String {
    match word {
        0 => "APSR".to_owned(),
        1 => "FPSCR".to_owned(),
        2 => "SP (moved)".to_owned(),
        3..35 => format!("S{}", word - 3),
        35..48 => format!("R{}", word - 35),
        48 => "LR".to_owned(),
        _ => format!("scratch + {}", (word - 49) * 4),
    }
}
