//! The example session of protocol.md, with the answers of the native simulator.

use super::{hex, messages};
use firmware::device::Draft;
use firmware::link::{Request, Response, SCHEMA, ToDevice, encode};
use firmware::units::Micros;
use std::fmt::Write;
use tests::desk;

pub fn transcript() -> String {
    let mut world = desk::world(Micros::new(0));
    let (mut out, mut session) = (String::from("```text\n"), 0);
    // Request, and the time for which the host then listens, ms.
    let script = [
        (Request::Hello { schema: SCHEMA }, 10),
        (messages::plain_channel(), 10),
        (desk::ARM, 30),
        (Request::Start, 10),
        (messages::amplitudes(&[(0, 10_000)]), 60),
        (Request::Stop, 90),
    ];
    world.run_until(10_000).expect("a simulator");
    let mut draft = Draft::default();
    for (seq, (request, listen_ms)) in (0u16..).zip(script) {
        let request = draft.prepare_request(request);
        let message = ToDevice {
            session,
            seq,
            request,
        };
        let frame = encode(&message).expect("fits");
        let json = serde_json::to_string(&message).expect("plain data");
        write_frame(&mut out, "host  ", world.now_us(), &json, &frame);
        world.send(&frame);
        let until = world.now_us() + listen_ms * 1_000;
        world.run_until(until).expect("a simulator");
        while let Some((at, bytes)) = world.recorder.bytes.pop_front() {
            for frame in bytes.split_inclusive(|&b| b == 0) {
                let message = decode(frame);
                let response: Response<'_> = postcard::from_bytes(&message).expect("known");
                if let Response::Hello(info) = &response {
                    session = info.session;
                }
                let json = serde_json::to_string(&response).expect("plain data");
                write_frame(&mut out, "device", at, &json, frame);
            }
        }
    }
    out + "```\n"
}

pub fn decode(frame: &[u8]) -> Vec<u8> {
    let mut messages = desk::messages(frame);
    let message = messages.next().expect("a frame");
    assert!(messages.next().is_none());
    message
}

fn write_frame(out: &mut String, sender: &str, at_us: u64, json: &str, frame: &[u8]) {
    let ms = at_us as f64 / 1e3;
    writeln!(out, "{sender} at {ms} ms").expect("a string");
    let mut rest = json;
    while !rest.is_empty() {
        // Breaks after the last comma that fits.
        let cut = match rest.get(..76).and_then(|line| line.rfind(',')) {
            Some(comma) if rest.len() > 76 => comma + 1,
            _ => rest.len(),
        };
        let (line, after) = rest.split_at(cut);
        writeln!(out, "    {line}").expect("a string");
        rest = after;
    }
    for line in frame.chunks(24) {
        writeln!(out, "  {}", hex(line, " ")).expect("a string");
    }
}
