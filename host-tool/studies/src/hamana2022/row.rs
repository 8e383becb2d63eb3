//! Formats and parses a wearer's row of `draws.csv`, with all digits of every number that decides a
//! claim.

use super::claims::{Individuations, PHASES_US, Torques};
use super::pattern::Pattern;
use super::population::Population;
use super::study::{DrawOutcome, Numbers};
use super::trials::Postures;
use super::voltages::{MOST_V, Voltages};
use crate::laboratory::parse_number;

/// Names of the numeric fields, with their allowed ranges.
const NUMBERS: [(&str, [f64; 2]); 21] = [
    ("va_th", VOLTS),
    ("va_max", VOLTS),
    ("vb_th", VOLTS),
    ("vb_max", VOLTS),
    (RATIO, [0.0, 1.0]),
    ("two_nm", TORQUE),
    ("apart_nm", TORQUE),
    ("one_nm", TORQUE),
    ("one_isolated_nm", TORQUE),
    ("ii_0", INDIVIDUATION),
    ("ii_500", INDIVIDUATION),
    ("ii_1000", INDIVIDUATION),
    ("ii_2000", INDIVIDUATION),
    ("ii_5000", INDIVIDUATION),
    ("ii_10000", INDIVIDUATION),
    ("one_0_deg", ANGLE),
    ("one_45_deg", ANGLE),
    ("one_90_deg", ANGLE),
    ("two_0_deg", ANGLE),
    ("two_45_deg", ANGLE),
    ("two_90_deg", ANGLE),
];
const RATIO: &str = "r_th";
const VOLTS: [f64; 2] = [0.0, MOST_V];
const TORQUE: [f64; 2] = [-100.0, 100.0];
const INDIVIDUATION: [f64; 2] = [0.0, 1.0];
const ANGLE: [f64; 2] = [-180.0, 180.0];
/// Outcomes of a draw without numbers, with their names in the file.
const MISSING: [(&str, DrawOutcome); 4] = [
    ("no points", DrawOutcome::NoPoints),
    ("no coupling", DrawOutcome::NoCoupling),
    ("held by the limiter", DrawOutcome::Held),
    ("no voltages", DrawOutcome::NoVoltages),
];
const WHOLE: &str = "whole";
const ELECTRODES: [&str; 2] = ["round", "small"];

/// Returns the names of the columns: outcome, electrodes and numbers, then one for each claim.
pub(super) fn columns(population: &Population) -> Vec<String> {
    let own = ["became", "electrodes"].into_iter();
    let own = own
        .chain(NUMBERS.map(|numbers| numbers.0))
        .chain(["left_out"]);
    let claims = population.claims.iter().map(|claim| claim.id.clone());
    own.map(str::to_owned).chain(claims).collect()
}

/// Formats the row of one wearer, without the random parameters.
pub(super) fn format_row(drawn: &DrawOutcome, population: &Population) -> String {
    let DrawOutcome::Whole(measured) = drawn else {
        let name = MISSING.iter().find(|(_, outcome)| outcome == drawn);
        let name = name.map_or("", |(name, _)| name);
        return name.to_owned() + &",".repeat(columns(population).len() - 1);
    };
    let number = |number: Option<f64>| number.map_or_else(String::new, |value| value.to_string());
    let claim = |is_set: Option<bool>| is_set.map_or_else(String::new, |flag| flag.to_string());
    let mut fields = vec![
        WHOLE.to_owned(),
        ELECTRODES[usize::from(measured.is_small)].to_owned(),
    ];
    fields.extend(numbers(measured).map(number));
    fields.push(measured.left_out.to_string());
    fields.extend(measured.claims().map(claim));
    fields.join(",")
}

/// Parses a row that [`format_row`] formatted.
///
/// # Errors
/// Fails with a description of the first mistake.
pub(super) fn parse_row(row: &str, population: &Population) -> Result<DrawOutcome, String> {
    let fields: Vec<&str> = row.split(',').collect();
    let wanted = columns(population).len();
    if fields.len() != wanted {
        return Err(format!(
            "the row has {} fields after the random parameters; expected: {wanted}",
            fields.len()
        ));
    }
    let [became, electrodes, rest @ ..] = &fields[..] else {
        return Err("the row has no fields".to_owned());
    };
    if *became != WHOLE {
        let known = MISSING.into_iter().find(|(name, _)| name == became);
        let known = known.map(|(_, drawn)| drawn);
        return known.ok_or_else(|| {
            format!(
                "became is `{became}`; allowed: whole, no points, no coupling, held by the \
                 limiter, no voltages"
            )
        });
    }
    let is_small = ELECTRODES
        .iter()
        .position(|electrode| electrode == electrodes);
    let is_small = is_small
        .ok_or_else(|| format!("electrodes is `{electrodes}`; allowed: round, small"))?
        == 1;
    let mut values = [None; NUMBERS.len()];
    for ((value, field), (name, ends)) in values.iter_mut().zip(rest).zip(NUMBERS) {
        *value = parse_number(field)?;
        if value.is_some_and(|value| !(ends[0]..=ends[1]).contains(&value)) {
            let [low, high] = ends;
            return Err(format!("{name} is {field}; allowed: {low} to {high}"));
        }
    }
    let left_out = rest.get(NUMBERS.len()).copied().unwrap_or_default();
    let most = (Pattern::all_two_point().len() + Pattern::all_one_point().len()) as u64
        * population.trials;
    match left_out.parse() {
        Ok(left_out) if left_out <= most => numbers_of(values, is_small, left_out),
        _ => Err(format!(
            "left_out is `{left_out}`; allowed: 0 to {most} trials"
        )),
    }
}

/// Returns the numbers in the order of [`NUMBERS`].
fn numbers(measured: &Numbers) -> [Option<f64>; NUMBERS.len()] {
    let Voltages {
        threshold_v: [va_th, vb_th],
        most_v: [va_max, vb_max],
        ratio,
    } = measured.voltages;
    let Torques {
        two,
        apart,
        one,
        one_isolated,
    } = measured.torques;
    let volts = [va_th, va_max, vb_th, vb_max].map(Some).into_iter();
    let torques = [two, apart, one, one_isolated].map(Some);
    let angles = measured.postures.into_iter().flatten().map(Some);
    let quantities = volts.chain([ratio]).chain(torques);
    let mut numbers = [None; NUMBERS.len()];
    for (number, value) in numbers
        .iter_mut()
        .zip(quantities.chain(measured.individuations).chain(angles))
    {
        *number = value;
    }
    numbers
}

/// Builds the outcome from values in the order of [`NUMBERS`].
fn numbers_of(
    values: [Option<f64>; NUMBERS.len()],
    is_small: bool,
    left_out: u64,
) -> Result<DrawOutcome, String> {
    let value = |name: &str| {
        let place = NUMBERS.iter().position(|number| number.0 == name);
        place.and_then(|place| values[place])
    };
    let must = |name: &str| value(name).ok_or_else(|| format!("{name} is missing"));
    let individuation = |after_us: u32| value(&format!("ii_{after_us}"));
    let individuations: Individuations = PHASES_US.map(individuation);
    let posture = |points: &str| -> Result<Postures, String> {
        let at = |pronated: u32| must(&format!("{points}_{pronated}_deg"));
        Ok([at(0)?, at(45)?, at(90)?])
    };
    let numbers = Numbers {
        voltages: Voltages {
            threshold_v: [must("va_th")?, must("vb_th")?],
            most_v: [must("va_max")?, must("vb_max")?],
            ratio: value(RATIO),
        },
        is_small,
        torques: Torques {
            two: must("two_nm")?,
            apart: must("apart_nm")?,
            one: must("one_nm")?,
            one_isolated: must("one_isolated_nm")?,
        },
        individuations,
        postures: [posture("one")?, posture("two")?],
        left_out,
    };
    Ok(DrawOutcome::Whole(Box::new(numbers)))
}
