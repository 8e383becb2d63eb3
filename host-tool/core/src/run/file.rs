//! A session with the name of its file.

use crate::session::{Session, SessionError};
use std::path::Path;

/// A session and where it came from.
#[derive(Clone, Debug)]
pub struct SessionFile {
    /// As given.
    pub name: String,
    /// Its text.
    pub text: String,
    /// What it says.
    pub session: Session,
}

impl SessionFile {
    /// Reads and checks a session file.
    ///
    /// # Errors
    /// [`SessionError`], rendered with the line concerned.
    pub fn load(path: &Path) -> Result<Self, SessionError> {
        let text = Session::text(path)?;
        Self::parse(&path.display().to_string(), &text)
    }

    /// A session that is part of the program.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn parse(name: &str, text: &str) -> Result<Self, SessionError> {
        Ok(Self {
            name: name.to_owned(),
            text: text.to_owned(),
            session: Session::parse(name, text)?,
        })
    }
}
