//! Text that overlaps text, or leaves its canvas.

use super::drawing::Drawing;

/// Largest overlap of boxes, CSS pixels, from rounding to whole units.
const SLACK: f64 = 0.5;

pub fn find(drawing: &Drawing) -> Vec<String> {
    let words: Vec<_> = drawing.words().filter(|w| !w.text.is_empty()).collect();
    let mut found = Vec::new();
    for (n, a) in words.iter().enumerate() {
        let b = a.bounds;
        let leaves = b.left < -SLACK
            || b.top < -SLACK
            || b.right > drawing.width + SLACK
            || b.bottom > drawing.height + SLACK;
        if leaves {
            found.push(format!("text leaves the canvas: {:?}", a.text));
        }
        for other in &words[n + 1..] {
            let (wide, high) = b.shared(&other.bounds);
            if wide > SLACK && high > SLACK {
                found.push(format!("text over text: {:?} and {:?}", a.text, other.text));
            }
        }
    }
    found
}
