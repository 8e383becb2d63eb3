//! The studies' tests, one program: a room each.

mod accuracy_study;
mod control_campaign;
mod control_hands;
mod control_twin;
mod declared;
mod distributed;
mod electrodes;
mod endpoint;
mod faults;
mod laboratory;
mod ladder_judge;
mod lee;
mod lift;
mod limit_cycle;
mod put_out;
mod ramps;
mod same_wearer;
mod search;
mod search_device;
mod search_judged;
mod shown_wearer;
mod sweeps;
mod thresholds_found;
mod tracking_causes;
mod two_points;
mod two_points_cells;
