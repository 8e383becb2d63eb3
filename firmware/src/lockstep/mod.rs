//! Lock-step execution: runs the three owners of `device` in virtual time, for the native simulator
//! and the QEMU image. It has no clock of its own; [`Lockstep::advance`] states how far time goes,
//! and every event happens at its exact microsecond. [`port`] controls the same simulation over a
//! line of bytes. The behaviour of the owners is in `device`.

mod memory;
pub mod port;
mod sink;

pub use sink::Sink;

use crate::device::{
    Controller, Identity, Mailboxes, MuscleTables, Pulser, REFILL_OFFSET_US, Session,
    WINDOWS_PER_TICK,
};
use crate::link::MAX_FRAME;
use crate::pulse::{CHANNELS, Levels, Sample, WINDOW_US, WindowPlan};
use crate::safety::{
    AllowanceWords, Fault, FaultRecord, Inputs, Reading, Setup, Stage, State, UsageAtBoot,
};
use crate::units::{DacCode, Micros, us};
use memory::Memory;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Time that each owner's call takes on the device, µs, after which its effects are visible. The
/// values lie between the mean and the maximum that the chip simulator measures at full load
/// (docs/how/architecture.md).
pub mod cost {
    /// Duration of a refill, from its compare to its DAC writes, µs.
    pub const REFILL_US: u32 = 30;
    /// Duration of a control tick, µs.
    pub const CONTROL_US: u32 = 30;
    /// Duration of the session's processing of one frame, µs.
    pub const SESSION_US: u32 = 40;
}

/// Inputs of the board during one [`Lockstep::advance`].
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct Sensors {
    /// Conversion code of the joint sensor, if one is connected.
    pub joint: Option<u16>,
    /// Load on each channel, Ω; `u32::MAX` means a detached electrode.
    pub load_ohm: [u32; CHANNELS],
    /// Whether the arm input is closed.
    pub arm: bool,
    /// Whether the hand-held stop is closed.
    pub hand_stop: bool,
    /// Whether the over-current comparator has tripped.
    pub over_current: bool,
    /// Time of a trigger edge during this advance. Earlier edges are ignored, because an earlier
    /// call has handled them.
    pub trigger: Option<Micros>,
    /// Whether the trigger input is active: during the whole advance, or from `trigger` on if that
    /// is set.
    pub held: bool,
}

impl Default for Sensors {
    fn default() -> Self {
        Self {
            joint: None,
            load_ohm: [2_000; CHANNELS],
            arm: true,
            hand_stop: true,
            over_current: false,
            trigger: None,
            held: false,
        }
    }
}

/// A simulated board: owners, mailboxes, and the window that plays.
///
/// A host opens a session and gets the device's answer:
///
/// ```
/// use firmware::device::Identity;
/// use firmware::link::message::ResetCause;
/// use firmware::link::{BROADCAST, Decoder, Kind, Request, Response, SCHEMA, ToDevice, encode};
/// use firmware::lockstep::{Lockstep, Sensors, Sink};
/// use firmware::pulse::Levels;
/// use firmware::safety::Stages;
/// use firmware::units::{DacCode, Micros};
///
/// struct Line(Vec<u8>);
/// impl Sink for Line {
///     fn write_levels(&mut self, _: Micros, _: Levels) {}
///     fn write_dac(&mut self, _: Micros, _: u8, _: DacCode) {}
///     fn write_bytes(&mut self, _: Micros, bytes: &[u8]) {
///         self.0.extend(bytes);
///     }
/// }
///
/// let identity = Identity {
///     kind: Kind::Native,
///     unique_id: [0; 3],
///     reset: ResetCause::PowerOn,
///     last_fault: None,
///     first_session: 7,
///     stages: Stages::AsConfigured,
///     option_bytes: None,
///     board: "",
///     crystal_hz: 0,
///     has_boot_loader: false,
/// };
/// let (mut board, mut line) = (Lockstep::new(identity, Micros::new(0)), Line(Vec::new()));
/// let request = Request::Hello { schema: SCHEMA };
/// let hello = encode(&ToDevice { session: BROADCAST, seq: 0, request }).unwrap();
/// board.receive(Micros::new(1_000), &hello, &Sensors::default(), &mut line);
/// board.advance(Micros::new(3_000), &Sensors::default(), &mut line);
///
/// let (delimiter, bytes) = line.0.split_last().unwrap();
/// let mut decoder = Decoder::default();
/// assert!(bytes.iter().all(|&byte| decoder.push(byte).is_none()));
/// let answer = decoder.push(*delimiter).unwrap().unwrap();
/// let Ok(Response::Hello(info)) = postcard::from_bytes(answer) else {
///     panic!("no session");
/// };
/// assert_eq!(info.session, 7);
/// ```
#[derive(Clone, Debug)]
pub struct Lockstep {
    pulser: Pulser,
    controller: Controller,
    tables: MuscleTables,
    session: Session,
    mail: Mailboxes,
    /// Time up to which all events have happened.
    now: Micros,
    /// Number of windows since boot, which determines the control ticks.
    count: u32,
    /// Window that plays now.
    playing: WindowPlan,
    /// Number of changes of `playing` that have reached the pins.
    played: usize,
    /// Window that plays after `playing`.
    next: WindowPlan,
    levels: Levels,
    dac: [DacCode; CHANNELS],
    reading: Option<Reading>,
    trigger: Option<Micros>,
    tripped: bool,
    /// Time at which the latest refill has written its DACs.
    written: Micros,
    /// Time at which bytes last left for the host.
    sent: Micros,
    /// Whether refills without any effect are left out.
    skips: bool,
    memory: Memory,
}

impl Lockstep {
    /// Creates a board that boots at `boot`.
    #[must_use]
    pub fn new(identity: Identity, boot: Micros) -> Self {
        let (mut playing, mut next) = (WindowPlan::new(), WindowPlan::new());
        playing.reset(boot, Levels::ISOLATED);
        next.reset(boot + us(WINDOW_US), Levels::ISOLATED);
        Self {
            pulser: Pulser::new(identity.last_fault, UsageAtBoot::default()),
            controller: Controller::new(),
            tables: MuscleTables::NONE,
            session: Session::new(identity),
            mail: Mailboxes::new(),
            now: boot,
            count: 0,
            playing,
            played: 0,
            next,
            levels: Levels::ISOLATED,
            dac: [DacCode::new(0); CHANNELS],
            reading: None,
            trigger: None,
            tripped: false,
            written: boot,
            sent: boot,
            skips: true,
            memory: Memory::default(),
        }
    }

    /// Resets the board part by part, because a chip has no memory for two of them. The result
    /// equals a new board, except that the spent part of the wearer's allowance stays unless power
    /// came up.
    pub fn boot(&mut self, identity: Identity, boot: Micros) {
        let found = self.memory.boot(identity.reset);
        self.pulser = Pulser::new(identity.last_fault, found);
        self.controller = Controller::new();
        self.tables.clear();
        self.session = Session::new(identity);
        self.mail = Mailboxes::new();
        self.playing.reset(boot, Levels::ISOLATED);
        self.next.reset(boot + us(WINDOW_US), Levels::ISOLATED);
        (self.now, self.written, self.sent) = (boot, boot, boot);
        (self.count, self.played) = (0, 0);
        (self.levels, self.dac) = (Levels::ISOLATED, [DacCode::new(0); CHANNELS]);
        (self.reading, self.trigger) = (None, None);
        (self.tripped, self.skips) = (false, true);
    }

    /// Makes the board call every owner in every window, as a hardware board does. This is slower;
    /// tests show that the results are the same.
    #[must_use]
    pub const fn without_skipping(mut self) -> Self {
        self.skips = false;
        self
    }

    /// Returns the memory that a reset leaves unchanged, so that tests can damage it.
    pub const fn allowance_copies_mut(&mut self) -> &mut [AllowanceWords; 2] {
        &mut self.memory.copies
    }

    /// Returns the device time.
    #[must_use]
    pub const fn now(&self) -> Micros {
        self.now
    }

    /// Returns the state of the pulser's state machine.
    #[must_use]
    pub const fn state(&self) -> State {
        self.pulser.state()
    }

    /// Returns the armed or last armed setup.
    #[must_use]
    pub const fn setup(&self) -> Option<&Setup> {
        self.pulser.setup()
    }

    /// Receives bytes, the last of which arrives at `at`. Time first advances to the moment at
    /// which the session has processed a frame that the bytes complete.
    pub fn receive(&mut self, at: Micros, bytes: &[u8], sensors: &Sensors, sink: &mut impl Sink) {
        let served = if bytes.contains(&0) {
            at + us(cost::SESSION_US)
        } else {
            at
        };
        self.serve(at, served, bytes, sensors, sink);
    }

    /// Receives bytes as [`Self::receive`] does, with a given time at which the session has
    /// processed them: a refill from `served` on sees the orders. This serves to replay the
    /// behaviour of another device.
    pub fn serve(
        &mut self,
        at: Micros,
        served: Micros,
        bytes: &[u8],
        sensors: &Sensors,
        sink: &mut impl Sink,
    ) {
        self.advance(served, sensors, sink);
        let (_, _, mut mail) = self.mail.split();
        for frame in bytes.split_inclusive(|&byte| byte == 0) {
            self.session.receive(at, frame, &mut mail);
            transmit(&mut self.session, self.now, &mut self.sent, sink);
        }
    }

    /// Advances time to `to`; does nothing if that time has been reached.
    pub fn advance(&mut self, to: Micros, sensors: &Sensors, sink: &mut impl Sink) {
        if sensors.trigger.is_some_and(|at| at.has_reached(self.now)) {
            self.trigger = sensors.trigger;
        }
        if sensors.over_current && !self.tripped {
            self.fault(Fault::OverCurrent, sink);
        }
        self.tripped = sensors.over_current;
        loop {
            let refill = self.playing.start + us(REFILL_OFFSET_US);
            let turn = self.playing.start + us(WINDOW_US);
            let is_rendered = refill.is_before(self.now);
            let event = if is_rendered { turn } else { refill };
            if !event.is_before(to) {
                break;
            }
            if is_rendered {
                self.begin_window(turn, sensors, sink);
            } else {
                self.refill(refill, sensors, sink);
            }
        }
        if self.now.is_before(to) {
            self.now = to;
        }
        self.play_until(to, sink);
    }

    /// Applies the changes of the playing window that lie before `to` to the pins.
    fn play_until(&mut self, to: Micros, sink: &mut impl Sink) {
        while let Some(change) = self.playing.changes.get(self.played).copied() {
            let at = self.playing.start + us(change.slot.into());
            if !at.is_before(to) {
                break;
            }
            self.played += 1; // below the number of changes
            self.set_levels(at, change.levels, sink);
        }
    }

    /// Begins to play the next window.
    fn begin_window(&mut self, start: Micros, sensors: &Sensors, sink: &mut impl Sink) {
        self.play_until(start, sink);
        self.convert_sample(sensors);
        // Copies only the contents; the two plans are large and mostly empty.
        self.playing.reset(start, self.next.initial);
        let _ = self.playing.changes.extend_from_slice(&self.next.changes); // same capacity
        self.playing.sample = self.next.sample;
        self.played = 0;
        self.now = start;
        self.count = self.count.wrapping_add(1);
        self.set_levels(start, self.playing.initial, sink);
    }

    /// Converts the mid-phase current of the played window, as the front end does.
    fn convert_sample(&mut self, sensors: &Sensors) {
        let Some(Sample {
            channel, second, ..
        }) = self.playing.sample.take()
        else {
            return;
        };
        let index = usize::from(channel);
        let (code, ohm) = (self.dac.get(index), sensors.load_ohm.get(index));
        if let (Some(stage), Some(&code), Some(&ohm)) = (self.stage(channel), code, ohm) {
            let current = stage.current_through(code, ohm);
            self.reading = Some(Reading::from_current(channel, second, current));
        }
    }

    fn stage(&self, channel: u8) -> Option<Stage> {
        let channels = &self.pulser.setup()?.channels;
        Some(channels.get(usize::from(channel)).copied().flatten()?.stage)
    }

    fn refill(&mut self, now: Micros, sensors: &Sensors, sink: &mut impl Sink) {
        // One past the compare, so that the window counts as rendered.
        self.now = now + us(1);
        let trigger = self.trigger.take_if(|at| now.has_reached(*at));
        let inputs = Inputs {
            arm: sensors.arm,
            hand_stop: sensors.hand_stop,
            over_current: sensors.over_current,
            trigger,
            held: sensors.held && self.trigger.is_none(), // otherwise the edge has yet to come
            reading: self.reading.take(),
        };
        let start = self.playing.start + us(WINDOW_US);
        let done = now + us(cost::REFILL_US);
        let is_tick = self.count.is_multiple_of(WINDOWS_PER_TICK);
        let rests = self.skips && self.pulser.try_skip_refill(start, &inputs, &mut self.mail);
        if rests {
            let levels = self.next.last_levels();
            self.next.reset(start, levels);
            // The pulser would have done nothing more. Neither the pulser nor the controller has
            // posted messages to the session since the session last read its mail, and output of
            // the session is transmitted at once.
            if !is_tick {
                self.written = done;
                return;
            }
        }
        let mut result = Ok(());
        if !rests {
            let (mut mail, _, _) = self.mail.split();
            let plan = &mut self.next;
            result = self.pulser.refill(now, start, &inputs, &mut mail, plan);
            for &(channel, code) in &plan.dac {
                if let Some(slot) = self.dac.get_mut(usize::from(channel)) {
                    *slot = code;
                }
                sink.write_dac(done, channel, code);
            }
            for (bank, &code) in (0..).zip(plan.trips.iter().flatten()) {
                sink.write_trip(done, bank, code);
            }
        }
        let mut ready = done;
        if is_tick {
            let (_, mut mail, _) = self.mail.split();
            self.controller
                .tick(now, sensors.joint, &mut self.tables, &mut mail);
            ready = done + us(cost::CONTROL_US);
        }
        self.memory.write_entries(&mut self.mail);
        if !self.skips || self.mail.has_message_for_session() {
            self.session.poll(now, &mut self.mail.split().2);
        }
        if result.is_err() {
            self.isolate(now, sink);
        }
        self.written = done;
        transmit(&mut self.session, ready, &mut self.sent, sink);
    }

    /// Handles a fault from outside the refill: disconnects the outputs at once.
    fn fault(&mut self, fault: Fault, sink: &mut impl Sink) {
        let record = FaultRecord::new(fault, self.now);
        self.pulser.fault(&record, &mut self.mail.split().0);
        self.isolate(self.now, sink);
    }

    /// Performs the hardware's fault stop. Rendered windows are not played any more, and the
    /// amplitudes go to zero after the writes of a refill in progress, which nothing interrupts on
    /// a board.
    fn isolate(&mut self, at: Micros, sink: &mut impl Sink) {
        self.play_until(at, sink);
        self.played = self.playing.changes.len();
        self.playing.sample = None;
        self.next.reset(self.next.start, Levels::ISOLATED);
        self.set_levels(at, Levels::ISOLATED, sink);
        let cleared = if at.is_before(self.written) {
            self.written
        } else {
            at
        };
        for (channel, code) in (0..).zip(&mut self.dac) {
            if *code != DacCode::new(0) {
                *code = DacCode::new(0);
                sink.write_dac(cleared, channel, DacCode::new(0));
            }
        }
    }

    fn set_levels(&mut self, at: Micros, levels: Levels, sink: &mut impl Sink) {
        if levels != self.levels {
            self.levels = levels;
            sink.write_levels(at, levels);
        }
    }
}

/// Empties the outbox at `at`, but not before the time of the last transmission: one owner's answer
/// may be ready later than the next one's.
fn transmit(session: &mut Session, at: Micros, sent: &mut Micros, sink: &mut impl Sink) {
    while session.has_output() {
        let mut buffer = [0; MAX_FRAME];
        let ahead = (*sent - at).us();
        // A time further ahead than any owner's duration results from a wrapped clock.
        let is_ahead = (0..1000).contains(&ahead);
        *sent = if is_ahead { *sent } else { at };
        let count = session.transmit(&mut buffer);
        sink.write_bytes(*sent, buffer.get(..count).unwrap_or_default());
    }
}
