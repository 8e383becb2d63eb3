//! Errors that the page shows.

use serde_json::{Value, json};
use std::fmt::Display;

/// Reason why a request was not carried out.
#[derive(Clone, PartialEq, Debug)]
pub struct CallError(Value);

impl CallError {
    /// Returns the error with a message for people, which begins with its number.
    pub fn new(message: impl Display) -> Self {
        Self(json!({ "message": message.to_string() }))
    }

    /// Returns the error for a session text with `mistakes`.
    #[cfg(feature = "sessions")]
    pub fn mistakes(message: impl Display, mistakes: Vec<Value>) -> Self {
        Self(json!({ "message": message.to_string(), "mistakes": mistakes }))
    }

    /// Returns the error as JSON.
    pub fn to_json(&self) -> Vec<u8> {
        self.0.to_string().into_bytes()
    }
}
