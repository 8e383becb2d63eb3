//! Benchmarks of the three owners at work: ten channels at 100 Hz, ten muscles, one finger.

use super::{Bench, Checksum, Clock, Random, control, link, muscle, pulse};
use crate::control::LawSpec;
use crate::device::{
    Controller, Identity, Mailboxes, MuscleTables, Pulser, Session, WINDOWS_PER_TICK,
};
use crate::link::message::ResetCause;
use crate::link::{BROADCAST, Kind, MAX_FRAME, Request, SCHEMA, SetupSum, ToDevice, encode};
use crate::muscle::MuscleSpec;
use crate::pulse::{CHANNELS, Sample, TrainSpec, WINDOW_US, WindowPlan};
use crate::safety::{
    ChannelSpec, Inputs, Reading, StageSpec, Stages, State, UsageAtBoot, WearerSpec,
};
use crate::units::{Amplitude, DacCode, Micros, us};
use heapless::Vec;

/// Mask of the channels that a host drives; the finger has the others.
const DIRECT: u16 = 0b11_1111_1000;
/// Number of the session that the first `Hello` opens.
const SESSION: u16 = 1;
/// Number of ticks after which the electrode check of ten channels has certainly ended.
const CHECK_TICKS: u32 = 40;

/// A device without a board, and its host.
struct HostAndDevice<'t> {
    pulser: Pulser,
    controller: Controller,
    tables: &'t mut MuscleTables,
    session: Session,
    mail: Mailboxes,
    plan: WindowPlan,
    dac: [DacCode; CHANNELS],
    /// Pulse to sample in the window that plays.
    sample: Option<Sample>,
    reading: Option<Reading>,
    /// Start of the next window.
    start: Micros,
    windows: u32,
    seq: u16,
    frame: Vec<u8, MAX_FRAME>,
    code: u16,
    ok: bool,
    /// Checksum of the session's output in the latest tick.
    said: Checksum,
}

impl<'t> HostAndDevice<'t> {
    /// Creates the device as after a boot.
    fn new(tables: &'t mut MuscleTables) -> Self {
        let identity = Identity {
            kind: Kind::Native,
            unique_id: [0; 3],
            reset: ResetCause::PowerOn,
            last_fault: None,
            first_session: 1,
            stages: Stages::AsConfigured,
            option_bytes: None,
            board: "",
            crystal_hz: 0,
            has_boot_loader: false,
        };
        Self {
            pulser: Pulser::new(None, UsageAtBoot::default()),
            controller: Controller::new(),
            tables,
            session: Session::new(identity),
            mail: Mailboxes::new(),
            plan: WindowPlan::new(),
            dac: [DacCode::new(0); CHANNELS],
            sample: None,
            reading: None,
            start: Micros::new(WINDOW_US),
            windows: 0,
            seq: 0,
            frame: Vec::new(),
            code: 2_000,
            ok: true,
            said: Checksum::default(),
        }
    }

    /// Configures, arms and starts the device, which stimulates from then on.
    fn start(&mut self) {
        let setup = self.configure();
        self.send_request(Request::Arm { setup });
        for _ in 0..CHECK_TICKS {
            self.tick();
        }
        self.send_request(Request::Start);
        self.tick();
        self.ok &= self.pulser.state() == State::Stimulating;
    }

    /// Configures the device, and returns the checksum of the setup.
    fn configure(&mut self) -> u32 {
        self.send_request(Request::Hello { schema: SCHEMA });
        let mut sent = SetupSum::default();
        let mut ask = |request: Request| {
            sent.note(&request);
            self.send_request(request);
        };
        ask(Request::Wearer(WearerSpec {
            rise_ms: 1,
            host_timeout_ms: 1000,
            ..WearerSpec::default()
        }));
        for channel in 0..CHANNELS as u8 {
            let spec = ChannelSpec {
                train: TrainSpec {
                    offset_us: u32::from(channel) * 997,
                    ..pulse::TRAIN
                },
                stage: StageSpec::Current {
                    full_scale_ua: 100_000,
                },
                limit: Amplitude::new(20_000),
                start: Amplitude::new(0),
                area_mm2: ChannelSpec::ASSUMED_AREA_MM2,
            };
            ask(Request::Channel { channel, spec });
            ask(Request::Muscle {
                channel,
                spec: MuscleSpec::new(muscle::FORCE, muscle::RECRUITMENT),
            });
        }
        ask(Request::Joint(control::finger(LawSpec::RECOMMENDED, 2)));
        self.send_request(Request::Subscribe { period_ms: 10 });
        self.tick();
        sent.total()
    }

    /// Encodes the frame of the next request.
    fn write(&mut self, request: Request) {
        let session = match request {
            Request::Hello { .. } => BROADCAST,
            _ => SESSION,
        };
        let seq = self.seq;
        self.seq = seq.wrapping_add(1);
        let message = ToDevice {
            session,
            seq,
            request,
        };
        self.frame = encode(&message).unwrap_or_default();
        self.ok &= !self.frame.is_empty();
    }

    fn receive(&mut self) {
        let (_, _, mut mail) = self.mail.split();
        self.session.receive(self.start, &self.frame, &mut mail);
    }

    fn send_request(&mut self, request: Request) {
        self.write(request);
        self.receive();
        self.read_output();
    }

    /// Renders the next window, one window before it plays.
    fn refill(&mut self) {
        let inputs = Inputs {
            arm: true,
            hand_stop: true,
            over_current: false,
            trigger: None,
            held: false,
            reading: self.reading.take(),
        };
        let (mut mail, _, _) = self.mail.split();
        let now = self.start - us(WINDOW_US);
        let result = self
            .pulser
            .refill(now, self.start, &inputs, &mut mail, &mut self.plan);
        self.ok &= result.is_ok();
    }

    /// Does what a board does between two refills: converts the current of the window that played,
    /// into 2 kΩ, and writes the next window's DACs.
    fn play(&mut self) {
        self.reading = self.sample.take().and_then(|sample| {
            let channel = usize::from(sample.channel);
            let code = self.dac.get(channel)?;
            let stage = self.pulser.setup()?.channels.get(channel)?;
            let current = stage.as_ref()?.stage.current_through(*code, 2_000);
            Some(Reading::from_current(
                sample.channel,
                sample.second,
                current,
            ))
        });
        self.sample = self.plan.sample.take();
        for &(channel, code) in &self.plan.dac {
            if let Some(slot) = self.dac.get_mut(usize::from(channel)) {
                *slot = code;
            }
        }
        self.start += us(WINDOW_US);
        self.windows = self.windows.wrapping_add(1);
    }

    fn control(&mut self) {
        let (_, mut mail, _) = self.mail.split();
        let now = self.start - us(WINDOW_US);
        self.controller
            .tick(now, Some(self.code), self.tables, &mut mail);
    }

    /// Reads the session's output into the checksum.
    fn read_output(&mut self) {
        let (_, _, mut mail) = self.mail.split();
        while mail.take_entry().is_some() {}
        self.session.poll(self.start, &mut mail);
        let mut buffer = [0; MAX_FRAME];
        while self.session.has_output() {
            let count = self.session.transmit(&mut buffer);
            self.said.add_bytes(buffer.get(..count).unwrap_or_default());
        }
    }

    /// Runs four windows and a control tick.
    fn tick(&mut self) {
        for _ in 0..WINDOWS_PER_TICK {
            self.refill();
            self.play();
        }
        self.control();
        self.read_output();
    }

    /// Sends the requests of a host in this millisecond: an angle or amplitudes every 11 ms.
    fn send_host_requests(&mut self, random: &mut Random) {
        self.code = random.between(800, 3_200) as u16;
        match self.windows / WINDOWS_PER_TICK % 11 {
            0 => {
                let request = link::setpoint(DIRECT, random);
                self.send_request(request);
            }
            5 => {
                let request = Request::Angle {
                    at: None,
                    centideg: random.between(2_000, 8_000) as i16,
                    centideg_per_s: None,
                };
                self.send_request(request);
            }
            _ => {}
        }
    }

    fn digest(&self, sum: &mut Checksum) {
        sum.add_word(u32::from(self.ok));
        sum.add_word(self.said.0);
        for change in &self.plan.changes {
            sum.add_word(u32::from(change.slot));
            sum.add_word(change.levels.0);
        }
        for (channel, code) in &self.plan.dac {
            sum.add_word(u32::from(*channel));
            sum.add_word(u32::from(code.get()));
        }
    }
}

pub(super) fn run_benchmarks<C: Clock>(bench: &mut Bench<'_, C>, tables: &mut MuscleTables) {
    setpoint(bench, tables);
    tick(bench, tables);
    refill(bench, tables);
}

// The benchmark's state fills nearly half of the chip's memory: only one exists at a time, and none
// is moved.

/// Measures a setpoint of seven amplitudes from its bytes to the pulser's mailbox.
#[inline(never)]
fn setpoint<C: Clock>(bench: &mut Bench<'_, C>, tables: &mut MuscleTables) {
    let mut desk = HostAndDevice::new(tables);
    desk.start();
    bench.measure(
        "session_setpoint",
        300,
        &mut desk,
        |desk, random| {
            desk.tick();
            desk.send_host_requests(random);
            desk.write(link::setpoint(DIRECT, random));
        },
        |desk, ()| desk.receive(),
        |desk, (), sum| desk.digest(sum),
    );
}

/// Measures the controller's tick: events, the finger, ten muscles, and a telemetry sample every
/// tenth time.
#[inline(never)]
fn tick<C: Clock>(bench: &mut Bench<'_, C>, tables: &mut MuscleTables) {
    let mut desk = HostAndDevice::new(tables);
    desk.start();
    bench.measure(
        "owner_control_tick",
        500,
        &mut desk,
        |desk, random| {
            desk.read_output();
            desk.send_host_requests(random);
            for _ in 0..WINDOWS_PER_TICK {
                desk.refill();
                desk.play();
            }
        },
        |desk, ()| desk.control(),
        |desk, (), sum| desk.digest(sum),
    );
}

/// Measures the pulser's refill, without painting.
#[inline(never)]
fn refill<C: Clock>(bench: &mut Bench<'_, C>, tables: &mut MuscleTables) {
    let mut desk = HostAndDevice::new(tables);
    desk.start();
    bench.measure(
        "owner_refill",
        800,
        &mut desk,
        |desk, random| {
            desk.play();
            if desk.windows.is_multiple_of(WINDOWS_PER_TICK) {
                desk.control();
                desk.read_output();
                desk.send_host_requests(random);
            }
        },
        |desk, ()| desk.refill(),
        |desk, (), sum| desk.digest(sum),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::safety::Fault;

    #[test]
    fn the_desk_stimulates_throughout() {
        let mut tables = std::boxed::Box::new(MuscleTables::NONE);
        let (mut desk, mut random) = (HostAndDevice::new(&mut tables), Random::default());
        desk.start();
        assert!(desk.ok);
        for _ in 0..500 {
            desk.send_host_requests(&mut random);
            desk.tick();
        }
        assert!(desk.ok);
        assert_eq!(desk.pulser.state(), State::Stimulating);
    }

    /// Two samples are in progress when the current measurement stops answering, and six more are
    /// requested.
    #[test]
    fn a_sense_that_does_not_answer_is_a_fault() {
        let mut tables = std::boxed::Box::new(MuscleTables::NONE);
        let (mut desk, mut random) = (HostAndDevice::new(&mut tables), Random::default());
        desk.start();
        for _ in 0..20 {
            desk.send_host_requests(&mut random);
            desk.tick();
        }
        let mut asked = 0;
        while desk.pulser.state() == State::Stimulating {
            assert!(asked <= 8, "{asked}");
            desk.refill();
            desk.play();
            desk.reading = None;
            asked += u32::from(desk.sample.is_some());
        }
        let fault = desk.pulser.last_fault().map(|record| record.fault);
        assert_eq!(fault, Some(Fault::ReadingMissing));
    }
}
