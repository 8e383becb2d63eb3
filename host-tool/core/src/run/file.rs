//! Sessions together with the name and text of their file.

use crate::record::Trial;
use crate::session::{Session, SessionError, WearerTexts, builtin_wearer_text};
use std::path::Path;

/// A session together with the name and text of the file that it was read from.
#[derive(Clone, Debug)]
pub struct SessionFile {
    /// Name of the file, as the caller gave it.
    pub name: String,
    /// Full text of the session file.
    pub text: String,
    /// Session parsed from the text.
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
        Self::parse_with_wearers(&name, &text, &|file| Session::wearer_text(path, file))
    }

    /// Parses the text of a session that is built into the program. If it names a wearer file, that
    /// file is taken from those that are built in, too.
    ///
    /// # Errors
    /// Returns a [`SessionError`] if the text is not a valid session.
    pub fn parse(name: &str, text: &str) -> Result<Self, SessionError> {
        Self::parse_with_wearers(name, text, &builtin_wearer_text)
    }

    /// Parses the session of a recorded trial again, with the wearer file that the record keeps.
    ///
    /// # Errors
    /// Returns a [`SessionError`] if the recorded text is not a valid session of this version.
    pub fn from_trial(trial: &Trial) -> Result<Self, SessionError> {
        Ok(Self {
            name: trial.session_file.clone(),
            text: trial.session_text.clone(),
            session: trial.session()?,
        })
    }

    /// Parses the text of a session; `texts` supplies the text of the wearer file that the session
    /// names.
    ///
    /// # Errors
    /// Returns a [`SessionError`] if the session or its wearer file is not valid.
    pub fn parse_with_wearers(
        name: &str,
        text: &str,
        texts: WearerTexts<'_>,
    ) -> Result<Self, SessionError> {
        Ok(Self {
            name: name.to_owned(),
            text: text.to_owned(),
            session: Session::parse_with_wearers(name, text, texts)?,
        })
    }
}
