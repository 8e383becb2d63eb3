//! The tests of sessions, runs and reports, one program: a room each.

mod calibration;
mod choice;
mod identify;
mod limb_activation;
mod limb_geometry;
mod limb_least_squares;
mod link_failures;
mod link_native;
mod report_page;
mod report_truth;
mod run_cut_short;
mod run_rungs;
mod session_arm;
mod session_endpoint;
mod session_errors;
mod session_files;
mod session_hand;
mod session_lift;
mod session_schema;
mod session_values;
mod session_wearer;
mod statistics;
mod statistics_normality;
mod statistics_refused;
mod wearer_files;
mod wearers_shipped;
