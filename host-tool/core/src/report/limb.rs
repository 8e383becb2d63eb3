//! Outline of a limb, for all pictures.

use crate::plot::ink::{Color, PAPER};
use crate::plot::{At, Canvas, Paint, Shape};

/// Width of the outline, pixels.
const OUTLINE: f64 = 1.8;

/// Draws the outline of a limb: bones that connect `joints` in their order. `half` is half the
/// width of a bone, pixels.
pub fn draw_bones(canvas: &mut Canvas, joints: &[At], half: f64, color: Color) {
    for (color, half) in [(color, half), (PAPER, half - OUTLINE)] {
        for at in joints {
            canvas.mark(*at, Shape::Disc, half, Paint::Full(color));
        }
        for pair in joints.windows(2) {
            let (from, to) = (pair[0], pair[1]); // windows of two
            let length = libm::hypot(to.0 - from.0, to.1 - from.1);
            let across = (to.1 - from.1) / length * half;
            let along = (to.0 - from.0) / length * half;
            let bone = [
                (from.0 + across, from.1 - along),
                (to.0 + across, to.1 - along),
                (to.0 - across, to.1 + along),
                (from.0 - across, from.1 + along),
            ];
            canvas.polygon(&bone, Paint::Full(color));
        }
    }
}
