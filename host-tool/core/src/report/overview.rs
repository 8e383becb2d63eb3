//! The picture in the README: an arm with ten electrodes, the pulses of ten channels over one
//! period, and the angle of a finger under the default controller and under the paper's
//! controller. It is narrow and has large letters, so that a phone shows it too.

use super::limb::draw_bones;
use super::tables::degrees;
use super::trajectory::{Angle, curves};
use crate::analysis::metrics_without_lag;
use crate::plot::canvas::standalone;
use crate::plot::figure::draw_legend;
use crate::plot::ink::{Color, GRID, INK, MUTED, PALETTE, channel_mark, stroke};
use crate::plot::panel::LetterScale;
use crate::plot::series::range;
use crate::plot::{At, Axis, Canvas, Key, Mark, Paint, Panel, Shape, Svg, Words};
use crate::record::{Edge, State, Trial};
use crate::session::LawName;

/// Size of the picture, CSS pixels. A phone with a screen 360 pixels wide shows a README 328 pixels
/// wide; the smallest letters of the picture are then 9.7 pixels high.
const SIZE: At = (540.0, 690.0);
const LETTERS: LetterScale = LetterScale(16.0 / 11.0);
const WORDS: Words = Words::new(16.0, INK);
/// Top left and bottom right corners of the plot of the pulses.
const LANES: (At, At) = ((262.0, 92.0), (524.0, 332.0));
/// Top left and bottom right corners of the plot of the angles.
const ANGLE: (At, At) = ((72.0, 470.0), (524.0, 630.0));
/// Horizontal position of the arm's centre line.
const ARM: f64 = 96.0;
/// Vertical positions of elbow, wrist and knuckles.
const JOINTS: [f64; 3] = [380.0, 248.0, 196.0];
/// Lengths of the two bones of the finger: the fixed one, and the one that the angle rotates.
const BONES: [f64; 2] = [46.0, 62.0];
/// Part of the trials that is shown, s. It is two periods of the reference.
const SHOWN_S: (f64, f64) = (10.0, 20.0);

/// Draws the picture from two trials of the same session: one under the default controller, which
/// also provides the edges of one period, and one under the paper's controller.
#[must_use]
pub fn picture(default: &Trial, paper: &Trial) -> String {
    let mut canvas = Canvas::default();
    let title = Words {
        size: 18.0,
        ..WORDS.bold().centred()
    };
    let words = "Simulated: no board has been built yet";
    canvas.text((SIZE.0 / 2.0, 20.0), words, title);
    canvas.text((6.0, 60.0), "ten electrodes, one finger", WORDS);
    let channels: Vec<u8> = (1..=2 * COLUMN).collect();
    draw_arm(&mut canvas, default, &channels, 0.0);
    let (left, top) = (LANES.0.0 - 22.0, LANES.0.1 - 32.0);
    canvas.text((left, top), "ten channels, one period", WORDS);
    lanes(&default.edges).draw(&mut canvas, LETTERS, 0.0, LANES);
    draw_angles(&mut canvas, default, paper);
    let description = "Simulated: ten channels of pulses drive a finger, whose angle follows its \
                reference closely under the default controller and less closely under the \
                paper's controller";
    standalone(&canvas.svg(SIZE, description))
}

/// Size of the picture of the arm alone, CSS pixels.
const ARM_SIZE: At = (328.0, 312.0);
/// Distance by which the arm alone is higher than in the picture of the README, CSS pixels.
const RAISED: f64 = 76.0;
/// Number of electrodes in each of two columns along the forearm.
const COLUMN: u8 = 5;
/// Distance of the electrodes from the wrist and from one another, CSS pixels.
const ALONG: [f64; 2] = [18.0, 24.0];

/// Draws the arm of the trial with the most channels, its electrodes with the names of the channels,
/// and the finger at its smallest and at its largest angle; an empty figure if no trial has an
/// angle.
pub(super) fn arm_figure(trials: &[Trial]) -> Svg {
    let has_angle = |trial: &&Trial| {
        trial
            .samples
            .map_each(|s| s.measured_deg)
            .any(|a| a.is_some())
    };
    let with_angle = trials.iter().filter(has_angle);
    let Some(trial) = with_angle.max_by_key(|trial| trial.channels.len()) else {
        return Svg::default();
    };
    let mut canvas = Canvas::default();
    let channels = trial.channels.iter().take(usize::from(2 * COLUMN));
    let numbers: Vec<u8> = channels.clone().map(|channel| channel.number).collect();
    draw_arm(&mut canvas, trial, &numbers, RAISED);
    for (place, channel) in (0_u8..).zip(channels) {
        let name = format!("{} {}", channel.number, channel.name);
        let y = electrode(place).1 - RAISED;
        canvas.text((ARM + 84.0, y), &name, WORDS);
    }
    let description = "A forearm with an electrode for each channel, and the index finger at its \
                       smallest and at its largest angle";
    canvas.svg(ARM_SIZE, description)
}

/// Returns the position of electrode `place`, from 0, in the picture of the README.
fn electrode(place: u8) -> At {
    let side = if place < COLUMN { -1.0 } else { 1.0 };
    let y = JOINTS[1] + ALONG[0] + ALONG[1] * f64::from(place % COLUMN);
    (ARM + side * 13.0, y)
}

/// Draws the arm from the elbow to the hand with electrodes of these channels, and the finger at its
/// smallest and at its largest angle, `raised` pixels above their place in the README's picture.
fn draw_arm(canvas: &mut Canvas, trial: &Trial, channels: &[u8], raised: f64) {
    let [elbow, wrist, knuckles] = JOINTS.map(|y| y - raised);
    let corners = [
        (-62.0, elbow),
        (-40.0, wrist),
        (-36.0, knuckles),
        (28.0, knuckles),
    ];
    let corners = corners.into_iter().chain([(40.0, wrist), (62.0, elbow)]);
    let arm: Vec<At> = corners.map(|(dx, y)| (ARM + dx, y)).collect();
    canvas.polygon(&arm, Paint::Ring(MUTED, 1.8));
    let angles = trial.samples.map_each(|sample| {
        let is_shown = (SHOWN_S.0..=SHOWN_S.1).contains(&sample.t_s);
        sample.measured_deg.filter(|_| is_shown)
    });
    let (least, most) = range(angles.flatten()).unwrap_or((0.0, 90.0));
    draw_finger(canvas, least, GRID, raised);
    draw_finger(canvas, most, MUTED, raised);
    for (words, down) in [
        (format!("{least:.0}° to"), 60.0),
        (format!("{most:.0}°"), 40.0),
    ] {
        canvas.text((ARM + 100.0, knuckles - down), &words, WORDS);
    }
    for (place, &number) in (0_u8..).zip(channels) {
        let (x, y) = electrode(place);
        let outside = if x < ARM { -21.0 } else { 21.0 };
        let dot = channel_mark(number).dot();
        canvas.mark((x, y - raised), Shape::Disc, 8.0, dot);
        let at = (x + outside, y - raised);
        canvas.text(at, &number.to_string(), WORDS.centred());
    }
}

/// Draws the two bones of the finger in outline. The joint between them is flexed by `angle_deg`.
fn draw_finger(canvas: &mut Canvas, angle_deg: f64, color: Color, raised: f64) {
    let start = (ARM + 12.0, JOINTS[2] + 4.0 - raised);
    let joint = (start.0, start.1 - BONES[0]);
    let (sin, cos) = libm::sincos(angle_deg.to_radians());
    let tip = (joint.0 + BONES[1] * sin, joint.1 - BONES[1] * cos);
    draw_bones(canvas, &[start, joint, tip], 13.0, color);
}

/// Returns the plot of the pulses with a row for each channel. The line is up in an anodic phase
/// and down in a cathodic phase.
fn lanes(edges: &[Edge]) -> Panel {
    let names = (1..=10).map(|number| number.to_string());
    let mut panel = Panel::new(
        "",
        Axis::linear("time (ms)", (0.0, 20.0), 4.0),
        Axis::rows("channel", names),
        0.0,
    );
    for number in 1..=10u8 {
        let row = f64::from(number - 1);
        let mut path = vec![(0.0, row)];
        let mut before = row;
        for edge in edges.iter().filter(|edge| edge.channel == number) {
            let at = edge.t_us as f64 / 1000.0;
            let level = match edge.state {
                State::Anodic => row - 0.38,
                State::Cathodic => row + 0.38,
                State::Isolated | State::Grounded => row,
            };
            path.extend([(at, before), (at, level)]);
            before = level;
        }
        path.push((20.0, row));
        let line = stroke(channel_mark(number).color, 2.0);
        panel.marks.push(Mark::Line(path, line));
    }
    panel
}

/// Draws the reference and the angle under each of both controllers, with the RMSE of each.
fn draw_angles(canvas: &mut Canvas, default: &Trial, paper: &Trial) {
    let error =
        |trial: &Trial| metrics_without_lag(trial).map_or(String::new(), |m| degrees(m.rmse_deg));
    let (blue, red) = (stroke(PALETTE[0], 2.6), stroke(PALETTE[1], 2.0));
    let ink = stroke(INK, 1.2);
    let keys = [
        (
            Key::Line(blue),
            format!("{}, RMSE {}", LawName::Recommended.title(), error(default)),
        ),
        (Key::Line(ink), "reference".to_owned()),
        (
            Key::Line(red),
            format!("{}, RMSE {}", LawName::Paper.title(), error(paper)),
        ),
    ];
    draw_legend(
        canvas,
        LetterScale(16.0 / 12.0),
        (6.0, ANGLE.0.1 - 66.0),
        &keys,
        SIZE.0,
    );
    let x = Axis::linear("time (s)", SHOWN_S, 5.0);
    let y = Axis::linear("angle (°)", (0.0, 100.0), 2.0);
    let measured: Angle = |s| s.measured_deg;
    let shown = [(blue, measured), (ink, |s| s.target_deg)];
    let marks = curves(&paper.samples, SHOWN_S, [(red, measured)], 400).chain(curves(
        &default.samples,
        SHOWN_S,
        shown,
        400,
    ));
    Panel {
        marks: marks.collect(),
        ..Panel::new("", Axis { grid: false, ..x }, y, 0.0)
    }
    .draw(canvas, LETTERS, 0.0, ANGLE);
}
