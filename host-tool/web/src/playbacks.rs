//! The sessions that play in the page, each with a number.

use crate::error::CallError;
use crate::playback::Playback;
use std::collections::BTreeMap;

/// Largest number of sessions at a time.
const MOST: usize = 8;

/// Sessions by number.
#[derive(Default)]
pub struct Playbacks {
    played: BTreeMap<u32, Playback>,
    next: u32,
}

impl Playbacks {
    /// Adds a session and returns its number.
    ///
    /// # Errors
    /// Too many sessions are open.
    pub fn add(&mut self, played: Playback) -> Result<u32, CallError> {
        if self.played.len() >= MOST {
            return Err(CallError::new(format!(
                "more than {MOST} sessions are open"
            )));
        }
        let id = self.next;
        self.next = self.next.wrapping_add(1);
        self.played.insert(id, played);
        Ok(id)
    }

    /// Returns the session with a number.
    ///
    /// # Errors
    /// There is none.
    pub fn get(&mut self, id: u32) -> Result<&mut Playback, CallError> {
        let found = self.played.get_mut(&id);
        found.ok_or_else(|| CallError::new(format!("there is no session {id}")))
    }

    /// Removes a session with its record.
    pub fn remove(&mut self, id: u32) {
        self.played.remove(&id);
    }
}
