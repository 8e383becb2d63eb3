//! Everything the stimulator does, without a clock, a register or a global.
//!
//! Bytes, samples and time come in; port words, DAC codes and bytes go out.
//! The rooms, top of the data's way first: `link` → `device` → `control`,
//! `muscle` → `safety` → `pulse`; `units` serves all. `board` exists only on
//! a target and holds registers, nothing else.
#![no_std]
#![deny(unsafe_code)]

pub mod control;
pub mod units;
