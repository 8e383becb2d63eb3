//! What is built into the page: sessions and wearers.

use crate::error::CallError;
use firmware::link::SCHEMA;
use hal_sim::input::LONGEST_TYPED;
use host_core::record::{FORMAT, Program};
use host_core::session::{SHIPPED, Session};
use serde_json::{Value, json};

/// Returns the version, the limits, and the names and titles of the shipped sessions and wearers.
pub fn built_in() -> Value {
    let sessions = SHIPPED.iter().map(|(file, text)| {
        let title = Session::parse(file, text).map(|session| session.title);
        json!({ "name": stem(file), "title": title.unwrap_or_default() })
    });
    let wearers = host_core::wearer::SHIPPED.iter();
    json!({
        "program": Program::current(),
        "schema": format!("{SCHEMA:#018x}"),
        "record_format": FORMAT,
        "longest_text": LONGEST_TYPED,
        "sessions": sessions.collect::<Vec<_>>(),
        "wearers": wearers.map(|(file, _)| stem(file)).collect::<Vec<_>>(),
    })
}

/// Returns the text of a shipped session.
///
/// # Errors
/// There is no session of this name.
pub fn session_text(name: &str) -> Result<Value, CallError> {
    let found = SHIPPED.iter().find(|(file, _)| stem(file) == name);
    let found = found.map(|(file, text)| json!({ "file": file, "text": text }));
    found.ok_or_else(|| CallError::new(format!("there is no shipped session {name:?}")))
}

fn stem(file: &str) -> &str {
    file.trim_end_matches(".toml")
}
