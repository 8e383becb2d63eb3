//! The pseudo-terminal as a host uses it.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use hal_sim::wire::pty::PtyWire;
use hal_sim::wire::{ByteStream, WRITE_PATIENCE};

/// Time limit; only a test that hangs exceeds it.
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
    let (mut bytes, mut buf, start) = (Vec::new(), [0; 64], Instant::now());
    loop {
        assert!(start.elapsed() < PATIENCE, "got {bytes:?}");
        let count = wire.read(&mut buf).expect("open");
        bytes.extend(&buf[..count]);
        if done(wire, &bytes) {
            return bytes;
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
        let got = read_until(&mut wire, |_, bytes| bytes.len() == 256);
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
    // A wait for each write would take 100 of them, on the slowest machine too.
    assert!(start.elapsed() < 50 * WRITE_PATIENCE, "waits once only");
    // Once the host reads again, it is served again.
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

/// Checks that a terminal is refused at `path` and that the existing file or link stays unchanged.
fn assert_kept(path: &Path, why: &str) {
    let is_file = path.symlink_metadata().expect("there").is_file();
    let read = || is_file.then(|| std::fs::read(path).expect("a file"));
    let before = (std::fs::read_link(path).ok(), read());
    let error = PtyWire::open(path).expect_err(why);
    assert_eq!(error.kind(), ErrorKind::AlreadyExists, "{why}");
    assert!(error.to_string().contains(why), "{why}: {error}");
    let after = (std::fs::read_link(path).ok(), read());
    assert_eq!(after, before, "{why}");
}

#[test]
fn a_stale_link_is_replaced_and_nothing_else() {
    let path = path("stale");
    symlink("/dev/pts/999999", &path).expect("new");
    let wire = PtyWire::open(&path).expect("replaces the link");
    assert_eq!(std::fs::read_link(&path).expect("a link"), wire.device());
    drop(wire);

    std::fs::write(&path, b"notes").expect("new");
    assert_kept(&path, "exists and is not a link");
    std::fs::remove_file(&path).expect("ours");
    std::fs::create_dir(&path).expect("new");
    assert_kept(&path, "exists and is not a link");
    std::fs::remove_dir(&path).expect("ours");
    // Links of other programs, some of which lead nowhere, such as to a board that is not plugged
    // in.
    for target in [
        "/dev/null",
        "/dev/ttyUSB99",
        "/dev/shm/7",
        "/dev/pts",
        "/dev/pts/ptmx",
        "nowhere",
    ] {
        symlink(target, &path).expect("new");
        assert_kept(&path, "not a pseudo-terminal");
        std::fs::remove_file(&path).expect("ours");
    }
}

#[test]
fn the_link_of_a_terminal_in_use_is_kept() {
    let path = path("used");
    let mut first = PtyWire::open(&path).expect("a terminal");
    assert_kept(&path, "a terminal that is in use");
    let mut host = host(&path);
    host.write_all(b"still mine").expect("open");
    let got = read_until(&mut first, |_, bytes| bytes.len() == 10);
    assert_eq!(got, b"still mine");
    drop(first);
    assert!(
        path.symlink_metadata().is_err(),
        "the first removes its own"
    );
}

#[test]
fn of_two_that_find_a_stale_link_one_has_it() {
    let path = path("two");
    for _ in 0..20 {
        symlink("/dev/pts/999999", &path).expect("new");
        let wires = std::thread::scope(|scope| {
            let threads = [0, 1].map(|_| scope.spawn(|| PtyWire::open(&path)));
            threads.map(|thread| thread.join().expect("no panic"))
        });
        let had: Vec<_> = wires.iter().flatten().collect();
        assert_eq!(had.len(), 1, "{wires:?}");
        assert_eq!(std::fs::read_link(&path).expect("a link"), had[0].device());
    }
}

#[test]
fn only_its_own_link_is_removed_at_the_end() {
    let path = path("end");
    let (first, other) = (PtyWire::open(&path).expect("free"), "/dev/pts/999998");
    // A link of another program, to another terminal and then to the same.
    for target in [other.into(), first.device().to_owned()] {
        let spare = path.with_extension("spare");
        symlink(&target, &spare).expect("new");
        std::fs::rename(&spare, &path).expect("replaced");
        assert_eq!(std::fs::read_link(&path).expect("a link"), target);
    }
    let target = first.device().to_owned();
    drop(first);
    assert_eq!(std::fs::read_link(&path).expect("kept"), target);
    std::fs::remove_file(&path).expect("ours");
}
