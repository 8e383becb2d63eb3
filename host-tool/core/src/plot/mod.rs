//! Pictures: one builder that every figure is declared with.
//!
//! Lives here: `ink` (colours and marks), `words` (how much room text takes),
//! `canvas` (an SVG's parts), `axis` (scales and their ticks), `panel` (a plot
//! between two axes), `figure` (legend, panels, notes) and `series` (long signals
//! made short). Not here: what a figure shows (`report`, and the studies' `figures`).
//! In: numbers and words. Out: SVG, for light and dark screens.

pub mod axis;
pub mod canvas;
pub mod figure;
pub mod ink;
mod labels;
pub mod panel;
pub mod series;
pub mod words;

pub use axis::{Axis, Scale};
pub use canvas::{Canvas, Svg, Words};
pub use figure::{Figure, Key};
pub use ink::{Color, Paint, Shape, Stroke};
pub use panel::{Mark, Panel};

/// A place: on a canvas in CSS pixels from its top left, on a panel in the units of
/// its axes.
pub type At = (f64, f64);
