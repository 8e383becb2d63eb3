//! Searches the places of the electrodes on a simulated forearm (Hamana 2022, III-A2).

use hal_sim::body::hand::digits::VISIBLE_DEG;
use hal_sim::body::hand::field::{Field, Pad, Shape};
use hal_sim::body::hand::forearm::Unit;
use hal_sim::body::hand::pools::DIGITS;
use hal_sim::body::hand::{HandSpec, digits};
use hal_sim::random::Random;

/// Spacing of the places that are tried, along and around the forearm, m.
const STEP_M: [f64; 2] = [0.012, 0.010];
/// The first pass of the search considers only every third nerve, which suffices to rank the
/// places.
const LOOKED_AT: usize = 3;
/// Number of best places of the first pass that a second pass ranks again with all nerves.
const TRIED_AGAIN: usize = 20;
/// Distance from the elbow from which on places are tried, as a fraction of the forearm's length.
const FROM: f64 = 0.25;
/// Distance from the wrist within which no places are tried, m. The return electrode lies there.
const END_M: f64 = 0.060;
/// Range of places around the forearm from the palmar midline, as fractions of its circumference.
const AROUND: [f64; 2] = [-0.15, 0.20];
/// Smallest distance of the centres of two round electrodes, m: 5 mm of skin between them.
const APART_M: f64 = 0.030;
/// Seed of the random order in which a person tries places.
const ORDER: u64 = 0x7124;
/// Place of the extensor's electrode over extensor indicis, as fractions of length and
/// circumference.
const EXTENSOR: [f64; 2] = [0.72, 0.45];

/// A place and its selectivity: the current that visibly bends any other digit, divided by the
/// current that visibly bends the index finger.
#[derive(Clone, Copy, Debug)]
struct PadSelectivity {
    pad: Pad,
    selectivity: f64,
}

/// Finds the most selective places of A and B and adds that of the extensor's electrode, all of
/// this shape. A is the one nearer to the thumb. Returns `None` if there are no two places at which
/// the index finger is the first digit to bend.
#[must_use]
pub fn search(spec: &HandSpec, field: &Field, units: &[Unit], shape: Shape) -> Option<[Pad; 3]> {
    let (first, second) = most_selective(spec, field, units, shape)?;
    Some(assign_points(spec, (first, second), shape))
}

/// Finds places as a person would: tries them in random order and takes the first two at which the
/// index finger is the first digit to bend.
#[must_use]
pub fn first_found(
    spec: &HandSpec,
    field: &Field,
    units: &[Unit],
    shape: Shape,
) -> Option<[Pad; 3]> {
    let mut pads: Vec<Pad> = places(spec, shape).collect();
    Random::new(spec.seed ^ ORDER).shuffle(&mut pads);
    let is_selective = |pad: &Pad| is_selective(spec, field, units, pad);
    let mut found = pads.into_iter();
    let first = found.find(is_selective)?;
    let second = found.find(|pad| are_apart(pad, &first) && is_selective(pad))?;
    Some(assign_points(spec, (first, second), shape))
}

/// Returns whether the index finger is the first digit that a steady current through `pad` bends.
pub(super) fn is_selective(spec: &HandSpec, field: &Field, units: &[Unit], pad: &Pad) -> bool {
    selectivity(spec, field, units.iter(), pad) > 1.0
}

fn most_selective(
    spec: &HandSpec,
    field: &Field,
    units: &[Unit],
    shape: Shape,
) -> Option<(Pad, Pad)> {
    let tried = |pad: Pad, every: usize| PadSelectivity {
        pad,
        selectivity: selectivity(spec, field, units.iter().step_by(every), &pad),
    };
    let mut candidates: Vec<PadSelectivity> = places(spec, shape)
        .map(|pad| tried(pad, LOOKED_AT))
        .collect();
    candidates.sort_by(|a, b| b.selectivity.total_cmp(&a.selectivity));
    // Evaluates the best places again with every nerve.
    let again = candidates
        .iter()
        .take(TRIED_AGAIN)
        .map(|trial| tried(trial.pad, 1));
    let mut best: Vec<PadSelectivity> = again.filter(|trial| trial.selectivity > 1.0).collect();
    best.sort_by(|a, b| b.selectivity.total_cmp(&a.selectivity));
    let first = best.first()?.pad;
    let second = best.iter().find(|trial| are_apart(&trial.pad, &first))?.pad;
    Some((first, second))
}

/// Assigns the place nearer to the thumb to A and the other to B, and adds the extensor's
/// electrode.
fn assign_points(spec: &HandSpec, (first, second): (Pad, Pad), shape: Shape) -> [Pad; 3] {
    let (a, b) = match first.y_m >= second.y_m {
        true => (first, second),
        false => (second, first),
    };
    [a, b, extensor_pad(spec, shape)]
}

/// Returns the extensor's electrode.
pub(super) fn extensor_pad(spec: &HandSpec, shape: Shape) -> Pad {
    let [along, around] = EXTENSOR;
    Pad {
        x_m: along * spec.forearm_m,
        y_m: around * spec.around_m,
        shape,
    }
}

/// Lists the places that are tried for A and B.
pub(super) fn places(spec: &HandSpec, shape: Shape) -> impl Iterator<Item = Pad> {
    let [low_m, high_m] = AROUND.map(|part| part * spec.around_m);
    let from_m = FROM * spec.forearm_m;
    let count = |length: f64, step: f64| (length / step) as usize + 1;
    let along = count(spec.forearm_m - END_M - from_m, STEP_M[0]);
    let around = count(high_m - low_m, STEP_M[1]);
    (0..along).flat_map(move |i| {
        (0..around).map(move |j| Pad {
            x_m: from_m + STEP_M[0] * i as f64,
            y_m: low_m + STEP_M[1] * j as f64,
            shape,
        })
    })
}

/// Returns whether two electrodes lie far enough apart.
pub(super) fn are_apart(a: &Pad, b: &Pad) -> bool {
    distance_m(a, b) >= APART_M
}

fn distance_m(a: &Pad, b: &Pad) -> f64 {
    libm::hypot(a.x_m - b.x_m, a.y_m - b.y_m)
}

/// Computes the selectivity of a steady current through `pad` alone.
fn selectivity<'u>(
    spec: &HandSpec,
    field: &Field,
    units: impl Iterator<Item = &'u Unit>,
    pad: &Pad,
) -> f64 {
    let flexors = units.filter(|unit| unit.pool.flexed_digit().is_some());
    let drive = |unit: &Unit| spec.rule.nerve_drive(&field.transfer(pad, unit.at_m), unit);
    selectivity_of_drives(spec, flexors.map(|unit| (unit, drive(unit))))
}

/// Computes the selectivity of a steady current that leaves through a place, from the drive of each
/// unit per ampere that enters there.
pub(super) fn selectivity_of_drives<'u>(
    spec: &HandSpec,
    drives: impl Iterator<Item = (&'u Unit, f64)>,
) -> f64 {
    let mut reached: [Vec<f64>; DIGITS] = Default::default();
    for (unit, drive) in drives {
        if let Some(digit) = unit.pool.flexed_digit() {
            reached[digit].push(-drive / unit.threshold);
        }
    }
    // Torque for a visible angle. The drive of the last motor unit that it needs decides.
    let visible_nm = spec.stiffness_nm_per_rad * VISIBLE_DEG.to_radians();
    let of_digit = |drives: &mut Vec<f64>| {
        drives.sort_unstable_by(|a, b| b.total_cmp(a));
        let of_one = spec.flexor_nm / drives.len() as f64;
        let needed = (visible_nm / of_one).ceil() as usize;
        drives
            .get(needed.saturating_sub(1))
            .map_or(0.0, |drive| drive.max(0.0))
    };
    let drives = reached.each_mut().map(of_digit);
    let others = drives
        .iter()
        .enumerate()
        .filter(|pair| pair.0 != digits::INDEX);
    let most = others.map(|pair| *pair.1).fold(f64::MIN_POSITIVE, f64::max);
    drives[digits::INDEX] / most
}
