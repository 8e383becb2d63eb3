//! The pseudo-terminal as a host sees it.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use hal_sim::wire::pty::PtyWire;
use hal_sim::wire::{ByteStream, WRITE_PATIENCE};

/// Nothing here takes so long unless it hangs.
const PATIENCE: Duration = Duration::from_secs(60);

fn path(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("flexor-pty-{}-{name}", std::process::id()))
}

fn host(path: &PathBuf) -> File {
    OpenOptions::new()
        .read(true)
        .write(true)
        .open(path)
        .expect("the link leads to a terminal")
}

fn read_until(wire: &mut PtyWire, mut done: impl FnMut(&PtyWire, &[u8]) -> bool) -> Vec<u8> {
    let (mut all, mut buf, start) = (Vec::new(), [0; 64], Instant::now());
    loop {
        assert!(start.elapsed() < PATIENCE, "got {all:?}");
        let count = wire.read(&mut buf).expect("open");
        all.extend(&buf[..count]);
        if done(wire, &all) {
            return all;
        }
    }
}

#[test]
fn all_bytes_pass_unchanged_both_ways_and_hosts_may_come_back() {
    let path = path("echo");
    let mut wire = PtyWire::open(&path).expect("a terminal");
    assert_eq!(wire.read(&mut [0; 8]).expect("open"), 0);
    assert!(!wire.connected());
    wire.write_all(b"nobody hears").expect("dropped");
    let every_byte: Vec<u8> = (0..=255).collect();
    for _ in 0..3 {
        let mut host = host(&path);
        read_until(&mut wire, |wire, _| wire.connected());
        host.write_all(&every_byte).expect("open");
        let got = read_until(&mut wire, |_, all| all.len() == 256);
        assert_eq!(got, every_byte);
        wire.write_all(&got).expect("open");
        let mut back = vec![0; 256];
        host.read_exact(&mut back).expect("echo");
        assert_eq!(back, every_byte);
        drop(host);
        read_until(&mut wire, |wire, _| !wire.connected());
    }
    drop(wire);
    assert!(path.symlink_metadata().is_err(), "the link is removed");
}

#[test]
fn a_host_that_never_reads_does_not_stop_the_board() {
    let path = path("deaf");
    let mut wire = PtyWire::open(&path).expect("a terminal");
    let mut deaf = host(&path);
    let start = Instant::now();
    for _ in 0..100 {
        wire.write_all(&[1; 1 << 16]).expect("dropped in part");
    }
    // A wait for each write would be 100 of them, on the slowest machine too.
    assert!(start.elapsed() < 50 * WRITE_PATIENCE, "waits once only");
    // Once it reads again it is served again.
    let mut buf = [0; 1 << 16];
    while !buf.contains(&2) {
        wire.write_all(&[2]).expect("open");
        let count = deaf.read(&mut buf).expect("open");
        assert!(count > 0);
    }
}

#[test]
fn a_new_host_does_not_hear_what_the_last_one_missed() {
    let path = path("stale-bytes");
    let mut wire = PtyWire::open(&path).expect("a terminal");
    let first = host(&path);
    wire.write_all(b"old").expect("open");
    drop(first);
    read_until(&mut wire, |wire, _| !wire.connected());
    let mut second = host(&path);
    read_until(&mut wire, |wire, _| wire.connected());
    wire.write_all(b"new").expect("open");
    let mut heard = [0; 3];
    second.read_exact(&mut heard).expect("open");
    assert_eq!(&heard, b"new");
}

#[test]
fn a_stale_link_is_replaced_and_a_file_is_not() {
    let path = path("stale");
    std::os::unix::fs::symlink("/dev/pts/999999", &path).expect("new");
    let wire = PtyWire::open(&path).expect("replaces the link");
    assert_eq!(std::fs::read_link(&path).expect("a link"), wire.device());
    drop(wire);

    std::fs::write(&path, b"notes").expect("new");
    let error = PtyWire::open(&path).expect_err("keeps the file");
    assert_eq!(error.kind(), ErrorKind::AlreadyExists);
    assert_eq!(std::fs::read(&path).expect("still there"), b"notes");
    std::fs::remove_file(&path).expect("ours");
}
