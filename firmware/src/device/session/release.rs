//! What takes the device away from its session: another host's `Hello`, and a stage table,
//! after which the device restarts. Both need a device at rest, and the session's own copy
//! of the state is as old as its last look at the mail. So the pulser, the owner of the
//! state, judges them in turn with what was ordered before; meanwhile nothing is ordered
//! that could end its rest.

use super::super::mail::{Order, OrderKind, Released, SessionMail};
use super::present::is_of_present;
use super::{Session, busy, is_arming, send};
use crate::link::{Code, Refusal, Request, Response};
use crate::safety::{StageTable, State};
use crate::units::Micros;

/// A takeover or a restart that the pulser has yet to judge.
#[derive(Debug)]
pub(super) struct Release {
    seq: u16,
    at: Micros,
    /// What to store before the restart; `None` for a takeover.
    table: Option<StageTable>,
}

impl Session {
    /// Asks the pulser whether another host may take over or, with a `table`, the device
    /// restart. What the session knows already is refused at once.
    ///
    /// # Errors
    /// The device is not at rest, or cannot be asked now.
    pub(super) fn ask_release(
        &mut self,
        now: Micros,
        seq: u16,
        table: Option<StageTable>,
        mail: &mut SessionMail<'_>,
    ) -> Result<(), Refusal<'static>> {
        if self.release_under_way(now).is_some() || !mail.has_room_for_order() {
            return Err(busy());
        }
        let restarts = table.is_some();
        if is_arming(mail) || !is_at_rest(self.state, restarts) {
            return Err(refusal(restarts));
        }
        let order = Order {
            seq,
            at: now,
            stops: mail.stop.raised(),
            kind: OrderKind::Release { restarts },
        };
        send(&mut mail.orders, order)?;
        self.release = Some(Release {
            seq,
            at: now,
            table,
        });
        Ok(())
    }

    /// The one that waits for its verdict; a verdict that is so late is lost.
    fn release_under_way(&mut self, now: Micros) -> Option<&Release> {
        self.release
            .take_if(|release| !is_of_present(release.at, now));
        self.release.as_ref()
    }

    /// Refuses what may not be ordered while the pulser judges a takeover or a restart, or
    /// before a restart.
    pub(super) fn check_release(
        &mut self,
        now: Micros,
        request: &Request,
    ) -> Result<(), Refusal<'static>> {
        let is_storing = self.storing.is_some();
        let ends_rest = matches!(request, Request::Arm { .. } | Request::Start);
        match self.release_under_way(now) {
            _ if is_storing => Err(busy()),
            Some(release) if ends_rest || release.table.is_some() => Err(busy()),
            _ => Ok(()),
        }
    }

    /// The pulser's verdict.
    pub(super) fn released(&mut self, verdict: Released, mail: &mut SessionMail<'_>) {
        let Released {
            seq, at, restarts, ..
        } = verdict;
        self.state = verdict.state;
        let is_asked =
            |release: &mut Release| release.seq == seq && release.table.is_some() == restarts;
        let Some(release) = self.release.take_if(is_asked) else {
            return; // nobody waits for it any more
        };
        if !verdict.is_granted {
            self.refuse(Some(seq), refusal(restarts));
        } else if let Some(table) = release.table {
            self.storing = Some(table);
            self.respond(&Response::Ack { seq, at });
        } else {
            match self.renew(at, seq, mail) {
                Ok(info) => self.respond(&Response::Hello(info)),
                Err(refusal) => self.refuse(Some(seq), refusal),
            }
        }
    }
}

/// Whether another host may take over in `state`, or the device restart: as the pulser has
/// it, which knows of an electrode check besides.
pub(in crate::device) const fn is_at_rest(state: State, restarts: bool) -> bool {
    match state {
        State::Idle => true,
        State::Boot | State::Fault => !restarts,
        State::Armed | State::Stimulating | State::Stopping => false,
    }
}

const fn refusal(restarts: bool) -> Refusal<'static> {
    if restarts {
        Refusal::new(Code::WrongState, "state")
    } else {
        Refusal::new(Code::SessionTaken, "session")
    }
}
