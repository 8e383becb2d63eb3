//! The flashed image on the chip simulator and the device code in this process
//! do the same: one session, edge by edge, code by code, message by message.

#[path = "qemu_parity/session.rs"]
mod session;
mod chip_parity {
    pub mod watched;
}

use chip_parity::watched::Watched;
use firmware::device::Identity;
use firmware::device::lockstep::{Lockstep, Sensors, Sink};
use firmware::link::message::ResetCause;
use firmware::link::{Decoder, Kind, Response};
use firmware::pulse::Levels;
use firmware::safety::StageSpec;
use firmware::units::{DacCode, Micros};
use hal_sim::body::Drive;
use hal_sim::chip::soc::Pace;
use hal_sim::trace::{self, Edge, Trace};
use hal_sim::world::Output;
use session::{BOOT, Step, channel_spec, thirty_seconds};
use std::time::Instant;

/// Everything that a device put out.
#[derive(Default)]
struct Record {
    trace: Trace,
    bytes: Vec<u8>,
}

impl Sink for Record {
    fn levels(&mut self, at: Micros, levels: Levels) {
        self.trace
            .record_levels(at.0.into(), trace::Levels(levels.0));
    }

    fn dac(&mut self, at: Micros, channel: u8, code: DacCode) {
        self.trace.record_dac(at.0.into(), channel, code.0);
    }

    fn bytes(&mut self, _: Micros, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }
}

/// The stages of the session's channels.
fn stages() -> [Option<Output>; 10] {
    std::array::from_fn(|channel| {
        let full_scale = match channel_spec(channel as u8).stage {
            StageSpec::Current { full_scale_ua } => {
                Drive::Milliamps(f64::from(full_scale_ua) * 1e-3)
            }
            StageSpec::Voltage { full_scale_mv, .. } => {
                Drive::Volts(f64::from(full_scale_mv) * 1e-3)
            }
        };
        Some(Output {
            full_scale,
            conducted: false,
        })
    })
}

/// The log's steps in time since its beginning, sensors apart from bytes.
fn on_chip(log: &[Step], pace: Pace) -> (Watched, Record, Vec<(Micros, Sensors)>) {
    let mut board = Watched::boot(stages(), &Sensors::default(), pace);
    // The wearer moves amid a control tick, away from every sample.
    let begin = (board.board.now_us() / 1000 + 1) * 1000 + 500;
    let time = |at: Micros| Micros(begin as u32).plus(at.elapsed_since(BOOT));
    let (mut record, mut worlds) = (Record::default(), Vec::new());
    board.advance(begin, &Sensors::default(), &mut record);
    for step in log {
        match step {
            Step::Receive(at, bytes, sensors) => {
                let sensors = Sensors {
                    trigger: None,
                    ..*sensors
                };
                worlds.push((time(*at), sensors));
                board.advance(time(*at).0.into(), &sensors, &mut record);
                board.send(bytes);
            }
            Step::Advance(to, sensors) => {
                let trigger = sensors.trigger.map(time);
                let sensors = Sensors {
                    trigger,
                    ..*sensors
                };
                worlds.push((time(*to), sensors));
                board.advance(time(*to).0.into(), &sensors, &mut record);
            }
        }
    }
    (board, record, worlds)
}

/// The same worlds and the same calls on the device code in this process.
fn in_process(chip: &Watched, worlds: &[(Micros, Sensors)], unique_id: [u32; 3]) -> Record {
    let identity = Identity {
        kind: Kind::Board,
        unique_id,
        reset: ResetCause::PowerOn,
        last_fault: None,
    };
    let mut record = Record::default();
    let boot = worlds[0].0.0 / 1000 * 1000 - 1000;
    let mut board = Lockstep::new(identity, Micros(boot));
    let mut calls = chip.served.iter().peekable();
    for (to, sensors) in worlds {
        while let Some(call) = calls.next_if(|call| call.done.is_before(*to)) {
            board.serve(call.at, call.done, &call.bytes, sensors, &mut record);
        }
        board.advance(*to, sensors, &mut record);
    }
    assert!(calls.next().is_none());
    record
}

fn messages(bytes: &[u8]) -> Vec<String> {
    let mut decoder = Decoder::default();
    let mut all = Vec::new();
    for &byte in bytes {
        let Some(message) = decoder.push(byte) else {
            continue;
        };
        let response: Response<'_> = postcard::from_bytes(message.unwrap()).unwrap();
        all.push(format!("{response:?}"));
        decoder.clear();
    }
    all
}

#[test]
fn thirty_seconds_are_the_same_on_chip_and_in_process() {
    let log = thirty_seconds();
    let start = Instant::now();
    let (board, chip, worlds) = on_chip(&log, Pace::Lazy);
    println!(
        "30 s on the chip took {:.1} s",
        start.elapsed().as_secs_f64()
    );
    let straddling = board.served.iter().filter(|call| {
        let into = call.at.0.wrapping_sub(2) % 250;
        into + call.done.elapsed_since(call.at) >= 250
    });
    let costs = || board.served.iter().map(|c| c.done.elapsed_since(c.at));
    println!(
        "{} calls, {} over a refill, cost {:?}..{:?} us",
        board.served.len(),
        straddling.count(),
        costs().min(),
        costs().max()
    );
    let native = in_process(&board, &worlds, [0; 3]);
    let (a, b): (Vec<Edge>, Vec<Edge>) =
        (chip.trace.edges().collect(), native.trace.edges().collect());
    println!("edges: {} chip, {} native", a.len(), b.len());
    let mut shown = 0;
    for (i, (x, y)) in a.iter().zip(&b).enumerate() {
        if x != y && shown < 20 {
            println!("{i}: chip {x:?} native {y:?}");
            shown += 1;
        }
    }
    let (a, b) = (messages(&chip.bytes), messages(&native.bytes));
    println!("messages: {} chip, {} native", a.len(), b.len());
    let mut shown = 0;
    for (i, (x, y)) in a.iter().zip(&b).enumerate() {
        if x != y && shown < 20 {
            println!("{i}: chip {x}\n   native {y}");
            shown += 1;
        }
    }
}
