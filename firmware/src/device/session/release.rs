//! Requests that take the device away from its session: another host's `Hello`, and those after
//! which the device restarts. Both need a device at rest, and the session's own copy of the
//! state is as old as its last look at the mail. So the pulser, which owns the state, judges them
//! in turn with the earlier orders; until then nothing is ordered that could end the rest.

use super::super::mail::{Order, OrderKind, ReleaseAnswer, SessionMail};
use super::present::is_recent;
use super::{Session, busy_refusal, is_arming, send};
use crate::link::{Code, Refusal, Request, Response};
use crate::safety::{StageTable, State};
use crate::units::Micros;

/// A restart that a host requested, and what the board does before it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Restart {
    /// Stores this table of its output stages.
    StoreStages(StageTable),
    /// Asks the next boot to enter the chip's boot loader.
    EnterBootLoader,
}

/// A takeover or a restart that the pulser has not judged yet.
#[derive(Clone, Debug)]
pub(super) struct Release {
    seq: u16,
    at: Micros,
    /// The requested restart; `None` for a takeover.
    restart: Option<Restart>,
}

impl Session {
    /// Asks the pulser whether another host may take over or, with a `restart`, whether the device
    /// may restart. If the session knows already that the device is not at rest, it refuses at
    /// once.
    ///
    /// # Errors
    /// Refuses if the device is not at rest, or if the pulser cannot be asked now.
    pub(super) fn request_release(
        &mut self,
        now: Micros,
        seq: u16,
        restart: Option<Restart>,
        mail: &mut SessionMail<'_>,
    ) -> Result<(), Refusal<'static>> {
        if self.pending_release(now).is_some() || !mail.has_room_for_order() {
            return Err(busy_refusal());
        }
        let restarts = restart.is_some();
        if is_arming(mail) || !may_release(self.state, restarts) {
            return Err(refusal(restarts));
        }
        let order = Order {
            seq,
            at: now,
            stops: mail.stop.count_raised(),
            kind: OrderKind::Release { restarts },
        };
        send(&mut mail.orders, order)?;
        self.release = Some(Release {
            seq,
            at: now,
            restart,
        });
        Ok(())
    }

    /// Returns the takeover or restart that waits for its verdict; a verdict that is too late
    /// counts as lost.
    fn pending_release(&mut self, now: Micros) -> Option<&Release> {
        self.release.take_if(|release| !is_recent(release.at, now));
        self.release.as_ref()
    }

    /// Refuses requests that are not allowed while the pulser judges a takeover or a restart, or
    /// before a restart.
    pub(super) fn check_release(
        &mut self,
        now: Micros,
        request: &Request,
    ) -> Result<(), Refusal<'static>> {
        let is_restarting = self.restart.is_some();
        let ends_rest = matches!(request, Request::Arm { .. } | Request::Start);
        match self.pending_release(now) {
            _ if is_restarting => Err(busy_refusal()),
            Some(release) if ends_rest || release.restart.is_some() => Err(busy_refusal()),
            _ => Ok(()),
        }
    }

    /// Carries out the pulser's verdict on a takeover or a restart.
    pub(super) fn apply_release_verdict(
        &mut self,
        verdict: ReleaseAnswer,
        mail: &mut SessionMail<'_>,
    ) {
        let ReleaseAnswer {
            seq, at, restarts, ..
        } = verdict;
        self.state = verdict.state;
        let is_asked =
            |release: &mut Release| release.seq == seq && release.restart.is_some() == restarts;
        let Some(release) = self.release.take_if(is_asked) else {
            return; // nobody waits for it any more
        };
        if !verdict.is_granted {
            self.refuse(Some(seq), refusal(restarts));
        } else if let Some(restart) = release.restart {
            self.restart = Some(restart);
            self.respond(&Response::Ack { seq, at });
        } else {
            match self.renew(at, seq, mail) {
                Ok(info) => self.respond(&Response::Hello(info)),
                Err(refusal) => self.refuse(Some(seq), refusal),
            }
        }
    }
}

/// Returns whether another host may take over in `state`, or whether the device may restart. The
/// pulser, which decides, also takes an electrode check into account.
pub(in crate::device) const fn may_release(state: State, restarts: bool) -> bool {
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
