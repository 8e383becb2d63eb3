//! Calibrations on the native simulator: results compared with the true values, and interruptions
//! at every step.

mod disk;
mod drift;
mod every_step;
mod machine;
mod scene;
mod whole;
