//! The device's identity, the right to send requests, and the numbers of sessions.

use super::super::mail::{ControlRequest, Order, OrderKind, SessionMail};
use super::{Session, busy_refusal, send, submit};
use crate::link::message::{OptionBytes, ResetCause};
use crate::link::{Code, HelloInfo, Kind, Refusal, SCHEMA, Sender, SetupSum, VERSION};
use crate::pulse::DEAD_TIME_US;
use crate::safety::{FaultRecord, Stages};
use crate::units::Micros;

/// The device's identity, as it is reported to hosts.
#[derive(Clone, Copy, Debug)]
pub struct Identity {
    /// Kind of device.
    pub kind: Kind,
    /// 96-bit unique number of the chip; zero in simulators.
    pub unique_id: [u32; 3],
    /// Cause of the latest reset.
    pub reset: ResetCause,
    /// Fault that was recorded before the reset, if any.
    pub last_fault: Option<FaultRecord>,
    /// Number of the first session, from [`first_session_number`] or arbitrary; 0 counts as 1.
    pub first_session: u16,
    /// The device's output stages.
    pub stages: Stages,
    /// The chip's option bytes; `None` in simulators without a chip.
    pub option_bytes: Option<OptionBytes>,
    /// Name of the board, empty in simulators without a chip. A name that is longer than
    /// [`BOARD_NAME`](crate::board::wiring::BOARD_NAME) is reported as empty.
    pub board: &'static str,
    /// Measured frequency of the crystal, Hz; 0 without a measurement.
    pub crystal_hz: u32,
    /// Whether [`Request::EnterBootLoader`](crate::link::Request::EnterBootLoader) is possible on
    /// this device.
    pub has_boot_loader: bool,
}

/// Returns the number of the first session, which another host is unlikely to guess by chance. The
/// device reports it to any host that sends `Hello`, so it is no secret.
#[must_use]
pub fn first_session_number(seed: &[u32]) -> u16 {
    // FNV-1a hash, folded to 16 bits.
    let hash = seed.iter().fold(0x811C_9DC5_u32, |hash, &word| {
        let bytes = word.to_le_bytes().into_iter();
        bytes.fold(hash, |hash, byte| {
            (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)
        })
    });
    ((hash >> 16 ^ hash) as u16).max(1) // its low half
}

impl Session {
    /// Opens a session, which begins without a subscription. Returns `None` if another host has a
    /// session: the pulser judges the takeover, and its verdict is the answer.
    ///
    /// # Errors
    /// Refuses a host with another schema, a takeover of a device that is not at rest, a device
    /// that is about to restart, and full mailboxes.
    pub(super) fn open(
        &mut self,
        now: Micros,
        seq: u16,
        session: u16,
        schema: u64,
        mail: &mut SessionMail<'_>,
    ) -> Result<Option<HelloInfo>, Refusal<'static>> {
        if schema != SCHEMA {
            return Err(Refusal::new(Code::SchemaMismatch, "schema"));
        }
        if self.restart.is_some() {
            return Err(busy_refusal()); // about to restart
        }
        if self.owner.is_some_and(|owner| owner != session) {
            self.request_release(now, seq, None, mail)?;
            return Ok(None);
        }
        if self.owner.is_none() {
            return self.renew(now, seq, mail).map(Some);
        }
        // The device may be stimulating: the timed setpoints of the session that ends are dropped
        // with it.
        if !mail.orders.ready() {
            return Err(busy_refusal());
        }
        let info = self.renew(now, seq, mail)?;
        let forget = Order {
            seq,
            at: now,
            stops: mail.stop.count_raised(),
            kind: OrderKind::Forget,
        };
        send(&mut mail.orders, forget)?;
        Ok(Some(info))
    }

    /// Begins the next session, for the host that sent `Hello` with number `seq`.
    pub(super) fn renew(
        &mut self,
        at: Micros,
        seq: u16,
        mail: &mut SessionMail<'_>,
    ) -> Result<HelloInfo, Refusal<'static>> {
        submit(ControlRequest::Subscribe(0), mail)?; // or the old one would go on
        self.last_session = self.last_session.checked_add(1).unwrap_or(1);
        self.owner = Some(self.last_session);
        self.expected = Some(seq.wrapping_add(1));
        self.draft.clear();
        self.setup = SetupSum::default();
        Ok(HelloInfo {
            seq,
            session: self.last_session,
            schema: SCHEMA,
            version: VERSION,
            kind: self.identity.kind,
            unique_id: self.identity.unique_id,
            at,
            state: self.state,
            reset: self.identity.reset,
            last_fault: self.identity.last_fault,
            dead_time_us: DEAD_TIME_US,
            stages: self.identity.stages,
            option_bytes: self.identity.option_bytes,
            board: self.identity.board.try_into().unwrap_or_default(),
            crystal_hz: self.identity.crystal_hz,
        })
    }

    /// Checks that the sender owns the session. Gaps in its request numbers count as lost
    /// requests.
    pub(super) fn check_owner(&mut self, sender: Sender) -> Result<(), Refusal<'static>> {
        let Sender { session, seq } = sender;
        if self.owner != Some(session) {
            self.counters.unknown_sessions = self.counters.unknown_sessions.saturating_add(1);
            let code = match self.owner {
                None => Code::NoSession,
                Some(_) => Code::SessionTaken,
            };
            return Err(Refusal::new(code, "session"));
        }
        let gap = seq.wrapping_sub(self.expected.unwrap_or(seq));
        // A lower number is late or duplicated; no gap follows it.
        if gap < 1 << 15 {
            self.counters.lost_frames = self.counters.lost_frames.saturating_add(gap.into());
            self.expected = Some(seq.wrapping_add(1));
        }
        Ok(())
    }
}
