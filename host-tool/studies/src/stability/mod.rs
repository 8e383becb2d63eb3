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
pub mod point_thresholds;
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

/// How a map is computed.
#[derive(Clone, Copy)]
pub enum Source {
    /// All at once, in seconds.
    Whole(Draw),
    /// Cell by cell, in up to some minutes: [`Declaration`].
    Cells(fn(u64) -> Declaration),
}

impl Source {
    /// Computes the map from a seed, and reports the finished part, 0 to 1.
    pub fn draw(self, seed: u64, progress: &mut dyn FnMut(f64)) -> Map {
        match self {
            Self::Whole(draw) => draw(seed, progress),
            Self::Cells(declare) => declare(seed).draw(progress),
        }
    }
}

/// Seed of the committed maps.
pub const SEED: u64 = 1;

/// Every map with the name of its files in docs/maps.
pub const MAPS: [(&str, Source); 18] = [
    ("control_period", Source::Cells(control_period::declare)),
    ("fatigue", Source::Cells(fatigue::declare)),
    ("gain_delay", Source::Whole(gain_delay::draw)),
    ("integrator", Source::Whole(integrator::draw)),
    ("loss", Source::Whole(loss::draw)),
    ("muscle_lag", Source::Cells(muscle_lag::declare)),
    ("point_thresholds", Source::Cells(point_thresholds::declare)),
    ("pulse_rate", Source::Whole(pulse_rate::draw)),
    ("rise", Source::Whole(rise::draw)),
    ("saturation", Source::Cells(saturation::declare)),
    ("sensor", Source::Cells(sensor::declare)),
    ("shipped_muscle", Source::Cells(shipped_muscle::declare)),
    ("sigma_gains", Source::Whole(sigma::gains)),
    ("sigma_order", Source::Whole(sigma::order)),
    ("thresholds", Source::Cells(thresholds::declare)),
    ("wall", Source::Whole(wall::draw)),
    ("wall_classical", Source::Whole(wall::draw_classical)),
    ("word_length", Source::Whole(word_length::draw)),
];
