//! The device's tests, one program: a room each.

mod control_feed_forward;
mod control_finger;
mod control_joint;
mod device_arming;
mod device_desk;
mod device_electrodes;
mod device_force;
mod device_force_reach;
mod device_frames;
mod device_fuzz;
mod device_limit_cycle;
mod device_over_current;
mod device_rungs;
mod device_safety;
mod device_setup_sum;
mod device_stop;
mod device_telemetry;
mod device_wall;
mod device_words;
mod haptics_wall;
mod muscle_accuracy;
mod muscle_inverse;
mod muscle_ladder;
mod muscle_properties;
mod muscle_recruitment;
mod safety_sums;
