//! The TCP connection as a host uses it.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

use hal_sim::wire::ByteStream;
use hal_sim::wire::tcp::TcpWire;

const REFUSAL: &[u8] = b"busy\0";

/// Time limit; only a test that hangs exceeds it.
const PATIENCE: Duration = Duration::from_secs(60);

fn wire() -> TcpWire {
    TcpWire::bind("127.0.0.1:0", REFUSAL.to_vec()).expect("a free port")
}

fn host(wire: &TcpWire) -> TcpStream {
    let stream = TcpStream::connect(wire.local_addr().expect("bound")).expect("listening");
    stream.set_read_timeout(Some(PATIENCE)).expect("not zero");
    stream
}

/// Reads until `done`, within the time limit, and returns all bytes.
fn serve_until(wire: &mut TcpWire, mut done: impl FnMut(&mut TcpWire, &[u8]) -> bool) -> Vec<u8> {
    let (mut bytes, mut buf, start) = (Vec::new(), [0; 64], Instant::now());
    while !done(wire, &bytes) {
        assert!(start.elapsed() < PATIENCE, "got {bytes:?}");
        let count = wire.read(&mut buf).expect("listening");
        bytes.extend(&buf[..count]);
    }
    bytes
}

#[test]
fn echoes_and_survives_a_change_of_host() {
    let mut wire = wire();
    assert!(!wire.connected());
    wire.write_all(b"nobody hears").expect("dropped");
    for round in [&b"first"[..], b"second"] {
        let mut host = host(&wire);
        host.write_all(round).expect("connected");
        let got = serve_until(&mut wire, |_, bytes| bytes.len() == round.len());
        assert!(wire.connected());
        wire.write_all(&got).expect("connected");
        let mut back = vec![0; round.len()];
        host.read_exact(&mut back).expect("echo");
        assert_eq!(back, round);
        drop(host);
        serve_until(&mut wire, |wire, _| !wire.connected());
    }
    assert_eq!(wire.refusals(), 0);
}

#[test]
fn a_second_host_is_told_and_the_first_goes_on() {
    let mut wire = wire();
    let mut first = host(&wire);
    serve_until(&mut wire, |wire, _| wire.connected());
    let mut second = host(&wire);
    second.write_all(&[7; 500]).expect("connected");
    serve_until(&mut wire, |wire, _| wire.refusals() == 1);
    let mut heard = Vec::new();
    second.read_to_end(&mut heard).expect("closed in order");
    assert_eq!(heard, REFUSAL);
    first.write_all(b"still here").expect("connected");
    let expected = b"still here";
    assert_eq!(serve_until(&mut wire, |_, all| all.len() == 10), expected);
}

#[test]
fn a_successor_that_waits_already_is_served_not_refused() {
    let mut wire = wire();
    let mut first = host(&wire);
    serve_until(&mut wire, |wire, _| wire.connected());
    first.write_all(b"last words").expect("connected");
    drop(first);
    let mut second = host(&wire);
    second.write_all(b"hello").expect("connected");
    let got = serve_until(&mut wire, |_, bytes| bytes.len() == 15);
    assert_eq!(got, b"last wordshello");
    assert_eq!(wire.refusals(), 0);
}

/// A script that has sent everything closes its side: `nc -N`, `shutdown(SHUT_WR)`.
#[test]
fn a_host_that_sends_no_more_gets_its_answers() {
    let mut wire = wire();
    let mut first = host(&wire);
    first.write_all(b"ask").expect("connected");
    first.shutdown(Shutdown::Write).expect("connected");
    serve_until(&mut wire, |_, bytes| bytes == b"ask");
    for _ in 0..100 {
        assert_eq!(wire.read(&mut [0; 64]).expect("listening"), 0);
    }
    assert!(wire.connected());
    wire.write_all(b"answer").expect("connected");
    // A successor that connects meanwhile is accepted, and later hosts are refused.
    let mut second = host(&wire);
    second.write_all(b"next").expect("connected");
    serve_until(&mut wire, |_, bytes| bytes == b"next");
    let mut heard = Vec::new();
    first.read_to_end(&mut heard).expect("closed in order");
    assert_eq!(heard, b"answer");
    assert_eq!(wire.refusals(), 0);
    wire.write_all(b"own").expect("connected");
    let mut own = [0; 3];
    second.read_exact(&mut own).expect("served");
    assert_eq!(&own, b"own");
}

#[test]
fn a_host_that_sends_no_more_keeps_its_place_for_a_second() {
    let mut wire = wire();
    let mut first = host(&wire);
    serve_until(&mut wire, |wire, _| wire.connected());
    first.shutdown(Shutdown::Write).expect("connected");
    let start = Instant::now();
    serve_until(&mut wire, |wire, _| {
        wire.write_all(b"sample").expect("connected");
        !wire.connected()
    });
    assert!(start.elapsed() >= Duration::from_secs(1));
    let mut heard = Vec::new();
    first.read_to_end(&mut heard).expect("closed in order");
    assert!(heard.starts_with(b"samplesample"));
}

#[test]
fn one_that_waits_behind_a_leaving_host_may_leave_too() {
    let mut wire = wire();
    drop(host(&wire));
    serve_until(&mut wire, |wire, _| wire.connected());
    drop(host(&wire));
    serve_until(&mut wire, |wire, _| !wire.connected());
    let mut third = host(&wire);
    third.write_all(b"here").expect("connected");
    assert_eq!(serve_until(&mut wire, |_, all| all.len() == 4), b"here");
}

#[test]
fn a_host_that_never_reads_is_disconnected() {
    let mut wire = wire();
    let _deaf = host(&wire);
    serve_until(&mut wire, |wire, _| wire.connected());
    wire.write_all(&vec![1; 64 << 20])
        .expect("no error for the board");
    assert!(!wire.connected());
}

#[test]
fn a_port_in_use_is_an_error() {
    let wire = wire();
    let address = wire.local_addr().expect("bound");
    let error = TcpWire::bind(address, Vec::new()).expect_err("in use");
    assert_eq!(error.kind(), std::io::ErrorKind::AddrInUse);
}
