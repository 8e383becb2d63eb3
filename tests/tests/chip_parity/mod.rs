//! The flashed image on the chip simulator and the device code in this process behave the same in
//! one session: edge by edge, code by code, message by message.

mod watched;

use crate::qemu_parity::session::{BOOT, Step, channel_spec, thirty_seconds};
use firmware::board::wiring::BOARD;
use firmware::device::Identity;
use firmware::link::{Event, HelloInfo, Kind, Response};
use firmware::lockstep::{Lockstep, Sensors};
use firmware::safety::{FaultRecord, StageSpec};
use firmware::units::{Micros, us};
use hal_sim::body::Drive;
use hal_sim::chip::soc::Pace;
use hal_sim::lockstep::Output;
use hal_sim::trace::{Edge, State, Trace};
use std::time::Instant;
use tests::desk::{identity, messages};
use tests::record::Record;
use watched::{ReceiveCall, WatchedBoard};

/// Returns the stages of the session's channels.
fn stages() -> [Option<Output>; 10] {
    let milli = |value: u32| f64::from(value) * 1e-3;
    std::array::from_fn(|channel| {
        let full_scale = match channel_spec(channel as u8).stage {
            StageSpec::Current { full_scale_ua } => Drive::Milliamps(milli(full_scale_ua)),
            StageSpec::Voltage { full_scale_mv, .. } => Drive::Volts(milli(full_scale_mv)),
        };
        Some(Output {
            full_scale,
            conducted: false,
        })
    })
}

/// Replays the log's steps, in time since its beginning. Returns the sensors separately from the
/// bytes.
fn on_chip(log: &[Step], pace: Pace) -> (WatchedBoard, Record, Vec<(Micros, Sensors)>) {
    let mut board = WatchedBoard::boot(stages(), &Sensors::default(), pace);
    // The wearer moves just after a control tick has read the angle. The chip converts it up to
    // four times before the next tick, and the last conversion may be late.
    let begin = (board.board.now_us() / 1000 + 1) * 1000 + 20;
    let time = |at: Micros| Micros::new(begin as u32) + us(at.elapsed_since(BOOT));
    let (mut record, mut worlds) = (Record::default(), Vec::new());
    board.advance(begin, &Sensors::default(), &mut record);
    for step in log {
        let (at, bytes, sensors) = match step {
            Step::Receive(at, bytes, sensors) => (at, Some(bytes), sensors),
            Step::Advance(to, sensors) => (to, None, sensors),
        };
        // A trigger edge belongs to a step of time, never to bytes.
        let trigger = sensors.trigger.filter(|_| bytes.is_none()).map(time);
        let is_ahead = sensors.trigger.is_some() && trigger.is_none();
        let sensors = Sensors {
            trigger,
            held: sensors.held && !is_ahead,
            ..*sensors
        };
        worlds.push((time(*at), sensors));
        board.advance(time(*at).get().into(), &sensors, &mut record);
        bytes.inspect(|bytes| board.send(bytes));
    }
    (board, record, worlds)
}

/// Replays the same inputs and the same calls on the device code in this process.
fn in_process(chip: &WatchedBoard, worlds: &[(Micros, Sensors)], hello: &HelloInfo) -> Record {
    let identity = Identity {
        unique_id: hello.unique_id,
        stages: hello.stages,
        option_bytes: hello.option_bytes,
        board: BOARD.name,
        crystal_hz: hello.crystal_hz,
        ..identity(Kind::Board, hello.session)
    };
    let mut record = Record::default();
    let boot = worlds[0].0.get() / 1000 * 1000 - 1000;
    let mut board = Lockstep::new(identity, Micros::new(boot));
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

#[test]
fn thirty_seconds_are_the_same_on_chip_and_in_process() {
    // The image chooses its own session number, and the same image always chooses the same.
    let (_, chip, _) = on_chip(&thirty_seconds(0)[..9], Pace::Lazy);
    compare(&thirty_seconds(hello(&chip).session));
}

/// Returns the first answer.
fn hello(record: &Record) -> HelloInfo {
    let first = messages(&record.bytes).next();
    match first.as_deref().map(|m| postcard::from_bytes(m).unwrap()) {
        Some(Response::Hello(info)) => info,
        other => panic!("no Hello but {other:?}"),
    }
}

fn compare(log: &[Step]) {
    let start = Instant::now();
    let (board, chip, worlds) = on_chip(log, Pace::Lazy);
    let wall = start.elapsed().as_secs_f64();
    let hello = hello(&chip);
    let native = in_process(&board, &worlds, &hello);
    let late = |call: &&ReceiveCall| {
        call.at.get().wrapping_sub(2) % 250 + call.done.elapsed_since(call.at) >= 250
    };
    let costs = board.served.iter().map(|c| c.done.elapsed_since(c.at));
    println!(
        "the chip took {wall:.1} s; the session was called {} times, longest {} us, {} over a refill",
        board.served.len(),
        costs.max().unwrap(),
        board.served.iter().filter(late).count(),
    );
    let phases = board.board.around.phases();
    for (port, counts) in [("B", &phases.b), ("C", &phases.c)] {
        let at = counts.iter().enumerate().filter(|(_, count)| **count > 0);
        let at: Vec<_> = at.collect();
        println!("edges of port {port} by cycle of their microsecond: {at:?}");
    }
    same_edges(&chip.trace, &native.trace);
    same_levels_of_banks(&chip.trace, &native.trace);
    same_messages(&chip.bytes, &native.bytes);
}

/// Compares the banks' levels. A chip's DAC reports only changes, the code in this process every
/// write.
fn same_levels_of_banks(chip: &Trace, native: &Trace) {
    for bank in 0..6 {
        let codes = |trace: &Trace| {
            let of_bank = trace.trips.iter().filter(|write| write.bank == bank);
            let mut codes: Vec<_> = of_bank.map(|write| write.code).collect();
            codes.dedup();
            codes
        };
        assert!(!codes(native).is_empty(), "bank {bank}");
        assert_eq!(codes(chip), codes(native), "bank {bank}");
    }
}

/// Checks that edges have the same order, microsecond and code; after an over-current the processor
/// disconnects up to a refill late.
fn same_edges(chip: &Trace, native: &Trace) {
    let (chip, native): (Vec<_>, Vec<_>) = (chip.edges().collect(), native.edges().collect());
    let kind = |e: &Edge| (e.channel, e.state);
    let is_in_order = chip.iter().map(kind).eq(native.iter().map(kind));
    let (mut stopped, mut differ) = (Vec::new(), 0);
    for (a, b) in chip.iter().zip(&native).filter(|(a, b)| a != b) {
        if a.state == State::Isolated && (1..100).contains(&(a.t_us.wrapping_sub(b.t_us))) {
            stopped.push(a.t_us - b.t_us);
        } else {
            differ += 1;
            if differ < 10 {
                println!("chip {a:?}\n   native {b:?}");
            }
        }
    }
    let (edges, late) = (chip.len(), stopped.len());
    println!("{edges} edges, {late} of a fault stop {stopped:?} us late, {differ} others differ");
    assert!(chip.len() > 30_000 && is_in_order);
    assert_eq!(differ, 0);
    assert!(stopped.len() <= 10);
}

/// Checks that the same messages come in the same order; a fault's time and residual charge are
/// those of the stop. An invalid frame is refused at once, while an answer may wait for a refill,
/// so a refill that interrupts the call may reverse the order. The session reads samples, edges and
/// reports once a millisecond, at a phase that depends on its start. So these kinds are compared
/// separately.
fn same_messages(chip: &[u8], native: &[u8]) {
    let apart = |bytes: &[u8]| {
        let is_answer = |message: &Vec<u8>| {
            let response = postcard::from_bytes(message).unwrap();
            !matches!(response, Response::Refused { seq: None, .. })
        };
        let is_sample = |message: &Vec<u8>| {
            let response = postcard::from_bytes(message).unwrap();
            let is_edge = |event| matches!(event, Event::SyncEdge | Event::TriggerEdge);
            match response {
                Response::Telemetry(_) => true,
                Response::Event { event, .. } => is_edge(event),
                _ => false,
            }
        };
        let (answers, refused): (Vec<_>, Vec<_>) = messages(bytes).partition(is_answer);
        let (samples, mut sorted_messages): (Vec<_>, Vec<_>) =
            answers.into_iter().partition(is_sample);
        sorted_messages.extend(samples);
        sorted_messages.extend(refused);
        sorted_messages
    };
    let (chip, native) = (apart(chip), apart(native));
    let (from_chip, here) = (chip.len(), native.len());
    println!("{from_chip} messages from the chip, {here} in process");
    let mut differ = 0;
    for (a, b) in chip.iter().zip(&native).filter(|(a, b)| a != b) {
        let [a, b] = [a, b].map(|message| postcard::from_bytes(message).unwrap());
        if without_stop(&a) != without_stop(&b) {
            differ += 1;
            if differ < 10 {
                println!("chip {a:?}\n   native {b:?}");
            }
        }
    }
    assert_eq!((differ, chip.len()), (0, native.len()));
}

fn without_stop(response: &Response<'_>) -> String {
    let mut response = response.clone();
    let forget =
        |record: &mut FaultRecord| (record.at, record.residual) = (Micros::new(0), [0; 10]);
    match &mut response {
        Response::Event {
            at,
            event: Event::Faulted(record),
        } => {
            *at = Micros::new(0);
            forget(record);
        }
        Response::Status { status, .. } => status.fault.iter_mut().for_each(forget),
        _ => {}
    }
    format!("{response:?}")
}
