//! The plan of a calibration: the wearer, the limits and the electrodes.

use super::{CalibrationError, Level};
use crate::session::Unit;
use crate::wearer::{Electrode, Wearer};
use serde::Deserialize;
use std::collections::BTreeSet;
use toml::Table;

/// Longest `host_timeout_ms` (host silence that ends stimulation) of a calibration, ms. `flexor
/// selftest --keep-alives` measures the shortest useful value, and docs/how/safety.md states the
/// longest that is safe.
pub const HOST_TIMEOUT_MS: u16 = 100;

/// Longest `fall_ms` of a calibration: the time in which the amplitude falls when stimulation ends,
/// ms.
const FALL_MS: i64 = 50;

/// Limits of the wearer that a calibration tightens, each with its largest value in ms.
const MOST_MS: [(&str, i64); 2] = [
    ("host_timeout_ms", HOST_TIMEOUT_MS as i64),
    ("fall_ms", FALL_MS),
];

/// Default `rise_ms` of a calibration: the time in which an amplitude rises from zero, ms. It is
/// less than half of a presentation of 1 s.
const RISE_MS: i64 = 200;

/// Electrode to calibrate, as the plan describes it. Levels are in the channel's unit.
#[derive(Clone, PartialEq, Debug)]
pub struct PlannedElectrode {
    /// Channel of the electrode, counted from 1.
    pub channel: u8,
    /// Position on the body, in words.
    pub place: String,
    /// Area of the active electrode, mm², from which the current density follows.
    pub area_mm2: u32,
    /// Unit of the levels: mA for a current stage, V for a voltage stage.
    pub stage: Unit,
    /// Output of the stage at the full DAC code, mA or V.
    pub full_scale: f64,
    /// Pulse width: the length of one phase, µs.
    pub width_us: u16,
    /// Pulse rate of the train, Hz.
    pub frequency_hz: f64,
    /// Level from which the search for the threshold begins at the lowest.
    pub start: Level,
    /// Difference from one level to the next in all steps but the placement.
    pub step: Level,
    /// Difference from one level to the next while the electrode is placed.
    pub coarse: Level,
    /// Highest level that may be given at this electrode.
    pub ceiling: Level,
}

/// Plan of a calibration: the wearer, the limits, and the electrodes in order. It contains no
/// mistakes.
#[derive(Clone, PartialEq, Debug)]
pub struct Plan {
    /// Pseudonym of the wearer.
    pub wearer: String,
    /// Limits of the wearer, with the fields of a session's `[wearer]`. Those that keep a
    /// calibration safe are filled in.
    pub limits: Table,
    /// Time for which each presentation gives its level, ms.
    pub on_ms: u32,
    /// Pause without stimulation after each presentation, ms.
    pub off_ms: u32,
    /// Electrodes in the order of their calibration, one to ten.
    pub electrodes: Vec<PlannedElectrode>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    wearer: String,
    #[serde(default)]
    limits: Table,
    #[serde(default = "one")]
    on_s: f64,
    #[serde(default = "one")]
    off_s: f64,
    #[serde(default, rename = "electrode")]
    electrodes: Vec<ElectrodeDeclaration>,
}

const fn one() -> f64 {
    1.0
}

/// Table `[[electrode]]` as the file of a plan contains it, without defaults.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ElectrodeDeclaration {
    channel: u8,
    place: String,
    #[serde(default = "area")]
    area_mm2: u32,
    #[serde(default)]
    stage: Stage,
    full_scale: Option<f64>,
    #[serde(default = "width")]
    width_us: u16,
    #[serde(default = "frequency")]
    frequency_hz: f64,
    start: Option<f64>,
    step: Option<f64>,
    coarse: Option<f64>,
    ceiling: f64,
}

/// Returns the default area of an electrode, mm²: that of a pad of 5 × 5 cm (Lee 2020, §2.2.1).
const fn area() -> u32 {
    2500
}

/// Returns the default pulse width, µs (Lee 2020, table 1).
const fn width() -> u16 {
    400
}

/// Returns the default pulse rate, Hz. It is slightly above the 30 Hz of Lee 2020, step 3, so that
/// an electrode that falls off is disconnected within 100 ms; the device notices this from three
/// pulses. Lee states that the threshold changes by less than 0.5 mA from 20 to 40 Hz.
const fn frequency() -> f64 {
    LEAST_HZ
}

/// Lowest pulse rate of a calibration, Hz: three periods and the device's own delay take less than
/// 100 ms.
const LEAST_HZ: f64 = 32.0;
/// Highest pulse rate of a calibration, Hz. In faster trains the device does not measure the
/// current of every pulse.
const MOST_HZ: f64 = 50.0;
/// Longest time from the third pulse on a loose electrode until the output is disconnected, ms: the
/// measurement of the current, and two windows of the pulse tape.
const TO_SILENCE_MS: f64 = 2.0;
const _: () = assert!(3.0 * 1000.0 / LEAST_HZ + TO_SILENCE_MS < 100.0);

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Stage {
    #[default]
    Current,
    Voltage,
}

impl Plan {
    /// Parses the text of a plan. `name` is its file name in error messages.
    ///
    /// # Errors
    /// Lists every mistake in the plan that can be found without the device's rules.
    pub fn parse(name: &str, text: &str) -> Result<Self, CalibrationError> {
        let refused =
            |messages: Vec<String>| CalibrationError::Plan(name.to_owned(), messages.join("\n  "));
        let file: File = toml::from_str(text).map_err(|error| {
            let before = error.span().and_then(|span| text.get(..span.start));
            let line = before.map_or(1, |before| before.matches('\n').count() + 1);
            refused(vec![format!("line {line}: {}", error.message())])
        })?;
        let mut mistakes = Vec::new();
        let plan = Self {
            on_ms: millis("on_s", file.on_s, [1.0, 10.0], &mut mistakes),
            off_ms: millis("off_s", file.off_s, [1.0, 60.0], &mut mistakes),
            limits: complete_limits(file.limits, &mut mistakes),
            electrodes: (file.electrodes.into_iter())
                .filter_map(|declaration| plan_electrode(declaration, &mut mistakes))
                .collect(),
            wearer: file.wearer,
        };
        plan.list_mistakes(&mut mistakes);
        match mistakes.is_empty() {
            true => Ok(plan),
            false => Err(refused(mistakes)),
        }
    }

    /// Creates the plan of a drift check from the electrodes of a wearer file. The limits of the
    /// electrodes are the highest levels. If the rate of an electrode in the file is outside 32 to
    /// 50 Hz, the plan uses the nearest rate within this range, because only there an electrode
    /// that falls off is disconnected within 100 ms.
    ///
    /// # Errors
    /// The file has no electrodes, or the thresholds of an electrode do not hold at any rate from
    /// 32 to 50 Hz.
    pub fn from_wearer(wearer: &Wearer) -> Result<Self, CalibrationError> {
        let mut mistakes = Vec::new();
        let limits = wearer_limits(wearer).map_err(|why| {
            CalibrationError::Plan(wearer.name.clone(), format!("its limits: {why}"))
        })?;
        let electrodes = wearer.electrodes.iter().map(|electrode| {
            let frequency_hz = rate(electrode).unwrap_or_else(|why| {
                mistakes.push(why);
                electrode.frequency_hz
            });
            let [start, step, coarse] = default_levels(electrode.unit)
                .map(|units| Level::from_units(units).unwrap_or_default());
            PlannedElectrode {
                channel: electrode.channel,
                place: electrode.place.clone(),
                area_mm2: electrode.area_mm2,
                stage: electrode.unit,
                full_scale: full_scale(electrode.unit),
                width_us: electrode.width_us,
                frequency_hz,
                start,
                step,
                coarse,
                ceiling: Level(electrode.limit.get()),
            }
        });
        let electrodes = electrodes.collect();
        let plan = Self {
            wearer: wearer.name.clone(),
            limits: tighten_limits(limits),
            on_ms: 1_000,
            off_ms: 1_000,
            electrodes,
        };
        plan.list_mistakes(&mut mistakes);
        match mistakes.is_empty() {
            true => Ok(plan),
            false => Err(CalibrationError::Plan(
                wearer.name.clone(),
                mistakes.join("\n  "),
            )),
        }
    }

    /// Returns the time for which each presentation gives its level, µs.
    #[must_use]
    pub fn on_us(&self) -> u64 {
        u64::from(self.on_ms) * 1000
    }

    /// Returns the pause without stimulation after each presentation, µs.
    #[must_use]
    pub fn off_us(&self) -> u64 {
        u64::from(self.off_ms) * 1000
    }

    fn list_mistakes(&self, mistakes: &mut Vec<String>) {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-';
        if self.wearer.is_empty() || self.wearer.len() > 60 || !self.wearer.chars().all(is_plain) {
            let wearer = crate::session::escape_control_chars(&self.wearer);
            mistakes.push(format!(
                "wearer is \"{wearer}\"; allowed: a pseudonym of 1 to 60 letters, digits and hyphens"
            ));
        }
        if self.electrodes.is_empty() && mistakes.is_empty() {
            mistakes.push("the plan has no [[electrode]]".to_owned());
        }
        let mut seen = BTreeSet::new();
        for electrode in &self.electrodes {
            if !seen.insert(electrode.channel) {
                mistakes.push(format!("channel {} is named twice", electrode.channel));
            }
        }
    }
}

fn millis(name: &str, seconds: f64, [least, most]: [f64; 2], mistakes: &mut Vec<String>) -> u32 {
    if !(least..=most).contains(&seconds) {
        mistakes.push(format!(
            "{name} is {seconds} s; allowed: {least} to {most} s"
        ));
    }
    (seconds * 1e3).round() as u32 // saturates
}

/// Returns the limits of a wearer file. Those in [`MOST_MS`] are lowered to the largest value that
/// a calibration may use.
fn tighten_limits(mut limits: Table) -> Table {
    for (name, most) in MOST_MS {
        let value = limits.get(name).and_then(toml::Value::as_integer);
        limits.insert(name.to_owned(), value.unwrap_or(most).min(most).into());
    }
    limits
}

/// Fills in the limits that a plan leaves out and a calibration needs. Adds a message to `mistakes` for
/// each limit of the plan that is too large for a calibration.
fn complete_limits(mut limits: Table, mistakes: &mut Vec<String>) -> Table {
    for (name, most) in MOST_MS {
        let value = limits.entry(name).or_insert(most.into());
        if value.as_integer().is_some_and(|integer| integer > most) {
            mistakes.push(format!(
                "limits.{name} is {value}; a calibration needs {most} or less"
            ));
        }
    }
    limits.entry("rise_ms").or_insert(RISE_MS.into());
    limits
}

/// Returns the default lowest level of the threshold search, step between levels, and step during
/// placement, in mA or V. The step for currents is that of Lee 2020 (step 3); the other values are
/// assumed.
const fn default_levels(unit: Unit) -> [f64; 3] {
    match unit {
        Unit::Milliampere => [4.0, 0.5, 2.0],
        Unit::Volt => [10.0, 1.0, 4.0],
    }
}

/// Returns the default output of a stage at the full DAC code, mA or V.
const fn full_scale(unit: Unit) -> f64 {
    match unit {
        Unit::Milliampere => 100.0,
        Unit::Volt => 60.0,
    }
}

/// Returns the limits of a wearer as the table `[limits]` of a wearer file.
fn wearer_limits(wearer: &Wearer) -> Result<Table, String> {
    let text = wearer.to_toml();
    let file: Table = toml::from_str(&text).map_err(|why| why.message().to_owned())?;
    let limits = file.get("limits").and_then(toml::Value::as_table);
    Ok(limits.cloned().unwrap_or_default())
}

fn plan_electrode(
    declaration: ElectrodeDeclaration,
    mistakes: &mut Vec<String>,
) -> Option<PlannedElectrode> {
    let before = mistakes.len();
    let channel = declaration.channel;
    let stage = match declaration.stage {
        Stage::Current => Unit::Milliampere,
        Stage::Voltage => Unit::Volt,
    };
    let [start, step, coarse] = default_levels(stage);
    let mut level = |name: &str, value: f64| {
        let level = Level::from_units(value).filter(|level| level.0 > 0);
        if level.is_none() {
            mistakes.push(format!(
                "channel {channel}: {name} is {value}; allowed: above 0 to 100, in steps of 0.001"
            ));
        }
        level
    };
    let [start, step, coarse, ceiling] = [
        level("start", declaration.start.unwrap_or(start)),
        level("step", declaration.step.unwrap_or(step)),
        level("coarse", declaration.coarse.unwrap_or(coarse)),
        level("ceiling", declaration.ceiling),
    ];
    let planned = PlannedElectrode {
        channel,
        place: declaration.place,
        area_mm2: declaration.area_mm2,
        stage,
        full_scale: declaration.full_scale.unwrap_or(full_scale(stage)),
        width_us: declaration.width_us,
        frequency_hz: declaration.frequency_hz,
        start: start.unwrap_or_default(),
        step: step.unwrap_or_default(),
        coarse: coarse.unwrap_or_default(),
        ceiling: ceiling.unwrap_or_default(),
    };
    if mistakes.len() == before {
        check_electrode(&planned, mistakes);
    }
    (mistakes.len() == before).then_some(planned)
}

fn check_electrode(plan: &PlannedElectrode, mistakes: &mut Vec<String>) {
    let channel = plan.channel;
    let mut say = |mistake: String| mistakes.push(format!("channel {channel}: {mistake}"));
    if !(1..=10).contains(&channel) {
        say("channels are 1 to 10".to_owned());
    }
    if plan.start >= plan.ceiling {
        say(format!(
            "start is {}; it must be below the ceiling of {}",
            plan.start, plan.ceiling
        ));
    }
    if plan.step > plan.coarse {
        say(format!(
            "step is {}; allowed: at most coarse, which is {}",
            plan.step, plan.coarse
        ));
    }
    if plan.ceiling.0.saturating_sub(plan.start.0) / plan.step.0.max(1) > 200 {
        say(format!(
            "step is {}, which makes more than 200 levels up to the ceiling; choose a larger step",
            plan.step
        ));
    }
    if !(LEAST_HZ..=MOST_HZ).contains(&plan.frequency_hz) {
        say(format!(
            "frequency_hz is {}; allowed: {LEAST_HZ} to {MOST_HZ} Hz, so that stimulation ends \
             within 100 ms if an electrode falls off",
            plan.frequency_hz
        ));
    }
}

/// Returns the pulse rate at which the drift check tests an electrode of a wearer file, Hz.
/// Otherwise returns why its thresholds hold at no possible rate.
fn rate(electrode: &Electrode) -> Result<f64, String> {
    let [from_hz, to_hz] = electrode.holds_hz;
    let nearest = electrode.frequency_hz.clamp(LEAST_HZ, MOST_HZ);
    match (from_hz..=to_hz).contains(&nearest) {
        true => Ok(nearest),
        false => Err(format!(
            "channel {}: its threshold is valid from {from_hz} to {to_hz} Hz, but a check uses \
             {LEAST_HZ} to {MOST_HZ} Hz, so that stimulation ends within 100 ms if an electrode \
             falls off; widen `from_hz` and `to_hz` if the threshold is valid there, or \
             calibrate again",
            electrode.channel
        )),
    }
}
