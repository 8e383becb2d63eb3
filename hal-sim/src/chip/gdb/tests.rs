//! The remote protocol over a socket, as gdb speaks it.

use super::*;
use crate::chip::image::tests::{CODE, program};
use crate::chip::soc::Pace;
use crate::trace::CHANNELS;
use std::thread::JoinHandle;

/// MOVS R0, #1; MOVS R1, #2; ADDS R0, R0, R1; B to the ADDS.
const LOOP: [u16; 4] = [0x2001, 0x2102, 0x1840, 0xE7FD];
/// LDR R0, [PC, #4]; LDR R1, [R0]; B .; the literal: the trace unit of the debug support.
const BEYOND: [u16; 6] = [0x4801, 0x6801, 0xE7FE, 0xBF00, 0x1000, 0xE004];

struct Gdb {
    stream: TcpStream,
    device: JoinHandle<Result<Debugger, BoardError>>,
}

impl Gdb {
    /// Attaches to a board that runs `code` and is then let go on for 20 ms.
    fn attach(code: &[u16]) -> Self {
        Self::attach_for(code, 20)
    }

    fn attach_for(code: &[u16], length_ms: u64) -> Self {
        let image = program(code, &[("Reset", CODE, 12)]);
        let outputs = [None; CHANNELS];
        let board = Board::power_on(image, outputs, Pace::Lazy, Points::default()).unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let stream = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let wait = std::time::Duration::from_secs(60);
        stream.set_read_timeout(Some(wait)).unwrap();
        let device = std::thread::spawn(move || {
            let mut debugger = Debugger::accept(&listener, board).unwrap();
            for step in 1..=length_ms {
                let end = step * 16_000; // 16 MHz after reset
                debugger.run_to(end)?;
            }
            Ok(debugger)
        });
        Self { stream, device }
    }

    fn send(&mut self, packet: &str) {
        let sum = packet.bytes().fold(0u8, u8::wrapping_add);
        Write::write_all(&mut self.stream, format!("${packet}#{sum:02x}").as_bytes()).unwrap();
    }

    /// The next packet, acknowledged.
    fn receive(&mut self) -> String {
        let (mut text, mut byte) = (String::new(), [0]);
        loop {
            self.stream.read_exact(&mut byte).unwrap();
            match byte[0] {
                b'$' => text.clear(),
                b'#' => break,
                byte => text.push(char::from(byte)),
            }
        }
        self.stream.read_exact(&mut [0; 2]).unwrap();
        Write::write_all(&mut self.stream, b"+").unwrap();
        text
    }

    fn exchange(&mut self, packet: &str) -> String {
        self.send(packet);
        self.receive()
    }

    /// Register `n` of R0–R15, from the packet of all.
    fn register(&mut self, n: usize) -> u32 {
        let all = self.exchange("g");
        u32::from_str_radix(&all[8 * n..8 * n + 8], 16)
            .unwrap()
            .swap_bytes()
    }
}

#[test]
fn the_core_halts_at_reset_steps_and_stops_at_breakpoints() {
    let mut gdb = Gdb::attach(&LOOP);
    assert_eq!(gdb.exchange("?"), "T05thread:01;");
    assert_eq!(gdb.register(15), CODE);
    assert_eq!(gdb.exchange("s"), "S05");
    assert_eq!((gdb.register(15), gdb.register(0)), (CODE + 2, 1));
    assert_eq!(gdb.exchange(&format!("Z1,{:x},2", CODE + 6)), "OK");
    for sum in [3, 5, 7] {
        assert_eq!(gdb.exchange("c"), "T05thread:01;swbreak:;");
        assert_eq!((gdb.register(15), gdb.register(0)), (CODE + 6, sum));
    }
    assert_eq!(gdb.exchange(&format!("z1,{:x},2", CODE + 6)), "OK");
    assert_eq!(gdb.exchange("D"), "OK");
    let debugger = gdb.device.join().unwrap().unwrap();
    assert!(
        debugger.board().cpu.cycle >= 20 * 16_000,
        "it went on alone"
    );
}

#[test]
fn ctrl_c_stops_what_runs() {
    // For ever, as it seems to gdb: it must not end before Ctrl-C comes.
    let mut gdb = Gdb::attach_for(&LOOP, u64::from(u32::MAX));
    gdb.send("c");
    Write::write_all(&mut gdb.stream, &[3]).unwrap();
    assert_eq!(gdb.receive(), "S02");
    assert_ne!(gdb.register(15), CODE, "it ran");
    gdb.send("k");
    assert!(matches!(
        gdb.device.join().unwrap(),
        Err(BoardError::Killed)
    ));
}

#[test]
fn memory_and_registers_are_read_and_written() {
    let mut gdb = Gdb::attach(&LOOP);
    assert_eq!(gdb.exchange(&format!("m{CODE:x},4")), "01200221");
    assert_eq!(gdb.exchange("M20000010,4:78563412"), "OK");
    assert_eq!(gdb.exchange("m20000011,2"), "5634");
    // CPUID; SCR, written as by the core; a register of a peripheral whose
    // clock is off reads 0; flash has no answer to a write.
    assert_eq!(gdb.exchange("me000ed00,4"), "41c20f41");
    assert_eq!(gdb.exchange("Me000ed10,4:04000000"), "OK");
    assert_eq!(gdb.exchange("me000ed10,4"), "04000000");
    assert_eq!(gdb.exchange("m40000024,4"), "00000000");
    // No gigabyte of zeros where no memory hangs.
    assert!(gdb.exchange("m60000000,40000000").starts_with('E'));
    assert!(gdb.exchange(&format!("M{CODE:x},2:0000")).starts_with('E'));
    let all = gdb.exchange("g");
    let changed = format!("efbeadde{}", &all[8..]);
    assert_eq!(gdb.exchange(&format!("G{changed}")), "OK");
    assert_eq!(gdb.exchange("g"), changed);
    let features = gdb.exchange("qXfer:features:read:target.xml:0,4000");
    assert!(features.contains("org.gnu.gdb.arm.m-profile"), "{features}");
    gdb.send("k");
    assert!(gdb.device.join().unwrap().is_err());
}

#[test]
fn what_nobody_models_is_told_in_words() {
    let mut gdb = Gdb::attach(&BEYOND);
    gdb.send("c");
    let said = gdb.receive();
    let bytes = said.as_bytes()[1..].chunks(2);
    let bytes = bytes.map(|hex| u8::from_str_radix(std::str::from_utf8(hex).unwrap(), 16));
    let said = String::from_utf8(bytes.collect::<Result<_, _>>().unwrap()).unwrap();
    assert!(
        said.contains("0xe0041000") && said.contains("Reset"),
        "{said}"
    );
    assert_eq!(gdb.receive(), "S0a", "SIGBUS");
    assert_eq!(gdb.register(15), CODE + 2);
    // Without gdb, it is the end of the run.
    assert_eq!(gdb.exchange("D"), "OK");
    assert!(matches!(
        gdb.device.join().unwrap(),
        Err(BoardError::Stopped { .. })
    ));
}

/// A gdb whose computer vanished would hold the core for ever.
#[test]
#[cfg(target_os = "linux")]
fn a_gdb_that_vanished_is_noticed() {
    let mut gdb = Gdb::attach(&LOOP);
    assert_eq!(gdb.exchange("?"), "T05thread:01;");
    let address = gdb.stream.peer_addr().unwrap();
    assert!(crate::wire::keepalive::tests::is_watched(address));
    gdb.send("D");
    gdb.device.join().unwrap().unwrap();
}
