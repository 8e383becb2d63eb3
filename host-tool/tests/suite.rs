//! The program's tests in one binary, one module each.

mod accuracy_cli;
mod any_image;
#[cfg(unix)]
mod bad_input_cli;
#[cfg(unix)]
mod bench_cli;
mod breadboard_cli;
#[cfg(unix)]
mod calibrate_cli;
#[cfg(unix)]
mod calibrate_lines;
#[cfg(unix)]
mod calibrate_orders;
#[cfg(unix)]
mod calibrate_stalled;
#[cfg(unix)]
mod calibrate_terminal;
mod calibration_frame;
#[cfg(unix)]
mod check_cli;
mod chip_cli;
mod compare_cli;
mod distributed_cli;
mod endpoint_cli;
mod errors;
mod examples;
mod experiment_again;
mod explain_model;
mod faults_cli;
#[cfg(unix)]
mod flash_terminal;
mod hand_cli;
#[cfg(unix)]
mod hand_ended_cli;
#[cfg(unix)]
mod hil_cli;
mod images;
#[cfg(unix)]
mod interruptions;
#[cfg(unix)]
mod lee_cli;
mod lift_cli;
mod lift_live;
mod live_frame;
mod live_lines;
#[cfg(target_os = "linux")]
mod long_run;
#[cfg(unix)]
mod monitor_terminal;
mod muscle_cli;
#[cfg(unix)]
mod odd_files;
mod page_markup;
#[cfg(unix)]
mod places;
mod playground_cli;
mod program;
#[cfg(unix)]
mod ramps_cli;
mod record_again;
#[cfg(unix)]
mod record_damage;
#[cfg(unix)]
mod record_identity;
#[cfg(unix)]
mod search_cli;
#[cfg(unix)]
mod seated;
mod serve;
mod shipped_cli;
mod steady;
mod trigger;
mod two_points_cli;
#[cfg(unix)]
mod watch_terminal;
