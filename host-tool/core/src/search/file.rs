//! Reads a file of searches and checks it against its session.

use super::SHIPPED;
use super::declaration::SearchDeclaration;
use super::error::SearchError;
use super::milli::Milli;
use super::plan::Search;
use crate::run::SessionFile;
use crate::session::Session;
use serde::Deserialize;
use std::path::Path;

/// Content of a file of searches, all on the same session.
#[derive(Clone, PartialEq, Debug)]
pub struct SearchFile {
    /// Path of the session, relative to this file. It determines wearer, channels and simulated
    /// body.
    pub session: String,
    /// Searches in the order in which they run, at least one.
    pub searches: Vec<Search>,
}

impl SearchFile {
    /// Parses and checks the text of a file of searches.
    ///
    /// # Errors
    /// Returns every mistake in the text.
    pub fn parse(text: &str) -> Result<Self, Vec<String>> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct File {
            session: String,
            #[serde(default, rename = "search")]
            searches: Vec<SearchDeclaration>,
        }
        let file: File = toml::from_str(text).map_err(|error| {
            let before = error.span().and_then(|span| text.get(..span.start));
            let line = before.map_or(1, |before| before.matches('\n').count() + 1);
            vec![format!("line {line}: {}", error.message())]
        })?;
        let (mut searches, mut messages) = (Vec::new(), Vec::new());
        if file.searches.is_empty() {
            messages.push("the file has no [[search]]".to_owned());
        }
        for (declared, number) in file.searches.into_iter().zip(1..) {
            match Search::new(declared) {
                Ok(search) => searches.push(search),
                Err(mistakes) => {
                    let message = |mistake| format!("search {number}: {mistake}");
                    messages.extend(mistakes.into_iter().map(message));
                }
            }
        }
        let session = file.session;
        match messages.is_empty() {
            true => Ok(Self { session, searches }),
            false => Err(messages),
        }
    }

    /// Loads the searches at `path`, or built-in ones of that name, and their session. Checks that
    /// the searches fit the session; `is_simulated` says whether the device simulates its wearer.
    ///
    /// # Errors
    /// A file cannot be read or has mistakes, of which all are reported.
    pub fn load(path: &Path, is_simulated: bool) -> Result<(Self, Session), SearchError> {
        let refused = |mistakes| SearchError::Mistakes(path.to_owned(), mistakes);
        let named = SHIPPED.iter().find(|(name, _)| path == Path::new(name));
        let named = named.filter(|_| !path.exists());
        let text = match named {
            Some((_, text)) => (*text).to_owned(),
            None => Session::text(path)?,
        };
        let file = Self::parse(&text).map_err(refused)?;
        let folder = path.parent().unwrap_or(Path::new("."));
        let session = match named {
            // Built-in searches, with a built-in session.
            Some(_) => {
                SessionFile::load(Path::new(file.session.trim_start_matches("../sessions/")))?
            }
            None => SessionFile::load(&folder.join(&file.session))?,
        };
        file.check(path, &session.session, is_simulated)?;
        Ok((file, session.session))
    }

    /// Checks that the searches, which are those at `path`, fit this session.
    ///
    /// # Errors
    /// They do not; all reasons are reported.
    pub fn check(
        &self,
        path: &Path,
        session: &Session,
        is_simulated: bool,
    ) -> Result<(), SearchError> {
        let mistakes = self.mistakes(session, is_simulated);
        match mistakes.is_empty() {
            true => Ok(()),
            false => Err(SearchError::Mistakes(path.to_owned(), mistakes)),
        }
    }

    /// Returns the reasons why the searches do not fit this session.
    fn mistakes(&self, session: &Session, is_simulated: bool) -> Vec<String> {
        let limit_of = |number: u8| {
            let mut channels = session.channels.iter();
            let channel =
                channels.find(|c| c.number == number && c.spec.train.trigger.is_none())?;
            Some((Milli(channel.spec.limit.get()), channel.unit().symbol()))
        };
        let mut messages = Vec::new();
        for (search, number) in self.searches.iter().zip(1..) {
            let declared = search.declaration();
            let mut beyond = search.limit_violations(limit_of);
            if is_simulated && declared.kind.is_rated() && declared.simulated_rating.is_none() {
                beyond.push(
                    "simulated_rating is missing: a simulated wearer gives no ratings".into(),
                );
            }
            let message = |violation| format!("search {number}: {violation}");
            messages.extend(beyond.into_iter().map(message));
        }
        messages
    }
}
