//! The studies' pictures, declared for `host_core::plot`.
//!
//! In: what a study measured. Out: SVG. Above the studies: none of them calls this
//! room.

mod accuracy;
mod control;
mod cycles;
mod failure;
mod hands;
mod ladder;
mod map;

pub use accuracy::picture as accuracy_picture;
pub use control::picture as control_picture;
pub use cycles::picture as cycles_picture;
pub use failure::picture as failure_picture;
pub use hands::picture as hands_picture;
pub use ladder::picture as ladder_picture;
pub use map::picture as map_picture;
