//! The JSON schema of a session file.

use serde_json::Value;

use super::fields::FILE;
use crate::fields::json_schema;

/// Returns the schema as JSON Schema draft 7, which editors of TOML understand.
#[must_use]
pub fn schema() -> Value {
    json_schema("Flexor session", &FILE)
}
