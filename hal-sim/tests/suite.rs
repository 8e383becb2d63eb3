//! Tests of the simulators, one program with a module for each.

mod body_arm;
mod body_bench;
mod body_bench_elbow;
mod body_elbow;
mod body_field;
mod body_finger;
mod body_muscle;
mod body_network;
mod body_sagittal;
mod body_shared;
#[cfg(all(feature = "chip", feature = "images"))]
mod chip_bench;
#[cfg(feature = "chip")]
mod chip_cycles;
#[cfg(all(feature = "chip", feature = "images"))]
mod chip_image;
#[cfg(feature = "images")]
mod images;
mod muscle_inverse;
mod trace_file;
mod trace_scheduler;
mod trace_vcd;
#[cfg(all(unix, feature = "wire"))]
mod wire_pty;
#[cfg(feature = "wire")]
mod wire_tcp;
