//! The effect of each request: an edit of the draft, or an order to another part of the device
//! program, which answers it.

use super::super::draft::check_channel;
use super::super::mail::{ControlRequest, Order, OrderKind, SessionMail};
use super::{Answer, Reply, Restart, Session, busy_refusal, is_arming, send, submit};
use crate::control::Endpoint;
use crate::link::{Code, Part, Refusal, Request, SetupSum};
use crate::pulse::{CHANNELS, TrainSpec};
use crate::safety::{
    ListedPulse, MAX_LISTED, Origin, PulseList, StageKind, StageSupply, StageTable, Stages, Stimuli,
};
use crate::units::{Amplitude, Angle, AngularRate, ForceRate, Micros};
use fixed::types::I16F16;
use heapless::Vec;

impl Session {
    /// Carries out a request of the session's owner: an edit of the draft, or an order to the part
    /// that will answer it.
    pub(super) fn answer(
        &mut self,
        now: Micros,
        seq: u16,
        request: &Request,
        part: Option<Part>,
        mail: &mut SessionMail<'_>,
    ) -> Answer {
        let stops = mail.stop.count_raised();
        let order = |kind| Order {
            seq,
            at: now,
            stops,
            kind,
        };
        self.check_release(now, request)?;
        // Each of these requests may compute a table of force control.
        if let Request::Channel { .. } | Request::Muscle { .. } | Request::ForceControl { .. } =
            request
        {
            self.check_at_rest(now)?;
        }
        if let Some(configured) = self.draft.configure(request) {
            configured?;
            match request {
                Request::Clear => self.setup = SetupSum::default(),
                _ => self.setup.record_part(part),
            }
            return Ok(Reply::Done);
        }
        match request {
            Request::Subscribe { period_ms } => {
                Request::PERIOD_MS.check(*period_ms)?;
                submit(ControlRequest::Subscribe(*period_ms), mail)?;
            }
            Request::Arm { setup } => return self.arm(*setup, order(OrderKind::Arm), mail),
            Request::Start => {
                let reply = later(order(OrderKind::Start), mail)?;
                let count = self.starting.map_or(0, |(count, _)| count);
                self.starting = Some((count.saturating_add(1), now)); // the mailbox holds fewer
                return Ok(reply);
            }
            Request::Acknowledge => return later(order(OrderKind::Acknowledge), mail),
            Request::Status => return later(order(OrderKind::Status), mail),
            Request::KeepAlive => return later(order(OrderKind::KeepAlive), mail),
            Request::Amplitudes {
                at,
                mask,
                values,
                widths,
            } => {
                let stimuli = stimuli(*mask, values, widths)?;
                let kind = OrderKind::Amplitudes { at: *at, stimuli };
                return later(order(kind), mail);
            }
            &Request::Angle {
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
                submit(request, mail)?;
                return Ok(Reply::Later);
            }
            &Request::Force {
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
                submit(request, mail)?;
                return Ok(Reply::Later);
            }
            &Request::Wrench { at, force_mn } => {
                for part in force_mn {
                    Endpoint::FORCE_MN.check(part)?;
                }
                let request = ControlRequest::Wrench {
                    seq,
                    arrived: now,
                    at: at.unwrap_or(now),
                    force_mn,
                };
                submit(request, mail)?;
                return Ok(Reply::Later);
            }
            &Request::ObjectHeld { held } => {
                let request = ControlRequest::Held {
                    seq,
                    arrived: now,
                    is_held: held,
                };
                submit(request, mail)?;
                return Ok(Reply::Later);
            }
            &Request::MuscleLevel { channel, level } => {
                check_channel(channel)?;
                let request = ControlRequest::MuscleLevel {
                    seq,
                    channel,
                    level,
                };
                submit(request, mail)?;
                return Ok(Reply::Later);
            }
            &Request::Measurement {
                joint,
                centideg,
                at,
            } => {
                Request::JOINT.check(joint)?;
                let request = ControlRequest::Measurement {
                    seq,
                    at,
                    joint,
                    angle: Angle::from_centideg(centideg),
                };
                submit(request, mail)?;
                return Ok(Reply::Later);
            }
            Request::Pulses { channel, pulses } => {
                return self.play_list(*channel, pulses, order(OrderKind::Pulses), mail);
            }
            Request::StoreStages { stages, supply } => {
                self.store_stages(now, seq, *stages, *supply, mail)?;
                return Ok(Reply::Later);
            }
            Request::EnterBootLoader => {
                self.enter_boot_loader(now, seq, mail)?;
                return Ok(Reply::Later);
            }
            // The server of a simulator handles this request before it arrives here.
            Request::SimulateTrigger => {
                return Err(Refusal::new(Code::SimulatorOnly, "trigger"));
            }
            // Handled before, as are `Hello` and `Stop`.
            _ => {
                return Err(Refusal::new(Code::UnknownMessage, "request"));
            }
        }
        Ok(Reply::Done)
    }

    /// Accepts a table of the board's stages if the device can store it; the pulser decides
    /// whether the device is idle.
    fn store_stages(
        &mut self,
        now: Micros,
        seq: u16,
        stages: [Option<StageKind>; CHANNELS],
        supply: StageSupply,
        mail: &mut SessionMail<'_>,
    ) -> Result<(), Refusal<'static>> {
        if matches!(
            self.identity.stages,
            Stages::AsConfigured | Stages::Simulated { .. }
        ) {
            return Err(Refusal::new(Code::NoStageMemory, "stages"));
        }
        let table = StageTable {
            origin: Origin::Owner,
            supply: Some(supply),
            stages,
        };
        table.validate()?;
        self.request_release(now, seq, Some(Restart::StoreStages(table)), mail)
    }

    /// Accepts a restart in the chip's boot loader if the device has one and the board's inputs
    /// are open; the pulser decides whether the device is idle.
    fn enter_boot_loader(
        &mut self,
        now: Micros,
        seq: u16,
        mail: &mut SessionMail<'_>,
    ) -> Result<(), Refusal<'static>> {
        if !self.identity.has_boot_loader {
            return Err(Refusal::new(Code::NoBootLoader, "boot_loader"));
        }
        if !self.may_enter_boot_loader {
            return Err(Refusal::new(Code::InputsClosed, "arm input"));
        }
        self.request_release(now, seq, Some(Restart::EnterBootLoader), mail)
    }

    /// Passes a list of pulses to the pulser. If two lists arrive within one window, the second is
    /// refused as busy.
    fn play_list(
        &self,
        channel: u8,
        pulses: &Vec<ListedPulse, MAX_LISTED>,
        order: Order,
        mail: &mut SessionMail<'_>,
    ) -> Answer {
        check_channel(channel)?;
        PulseList::COUNT.check(pulses.len() as i64)?;
        for pulse in pulses {
            ListedPulse::AFTER_US.check(pulse.after_us)?;
            ListedPulse::AMPLITUDE.check(pulse.amplitude.get())?;
            TrainSpec::WIDTH_US.check(pulse.width_us)?;
        }
        if !mail.lists.ready() || !mail.has_room_for_order() {
            return Err(busy_refusal());
        }
        let pulses = pulses.clone();
        send(&mut mail.lists, PulseList { channel, pulses })?;
        later(order, mail)
    }

    /// Checks the whole draft, and that its checksum is the host's `sum`, and passes it to the
    /// pulser and the controller.
    fn arm(&mut self, sum: u32, order: Order, mail: &mut SessionMail<'_>) -> Answer {
        // One order at a time, and all of it: a part left behind would block the next order.
        if is_arming(mail) || !mail.setup.ready() || !mail.has_room_for_order() {
            return Err(busy_refusal());
        }
        // Checked before the draft's mistakes, because the host may mean another setup.
        if self.setup.total() != sum {
            return Err(Refusal::new(Code::OtherSetup, "setup"));
        }
        // `None` only if a mistake was ignored.
        let refuse = |mistake| Err(Refusal::from(mistake));
        let setup = self.draft.examine(refuse)?.ok_or_else(busy_refusal)?;
        // Nothing is refused from here on: every part was just built, and the mailboxes are as
        // large as the largest setup.
        for line in self.draft.lines() {
            send(&mut mail.lines, line.clone())?;
        }
        for part in self.draft.parts() {
            send(&mut mail.control_parts, part?)?;
        }
        send(&mut mail.setup, setup)?;
        later(order, mail)
    }
}

/// Returns a host's amplitudes and widths as arrays, filled from the front. There must be one
/// value per bit of `mask`, and one width per bit or none.
fn stimuli(mask: u16, values: &[Amplitude], widths: &[u16]) -> Result<Stimuli, Refusal<'static>> {
    Request::MASK.check(mask)?;
    let count = mask.count_ones();
    let is_one_each = |length: usize| length == count as usize;
    let wrong = |field| {
        let count = count.cast_signed();
        Err(Refusal::new(Code::AmplitudeCount, field).with_range(count, count))
    };
    if !is_one_each(values.len()) {
        return wrong("values");
    }
    if !widths.is_empty() && !is_one_each(widths.len()) {
        return wrong("widths");
    }
    for &width_us in widths {
        Request::WIDTHS.check(width_us)?;
    }
    let (mut amplitudes, mut all_widths) = ([Amplitude::ZERO; CHANNELS], [0; CHANNELS]);
    for (slot, value) in amplitudes.iter_mut().zip(values) {
        *slot = *value;
    }
    for (slot, width_us) in all_widths.iter_mut().zip(widths) {
        *slot = *width_us;
    }
    Ok(Stimuli {
        mask,
        values: amplitudes,
        widths: all_widths,
    })
}

fn rate(centideg_per_s: i32) -> Result<AngularRate, Refusal<'static>> {
    Request::CENTIDEG_PER_S.check(centideg_per_s)?;
    // 2e6 · 65 536 / 100 < 2^31.
    Ok(AngularRate::new(I16F16::from_bits(
        (i64::from(centideg_per_s) * 65_536 / 100) as i32,
    )))
}

fn force_rate(millinewton_per_s: i32) -> Result<ForceRate, Refusal<'static>> {
    Request::MILLINEWTON_PER_S.check(millinewton_per_s)?;
    // 32 767 000 · 65 536 / 1000 < 2^31.
    Ok(ForceRate::new(I16F16::from_bits(
        (i64::from(millinewton_per_s) * 65_536 / 1000) as i32,
    )))
}

#[inline(never)] // tests of the image stop here
fn later(order: Order, mail: &mut SessionMail<'_>) -> Answer {
    if !mail.has_room_for_order() {
        return Err(busy_refusal());
    }
    send(&mut mail.orders, order)?;
    Ok(Reply::Later)
}
