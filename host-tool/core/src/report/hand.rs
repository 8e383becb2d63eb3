//! A force at the hand over time: the wanted force and, where a simulated wearer has it, the true
//! one.

use super::trajectory::end_s;
use crate::plot::ink::{INK, PALETTE, stroke};
use crate::plot::series::{range, round_step, shorten};
use crate::plot::{Axis, Figure, Key, Mark, Panel, Stroke, Svg};
use crate::record::{Run, Sample, Trial};

const HEIGHT: f64 = 90.0;
/// Number of groups of points to which a curve is reduced; each group keeps at most two points.
const BUCKETS: usize = 300;
const CAME: Stroke = stroke(PALETTE[0], 1.8);
const WANTED: Stroke = stroke(INK, 1.0);

/// Directions of a force at the hand, in the order of the values in a sample.
const AXES: [&str; 3] = ["backward (N)", "to the right (N)", "upward (N)"];

/// Draws a panel for each direction of the force in each trial with an arm; an empty figure if
/// there is none.
pub(super) fn figure(trials: &[Trial]) -> Svg {
    let driven = trials
        .iter()
        .filter(|trial| trial.samples.map_each(is_wanted).any(|is| is));
    let driven: Vec<&Trial> = driven.collect();
    if driven.is_empty() {
        return Svg::default();
    }
    let forces = driven.iter().flat_map(|trial| {
        let both = |s: &Sample| [&s.hand_n[..], &s.hand_true_n].concat();
        trial.samples.map_each(both)
    });
    let (low, high) = range(forces.flatten().flatten()).unwrap_or((0.0, 1.0));
    let step = round_step((high - low).max(0.1), 3.0);
    let ends = (
        (low / step).floor() * step,
        (high / step).ceil() * step + step,
    );
    let row = |trial: &&Trial| {
        let panel = |axis: usize| {
            let x = Axis {
                grid: false,
                ..Axis::linear("time (s)", (0.0, end_s(trials)), 5.0)
            };
            let y = Axis::linear(AXES[axis], ends, 4.0);
            let lines = |select: fn(&Sample) -> &[Option<f64>], stroke| {
                let known = move |s: &Sample| Some((s.t_s, (*select(s).get(axis)?)?));
                let points = trial.samples.map_each(known).flatten();
                let parts = shorten(points, BUCKETS).into_iter();
                parts.map(move |part| Mark::Line(part, stroke))
            };
            let came = lines(|s| &s.hand_true_n, CAME);
            Panel {
                marks: came.chain(lines(|s| &s.hand_n, WANTED)).collect(),
                ..Panel::new(&trial.name, x, y, HEIGHT)
            }
        };
        (0..AXES.len()).map(panel).collect()
    };
    let mut legend = vec![(Key::Line(WANTED), "reference".to_owned())];
    let is_known = |s: &Sample| !s.hand_true_n.is_empty();
    let mut trials = driven.iter();
    if trials.any(|trial| trial.samples.map_each(is_known).any(|is| is)) {
        legend.push((Key::Line(CAME), "force of the simulated arm".to_owned()));
    }
    Figure {
        description: "Force at the hand over time".to_owned(),
        legend,
        rows: driven.iter().map(row).collect(),
        ..Figure::default()
    }
    .svg()
}

/// Describes in one sentence the wanted force at the hand, how often the arm could not produce it,
/// and how far the force of a simulated arm differed from it; `None` without an arm.
pub(super) fn hand_result(run: &Run) -> Option<String> {
    let (mut most, mut unmade, mut total) = (None, 0_usize, 0_usize);
    let mut pairs: Vec<([f64; 3], [f64; 3])> = Vec::new();
    for trial in &run.trials {
        let mut samples = trial.samples.reader();
        while let Some(sample) = samples.next_sample() {
            let wanted = known_vector(&sample.hand_n);
            if let Some(length) = wanted.map(length) {
                most = Some(most.map_or(length, |most: f64| most.max(length)));
            }
            unmade += usize::from(sample.hand_made.is_some_and(|made| made < 1.0));
            total += usize::from(is_wanted(sample));
            pairs.extend(wanted.zip(known_vector(&sample.hand_true_n)));
        }
    }
    let most = most?;
    let mut text = format!("The reference force at the hand reached {most:.1} N");
    if unmade > 0 {
        let percent = 100.0 * unmade as f64 / total as f64; // one at least
        text += &format!(
            "; for {percent:.1} % of the time the arm could not produce the reference and \
             produced no force"
        );
    }
    if pairs.is_empty() {
        return Some(text + "; the actual force was not measured.");
    }
    let rms = |select: fn(&([f64; 3], [f64; 3])) -> f64| {
        let squares: f64 = pairs.iter().map(|pair| select(pair).powi(2)).sum();
        (squares / pairs.len() as f64).sqrt()
    };
    let missed = rms(|(wanted, came)| length(std::array::from_fn(|n| came[n] - wanted[n])));
    let wanted = rms(|(wanted, _)| length(*wanted));
    text += &format!("; the force of the simulated arm differed from it by {missed:.1} N rms");
    if wanted > 0.0 {
        text += &format!(", {:.0} % of the reference", 100.0 * missed / wanted);
    }
    Some(text + ".")
}

fn is_wanted(sample: &Sample) -> bool {
    !sample.hand_n.is_empty()
}

fn known_vector(force: &[Option<f64>]) -> Option<[f64; 3]> {
    match *force {
        [Some(x), Some(y), Some(z)] => Some([x, y, z]),
        _ => None,
    }
}

fn length(force: [f64; 3]) -> f64 {
    force.iter().map(|part| part * part).sum::<f64>().sqrt()
}
