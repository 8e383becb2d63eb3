//! Draws the arm of each participant of a study with reference and measured forces, as an HTML
//! page.

use super::metrics::force;
use super::participant::DIRECTION_NAMES;
use super::replication::{ParticipantResult, Replication};
use host_core::html;
use host_core::plot::ink::{GRID, INK, MUTED, PALETTE, stroke};
use host_core::plot::{At, Canvas, Paint, Svg, Words};
use host_core::report::{Html, document, draw_bones};

/// Size of a picture, CSS pixels.
const SIZE: At = (320.0, 330.0);
/// Position of the breastbone in a picture.
const ORIGIN: At = (150.0, 72.0);
/// Scale of the arm, pixels per metre.
const PER_M: f64 = 420.0;
/// Length of the longest arrow, pixels.
const LONGEST: f64 = 95.0;
/// Direction of view, °: to the right of the front, and above.
const SEEN_DEG: [f64; 2] = [40.0, 20.0];

/// Projects a vector in the axes of the simulated arm onto the screen, right and down.
fn project([x, y, z]: [f64; 3]) -> At {
    let (aside, ahead) = libm::sincos(SEEN_DEG[0].to_radians());
    let (high, level) = libm::sincos(SEEN_DEG[1].to_radians());
    let right = aside * x + ahead * y;
    let away = -ahead * x + aside * y;
    (right, -(level * z + high * away))
}

fn place(at: [f64; 3]) -> At {
    let (x, y) = project(at);
    (ORIGIN.0 + PER_M * x, ORIGIN.1 + PER_M * y)
}

/// Draws an arrow from `from` with the length `(dx, dy)`.
fn arrow(canvas: &mut Canvas, from: At, (dx, dy): At, paint: (host_core::plot::Color, f64)) {
    let to = (from.0 + dx, from.1 + dy);
    canvas.line(&[from, to], stroke(paint.0, paint.1));
    let length = libm::hypot(dx, dy);
    if length < 4.0 {
        return;
    }
    let (ux, uy) = (dx / length, dy / length);
    let back = (to.0 - 8.0 * ux, to.1 - 8.0 * uy);
    let corners = [
        (to.0, to.1),
        (back.0 - 3.5 * uy, back.1 + 3.5 * ux),
        (back.0 + 3.5 * uy, back.1 - 3.5 * ux),
    ];
    canvas.polygon(&corners, Paint::Full(paint.0));
}

/// Returns the reference force and the mean measured force of each direction at full magnitude, N.
fn forces(person: &ParticipantResult, name: &str) -> Vec<[[f64; 3]; 2]> {
    let Some(condition) = person.condition(name) else {
        return Vec::new();
    };
    let of = |place: usize| {
        let all = condition
            .targets
            .iter()
            .filter(|target| target.command == 2 * place + 1);
        let all: Vec<_> = all.collect();
        let wanted = all.first()?.wanted_n;
        let given = std::array::from_fn(|axis| {
            all.iter()
                .map(|target| force(target.measured)[axis])
                .sum::<f64>()
                / all.len() as f64
        });
        Some([wanted, given])
    };
    (0..DIRECTION_NAMES.len()).filter_map(of).collect()
}

/// Draws a participant's arm with the reference and measured forces of one condition.
fn picture(person: &ParticipantResult, name: &str, title: &str) -> Svg {
    let mut canvas = Canvas::default();
    let all = forces(person, name);
    let sizes = all.iter().flatten().map(|values| {
        let (x, y) = project(*values);
        libm::hypot(x, y)
    });
    let largest = sizes.fold(0.0, f64::max).max(1e-9);
    canvas.text((12.0, 18.0), title, Words::new(13.0, INK).bold());
    let below = format!("longest arrow: {largest:.1} N in this view");
    canvas.text((12.0, SIZE.1 - 14.0), &below, Words::new(12.0, MUTED));
    let joints = person.places_m.map(place);
    let trunk = [place([0.0, 0.0, 0.05]), place([0.0, 0.0, -0.42])];
    canvas.line(&trunk, stroke(GRID, 10.0));
    draw_bones(&mut canvas, &joints, 9.0, MUTED);
    let hand = joints[3];
    let scaled = |of: [f64; 3]| {
        let (x, y) = project(of);
        (LONGEST * x / largest, LONGEST * y / largest)
    };
    for (at, [wanted, given]) in all.iter().enumerate() {
        let color = PALETTE[at % PALETTE.len()];
        let (dx, dy) = scaled(*wanted);
        canvas.line(
            &[hand, (hand.0 + dx, hand.1 + dy)],
            stroke(color.mix(GRID, 0.45), 6.0),
        );
        arrow(&mut canvas, hand, scaled(*given), (color, 2.2));
    }
    let described = format!(
        "{title}: an arm with reference forces (broad lines) and measured forces (arrows) at the \
         hand"
    );
    canvas.svg(SIZE, &described)
}

/// Draws the legend of the colours.
fn legend() -> Svg {
    let mut canvas = Canvas::default();
    for (at, name) in DIRECTION_NAMES.iter().enumerate() {
        let x = 16.0 + 120.0 * at as f64;
        canvas.line(&[(x, 14.0), (x + 24.0, 14.0)], stroke(PALETTE[at], 4.0));
        canvas.text((x + 30.0, 14.0), name, Words::new(13.0, INK));
    }
    canvas.svg((740.0, 28.0), "colours of the six reference directions")
}

/// Returns the page with the arms of this study's participants.
#[must_use]
pub fn page(study: &Replication) -> String {
    let mut body = html!(
        "<p class=\"facts\">Simulated arms, no evidence about people. View from the front, the \
         right and above. A broad line is the reference force at full size; the arrow of the same \
         colour is the mean of five measured forces. All measured forces of a condition are \
         rotated about the vertical by one angle, as in the analysis.</p>\n<figure>{}</figure>\n",
        legend()
    );
    for (at, person) in study.people.iter().enumerate() {
        let pictures = [
            ("C2", "C2: S1's frame"),
            ("C3", "C3: calibrated"),
            ("squares", "C3 with least squares"),
        ];
        let pictures = pictures.map(|(name, told)| {
            let title = format!("S{}, {told}", at + 1);
            html!("<figure>{}</figure>\n", picture(person, name, &title))
        });
        body += html!(
            "<section><h2>S{}</h2>\n<div style=\"display:grid;\
             grid-template-columns:repeat(3,minmax(0,1fr));gap:8px\">\n{}</div></section>\n",
            at + 1,
            pictures.into_iter().collect::<Html>()
        );
    }
    document("Reference and measured forces at the hand", &body)
}
