//! Requests that end a session, another host's `Hello` and a stage table, against actions of the
//! pulser at any point between two frames of one packet. The board's session reads its mail only
//! after the whole packet.

use crate::device_desk::*;
use firmware::device::{
    Controller, Identity, Mailboxes, MuscleTables, Pulser, Session, WINDOWS_PER_TICK,
};
use firmware::link::{Code, Request, SCHEMA, SetupSum};
use firmware::pulse::{CHANNELS, Sample, WINDOW_US, WindowPlan};
use firmware::safety::{
    Inputs, Origin, Reading, StageKind, StageSupply, StageTable, Stages, State, UsageAtBoot,
};
use firmware::units::{DacCode, Micros, us};

/// Name, whether the case has another host's `Hello`, and the requests of a packet.
type Case = (&'static str, bool, fn(u32) -> Vec<(u16, Request)>);

/// Session that the first `Hello` opens, and the session of another host.
const OWNER: u16 = 1;
const STRANGER: u16 = 77;
const HELLO: Request = Request::Hello { schema: SCHEMA };
const STAGES: [Option<StageKind>; CHANNELS] = [Some(StageKind::Current {
    full_scale_ua: 100_000,
}); CHANNELS];
const STORE: Request = Request::StoreStages {
    stages: STAGES,
    supply: StageSupply::Common,
};

/// The three owners, called one by one as a board's interrupts and thread do.
struct Owners {
    pulser: Pulser,
    controller: Controller,
    tables: MuscleTables,
    session: Session,
    mail: Mailboxes,
    plan: WindowPlan,
    dac: [DacCode; CHANNELS],
    sample: Option<Sample>,
    reading: Option<Reading>,
    /// Start of the next window.
    start: Micros,
    windows: u32,
    seq: u16,
    said: Vec<u8>,
}

impl Owners {
    /// Returns owners configured with one channel, and the setup's checksum.
    fn configured() -> (Self, u32) {
        let table = StageTable {
            origin: Origin::Owner,
            supply: Some(StageSupply::Common),
            stages: STAGES,
        };
        let stages = Stages::Stored(table);
        let mut owners = Self {
            pulser: Pulser::new(None, UsageAtBoot::default()),
            controller: Controller::new(),
            tables: MuscleTables::NONE,
            session: Session::new(Identity {
                stages,
                ..identity(OWNER, None)
            }),
            mail: Mailboxes::new(),
            plan: WindowPlan::new(),
            dac: [DacCode::new(0); CHANNELS],
            sample: None,
            reading: None,
            start: Micros::new(WINDOW_US),
            windows: 0,
            seq: 0,
            said: Vec::new(),
        };
        let mut sum = SetupSum::default();
        let spec = channel(PLAIN);
        for request in [
            HELLO,
            Request::Wearer(wearer()),
            Request::Channel { channel: 0, spec },
        ] {
            sum.note(&request);
            owners.deliver_frame(OWNER, request);
            owners.run(4);
        }
        owners.said.clear();
        (owners, sum.total())
    }

    /// Delivers one frame to the session, which does not read its mail.
    fn deliver_frame(&mut self, session: u16, request: Request) {
        let bytes = frame(session, self.seq, request);
        self.seq += 1;
        let (_, _, mut mail) = self.mail.split();
        self.session.receive(self.start, &bytes, &mut mail);
    }

    /// Runs one window: a refill and, every fourth time, a control tick, but not the session.
    fn window(&mut self) {
        let inputs = Inputs {
            arm: true,
            hand_stop: true,
            reading: self.reading.take(),
            ..Inputs::default()
        };
        let (mut pulser, mut controller, _) = self.mail.split();
        let now = self.start - us(WINDOW_US);
        let plan = &mut self.plan;
        let done = (self.pulser).refill(now, self.start, &inputs, &mut pulser, plan);
        assert_eq!(done, Ok(()));
        if self.windows.is_multiple_of(WINDOWS_PER_TICK) {
            self.controller
                .tick(now, None, &mut self.tables, &mut controller);
        }
        self.reading = self.sample.take().and_then(|sample| {
            let channel = usize::from(sample.channel);
            let stage = self.pulser.setup()?.channels[channel].as_ref()?.stage;
            let current = stage.current_through(self.dac[channel], 2_000);
            Some(Reading::from_current(
                sample.channel,
                sample.second,
                current,
            ))
        });
        self.sample = self.plan.sample.take();
        for &(channel, code) in &self.plan.dac {
            self.dac[usize::from(channel)] = code;
        }
        self.start += us(WINDOW_US);
        self.windows += 1;
    }

    /// Lets the session read its mail.
    fn poll(&mut self) {
        let (_, _, mut mail) = self.mail.split();
        self.session.poll(self.start, &mut mail);
        let mut buffer = [0; 4096];
        let count = self.session.transmit(&mut buffer);
        self.said.extend(&buffer[..count]);
    }

    /// Runs windows as on a board: the session reads its mail after each control tick.
    fn run(&mut self, windows: u32) {
        for _ in 0..windows {
            self.window();
            if self.windows.is_multiple_of(WINDOWS_PER_TICK) {
                self.poll();
            }
        }
        self.poll();
    }

    fn heard(&mut self) -> Vec<OwnedResponse> {
        decode(&std::mem::take(&mut self.said))
    }
}

/// Returns the number of windows from an arm order to the state *Armed*.
fn windows_to_armed() -> u32 {
    let (mut owners, setup) = Owners::configured();
    owners.deliver_frame(OWNER, Request::Arm { setup });
    let mut windows = 0;
    while owners.pulser.state() != State::Armed {
        owners.run(1);
        windows += 1;
        assert!(windows < 1_000, "never armed");
    }
    windows
}

/// Frames of one packet; at one point before, between or after them, `windows` pass without the
/// session.
struct Packet<'a> {
    frames: &'a [(u16, Request)],
    between: usize,
    windows: u32,
}

impl Packet<'_> {
    fn reach(&self, owners: &mut Owners) {
        for (place, (session, request)) in self.frames.iter().enumerate() {
            if place == self.between {
                (0..self.windows).for_each(|_| owners.window());
            }
            owners.deliver_frame(*session, request.clone());
        }
        if self.between == self.frames.len() {
            (0..self.windows).for_each(|_| owners.window());
        }
        owners.poll();
    }
}

/// Runs each packet at each moment around the end of an electrode check, with each number of
/// windows at each point between two frames. `judge` gets the answers.
fn at_every_point(
    frames: impl Fn(u32) -> Vec<(u16, Request)>,
    arms_before: bool,
    mut judge: impl FnMut(&mut Owners, &[OwnedResponse], String),
) {
    let armed = windows_to_armed();
    let steps_before = if arms_before {
        armed - 9..armed + 3
    } else {
        0..1
    };
    for before in steps_before {
        for windows in [1, 2, 3, 4, 5, 9, armed + 8] {
            let mut between = 0;
            loop {
                let (mut owners, setup) = Owners::configured();
                if arms_before {
                    owners.deliver_frame(OWNER, Request::Arm { setup });
                    owners.run(before);
                }
                owners.heard();
                let frames = frames(setup);
                let packet = Packet {
                    frames: &frames,
                    between,
                    windows,
                };
                packet.reach(&mut owners);
                owners.run(8);
                let heard = owners.heard();
                let when = format!("{before} windows behind Arm, {windows} before {between}");
                judge(&mut owners, &heard, when);
                if between == frames.len() {
                    break;
                }
                between += 1;
            }
        }
    }
}

fn is_taken_over(heard: &[OwnedResponse]) -> bool {
    heard.iter().any(|h| matches!(h, OwnedResponse::Hello(_)))
}

/// Another host's `Hello` never takes over a device that is armed, is about to be armed, or
/// stimulates.
#[test]
fn no_stranger_takes_over_what_another_armed_whenever_the_verdict_comes() {
    let packets: [Case; 4] = [
        ("armed before", true, |_| {
            vec![
                (OWNER, Request::KeepAlive),
                (STRANGER, HELLO),
                (OWNER, Request::Status),
                (STRANGER, HELLO),
            ]
        }),
        ("armed in the packet", false, |setup| {
            vec![
                (OWNER, Request::Arm { setup }),
                (STRANGER, HELLO),
                (OWNER, Request::KeepAlive),
                (STRANGER, HELLO),
            ]
        }),
        ("started in the packet", true, |_| {
            vec![
                (OWNER, Request::Start),
                (STRANGER, HELLO),
                (OWNER, Request::KeepAlive),
                (STRANGER, HELLO),
            ]
        }),
        ("armed behind the stranger", false, |setup| {
            vec![
                (STRANGER, HELLO),
                (OWNER, Request::Arm { setup }),
                (OWNER, Request::KeepAlive),
            ]
        }),
    ];
    for (name, arms_before, frames) in packets {
        let (mut taken, mut kept) = (0, 0);
        at_every_point(frames, arms_before, |owners, heard, when| {
            if is_taken_over(heard) {
                taken += 1;
                for _ in 0..200 {
                    assert_eq!(owners.pulser.state(), State::Idle, "{name}, {when}");
                    owners.run(1);
                }
                return;
            }
            kept += 1;
            owners.deliver_frame(OWNER, Request::KeepAlive);
            owners.run(4);
            let heard = owners.heard();
            let is_heard = matches!(heard.first(), Some(OwnedResponse::Ack(..)));
            assert!(is_heard, "{name}, {when}: {heard:?}");
        });
        println!("{name}: taken over {taken}, kept {kept}");
        assert_eq!(taken > 0, name == "armed behind the stranger", "{name}");
    }
}

/// A board restarts to store its stages only when it is idle, whenever the result of the electrode
/// check comes.
#[test]
fn no_board_restarts_unless_idle_whenever_the_verdict_comes() {
    let packets: [Case; 4] = [
        ("armed before", true, |_| {
            vec![(OWNER, Request::KeepAlive), (OWNER, STORE)]
        }),
        ("started in the packet", true, |_| {
            vec![
                (OWNER, Request::Start),
                (OWNER, Request::KeepAlive),
                (OWNER, STORE),
            ]
        }),
        ("armed in the packet", false, |setup| {
            vec![
                (OWNER, Request::Arm { setup }),
                (OWNER, Request::KeepAlive),
                (OWNER, STORE),
            ]
        }),
        ("armed behind", false, |setup| {
            vec![
                (OWNER, STORE),
                (OWNER, Request::Arm { setup }),
                (OWNER, Request::Start),
            ]
        }),
    ];
    for (name, arms_before, frames) in packets {
        let mut stored = 0;
        at_every_point(frames, arms_before, |owners, _, when| {
            if owners.session.restart().is_none() {
                return;
            }
            stored += 1;
            for _ in 0..200 {
                assert_eq!(owners.pulser.state(), State::Idle, "{name}, {when}");
                owners.run(1);
            }
        });
        println!("{name}: stored {stored}");
        assert_eq!(stored > 0, name == "armed behind", "{name}");
    }
}

/// A device at rest is taken over within a window or two. The earlier host is then foreign, and its
/// orders in between neither arm nor start.
#[test]
fn a_device_at_rest_is_taken_over_by_the_pulsers_word() {
    let (mut owners, setup) = Owners::configured();
    owners.deliver_frame(STRANGER, HELLO);
    owners.poll();
    assert_eq!(owners.heard(), [], "the pulser has not said so yet");
    owners.deliver_frame(OWNER, Request::Arm { setup });
    owners.deliver_frame(STRANGER + 1, HELLO);
    owners.run(4);
    let heard = owners.heard();
    let codes = heard.iter().filter_map(|h| match h {
        OwnedResponse::Refused(_, code, _) => Some(*code),
        _ => None,
    });
    let busy = [Code::DeviceBusy; 2];
    assert_eq!(codes.collect::<Vec<_>>(), busy, "{heard:?}");
    let hello = heard.iter().find_map(|h| match h {
        OwnedResponse::Hello(info) => Some(info.clone()),
        _ => None,
    });
    let hello = hello.expect("the first stranger's answer");
    assert_eq!((hello.session, hello.state), (OWNER + 1, State::Idle));
    owners.deliver_frame(OWNER, Request::Arm { setup });
    owners.run(200);
    assert_eq!(owners.pulser.state(), State::Idle);
}

/// Repeated `Start` requests with one number: until each is answered, no configuration is accepted
/// that a `Stop` would wait for.
#[test]
fn each_start_is_waited_for() {
    let windows = windows_to_armed();
    let (mut owners, setup) = Owners::configured();
    owners.deliver_frame(OWNER, Request::Arm { setup });
    owners.run(windows - 1);
    owners.heard();
    // Refused, because the check is not over.
    owners.deliver_frame(OWNER, Request::Start);
    owners.window();
    owners.seq -= 1;
    owners.deliver_frame(OWNER, Request::Start);
    owners.poll();
    owners.window();
    assert_eq!(owners.pulser.state(), State::Stimulating);
    owners.heard();
    let spec = channel(PLAIN);
    owners.deliver_frame(OWNER, Request::Channel { channel: 0, spec });
    owners.poll();
    let heard = owners.heard();
    let refused = |h: &OwnedResponse| matches!(h, OwnedResponse::Refused(_, Code::WrongState, _));
    assert!(heard.iter().any(refused), "{heard:?}");
}
