//! Checks a session text as `flexor check` does.

use crate::describe::describe;
use crate::error::CallError;
use host_core::choice::resolve_auto_models;
use host_core::run::SessionFile;
use host_core::session::LawName;
use serde_json::Value;

/// Reads a session text with the controller `law` in place of the session's own, if there is one.
/// Models that the session leaves to the program are chosen.
///
/// # Errors
/// The mistakes of the text, or a controller that does not fit.
pub fn read(name: &str, text: &str, law: Option<&str>) -> Result<SessionFile, CallError> {
    let parsed = SessionFile::parse(name, text);
    let mut file =
        parsed.map_err(|error| CallError::mistakes("the session has mistakes", error.to_json()))?;
    if let Some(law) = law {
        let law = LawName::from_name(law)
            .ok_or_else(|| CallError::new(format!("there is no controller {law:?}")))?;
        let lawful = file.session.clone().with_law(law);
        file.session = lawful
            .map_err(|error| CallError::mistakes("the controller does not fit", error.to_json()))?;
    }
    resolve_auto_models(&mut file.session).map_err(CallError::new)?;
    Ok(file)
}

/// Describes the session of a text.
///
/// # Errors
/// The mistakes of the text.
pub fn check(name: &str, text: &str) -> Result<Value, CallError> {
    read(name, text, None).map(|file| describe(&file.session))
}
