//! Calibrations on the native simulator: what is found against the truth, and what ends
//! them at every step.

mod disk;
mod drift;
mod every_step;
mod machine;
mod scene;
mod whole;
