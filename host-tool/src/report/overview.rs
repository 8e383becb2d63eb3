//! The README's picture: an arm with ten electrodes, the ten lanes of pulses of
//! one period, and the finger's angle under the device's default and under the
//! paper's law. Narrow and with large letters, so that a phone shows it too.

use super::canvas::{
    Area, Drawn, GRID, INK, Key, MUTED, PALETTE, anchored, bold, channel_mark, legend_of, line, px,
    standalone, svg_wide, text, turned,
};
use super::series::{range, shorten};
use super::tables::degrees;
use crate::analysis::metrics;
use crate::record::{Edge, Sample, State, Trial};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

/// CSS pixels. On a screen of 360 a README has 328: the smallest letters are then
/// 9.7 pixels high.
const WIDTH: i32 = 540;
const HEIGHT: i32 = 690;
const LETTERS: i32 = 16;
/// Left, top, right, bottom of the two plots.
const LANES: (i32, i32, i32, i32) = (262, 92, 524, 332);
const ANGLE: (i32, i32, i32, i32) = (72, 470, 524, 630);
/// The arm's middle, and the elbow's, the wrist's and the knuckles' heights.
const ARM: i32 = 96;
const JOINTS: [i32; 3] = [380, 248, 196];
/// The finger: its first bone, and what the angle turns.
const BONES: [f64; 2] = [46.0, 62.0];
/// A period of the trains, ms.
const PERIOD_MS: f64 = 20.0;
/// What of the trials is shown, s: two periods of the target.
const SHOWN_S: (f64, f64) = (10.0, 20.0);
/// Top of the scale, degrees.
const TOP_DEG: f64 = 100.0;

/// One picture of the same session under the device's default law, with the edges
/// of one period, and under the paper's.
#[must_use]
pub fn picture(default: &Trial, paper: &Trial) -> String {
    let what = "Simulated: ten channels of pulses drive a finger, whose angle follows its target \
                under the device's default law, and less well under the paper's";
    standalone(&svg_wide((WIDTH, HEIGHT), what, |root| {
        let title = bold(anchored(text(18, INK), HPos::Center));
        let words = "Simulated: no board has been built yet";
        root.draw(&Text::new(words, (px(WIDTH / 2), px(20)), title))?;
        draw_arm(root, default)?;
        draw_lanes(root, &default.edges)?;
        draw_angles(root, default, paper)
    }))
}

/// The arm from the elbow up, its ten electrodes, and the finger at its
/// straightest and at its most bent.
fn draw_arm(root: &Area<'_>, trial: &Trial) -> Drawn {
    root.draw(&Text::new(
        "ten electrodes, one finger",
        (px(6), px(60)),
        text(LETTERS, INK),
    ))?;
    let [elbow, wrist, knuckles] = JOINTS;
    let corner = |dx: i32, y: i32| (px(ARM + dx), px(y));
    let arm = [
        corner(-62, elbow),
        corner(-40, wrist),
        corner(-36, knuckles),
        corner(28, knuckles),
        corner(40, wrist),
        corner(62, elbow),
    ];
    let angles = shown(trial).filter_map(|sample| sample.measured_deg);
    let (least, most) = range(angles).unwrap_or((0.0, 90.0));
    let around: Vec<_> = arm.iter().chain(arm.first()).copied().collect();
    root.draw(&PathElement::new(around, line(MUTED, 18)))?;
    draw_finger(root, least, GRID)?;
    draw_finger(root, most, MUTED)?;
    let at = (px(ARM + 100), px(knuckles - 60));
    let words = format!("{least:.0}° to");
    root.draw(&Text::new(words, at, text(LETTERS, INK)))?;
    let at = (at.0, at.1 + px(20));
    let words = format!("{most:.0}°");
    root.draw(&Text::new(words, at, text(LETTERS, INK)))?;
    for number in 1..=10u8 {
        draw_electrode(root, number)?;
    }
    Ok(())
}

/// Two bones in outline; the joint between them is bent by `angle_deg`.
fn draw_finger(root: &Area<'_>, angle_deg: f64, color: RGBColor) -> Drawn {
    let start = (f64::from(ARM + 12), f64::from(JOINTS[2]) + 4.0);
    let joint = (start.0, start.1 - BONES[0]);
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    let tip = (joint.0 + BONES[1] * sin, joint.1 - BONES[1] * cos);
    let at = |x: f64, y: f64| ((x * 4.0) as i32, (y * 4.0) as i32);
    for (color, half) in [(color, 13.0), (WHITE, 11.2)] {
        for (x, y) in [start, joint, tip] {
            root.draw(&Circle::new(at(x, y), (half * 4.0) as i32, color.filled()))?;
        }
        for (from, to) in [(start, joint), (joint, tip)] {
            let length = (to.0 - from.0).hypot(to.1 - from.1);
            let across = (to.1 - from.1) / length * half;
            let along = (to.0 - from.0) / length * half;
            let bone = [
                at(from.0 + across, from.1 - along),
                at(to.0 + across, to.1 - along),
                at(to.0 - across, to.1 + along),
                at(from.0 - across, from.1 + along),
            ];
            root.draw(&Polygon::new(bone.to_vec(), color.filled()))?;
        }
    }
    Ok(())
}

/// An electrode with its number, in two columns down the forearm.
fn draw_electrode(root: &Area<'_>, number: u8) -> Drawn {
    let row = i32::from(number - 1) % 5;
    let side = if number <= 5 { -1 } else { 1 };
    let y = px(JOINTS[1] + 18 + row * 24);
    let mark = channel_mark(number);
    let at = (px(ARM + side * 13), y);
    root.draw(&Circle::new(at, px(8), mark.dot()))?;
    let style = anchored(text(LETTERS, INK), HPos::Center);
    let at = (px(ARM + side * 34), y);
    root.draw(&Text::new(number.to_string(), at, style))?;
    Ok(())
}

/// A row per channel: up while anodic, down while cathodic.
fn draw_lanes(root: &Area<'_>, edges: &[Edge]) -> Drawn {
    let (left, top, right, bottom) = LANES;
    let heading = (px(left - 22), px(60));
    root.draw(&Text::new(
        "ten pulse lanes, one period",
        heading,
        text(LETTERS, INK),
    ))?;
    let x = |ms: f64| px(left) + (f64::from(px(right - left)) * ms / PERIOD_MS) as i32;
    for tick in [0, 5, 10, 15, 20] {
        let at = x(f64::from(tick));
        let grid = [(at, px(top)), (at, px(bottom))];
        root.draw(&PathElement::new(grid, line(GRID, 10)))?;
        let style = anchored(text(LETTERS, MUTED), HPos::Center);
        let place = (at, px(bottom + 14));
        root.draw(&Text::new(tick.to_string(), place, style))?;
    }
    axis_names(root, LANES, "time (ms)", "channel", 48)?;
    let pitch = (bottom - top) / 10;
    for number in 1..=10u8 {
        let middle = top + pitch / 2 + i32::from(number - 1) * pitch;
        let style = anchored(text(LETTERS, MUTED), HPos::Right);
        let at = (px(left - 8), px(middle));
        root.draw(&Text::new(number.to_string(), at, style))?;
        let mut path = vec![(x(0.0), px(middle))];
        for edge in edges.iter().filter(|edge| edge.channel == number) {
            let at = x(edge.t_us as f64 / 1000.0);
            let level = match edge.state {
                State::Anodic => middle - 9,
                State::Cathodic => middle + 9,
                State::Isolated | State::Grounded => middle,
            };
            let before = path.last().map_or(px(middle), |(_, y)| *y);
            path.extend([(at, before), (at, px(level))]);
        }
        path.push((x(PERIOD_MS), px(middle)));
        let color = channel_mark(number).color;
        root.draw(&PathElement::new(path, line(color, 20)))?;
    }
    Ok(())
}

/// Names under and beside a plot; `beside` is how far left the latter stands.
fn axis_names(
    root: &Area<'_>,
    (left, top, right, bottom): (i32, i32, i32, i32),
    across: &str,
    up: &str,
    beside: i32,
) -> Drawn {
    let style = anchored(text(LETTERS, INK), HPos::Center);
    let at = (px((left + right) / 2), px(bottom + 38));
    root.draw(&Text::new(across.to_owned(), at, style))?;
    let at = (px(left - beside), px((top + bottom) / 2));
    let style = turned(text(LETTERS, INK));
    root.draw(&Text::new(up.to_owned(), at, style))?;
    Ok(())
}

/// Target and angle under both laws, each with its RMSE.
fn draw_angles(root: &Area<'_>, default: &Trial, paper: &Trial) -> Drawn {
    let (left, top, right, bottom) = ANGLE;
    let error = |trial: &Trial| metrics(trial).map_or(String::new(), |m| degrees(m.rmse_deg));
    let ours = format!("device's default, RMSE {}", error(default));
    let theirs = format!("paper's law, RMSE {}", error(paper));
    let (blue, red) = (line(PALETTE[0], 26), line(PALETTE[1], 20));
    legend_of(LETTERS, root, (6, top - 42), &[(Key::Line(blue), &ours)])?;
    legend_of(
        LETTERS,
        root,
        (6, top - 20),
        &[
            (Key::Line(red), &theirs),
            (Key::Line(line(INK, 12)), "target"),
        ],
    )?;
    let y = |deg: f64| px(bottom) - (f64::from(px(bottom - top)) * deg / TOP_DEG) as i32;
    let (from, to) = SHOWN_S;
    let x = |s: f64| px(left) + (f64::from(px(right - left)) * (s - from) / (to - from)) as i32;
    for tick in [0, 50, 100] {
        let at = y(f64::from(tick));
        let grid = [(px(left), at), (px(right), at)];
        root.draw(&PathElement::new(grid, line(GRID, 10)))?;
        let style = anchored(text(LETTERS, MUTED), HPos::Right);
        root.draw(&Text::new(tick.to_string(), (px(left - 8), at), style))?;
    }
    for tick in [10, 12, 14, 16, 18, 20] {
        let style = anchored(text(LETTERS, MUTED), HPos::Center);
        let at = (x(f64::from(tick)), px(bottom + 16));
        root.draw(&Text::new(tick.to_string(), at, style))?;
    }
    axis_names(root, ANGLE, "time (s)", "angle (°)", 54)?;
    let courses: [(&Trial, Quantity, ShapeStyle); 3] = [
        (paper, |s| s.measured_deg, red),
        (default, |s| s.measured_deg, blue),
        (default, |s| s.target_deg, line(INK, 12)),
    ];
    for (trial, angle, style) in courses {
        let points = shown(trial).filter_map(|s| Some((s.t_s, angle(s)?)));
        for part in shorten(points, 400) {
            let path: Vec<_> = part.iter().map(|(s, deg)| (x(*s), y(*deg))).collect();
            root.draw(&PathElement::new(path, style))?;
        }
    }
    Ok(())
}

/// What a course shows of a sample, degrees.
type Quantity = fn(&Sample) -> Option<f64>;

/// The samples in the part of a trial that is shown.
fn shown(trial: &Trial) -> impl Iterator<Item = &Sample> {
    let (from, to) = SHOWN_S;
    let samples = trial.samples.iter();
    samples.filter(move |sample| (from..=to).contains(&sample.t_s))
}
