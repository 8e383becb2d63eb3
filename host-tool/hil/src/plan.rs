//! Distribution of more lines than an analyser has inputs over several captures.

use crate::capture::Capture;
use crate::line::Measurement;

/// Reason why lines cannot be distributed, or a capture does not fit its plan.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlanError {
    /// The analyser cannot record a line and the common line together.
    #[error("plan: {inputs} inputs; allowed: 2 to 64, one of which records the common line")]
    Inputs {
        /// Number of inputs.
        inputs: usize,
    },
    /// There is nothing to record.
    #[error("plan: no line; name at least one")]
    NoLines,
    /// A name occurs twice, or the common line is among the lines.
    #[error("plan: `{name}` occurs twice; name every line once, without the common line")]
    Repeated {
        /// Name of the line.
        name: String,
    },
    /// A capture lacks a probe.
    #[error("capture: no probe with bit {bit} for line `{name}`; record all probes of the plan")]
    NoProbe {
        /// Bit of the probe.
        bit: u8,
        /// Name of the line.
        name: String,
    },
}

/// Connection of one probe.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Connection {
    /// Bit of the probe: 0 for input `D0`.
    pub bit: u8,
    /// Name of the line.
    pub line: String,
}

/// Captures that cover all lines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Name of the line that every capture records on its last input: the sync output, or if that
    /// does not move in the session, a line that does. It aligns captures whose other lines are
    /// quiet.
    pub common: String,
    /// Connections of every capture, by bit.
    pub captures: Vec<Vec<Connection>>,
}

/// Distributes lines over captures with `inputs` probes each. Lines keep their order, and every
/// capture records `common` on its highest input, so that its probe stays where it is.
///
/// # Errors
/// Returns a [`PlanError`] unless there are 2 to 64 inputs and unique names.
pub fn plan(lines: &[String], common: &str, inputs: usize) -> Result<Plan, PlanError> {
    if !(2..=64).contains(&inputs) {
        return Err(PlanError::Inputs { inputs });
    }
    if lines.is_empty() {
        return Err(PlanError::NoLines);
    }
    for (index, name) in lines.iter().enumerate() {
        let repeated = lines.iter().take(index).any(|other| other == name);
        if repeated || name == common {
            let name = name.clone();
            return Err(PlanError::Repeated { name });
        }
    }
    let connect = |(bit, line): (u8, &String)| Connection {
        bit,
        line: line.clone(),
    };
    let captures = lines.chunks(inputs - 1).map(|lines| {
        let mut connections: Vec<Connection> = (0_u8..).zip(lines).map(connect).collect();
        connections.push(Connection {
            bit: (inputs - 1) as u8,
            line: common.to_string(),
        });
        connections
    });
    Ok(Plan {
        common: common.to_string(),
        captures: captures.collect(),
    })
}

/// Returns the lines of a capture under the names of its connections.
///
/// # Errors
/// Returns [`PlanError::NoProbe`] if a connected probe was not recorded.
pub fn connect(capture: &Capture, connections: &[Connection]) -> Result<Measurement, PlanError> {
    let line = |connection: &Connection| {
        let no_probe = || PlanError::NoProbe {
            bit: connection.bit,
            name: connection.line.clone(),
        };
        let line = capture.line(connection.bit, &connection.line);
        line.ok_or_else(no_probe)
    };
    let lines: Result<Vec<_>, PlanError> = connections.iter().map(line).collect();
    Ok(Measurement {
        samplerate_hz: capture.samplerate_hz(),
        samples: capture.samples(),
        lines: lines?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twenty_lines_need_three_captures_of_an_eight_input_analyser() {
        let lines: Vec<String> = (1..=10)
            .flat_map(|n| [format!("c{n}"), format!("a{n}")])
            .collect();
        let plan = plan(&lines, "sync", 8);
        let captures = plan.map(|plan| plan.captures).unwrap_or_default();
        let text: Vec<String> = captures
            .iter()
            .map(|connections| {
                let cells = connections.iter().map(|c| format!("{}={}", c.bit, c.line));
                cells.collect::<Vec<_>>().join(" ")
            })
            .collect();
        assert_eq!(
            text,
            [
                "0=c1 1=a1 2=c2 3=a2 4=c3 5=a3 6=c4 7=sync",
                "0=a4 1=c5 2=a5 3=c6 4=a6 5=c7 6=a7 7=sync",
                "0=c8 1=a8 2=c9 3=a9 4=c10 5=a10 7=sync",
            ]
        );
    }

    #[test]
    fn bad_plans_are_refused() {
        let names = |names: &[&str]| names.iter().map(|n| n.to_string()).collect::<Vec<_>>();
        let error = |lines: &[&str], inputs| plan(&names(lines), "sync", inputs).err();
        assert_eq!(error(&["c1"], 1), Some(PlanError::Inputs { inputs: 1 }));
        assert_eq!(error(&["c1"], 65), Some(PlanError::Inputs { inputs: 65 }));
        assert_eq!(error(&[], 8), Some(PlanError::NoLines));
        for (lines, name) in [(["c1", "c1"], "c1"), (["c1", "sync"], "sync")] {
            let name = name.to_string();
            assert_eq!(error(&lines, 8), Some(PlanError::Repeated { name }));
        }
    }
}
