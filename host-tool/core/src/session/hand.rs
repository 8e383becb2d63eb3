//! `[body] kind = "hand"`: reads a simulated hand from a session file, and writes one as a session
//! file.

use hal_sim::body::hand::FittedHand;
use hal_sim::body::hand::field::{Pad, Shape};
use hal_sim::body::hand::spec::{ROUND_M, SMALL_M};

use super::channel::Channel;
use super::hand_fields::{CHANNELS, ELECTRODES, Electrodes, QUANTITIES, RULES, nominal};
use super::sites::read_sites;
use crate::fields::decimal::format_toml_number;
use crate::fields::error::Problem;
use crate::fields::table::Table;
use crate::wearer::Unit;

/// Power of ten that converts the positions of the electrodes from the mm of session files to m.
const MILLI: i32 = -3;

/// Reads a simulated forearm and hand. Numbers that the file leaves out are nominal. `channels` are
/// the valid channels of the file.
pub(super) fn read_hand(t: &Table<'_>, channels: &[Channel]) -> Option<FittedHand> {
    let mut hand = nominal();
    let sites = read_sites(t, CHANNELS);
    for quantity in &QUANTITIES {
        if let Some(value) = t.decimal(quantity.name, quantity.power) {
            *(quantity.of)(&mut hand) = value;
        }
    }
    hand.spec.rule = t.choice("rule", &RULES)?;
    hand.spec.sums = !t.has("sums") || t.flag("sums");
    hand.spec.units = t.integer::<u32>("units") as usize; // at most 256
    let seed = t.integer::<i64>("seed");
    let is_seed = seed != i64::MIN && seed != i64::MAX;
    if !is_seed {
        let allowed = "between -9223372036854775808 and 9223372036854775807".to_owned();
        t.report_out_of_range("seed", allowed);
    }
    hand.spec.seed = seed.cast_unsigned();
    let shape = shape(t.choice("electrodes", &ELECTRODES)?);
    let places = t.pairs("pads_mm", MILLI);
    let points = places.into_iter().map(|[x_m, y_m]| Pad { x_m, y_m, shape });
    hand.points = points.collect::<Vec<_>>().try_into().ok()?;
    let wrong = hand.spec.placement_errors(&hand.points);
    for why in &wrong {
        let why = why.to_string();
        t.report("pads_mm", Problem::Misplaced { why });
    }
    hand.channels = sites?;
    let driven = report_current_stages(t, &hand, channels);
    (is_seed && wrong.is_empty() && driven).then_some(hand)
}

/// Reports each electrode of the hand whose channel has a current stage, because the simulated hand
/// supports voltage stages only. Returns whether there is no error.
fn report_current_stages(t: &Table<'_>, hand: &FittedHand, channels: &[Channel]) -> bool {
    let mut are_volts = true;
    for (name, site) in CHANNELS.into_iter().zip(hand.channels) {
        let own = channels
            .iter()
            .find(|channel| usize::from(channel.index()) == site);
        if let Some(channel) = own.filter(|channel| channel.unit() == Unit::Milliampere) {
            let channel = channel.number;
            t.report(name, Problem::CurrentIntoHand { channel });
            are_volts = false;
        }
    }
    are_volts
}

const fn shape(electrodes: Electrodes) -> Shape {
    match electrodes {
        Electrodes::Round => Shape::Round {
            diameter_m: ROUND_M,
        },
        Electrodes::Small => Shape::Rectangle {
            along_m: SMALL_M[0],
            around_m: SMALL_M[1],
        },
    }
}

/// Error for a hand that no session file can describe. It holds the name of the field whose value
/// cannot be written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("E568 no session file can describe this hand: the format cannot express its `{0}`")]
pub struct UnnamedHand(pub &'static str);

/// Returns `hand` as the text of the `[body]` table of a session file, with every number written
/// out. If the numbers are within the ranges of their fields, reading the text gives `hand` again,
/// bit for bit.
///
/// # Errors
/// The electrodes are neither round nor small, the two shapes of session files; a number is
/// infinite, as in an ablation; or the seed is the smallest or the largest integer of 64 bits.
pub fn hand_body(hand: &FittedHand) -> Result<String, UnnamedHand> {
    let mut text = "[body]\nkind = \"hand\"\n".to_owned();
    let mut say = |name: &str, value: &str| text += &format!("{name} = {value}\n");
    for (name, channel) in CHANNELS.into_iter().zip(hand.channels) {
        say(name, &(channel + 1).to_string());
    }
    let is_all = |name: &&(&str, Electrodes)| {
        let own = shape(name.1);
        hand.points.iter().all(|pad| pad.shape == own)
    };
    let (electrodes, _) = ELECTRODES
        .iter()
        .find(is_all)
        .ok_or(UnnamedHand("electrodes"))?;
    let places = hand.points.map(|pad| {
        let [along, around] = [pad.x_m, pad.y_m].map(|m| format_toml_number(m, -MILLI));
        format!("[{along}, {around}]")
    });
    if hand
        .points
        .iter()
        .any(|pad| !(pad.x_m + pad.y_m).is_finite())
    {
        return Err(UnnamedHand("pads_mm"));
    }
    say("pads_mm", &format!("[{}]", places.join(", ")));
    say("electrodes", &format!("\"{electrodes}\""));
    let rule = RULES.iter().find(|(_, rule)| *rule == hand.spec.rule);
    let (rule, _) = rule.ok_or(UnnamedHand("rule"))?;
    say("rule", &format!("\"{rule}\""));
    say("sums", &hand.spec.sums.to_string());
    say("units", &hand.spec.units.to_string());
    let seed = hand.spec.seed.cast_signed();
    if seed == i64::MIN || seed == i64::MAX {
        return Err(UnnamedHand("seed"));
    }
    say("seed", &seed.to_string());
    for quantity in &QUANTITIES {
        if !(quantity.of)(&mut hand.clone()).is_finite() {
            return Err(UnnamedHand(quantity.name));
        }
        say(quantity.name, &quantity.format_value(hand));
    }
    Ok(text)
}
