//! The simulators' tests, one program: a room each.

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
mod chip_bench;
mod chip_cycles;
mod chip_image;
mod images;
mod muscle_inverse;
mod trace_file;
mod trace_scheduler;
mod trace_vcd;
#[cfg(unix)]
mod wire_pty;
mod wire_tcp;
