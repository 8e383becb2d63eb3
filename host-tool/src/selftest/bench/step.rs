//! Steps of a bench test: the measurement and the bounds of each.

use super::board::{BoardActivity, Pattern};

/// Dummy loads in the order in which they are needed, Ω (docs/reference/hardware.md, Before a person is
/// connected).
const LOADS_OHM: [u32; 3] = [2_000, 500, 10_000];

/// One value that a person measures.
#[derive(Clone, PartialEq, Debug)]
pub struct Step {
    /// Name in files, such as "2000-peak".
    pub id: String,
    /// Load in the output, Ω.
    pub load_ohm: u32,
    /// Action of the board.
    pub doing: BoardActivity,
    /// Place of the probe, and the reading on the screen.
    pub what: String,
    /// Unit in which the value is typed.
    pub unit: &'static str,
    /// Value that the pattern should give.
    pub expected: f64,
    /// Smallest value that passes.
    pub low: f64,
    /// Largest value that passes.
    pub high: f64,
    /// Source of the bounds.
    pub source: &'static str,
}

/// Returns all steps of a pattern in the sequence in which they are measured.
#[must_use]
pub fn steps(pattern: &Pattern) -> Vec<Step> {
    let mut steps = vec![pump()];
    for load_ohm in LOADS_OHM {
        steps.extend(load_steps(pattern, load_ohm));
    }
    steps.extend([stop(), fall()]);
    steps
}

/// Returns a step with 2 kΩ whose bounds are `apart` from the expected value.
fn step_with_bounds(id: &str, unit: &'static str, expected: f64, apart: f64) -> Step {
    Step {
        id: id.to_owned(),
        load_ohm: 2_000,
        doing: BoardActivity::Plays,
        what: String::new(),
        unit,
        expected,
        low: (expected - apart).max(0.0),
        high: expected + apart,
        source: "",
    }
}

fn pump() -> Step {
    Step {
        what: "PB10: period of the pump signal, mean of 1000 or more periods".to_owned(),
        source: "hil.md part 3: 50 us within the crystal's 50 ppm; 50 ppm more for the \
                 oscilloscope",
        ..step_with_bounds("pump-period", "us", 50.0, 0.005)
    }
}

fn load_steps(pattern: &Pattern, load_ohm: u32) -> [Step; 7] {
    let peak_v = pattern.peak_v(load_ohm);
    let across = "across the load";
    let with = |name: &str, unit, expected, apart, quantity: &str, source| Step {
        load_ohm,
        what: format!("{across}: {quantity}"),
        source,
        ..step_with_bounds(&format!("{load_ohm}-{name}"), unit, expected, apart)
    };
    let phase = "hardware.md, Before a person is connected, 2: width within 1 us";
    [
        with(
            "peak",
            "V",
            peak_v,
            0.05 * peak_v,
            "height of the first phase's flat top, without its sign",
            "faults.md: a current may exceed the requested one by 5 %; 5 % below for symmetry",
        ),
        with(
            "first",
            "us",
            200.0,
            1.0,
            "width of the first phase at half its height",
            phase,
        ),
        with("gap", "us", 50.0, 1.0, "time between the two phases", phase),
        with(
            "second",
            "us",
            200.0,
            1.0,
            "width of the second phase at half its height",
            phase,
        ),
        with(
            "period",
            "ms",
            20.0,
            0.002,
            "time from one first phase to the next",
            "hil.md part 3: the crystal's 50 ppm; 50 ppm more for the oscilloscope",
        ),
        Step {
            low: 0.0,
            high: 1.0,
            ..with(
                "match",
                "%",
                0.0,
                1.0,
                "difference of the areas of the two phases, relative to the first, without sign",
                "hardware.md, Before a person is connected, 2: phases matched to 1 %",
            )
        },
        Step {
            low: 0.0,
            ..with(
                "mean",
                "mV",
                0.0,
                1e-3 * f64::from(load_ohm), // 1 µA
                "mean over 60 s, with a meter behind a low-pass filter, without sign",
                "safety.md, Limits: 1 uA of net direct current",
            )
        },
    ]
}

fn stop() -> Step {
    Step {
        doing: BoardActivity::StopOpens,
        what: "stop contact and load: open the hand-held stop; time from its opening to the \
               start of the last pulse, 0 if no pulse starts later"
            .to_owned(),
        low: 0.0,
        source: "hardware.md, Wiring: no pulse starts 0.5 ms later (two windows)",
        ..step_with_bounds("stop", "ms", 0.0, 0.5)
    }
}

fn fall() -> Step {
    Step {
        doing: BoardActivity::Falls,
        what: "across the load, single shot: time from last full pulse to last pulse".to_owned(),
        low: 0.0,
        source: "the pattern's fall of 50 ms, and the 20 ms from the last full pulse to the next",
        ..step_with_bounds("fall", "ms", 50.0, 20.0)
    }
}

/// The reason why typed text is not a measured value.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[error("E785 `{typed}` is not a measured value: {why}; type a value such as {like}")]
pub struct ValueError {
    typed: String,
    why: String,
    like: String,
}

/// Parses a number and its unit, such as "2.51 V".
///
/// # Errors
/// Fails if the text is empty or not a number, has no unit or another unit, a minus sign or a
/// comma, or is above 10⁶.
pub fn read_value(step: &Step, typed: &str) -> Result<f64, ValueError> {
    let fail = |why: &str| ValueError {
        typed: host_core::session::escape_control_chars(typed.trim()),
        why: why.to_owned(),
        like: format!("{} {}", step.expected, step.unit),
    };
    let text = typed.trim();
    if text.is_empty() {
        return Err(fail("it is empty"));
    }
    let is_number = |c: char| c.is_ascii_digit() || ".,+-eE".contains(c);
    let end = text.find(|c| !is_number(c)).unwrap_or(text.len());
    let (number, unit) = text.split_at(end);
    if number.is_empty() {
        return Err(fail("it does not begin with a number"));
    }
    if number.contains(',') {
        return Err(fail("write decimals after a point"));
    }
    let value: f64 = number
        .parse()
        .map_err(|_| fail("the number cannot be read"))?;
    match unit.trim().replace(['µ', 'μ'], "u") {
        unit if unit == step.unit => {}
        unit if unit.is_empty() => return Err(fail("it has no unit")),
        _ => return Err(fail(&format!("the unit is {}", step.unit))),
    }
    if value.is_sign_negative() && value != 0.0 {
        return Err(fail("it is negative, but the magnitude is needed"));
    }
    match value <= 1e6 {
        true => Ok(value.abs()),
        false => Err(fail("it is larger than 1000000")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::safety::StageKind;

    #[test]
    fn what_is_typed_is_a_value_with_its_unit_or_told() {
        let pattern = Pattern::new(
            1,
            StageKind::Current {
                full_scale_ua: 100_000,
            },
        );
        let test_steps = steps(&pattern);
        let [_, peak, first, ..] = &test_steps[..] else {
            panic!("steps");
        };
        assert_eq!((peak.expected, peak.unit), (10.0, "V"));
        for (typed, value) in [
            ("10 V", 10.0),
            (" 9.87V ", 9.87),
            ("1e1 V", 10.0),
            ("-0 V", 0.0),
        ] {
            assert_eq!(read_value(peak, typed), Ok(value), "{typed}");
        }
        assert_eq!(read_value(first, "200.1 µs"), Ok(200.1));
        assert_eq!(read_value(first, "200.1 μs"), Ok(200.1));
        for (typed, why) in [
            ("", "empty"),
            ("ten volts", "begin with a number"),
            ("10", "no unit"),
            ("10 mV", "the unit is V"),
            ("10 V V", "the unit is V"),
            ("10,2 V", "point"),
            ("-10 V", "negative"),
            ("1e9 V", "larger than"),
            ("e V", "cannot be read"),
            ("1.2.3 V", "cannot be read"),
            ("inf V", "begin with a number"),
            ("1e999 V", "larger than"),
        ] {
            let message = read_value(peak, typed).unwrap_err().to_string();
            assert!(
                message.starts_with("E785") && message.contains(why),
                "{typed}: {message}"
            );
        }
    }

    #[test]
    fn every_step_has_bounds_around_what_is_expected_and_their_source() {
        for kind in [
            StageKind::Current {
                full_scale_ua: 100_000,
            },
            StageKind::Voltage {
                full_scale_mv: 60_000,
            },
        ] {
            let test_steps = steps(&Pattern::new(10, kind));
            assert_eq!(test_steps.len(), 1 + 3 * 7 + 2);
            let mut ids: Vec<_> = test_steps.iter().map(|step| &step.id).collect();
            ids.sort();
            ids.dedup();
            assert_eq!(ids.len(), test_steps.len());
            for step in &test_steps {
                assert!((step.low..=step.high).contains(&step.expected), "{step:?}");
                assert!(step.low < step.high && !step.source.is_empty(), "{step:?}");
            }
        }
    }
}
