//! Figures of the studies, built with `host_core::plot`.
//!
//! Each takes the results of a study and returns SVG. The studies themselves do not use this
//! module.

mod accuracy;
mod control;
mod cycles;
mod detail;
mod failure;
mod flags;
mod hands;
mod ladder;
mod map;

pub use accuracy::picture as accuracy_picture;
pub use control::picture as control_picture;
pub use cycles::picture as cycles_picture;
pub use detail::{Cost, picture as detail_picture};
pub use failure::picture as failure_picture;
pub use flags::picture as flags_picture;
pub use hands::picture as hands_picture;
pub use ladder::picture as ladder_picture;
pub use map::picture as map_picture;
