//! Maps of where each method fails, with the predicted boundary beside the found one.
//!
//! Lives here: the [`Map`] type with its text, and one file per map. Not here:
//! the methods themselves (`firmware`), bodies (`hal-sim`), the picture
//! (`figures`), the command (`cli`).
//! In: a seed. Out: a [`Map`]; docs/maps keeps its text and its picture.

mod chance;
mod describing;
mod finger;
pub mod gain_delay;
pub mod integrator;
pub mod loss;
pub mod map;
pub mod pulse_rate;
pub mod sigma;
pub mod wall;
pub(crate) mod wall_loop;
pub mod word_length;

pub use map::{Axis, Cell, Class, Map, Panel, Panels};

/// A map by the name of its files in docs/maps.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// File stem.
    pub name: &'static str,
    /// Computes it from a seed; tells the part done, 0 to 1, on the way.
    pub draw: fn(u64, &mut dyn FnMut(f64)) -> Map,
}

/// The seed of the committed maps.
pub const SEED: u64 = 1;

/// Every map.
pub const MAPS: &[Entry] = &[
    Entry::new("gain_delay", gain_delay::draw),
    Entry::new("integrator", integrator::draw),
    Entry::new("loss", loss::draw),
    Entry::new("pulse_rate", pulse_rate::draw),
    Entry::new("sigma_gains", sigma::gains),
    Entry::new("sigma_order", sigma::order),
    Entry::new("wall", wall::draw),
    Entry::new("wall_classical", wall::draw_classical),
    Entry::new("word_length", word_length::draw),
];

impl Entry {
    const fn new(name: &'static str, draw: fn(u64, &mut dyn FnMut(f64)) -> Map) -> Self {
        Self { name, draw }
    }
}
