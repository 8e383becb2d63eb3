//! A session with the name of its file.

use crate::record::Trial;
use crate::session::{Session, SessionError, WearerTexts, shipped_text};
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
        let name = path.display().to_string();
        Self::parse_beside(&name, &text, &|file| Session::wearer_text(path, file))
    }

    /// A session that is part of the program.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn parse(name: &str, text: &str) -> Result<Self, SessionError> {
        Self::parse_beside(name, text, &shipped_text)
    }

    /// The session of a recorded trial, on the wearer file that the record keeps.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn recorded(trial: &Trial) -> Result<Self, SessionError> {
        Ok(Self {
            name: trial.session_file.clone(),
            text: trial.session_text.clone(),
            session: trial.session()?,
        })
    }

    /// One whose wearer file `texts` knows.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn parse_beside(
        name: &str,
        text: &str,
        texts: WearerTexts<'_>,
    ) -> Result<Self, SessionError> {
        Ok(Self {
            name: name.to_owned(),
            text: text.to_owned(),
            session: Session::parse_beside(name, text, texts)?,
        })
    }
}
