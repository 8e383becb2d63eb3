//! The host program's tests, one program: a room each.

mod accuracy_study;
#[cfg(unix)]
mod bad_input_cli;
mod chip_cli;
mod control_campaign;
mod control_twin;
mod errors;
mod explain_model;
mod harris_wall;
mod images;
#[cfg(unix)]
mod interruptions;
mod ladder_adequacy;
mod ladder_table;
mod link_native;
mod live_frame;
mod live_lines;
mod muscle_cli;
#[cfg(unix)]
mod record_again;
#[cfg(unix)]
mod record_damage;
#[cfg(unix)]
mod record_identity;
mod report_page;
mod run_cut_short;
mod run_rungs;
mod serve;
mod session_errors;
mod session_files;
mod trigger;
