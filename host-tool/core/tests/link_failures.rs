//! Errors of the host if it is kept from its port, if the device has another protocol version, and
//! if the device never stops sending.

use firmware::link::{Event, HelloInfo, Request, Response, SCHEMA, ToDevice, encode};
use firmware::units::Micros;
use hal_sim::world::World;
use host_core::link::{Connection, Error, Port, SimulatedPort};
use host_core::run::{SessionFile, run, simulated_port};
use std::io;

fn native() -> SimulatedPort {
    SimulatedPort::new(super::link_native::native_world(Micros::new(0)))
}

/// The port of a computer that is suspended once.
struct SleepingPort {
    port: SimulatedPort,
    /// Duration of the suspension, which begins with the next wait, µs.
    sleep_us: u64,
    /// State of the port after the suspension.
    then: AfterSleep,
}

#[derive(Clone, Copy, PartialEq)]
enum AfterSleep {
    /// The received bytes wait to be read.
    Waits,
    /// No more bytes arrive.
    Silent,
    /// The port has disappeared.
    Gone,
}

impl Port for SleepingPort {
    fn now_us(&mut self) -> u64 {
        self.port.now_us()
    }

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        self.port.send(frame)
    }

    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>> {
        if self.sleep_us > 0 {
            let now_us = self.port.now_us();
            self.port.world.run_until(now_us + self.sleep_us)?;
            self.sleep_us = 0;
            return match self.then {
                AfterSleep::Gone => Err(io::ErrorKind::BrokenPipe.into()),
                // The read returns like one that timed out, because the host does not notice that
                // it was suspended.
                _ => Ok(Vec::new()),
            };
        }
        let bytes = self.port.receive(until_us)?;
        Ok(match self.then {
            AfterSleep::Silent => Vec::new(),
            _ => bytes,
        })
    }

    fn world(&mut self) -> Option<&mut World> {
        Some(&mut self.port.world)
    }
}

/// Returns the result of a `Status` request during which this computer is suspended.
fn status_while_asleep(sleep_us: u64, then: AfterSleep) -> Result<(), String> {
    let port = SleepingPort {
        port: native(),
        sleep_us: 0,
        then: AfterSleep::Waits,
    };
    let (mut client, _) = Connection::open(port).unwrap();
    (client.port().sleep_us, client.port().then) = (sleep_us, then);
    client.status().map(drop).map_err(|error| error.to_string())
}

#[test]
fn an_answer_that_came_while_this_computer_slept_is_read() {
    for sleep_us in [1, 400_000, 600_000, 5_000_000] {
        assert_eq!(
            status_while_asleep(sleep_us, AfterSleep::Waits),
            Ok(()),
            "{sleep_us}"
        );
    }
}

#[test]
fn what_this_computer_slept_through_is_not_the_device_s_fault() {
    for (sleep_us, then, says) in [
        (
            5_000_000,
            AfterSleep::Silent,
            "E509 this computer did not run this program for 4998 ms",
        ),
        (
            5_000_000,
            AfterSleep::Gone,
            "E509 this computer did not run this program for 4998 ms",
        ),
        (
            1,
            AfterSleep::Silent,
            "E501 the device did not answer Status within 500 ms",
        ),
        (1, AfterSleep::Gone, "E502 lost the device"),
    ] {
        let error = status_while_asleep(sleep_us, then).unwrap_err();
        assert!(error.starts_with(says), "{error}");
        let blames = ["is the device powered", "lost the device"];
        let is_blamed = blames.iter().any(|blame| error.contains(blame));
        assert_eq!(is_blamed, sleep_us == 1, "{error}");
    }
}

/// A device that answers `Hello` with given bytes.
struct AnsweringPort<F>(SimulatedPort, Option<Vec<u8>>, F);

impl<F: Fn(ToDevice) -> Vec<u8> + Send> Port for AnsweringPort<F> {
    fn now_us(&mut self) -> u64 {
        self.0.now_us()
    }

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        let mut decoder = firmware::link::Decoder::default();
        let read = |byte: &u8| Some(decoder.push(*byte)?.ok()?.to_vec());
        if let Some(message) = frame.iter().find_map(read) {
            self.1 = Some((self.2)(postcard::from_bytes(&message).unwrap()));
        }
        Ok(())
    }

    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>> {
        match self.1.take() {
            Some(bytes) => Ok(bytes),
            None => self.0.receive(until_us),
        }
    }
}

/// Connects to a device that answers `Hello` in this way, and returns the error.
fn hello_error(answer: impl Fn(ToDevice) -> Vec<u8> + Send) -> Option<Error> {
    Connection::open(AnsweringPort(native(), None, answer)).err()
}

#[test]
fn another_schema_in_hello_is_refused_by_both_names() {
    let (_, info) = Connection::open(native()).unwrap();
    let hello = |seq, schema| {
        Response::Hello(HelloInfo {
            seq,
            schema,
            ..info.clone()
        })
    };
    let other = 0x0123_4567_89AB_CDEF_u64;
    let says = format!(
        "E508 the device has protocol schema {other:#018x}, this program has {SCHEMA:#018x}"
    );
    let same = hello_error(|asked| encode(&hello(asked.seq, SCHEMA)).unwrap().to_vec());
    assert!(same.is_none(), "{same:?}");
    let alike = hello_error(|asked| encode(&hello(asked.seq, other)).unwrap().to_vec());
    // One answer continues with other fields, the other ends after the schema.
    let longer = |asked: ToDevice| (0u32, asked.seq, 7u16, other, "a name", [9u8; 32]);
    let longer = hello_error(|asked| encode(&longer(asked)).unwrap().to_vec());
    let shorter = hello_error(|asked| encode(&(0u32, asked.seq, 7u16, other)).unwrap().to_vec());
    for error in [alike, longer, shorter] {
        let error = error.unwrap().to_string();
        assert!(error.starts_with(&says), "{error}");
    }
    // This answer belongs to the request of an earlier host.
    let late = hello_error(|asked| encode(&hello(asked.seq + 1, other)).unwrap().to_vec());
    let late = late.unwrap().to_string();
    assert!(late.starts_with("E501"), "{late}");
}

/// A device that sends endless events once it stimulates.
struct Flood {
    port: SimulatedPort,
    event: Event,
    is_flooding: bool,
}

impl Port for Flood {
    fn now_us(&mut self) -> u64 {
        self.port.now_us()
    }

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        self.port.send(frame)
    }

    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>> {
        let now_us = self.port.now_us();
        assert!(now_us < 20_000_000, "it never ends");
        self.is_flooding |= now_us > 1_000_000;
        if !self.is_flooding {
            return self.port.receive(until_us);
        }
        // Reading and writing take time.
        let mut bytes = self.port.receive(now_us + 100)?;
        let (at, event) = (Micros::new(now_us as u32), self.event);
        let frame = encode(&Response::Event { at, event }).unwrap();
        for _ in 0..20 {
            bytes.extend_from_slice(&frame);
        }
        Ok(bytes)
    }
}

#[test]
fn events_without_end_make_no_run_longer() {
    let text = include_str!("../../tests/one_channel.toml");
    let text = text.replace("duration_s = 30.0", "duration_s = 3.0");
    let file = SessionFile::parse("one.toml", &text).unwrap();
    let cycle = Event::LimitCycle {
        swing_centideg: 1,
        period_ms: 1,
        gain_milli: 1,
    };
    let reading = Event::Electrode {
        channel: 0,
        applied: firmware::units::Amplitude::new(1),
        current_ua: 1,
    };
    for (event, most) in [(cycle, 10_001), (reading, 10)] {
        let boot = Micros::new(0);
        let device = Box::new(hal_sim::native::native(boot));
        let port = Flood {
            port: simulated_port(&file.session, 1, device, boot).unwrap(),
            event,
            is_flooding: false,
        };
        let (outcome, port) = run(&file, port, None, |_| ());
        assert!(outcome.error.is_none(), "{:?}", outcome.error);
        let length_us = port.unwrap().now_us() - outcome.epoch_us.unwrap();
        assert!((3_000_000..4_000_000).contains(&length_us), "{length_us}");
        let last = outcome.trial.samples.last().unwrap().t_s;
        assert!((2.9..3.5).contains(&last), "{last}");
        let events = &outcome.trial.events;
        assert!(events.len() <= most, "{}", events.len());
        let (_, left_out) = events.last().unwrap();
        assert!(
            left_out.ends_with("more events were not recorded"),
            "{left_out}"
        );
        assert!(outcome.trial.electrode_check.len() <= 100);
    }
}

#[test]
fn a_poll_of_what_has_come_ends_too() {
    let port = Flood {
        port: native(),
        event: Event::Recovered,
        is_flooding: false,
    };
    let (mut client, _) = Connection::open(port).unwrap();
    client.request(Request::KeepAlive).unwrap();
    client.port().is_flooding = true;
    let now_us = client.port().now_us();
    let mut count = 0;
    while client.next(now_us).unwrap().is_some() {
        count += 1;
    }
    assert_eq!(count, 20);
}
