//! Requests of the page, and their answers.

use crate::draw::Draw;
use crate::error::CallError;
use crate::models::Train;
use crate::playback::{Action, Opening, Playback, Setpoints};
use crate::playbacks::Playbacks;
use crate::{catalogue, check, draw, models};
use serde::Deserialize;
use serde_json::{Value, json};

/// Request of the page.
#[derive(Deserialize, Debug)]
#[serde(tag = "verb", rename_all = "snake_case", deny_unknown_fields)]
pub enum Call {
    /// What is built into the page.
    About {},
    /// Text of a shipped session.
    Session { name: String },
    /// Mistakes of a session text, or its description.
    Check { name: String, text: String },
    /// Begins a session; the answer has its number.
    Open { session: Opening },
    /// Lets the time of a session pass until `to_us` after the start of the trains. Before that,
    /// setpoints may be sent.
    Advance {
        id: u32,
        to_us: u64,
        #[serde(default)]
        send: Option<Setpoints>,
    },
    /// Action at the controls of a session.
    Act { id: u32, action: Action },
    /// Names and lengths of the files of a record.
    Files { id: u32 },
    /// Bytes of a file of a record.
    File { id: u32, path: String },
    /// Forgets a session and its record.
    Drop { id: u32 },
    /// Session of a random wearer of a study.
    Draw { draw: Draw },
    /// Response of a muscle to a train.
    Response { train: Train },
}

/// State behind the page.
#[derive(Default)]
pub struct Page {
    playbacks: Playbacks,
}

impl Page {
    /// Carries out a request, which is JSON. Returns JSON or the bytes of a file.
    ///
    /// # Errors
    /// The request is not valid, or is refused.
    pub fn answer(&mut self, request: &[u8]) -> Result<Vec<u8>, CallError> {
        let call: Call = serde_json::from_slice(request).map_err(CallError::new)?;
        let value = match call {
            Call::File { id, path } => {
                let found = self.playbacks.get(id)?.files().read(&path);
                return found.ok_or_else(|| CallError::new(format!("there is no file {path:?}")));
            }
            call => self.value(call)?,
        };
        Ok(value.to_string().into_bytes())
    }

    fn value(&mut self, call: Call) -> Result<Value, CallError> {
        Ok(match call {
            Call::About {} => catalogue::built_in(),
            Call::Session { name } => catalogue::session_text(&name)?,
            Call::Check { name, text } => check::check(&name, &text)?,
            Call::Open { session } => {
                let (playback, description) = Playback::open(&session)?;
                json!({ "id": self.playbacks.add(playback)?, "session": description })
            }
            Call::Advance { id, to_us, send } => {
                let playback = self.playbacks.get(id)?;
                if let Some(setpoints) = send {
                    playback.send(setpoints)?;
                }
                playback.advance(to_us)
            }
            Call::Act { id, action } => self.playbacks.get(id)?.act(action)?,
            Call::Files { id } => {
                let listed = self.playbacks.get(id)?.files().list();
                json!({ "files": listed })
            }
            Call::Drop { id } => {
                self.playbacks.remove(id);
                json!({})
            }
            Call::Draw { draw } => draw::replay(&draw)?,
            Call::Response { train } => models::response(&train)?,
            Call::File { .. } => json!({}), // answered with bytes
        })
    }
}
