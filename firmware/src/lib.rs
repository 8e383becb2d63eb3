//! Device program of the stimulator, without clocks, registers or global state.
//!
//! Inputs are bytes, samples and the time; outputs are port words, DAC codes and bytes. The
//! modules, in the order in which data passes them: `link` → `device` → `haptics` → `control`,
//! `muscle` → `safety` → `pulse`. `limb` is beside `control`; `units`, `range` and `arithmetic`
//! serve all of them. `board` contains the registers, on targets only, and `board::wiring` data
//! that every module may use. `lockstep` runs the device in virtual time, for simulators. `bench`
//! runs each algorithm and measures its cycles and results.
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
