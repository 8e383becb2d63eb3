//! Tests the remote protocol over a socket, as debuggers and their launchers use it.

mod client;
mod launchers;

use super::*;
use crate::chip::image::tests::{CODE, program};
use crate::chip::soc::Pace;
use crate::trace::CHANNELS;
use packet::{frame_packet, number, unhex};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::thread::JoinHandle;

/// MOVS R0, #1; MOVS R1, #2; ADDS R0, R0, R1; B to the ADDS.
const LOOP: [u16; 4] = [0x2001, 0x2102, 0x1840, 0xE7FD];
/// LDR R0, [PC, #4]; LDR R1, [R0]; B .; the literal: an address in the trace unit of the debug
/// support, which is not modelled.
const BEYOND: [u16; 6] = [0x4801, 0x6801, 0xE7FE, 0xBF00, 0x1000, 0xE004];
/// LDR R0, [PC, #12]; MOVS R1, #0; ADDS R1, #1; STR R1, [R0]; STRB R1, [R0, #9];
/// LDRH R2, [R0, #4]; B to the ADDS; 0x2000_0000.
const TOUCHES: [u16; 10] = [
    0x4803, 0x2100, 0x3101, 0x6001, 0x7241, 0x8882, 0xE7FA, 0xBF00, 0x0000, 0x2000,
];

/// A board at whose port debuggers come and go.
struct ServedBoard {
    at: SocketAddr,
    device: JoinHandle<Result<Debugger, BoardError>>,
}

impl ServedBoard {
    fn new(code: &[u16], outlives: AfterDebugger, length_ms: u64) -> Self {
        let image = program(code, &[("Reset", CODE, 12)]);
        let outputs = [None; CHANNELS];
        let board = Board::power_on(image, outputs, Pace::Lazy, Points::default()).unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let at = listener.local_addr().unwrap();
        let device = std::thread::spawn(move || {
            let mut debugger = Debugger::new(listener, board, outlives);
            for step in 1..=length_ms {
                let end = step * 16_000; // 16 MHz after reset
                debugger.run_to(end)?;
            }
            Ok(debugger)
        });
        Self { at, device }
    }

    /// Serves for a practically unlimited time.
    fn for_ever(code: &[u16]) -> Self {
        Self::new(code, AfterDebugger::Debugger, u64::from(u32::MAX))
    }

    fn connect(&self) -> Gdb {
        let stream = TcpStream::connect(self.at).unwrap();
        let wait = std::time::Duration::from_secs(60);
        stream.set_read_timeout(Some(wait)).unwrap();
        Gdb { stream }
    }

    /// Connects, and attaches as soon as no other client is attached.
    fn attach(&self) -> Gdb {
        let mut gdb = self.connect();
        while gdb.exchange("?").starts_with("E.") {}
        gdb
    }
}

struct Gdb {
    stream: TcpStream,
}

impl Gdb {
    fn write(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).unwrap();
    }

    fn send(&mut self, packet: &str) {
        self.write(&frame_packet(packet.as_bytes()));
    }

    fn byte(&mut self) -> u8 {
        let mut byte = [0];
        self.stream.read_exact(&mut byte).unwrap();
        byte[0]
    }

    /// Receives the next packet and acknowledges it.
    fn receive(&mut self) -> String {
        let mut text = String::new();
        loop {
            match self.byte() {
                b'$' => text.clear(),
                b'#' => break,
                byte => text.push(char::from(byte)),
            }
        }
        self.stream.read_exact(&mut [0; 2]).unwrap();
        self.write(b"+");
        text
    }

    fn exchange(&mut self, packet: &str) -> String {
        self.send(packet);
        self.receive()
    }

    /// Sends each packet and checks its answer.
    fn exchanges(&mut self, packets: &[(&str, &str)]) {
        for (packet, answer) in packets {
            assert_eq!(self.exchange(packet), *answer, "{packet}");
        }
    }

    /// Returns the text that `monitor line` prints, and its last packet.
    fn monitor(&mut self, line: &str) -> (String, String) {
        let mut output = String::new();
        let mut answer = self.exchange(&format!("qRcmd,{}", hex(line.as_bytes())));
        while let Some(text) = answer.strip_prefix('O').filter(|text| *text != "K") {
            output += &String::from_utf8(unhex(text.as_bytes()).unwrap()).unwrap();
            answer = self.receive();
        }
        (output, answer)
    }

    /// Returns register `n`, which has 32 bits.
    fn register(&mut self, n: usize) -> u32 {
        let value = self.exchange(&format!("p{n:x}"));
        number(value.as_bytes()).unwrap().swap_bytes()
    }
}

const HALTED: &str = "T05thread:1;";

#[test]
fn the_core_halts_at_reset_steps_and_stops_at_breakpoints() {
    let served = ServedBoard::new(&LOOP, AfterDebugger::Nothing, 20);
    let mut gdb = served.connect();
    assert_eq!(gdb.exchange("?"), HALTED);
    assert_eq!(gdb.register(15), CODE);
    gdb.exchanges(&[("s", HALTED)]);
    assert_eq!((gdb.register(15), gdb.register(0)), (CODE + 2, 1));
    let there = format!("1,{:x},2", CODE + 6);
    assert_eq!(gdb.exchange(&format!("Z{there}")), "OK");
    for sum in [3, 5, 7] {
        assert_eq!(gdb.exchange("vCont;c"), HALTED);
        assert_eq!((gdb.register(15), gdb.register(0)), (CODE + 6, sum));
    }
    // A client that supports them gets `swbreak` or `hwbreak` in the stop reply.
    let own = gdb.exchange("qSupported:swbreak+;hwbreak+;xmlRegisters=i386");
    assert!(
        own.contains("PacketSize=4000;") && own.contains("qXfer:memory-map:read+"),
        "{own}"
    );
    assert_eq!(gdb.exchange("c"), format!("{HALTED}hwbreak:;"));
    assert_eq!(gdb.exchange(&format!("z{there}")), "OK");
    assert_eq!(gdb.exchange(&format!("Z0,{:x},2", CODE + 4)), "OK");
    assert_eq!(gdb.exchange("vCont;c:-1"), format!("{HALTED}swbreak:;"));
    // Steps over a breakpoint, from an address, and with a signal that is ignored.
    gdb.exchanges(&[("vCont;s:1;c", HALTED)]);
    assert_eq!(gdb.register(15), CODE + 6);
    assert_eq!(gdb.exchange(&format!("S05;{CODE:x}")), HALTED);
    assert_eq!(gdb.register(15), CODE + 2);
    assert_eq!(gdb.exchange("D"), "OK");
    let debugger = served.device.join().unwrap().unwrap();
    assert!(
        debugger.board().cpu.cycle >= 20 * 16_000,
        "it went on alone"
    );
}

#[test]
fn the_comparators_of_the_fpb_have_an_end() {
    let served = ServedBoard::for_ever(&LOOP);
    let mut gdb = served.connect();
    for n in 0..6 {
        assert_eq!(
            gdb.exchange(&format!("Z1,{:x},2", CODE + 0x100 + 2 * n)),
            "OK"
        );
    }
    gdb.exchanges(&[
        ("Z1,8000000,2", "E1c"),
        ("Z0,8000000,2", "OK"),
        ("Z0,20000000,2", "OK"),
    ]);
    gdb.exchange("qSupported:error-message+");
    assert_eq!(
        gdb.exchange("Z1,8000000,2"),
        "E.all six breakpoint comparators are in use"
    );
    assert_eq!(gdb.exchange(&format!("z1,{:x},2", CODE + 0x100)), "OK");
    gdb.exchanges(&[("Z1,8000000,2", "OK")]);
}

#[test]
fn ctrl_c_stops_what_runs() {
    let served = ServedBoard::for_ever(&LOOP);
    let mut gdb = served.connect();
    gdb.send("c");
    while gdb.register(15) == CODE {} // until it runs
    gdb.write(&[3]);
    assert_eq!(gdb.receive(), "T02thread:1;");
    // An interrupt that arrives when the core is halted has no effect.
    gdb.write(&[3]);
    gdb.exchanges(&[("?", "T02thread:1;"), ("s", HALTED)]);
    // Memory can also be read while the core runs.
    gdb.send("vCont;c:0");
    assert_eq!(gdb.exchange(&format!("m{CODE:x},2")), "0120");
    gdb.write(&[3]);
    assert_eq!(gdb.receive(), "T02thread:1;");
}

#[test]
fn memory_and_registers_are_read_and_written() {
    let served = ServedBoard::for_ever(&LOOP);
    let mut gdb = served.connect();
    assert_eq!(gdb.exchange(&format!("m{CODE:x},4")), "01200221");
    gdb.exchanges(&[
        ("M20000010,4:78563412", "OK"),
        ("m20000011,2", "5634"),
        ("X20000020,3:a}\x03b", "OK"), // one byte is escaped
        ("m20000020,3", "612362"),
        ("X20000020,0:", "OK"), // gdb tests with this packet whether X packets are supported
        // CPUID; SCR, written as by the core.
        ("me000ed00,4", "41c20f41"),
        ("Me000ed10,4:04000000", "OK"),
        ("me000ed10,4", "04000000"),
        // A register of a peripheral whose clock is off reads 0.
        ("m40000024,4", "00000000"),
        // Identity of the chip: DBGMCU_IDCODE, and the flash size in KiB, a half-word.
        ("me0042000,4", "13640710"),
        ("me0042000,2", "1364"),
        ("m1fff7a22,2", "0004"),
        ("m1fff7a10,4", "464c4558"),
        // Scripts of probes can set the freeze bits of DBGMCU.
        ("Me0042008,4:00180000", "OK"),
        ("me0042008,4", "00180000"),
        // No gigabyte of zeros where no memory is connected; an unused address; flash.
        ("m60000000,40000000", "E0e"),
        ("m30000000,4", "E0e"),
        ("M30000000,4:00000000", "E0e"),
        ("M8000000,2:0000", "E0e"),
        // The bytes before the end of SRAM, and before the end of memory.
        ("m2001fffe,4", "0000"),
        ("Mffffffff,2:0000", "E0e"),
    ]);
    let answer = gdb.exchange("m8000000,ffffffff");
    assert_eq!(
        answer.len(),
        packet::LONGEST,
        "as much as fits into a packet"
    );
    let features = gdb.exchange("qXfer:features:read:target.xml:0,3000");
    assert!(features.starts_with("l<?xml") && features.contains("org.gnu.gdb.arm.m-system"));
    let memory_map: String = (0..)
        .map(|n| gdb.exchange(&format!("qXfer:memory-map:read::{:x},80", n * 128)))
        .scan(false, |ended, part| {
            let goes_on = !*ended;
            *ended = part.starts_with('l');
            goes_on.then(|| part[1..].to_owned())
        })
        .collect();
    assert_eq!(memory_map, memory::MAP);
}

#[test]
fn registers_of_the_chip_are_written_in_the_width_that_is_asked_for() {
    let served = ServedBoard::for_ever(&LOOP);
    let mut gdb = served.connect();
    gdb.exchanges(&[
        // RCC: clocks of port A and TIM1, by half-word and byte.
        ("M40023844,2:0100", "OK"),
        ("m40023844,4", "01000000"),
        // TIM1_ARR and CCR1 take half-words.
        ("M4001002c,2:3412", "OK"),
        ("m4001002c,4", "34120000"),
        ("M40010034,4:78560000", "OK"),
        ("m40010034,2", "7856"),
        // Priorities of interrupts are bytes.
        ("Me000e401,1:50", "OK"),
        ("me000e400,4", "00500000"),
        // SCR takes no byte writes, and 4 bytes at an odd address are no word.
        ("Me000ed10,1:04", "E0e"),
        ("M20000001,5:0102030405", "OK"),
        ("m20000000,8", "0001020304050000"),
    ]);
}

#[test]
fn each_register_is_read_and_set_by_its_number() {
    let served = ServedBoard::for_ever(&LOOP);
    let mut gdb = served.connect();
    let values = gdb.exchange("g");
    assert_eq!(&values[120..128], hex(&CODE.to_le_bytes()));
    gdb.exchanges(&[
        ("P0=efbeadde", "OK"),
        ("p0", "efbeadde"),
        ("P11=00100020", "OK"), // MSP, the stack pointer in use
        ("pd", "00100020"),
        ("P12=00180020", "OK"), // PSP
        ("P13=01", "OK"),       // PRIMASK
        ("P14=40", "OK"),       // BASEPRI
        ("P15=01", "OK"),       // FAULTMASK
        ("P16=02", "OK"),       // CONTROL: SP is PSP
        ("pd", "00180020"),
        ("p11", "00100020"),
        ("p13", "01"),
        ("p14", "40"),
        ("p15", "01"),
        ("p16", "02"),
        ("P17=0000000000000840", "OK"), // D0
        ("p17", "0000000000000840"),
        ("P27=00000003", "OK"), // FPSCR
        ("p27", "00000003"),
        ("p28", "E0e"),
        ("P28=00", "E0e"),
        ("P0=00", "E16"),
        ("P0", "E16"),
        ("pzz", "E16"),
    ]);
    let changed = gdb.exchange("g");
    assert_eq!(gdb.exchange(&format!("G{values}")), "OK");
    assert_ne!(changed, values);
    assert_eq!(gdb.exchange("g"), values);
    gdb.exchanges(&[("G00", "E16"), ("Gxx", "E16")]);
}

#[test]
fn watched_data_stops_the_core_behind_the_instruction() {
    let served = ServedBoard::for_ever(&TOUCHES);
    let mut gdb = served.connect();
    let cycles = |gdb: &mut Gdb| gdb.exchange("me0001004,4");
    for (set, stop, behind) in [
        ("2,20000000,4", "watch:20000000;", 8),
        ("4,20000002,1", "awatch:20000002;", 8),
        ("2,20000009,1", "watch:20000009;", 10),
        ("2,20000008,4", "watch:20000009;", 10),
        ("3,20000004,8", "rwatch:20000004;", 12),
    ] {
        // Steps from reset reach the same cycle.
        gdb.monitor("reset halt");
        gdb.exchanges(&[
            ("Me000edfc,4:00000001", "OK"),
            ("Me0001000,4:01000000", "OK"),
        ]);
        while gdb.register(15) != CODE + behind {
            gdb.exchanges(&[("s", HALTED)]);
        }
        let stepped = cycles(&mut gdb);
        gdb.monitor("reset halt");
        gdb.exchanges(&[
            ("Me000edfc,4:00000001", "OK"),
            ("Me0001000,4:01000000", "OK"),
        ]);
        assert_eq!(gdb.exchange(&format!("Z{set}")), "OK");
        assert_eq!(gdb.exchange("c"), format!("{HALTED}{stop}"), "{set}");
        assert_eq!(gdb.register(15), CODE + behind, "{set}");
        assert_eq!(cycles(&mut gdb), stepped, "{set}");
        assert_ne!(stepped, "00000000");
        // The core stops once more after one turn of the loop.
        assert_eq!(gdb.exchange("c"), format!("{HALTED}{stop}"), "{set}");
        assert_eq!((gdb.register(15), gdb.register(1)), (CODE + behind, 2));
        assert_eq!(gdb.exchange(&format!("z{set}")), "OK");
    }
    // No read of the watched data occurs, or no watchpoint is left.
    gdb.exchanges(&[("Z3,20000000,4", "OK"), ("Z2,20000010,10", "OK")]);
    gdb.send("c");
    gdb.write(&[3]);
    assert_eq!(gdb.receive(), "T02thread:1;");
}

#[test]
fn there_are_four_comparators_of_data() {
    let served = ServedBoard::for_ever(&LOOP);
    let mut gdb = served.connect();
    gdb.exchanges(&[
        ("Z2,20000000,4", "OK"),
        ("Z3,20000010,2", "OK"),
        ("Z4,20000020,1", "OK"),
        ("Z2,20000100,20", "OK"),
        ("Z2,20000200,4", "E1c"),
        ("Z2,20000000,4", "OK"), // is already watched
        ("z3,20000010,2", "OK"),
        // A range that one comparator cannot cover takes more.
        ("Z2,20000204,8", "E1c"),
        ("Z2,20000208,8", "OK"),
        ("z2,20000208,8", "OK"),
        ("z2,20000208,8", "OK"),
        ("z4,20000020,1", "OK"),
        ("Z2,20000204,8", "OK"),
        ("Z2,20000204,0", "E16"),
        ("Z2,fffffffe,4", "E0e"),
        ("Z5,20000204,4", ""),
        // The DWT registers show the watchpoints.
        ("me0001020,c", "000000200200000006000000"),
        ("me0001000,4", "00000040"),
    ]);
    // Another debugger begins without watchpoints.
    gdb.exchanges(&[("D", "OK")]);
    drop(gdb);
    let mut gdb = served.connect();
    gdb.exchanges(&[
        ("?", HALTED),
        ("me0001028,4", "00000000"),
        ("Z2,20000204,8", "OK"),
    ]);
}

#[test]
fn what_nobody_models_is_told_in_words() {
    let served = ServedBoard::new(&BEYOND, AfterDebugger::Nothing, 20);
    let mut gdb = served.connect();
    gdb.send("c");
    let bytes = unhex(&gdb.receive().as_bytes()[1..]).unwrap();
    let message = String::from_utf8(bytes).unwrap();
    assert!(
        message.contains("0xe0041000") && message.contains("Reset"),
        "{message}"
    );
    assert_eq!(gdb.receive(), "T0athread:1;", "SIGBUS");
    assert_eq!(gdb.register(15), CODE + 2);
    // Without a debugger, the stop ends the run.
    assert_eq!(gdb.exchange("D"), "OK");
    let ended = served.device.join().unwrap();
    assert!(matches!(ended, Err(BoardError::Stopped { .. })));
}

/// Checks that the server notices a debugger whose computer vanished; it would hold the core for
/// ever.
#[test]
#[cfg(target_os = "linux")]
fn a_debugger_that_vanished_is_noticed() {
    let served = ServedBoard::new(&LOOP, AfterDebugger::Nothing, 20);
    let mut gdb = served.connect();
    assert_eq!(gdb.exchange("?"), HALTED);
    let address = gdb.stream.peer_addr().unwrap();
    assert!(crate::wire::keepalive::tests::is_watched(address));
    gdb.send("D");
    served.device.join().unwrap().unwrap();
}
