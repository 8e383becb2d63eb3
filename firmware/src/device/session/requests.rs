//! What each request does: edits the draft, or orders something of another
//! owner, who answers it.

use super::super::draft::check_channel;
use super::super::mail::{ControlRequest, Order, OrderKind, SessionMail};
use super::{Answer, Reply, Session, ask, busy, is_arming, send};
use crate::control::Joint;
use crate::haptics::Wall;
use crate::link::{Code, Refusal, Request};
use crate::pulse::{CHANNELS, check_members};
use crate::units::{Amplitude, Angle, AngularRate, ForceRate, Micros, OutOfRange};
use fixed::types::I16F16;

impl Session {
    /// What a request of the session's owner comes to: an edit of the draft, or an
    /// order to the owner who will answer it.
    pub(super) fn answer(
        &mut self,
        now: Micros,
        seq: u16,
        request: Request,
        mail: &mut SessionMail<'_>,
    ) -> Answer {
        let stops = mail.stop.raised();
        let order = |kind| Order {
            seq,
            at: now,
            stops,
            kind,
        };
        match request {
            Request::Clear => self.draft.clear(),
            Request::Wearer(spec) => {
                spec.validate()?;
                self.draft.wearer = spec;
            }
            Request::Channel { channel, spec } => {
                spec.validate(&self.draft.wearer.validate()?)
                    .map_err(|e| Refusal::from(e).on(channel))?;
                self.draft.set_channel(channel, spec)?;
            }
            Request::Groups(groups) => {
                check_members(&groups)?;
                self.draft.groups = groups;
            }
            Request::Sync { channel } => {
                if let Some(channel) = channel {
                    check_channel(channel)?;
                }
                self.draft.sync = channel;
            }
            Request::Muscle { channel, spec } => {
                spec.validate().map_err(|e| Refusal::from(e).on(channel))?;
                self.draft.set_muscle(channel, spec)?;
            }
            Request::Joint(spec) => {
                Joint::new(&spec)?;
                self.draft.joint = Some(spec);
            }
            Request::Wall(spec) => {
                Wall::new(&spec)?;
                self.draft.wall = Some(spec);
            }
            Request::ForceControl { channel, spec } => {
                spec.check().map_err(|e| Refusal::from(e).on(channel))?;
                self.draft.set_force(channel, spec)?;
            }
            Request::Subscribe { period_ms } => {
                OutOfRange::check("period_ms", period_ms.into(), 0, 1000)?;
                ask(ControlRequest::Subscribe(period_ms), mail)?;
            }
            Request::Arm => return self.arm(order(OrderKind::Arm), mail),
            Request::Start => return later(order(OrderKind::Start), mail),
            Request::Acknowledge => return later(order(OrderKind::Acknowledge), mail),
            Request::Status => return later(order(OrderKind::Status), mail),
            Request::KeepAlive => return later(order(OrderKind::KeepAlive), mail),
            Request::Amplitudes { mask, values } => {
                return later(
                    order(OrderKind::Amplitudes {
                        mask,
                        values: spread(mask, &values)?,
                    }),
                    mail,
                );
            }
            Request::Angle {
                at,
                centideg,
                centideg_per_s,
            } => {
                let request = ControlRequest::Angle {
                    seq,
                    arrived: now,
                    at: at.unwrap_or(now),
                    angle: Angle::from_centideg(centideg),
                    rate: centideg_per_s.map(rate).transpose()?,
                };
                ask(request, mail)?;
                return Ok(Reply::Later);
            }
            Request::Force {
                channel,
                at,
                millinewton,
                millinewton_per_s,
            } => {
                check_channel(channel)?;
                let request = ControlRequest::Force {
                    seq,
                    arrived: now,
                    at: at.unwrap_or(now),
                    channel,
                    millinewton,
                    rate: millinewton_per_s.map(force_rate).transpose()?,
                };
                ask(request, mail)?;
                return Ok(Reply::Later);
            }
            Request::Rung { channel, rung } => {
                check_channel(channel)?;
                let request = ControlRequest::Rung { seq, channel, rung };
                ask(request, mail)?;
                return Ok(Reply::Later);
            }
            Request::Measurement {
                joint,
                centideg,
                at,
            } => {
                OutOfRange::check("joint", joint.into(), 0, 0)?;
                let angle = Angle::from_centideg(centideg);
                ask(ControlRequest::Measurement { seq, at, angle }, mail)?;
                return Ok(Reply::Later);
            }
            // Who serves a simulator takes it on its way here.
            Request::SimulateTrigger => {
                return Err(Refusal::new(Code::SimulatorOnly, "trigger"));
            }
            // Handled before.
            Request::Hello { .. } | Request::Stop => {
                return Err(Refusal::new(Code::UnknownMessage, "request"));
            }
        }
        Ok(Reply::Done)
    }

    /// Checks the whole draft and hands it to its two users.
    fn arm(&mut self, order: Order, mail: &mut SessionMail<'_>) -> Answer {
        // One order at a time, and all of it: a part left behind would block the
        // next one.
        if is_arming(mail) || !mail.setup.ready() || !mail.has_room_for_order() {
            return Err(busy());
        }
        let setup = self.draft.check()?;
        // Nothing is refused from here on: every part was just built, and the
        // mailboxes are as large as the largest setup.
        for part in self.draft.parts() {
            send(&mut mail.control_parts, part?)?;
        }
        send(&mut mail.setup, setup)?;
        later(order, mail)
    }
}

/// One value per bit of `mask`, as an array with the values in front. A mask of
/// nothing asks for nothing: it would only say that the host is there, in any state.
fn spread(mask: u16, values: &[Amplitude]) -> Result<[Amplitude; CHANNELS], Refusal<'static>> {
    OutOfRange::check("mask", mask.into(), 1, (1 << CHANNELS) - 1)?;
    if mask.count_ones() as usize != values.len() {
        let count = mask.count_ones().cast_signed();
        return Err(Refusal::new(Code::AmplitudeCount, "values").allowed(count, count));
    }
    let mut all = [Amplitude::ZERO; CHANNELS];
    for (slot, value) in all.iter_mut().zip(values) {
        *slot = *value;
    }
    Ok(all)
}

/// Rates beyond ±20 000 °/s are no finger's.
fn rate(centideg_per_s: i32) -> Result<AngularRate, Refusal<'static>> {
    OutOfRange::check(
        "centideg_per_s",
        centideg_per_s.into(),
        -2_000_000,
        2_000_000,
    )?;
    // 2e6 · 65 536 / 100 < 2^31.
    Ok(AngularRate(I16F16::from_bits(
        (i64::from(centideg_per_s) * 65_536 / 100) as i32,
    )))
}

/// Rates beyond ±32 767 N/s are no muscle's.
fn force_rate(millinewton_per_s: i32) -> Result<ForceRate, Refusal<'static>> {
    const MOST: i32 = 32_767_000;
    OutOfRange::check("millinewton_per_s", millinewton_per_s.into(), -MOST, MOST)?;
    // 32 767 000 · 65 536 / 1000 < 2^31.
    Ok(ForceRate(I16F16::from_bits(
        (i64::from(millinewton_per_s) * 65_536 / 1000) as i32,
    )))
}

fn later(order: Order, mail: &mut SessionMail<'_>) -> Answer {
    if !mail.has_room_for_order() {
        return Err(busy());
    }
    send(&mut mail.orders, order)?;
    Ok(Reply::Later)
}
