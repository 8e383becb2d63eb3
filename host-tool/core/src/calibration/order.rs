//! Orders of an operator, and the reasons for refusing them.

use super::Step;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Greatest length of the name of a movement, characters.
const LONGEST: usize = 60;

/// Largest number of movements that an operator may name for one electrode.
const MOST: usize = 10;

/// Command of an operator. Its JSON form is, for example, `{"order":"raise"}`.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(tag = "order", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Order {
    /// Give the next higher level for the length of a presentation.
    Raise,
    /// Lower the level by one step: at once if a level is being given, otherwise for the next
    /// presentation.
    Lower,
    /// Give the present level once more, for the length of a presentation.
    Again,
    /// Answer the open question with yes.
    Yes,
    /// Answer the open question with no.
    No,
    /// Answer the question which movements the electrode causes.
    Moves {
        /// Names of the movements; empty if nothing moves.
        moves: Vec<String>,
    },
    /// Report that the level was too much. Stimulation ends at once, and the level is never given
    /// again at this electrode.
    TooMuch,
    /// Take the highest level that the wearer accepted as the limit, without trying higher ones.
    Enough,
    /// Leave this electrode out of the calibration.
    Skip,
    /// End stimulation at once, and the whole calibration.
    Abort,
}

/// Reason why a line of input is not a command.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum OrderError {
    /// The line is not a valid command, for the given reason (E678).
    #[error(
        "E678 the line is not a valid order ({0}); nothing was changed; send one JSON object \
         per line, such as {{\"order\":\"raise\"}}"
    )]
    Nonsense(String),
}

impl Order {
    /// Parses a line of input, which must be the JSON form of one command.
    ///
    /// # Errors
    /// The line is not a valid command.
    pub fn parse(line: &str) -> Result<Self, OrderError> {
        let nonsense =
            |why: String| OrderError::Nonsense(crate::session::escape_control_chars(&why));
        let order: Self = serde_json::from_str(line).map_err(|why| nonsense(why.to_string()))?;
        // For variants without fields, serde's tagged enums ignore unknown fields, so they are
        // checked here.
        let value: Value = serde_json::from_str(line).map_err(|why| nonsense(why.to_string()))?;
        let has_moves = matches!(order, Self::Moves { .. });
        let mut keys = value.as_object().into_iter().flat_map(|map| map.keys());
        if let Some(key) = keys.find(|key| *key != "order" && !(has_moves && *key == "moves")) {
            return Err(nonsense(format!("unknown field `{key}`")));
        }
        if let Self::Moves { moves } = &order {
            let is_name = |name: &String| {
                let length = name.trim().chars().count();
                (1..=LONGEST).contains(&length) && !name.chars().any(char::is_control)
            };
            if moves.len() > MOST || !moves.iter().all(is_name) {
                let why = format!(
                    "`moves` allows at most {MOST} names of 1 to {LONGEST} characters, without \
                     control characters"
                );
                return Err(OrderError::Nonsense(why));
            }
        }
        Ok(order)
    }

    /// Returns whether the command can make the device give a level.
    #[must_use]
    pub const fn raises(&self) -> bool {
        matches!(self, Self::Raise | Self::Again)
    }

    /// Returns whether the command lowers the level or ends the calibration. Such a command is
    /// carried out in every state.
    #[must_use]
    pub const fn lowers(&self) -> bool {
        matches!(self, Self::Lower | Self::TooMuch | Self::Abort)
    }
}

/// Reason why a command was not carried out. The state is unchanged.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum Refusal {
    /// The command is not possible in the present state, for the given reason (E671).
    #[error("E671 not now: {0}")]
    NotNow(String),
    /// The result of a step contradicts the results of other steps (E676). The values are the
    /// step's name and the reason.
    #[error("E676 the result of step `{0}` contradicts the others: {1}")]
    OutOfOrder(&'static str, String),
}

impl Refusal {
    pub(super) fn not_now(reason: &str) -> Self {
        Self::NotNow(reason.to_owned())
    }

    pub(super) fn out_of_order(step: Step, reason: String) -> Self {
        Self::OutOfOrder(step.name(), reason)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_orders_count() {
        assert_eq!(Order::parse(r#"{"order":"raise"}"#), Ok(Order::Raise));
        assert_eq!(Order::parse(r#"{"order":"too-much"}"#), Ok(Order::TooMuch));
        let moves = vec!["wrist extension".to_owned()];
        let line = r#"{"order":"moves","moves":["wrist extension"]}"#;
        assert_eq!(Order::parse(line), Ok(Order::Moves { moves }));
        for nonsense in [
            "",
            "raise",
            "{}",
            "[]",
            "null",
            r#"{"order":"up"}"#,
            r#"{"order":"raise","by":5}"#,
            r#"{"order":"moves"}"#,
            r#"{"order":"moves","moves":[""]}"#,
            r#"{"order":"moves","moves":["\u0007"]}"#,
            r#"{"order":"raise"}{"order":"raise"}"#,
        ] {
            let message = Order::parse(nonsense).unwrap_err().to_string();
            assert!(message.starts_with("E678"), "{nonsense}: {message}");
        }
    }
}
