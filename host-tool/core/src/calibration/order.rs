//! What an operator orders, and why it is not done.

use super::Step;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Longest name of a movement, characters.
const LONGEST: usize = 60;

/// Most movements of one point.
const MOST: usize = 10;

/// An operator's order. As JSON `{"order":"raise"}`, with `moves` a list of names.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(tag = "order", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Order {
    /// One step up, given for the presentation's length.
    Raise,
    /// One step down: at once if it is being given, else for what comes next.
    Lower,
    /// The present level once more.
    Again,
    /// Yes to the step's question.
    Yes,
    /// No to the step's question.
    No,
    /// The names of what the point moves.
    Moves {
        /// One or more, or none if nothing moves.
        moves: Vec<String>,
    },
    /// It was too much: silent at once, and never given again at this electrode.
    TooMuch,
    /// The last accepted level is the limit, without trying more.
    Enough,
    /// Leaves this electrode out.
    Skip,
    /// Ends everything: silent at once.
    Abort,
}

/// A line that is no order.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum OrderError {
    /// It is none.
    #[error(
        "E678 this is no order ({0}): nothing was changed; send one JSON object a line, such \
         as {{\"order\":\"raise\"}}"
    )]
    Nonsense(String),
}

impl Order {
    /// Reads a line of JSON.
    ///
    /// # Errors
    /// It is no order.
    pub fn parse(line: &str) -> Result<Self, OrderError> {
        let nonsense = |why: String| OrderError::Nonsense(crate::session::visible(&why));
        let order: Self = serde_json::from_str(line).map_err(|why| nonsense(why.to_string()))?;
        // A tagged enum heeds no unknown field of an order that has none.
        let said: Value = serde_json::from_str(line).map_err(|why| nonsense(why.to_string()))?;
        let has_moves = matches!(order, Self::Moves { .. });
        let mut keys = said.as_object().into_iter().flat_map(|map| map.keys());
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
                    "moves are at most {MOST} names of 1 to {LONGEST} characters without control \
                     characters"
                );
                return Err(OrderError::Nonsense(why));
            }
        }
        Ok(order)
    }

    /// Whether it can make the device give more than before.
    #[must_use]
    pub const fn raises(&self) -> bool {
        matches!(self, Self::Raise | Self::Again)
    }

    /// Whether it lowers or ends, and is carried out in every state.
    #[must_use]
    pub const fn lowers(&self) -> bool {
        matches!(self, Self::Lower | Self::TooMuch | Self::Abort)
    }
}

/// Why an order is not carried out now. Nothing was changed.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum Refusal {
    /// Not in this state.
    #[error("E671 not now: {0}")]
    NotNow(String),
    /// Levels would be out of order.
    #[error("E676 out of order at {0}: {1}")]
    OutOfOrder(&'static str, String),
}

impl Refusal {
    pub(super) fn beyond(what: &str) -> Self {
        Self::NotNow(what.to_owned())
    }

    pub(super) fn order(step: Step, what: String) -> Self {
        Self::OutOfOrder(step.name(), what)
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
            let told = Order::parse(nonsense).unwrap_err().to_string();
            assert!(told.starts_with("E678 "), "{nonsense}: {told}");
        }
    }
}
