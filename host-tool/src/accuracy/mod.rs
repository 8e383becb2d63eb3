//! Muscle models compared: error of each method and rung against the reference.
