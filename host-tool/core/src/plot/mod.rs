//! Plots: one builder with which every figure is declared.
//!
//! This module has `ink` (colours and marks), `words` (the space that text takes), `canvas` (the
//! elements of an SVG), `axis` (scales and their ticks), `panel` (a plot between two axes),
//! `figure` (legend, panels, notes) and `series` (reduction of long signals). What a figure shows
//! is in `report`, and in the `figures` of studies.
//!
//! Input: numbers and words. Output: SVG, for light and dark screens.

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

/// Horizontal and vertical position: on a canvas in CSS pixels from the top left, in a panel in the
/// units of its axes.
pub type At = (f64, f64);
