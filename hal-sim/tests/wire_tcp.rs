//! The TCP wire as a host sees it.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use hal_sim::wire::ByteStream;
use hal_sim::wire::tcp::TcpWire;

const REFUSAL: &[u8] = b"busy\0";

/// Nothing here takes so long unless it hangs.
const PATIENCE: Duration = Duration::from_secs(60);

fn wire() -> TcpWire {
    TcpWire::bind("127.0.0.1:0", REFUSAL.to_vec()).expect("a free port")
}

fn host(wire: &TcpWire) -> TcpStream {
    let stream = TcpStream::connect(wire.local_addr().expect("bound")).expect("listening");
    stream.set_read_timeout(Some(PATIENCE)).expect("not zero");
    stream
}

/// Reads the wire until `done`, at most 5 s; returns what came.
fn serve_until(wire: &mut TcpWire, mut done: impl FnMut(&TcpWire, &[u8]) -> bool) -> Vec<u8> {
    let (mut all, mut buf, start) = (Vec::new(), [0; 64], Instant::now());
    while !done(wire, &all) {
        assert!(start.elapsed() < PATIENCE, "got {all:?}");
        let count = wire.read(&mut buf).expect("listening");
        all.extend(&buf[..count]);
    }
    all
}

#[test]
fn echoes_and_survives_a_change_of_host() {
    let mut wire = wire();
    assert!(!wire.connected());
    wire.write_all(b"nobody hears").expect("dropped");
    for round in [&b"first"[..], b"second"] {
        let mut host = host(&wire);
        host.write_all(round).expect("connected");
        let got = serve_until(&mut wire, |_, all| all.len() == round.len());
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
    let got = serve_until(&mut wire, |_, all| all.len() == 15);
    assert_eq!(got, b"last wordshello");
    assert_eq!(wire.refusals(), 0);
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
