//! Tests across packages, one program: a room each.

mod accuracy;
mod bad_input;
mod chip_faults;
mod chip_latency;
mod chip_numbers;
mod chip_parity;
mod chip_patterns;
mod committed_seed;
mod cycles;
mod device_numbers;
mod device_stops;
mod edges;
mod fidelity;
mod force;
mod force_reach;
mod force_steering;
mod fuzz_short;
mod judge;
mod maps;
mod million_pulses;
mod pictures;
mod protocol_parity;
mod protocol_vectors;
mod qemu_instructions;
mod qemu_parity;
mod trigger;
