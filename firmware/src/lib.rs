//! Everything the stimulator does, without a clock, a register or a global.
//!
//! Bytes, samples and time come in; port words, DAC codes and bytes go out.
//! The rooms, top of the data's way first: `link` → `device` → `haptics` →
//! `control`, `muscle` → `safety` → `pulse`; `limb` stands beside `control`;
//! `units`, `range` and `arithmetic` serve all. `board` holds registers, on a target only, and
//! `board::wiring`, data that everything may use.
//! `lockstep` runs the device in virtual time, for simulators. `bench` runs each
//! algorithm for its cycles and results.
#![no_std]
#![deny(unsafe_code)]

pub mod arithmetic;
pub mod bench;
pub mod board;
pub mod control;
mod crc;
pub mod device;
pub mod haptics;
pub mod limb;
pub mod link;
pub mod lockstep;
pub mod muscle;
pub mod pulse;
pub mod range;
pub mod safety;
mod seal;
pub mod units;

#[cfg(test)]
extern crate std;
