//! Maps of where each method fails, with the predicted boundary beside the measured one.
//!
//! Contains the [`Map`] type with its text, and one module for each map. Takes a seed and returns a
//! [`Map`], whose text and figure are committed in docs/maps. The methods are in `firmware`, the
//! simulated limbs in `hal-sim`, the figures in `figures`.

mod chance;
pub mod control_period;
pub mod declaration;
mod describing;
pub mod fatigue;
mod finger;
pub mod gain_delay;
pub mod integrator;
pub mod loss;
pub mod map;
pub mod muscle_lag;
pub mod pulse_rate;
pub mod rise;
pub mod saturation;
pub mod sensor;
pub mod shipped_muscle;
pub mod sigma;
pub mod thresholds;
pub mod wall;
pub(crate) mod wall_loop;
pub mod word_length;

pub use declaration::{Declaration, Place};
pub use map::{Axis, Cell, Class, Layout, Map, Panel, Panels};

/// Function that computes a map from a seed, and reports the finished part, 0 to 1.
pub type Draw = fn(u64, &mut dyn FnMut(f64)) -> Map;

/// Seed of the committed maps.
pub const SEED: u64 = 1;

/// Every map with the name of its files in docs/maps.
pub const MAPS: [(&str, Draw); 10] = [
    ("gain_delay", gain_delay::draw),
    ("integrator", integrator::draw),
    ("loss", loss::draw),
    ("pulse_rate", pulse_rate::draw),
    ("rise", rise::draw),
    ("sigma_gains", sigma::gains),
    ("sigma_order", sigma::order),
    ("wall", wall::draw),
    ("wall_classical", wall::draw_classical),
    ("word_length", word_length::draw),
];
