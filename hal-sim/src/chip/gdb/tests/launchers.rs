//! Tests clients that come and go, and requests of launchers to a probe's server.

use super::*;
use crate::chip::board::wiring::CORE_HZ;
use crate::chip::gdb::line::Line;
use crc::{CRC_32_MPEG_2, Crc};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

/// BKPT 0; MOVS R0, #7; B to the BKPT.
const BKPT: [u16; 3] = [0xBE00, 0x2007, 0xE7FC];
/// MOVS R0, #4 (SYS_WRITE0); ADR R1, text; BKPT 0xAB; MOVS R0, #0x18 (SYS_EXIT); LDR R1, reason;
/// BKPT 0xAB; "hi\n"; ADP_Stopped_ApplicationExit.
const SPEAKS: [u16; 10] = [
    0x2004, 0xA102, 0xBEAB, 0x2018, 0x4901, 0xBEAB, 0x6968, 0x000A, 0x0026, 0x0002,
];

#[test]
fn a_port_that_is_only_looked_at_stays_open() {
    let served = ServedBoard::for_ever(&LOOP);
    for _ in 0..20 {
        drop(served.connect());
    }
    let mut idle = served.connect();
    let mut browser = served.connect();
    browser.write(b"GET / HTTP/1.1\r\nHost: chip\r\n\r\n");
    let mut gdb = served.connect();
    assert_eq!(gdb.exchange("?"), HALTED);
    assert_eq!(gdb.register(15), CODE, "nobody let it go");
    // A client that stayed unattached gets an error that names the attached one, and can attach
    // later.
    let own = gdb.stream.local_addr().unwrap();
    let refusal = format!("E.{own} already debugs this chip; only one debugger can attach");
    assert_eq!(idle.exchange("?"), refusal);
    assert_eq!(served.connect().exchange("qSupported"), refusal);
    gdb.exchanges(&[("s", HALTED)]);
    drop(gdb);
    let mut answer = idle.exchange("?");
    while answer == refusal {
        answer = idle.exchange("?");
    }
    assert_eq!(answer, HALTED);
    assert_eq!(
        idle.register(15),
        CODE + 2,
        "the core waited where it stood"
    );
}

#[test]
fn detaching_lets_the_core_run_and_attaching_halts_it() {
    let served = ServedBoard::for_ever(&LOOP);
    let mut gdb = served.connect();
    assert_eq!(gdb.exchange(&format!("Z1,{:x},2", CODE + 6)), "OK");
    gdb.exchanges(&[("c", HALTED), ("D", "OK")]);
    let r0 = |gdb: &mut Gdb| {
        u32::from_str_radix(&gdb.exchange("g")[..8], 16)
            .unwrap()
            .swap_bytes()
    };
    // A detached client need not hang up, and its breakpoint no longer has effect.
    let mut next = served.connect();
    assert_eq!(next.exchange("?"), HALTED);
    let (first, second) = (r0(&mut next), r0(&mut next));
    assert!(first > 3, "it ran");
    assert_eq!(first, second, "it stands");
    let read = gdb.stream.read(&mut [0; 8]);
    assert!(!matches!(read, Ok(1..)), "it was let go");
    // A client that hangs up while the core runs lets it run, without its breakpoints.
    assert_eq!(next.exchange("vCont?"), "vCont;c;C;s;S");
    next.send("c");
    drop(next);
    let mut last = served.attach();
    assert_ne!(r0(&mut last), second);
}

/// A client that has sent everything and closed the connection before the server polls.
struct Scripted {
    says: Vec<u8>,
    /// Bytes that the server answered.
    answers: Arc<Mutex<Vec<u8>>>,
}

impl Line for Scripted {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.says.len().min(buffer.len());
        if count == 0 {
            return Err(io::ErrorKind::ConnectionReset.into());
        }
        buffer[..count].copy_from_slice(&self.says[..count]);
        self.says.drain(..count);
        Ok(count)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.answers.lock().unwrap().extend(bytes);
        Ok(())
    }

    fn name(&self) -> String {
        "a script".to_owned()
    }
}

struct Script(VecDeque<Scripted>);

impl Port for Script {
    fn accept(&mut self) -> io::Result<Option<Box<dyn Line>>> {
        let next = self.0.pop_front();
        Ok(next.map(|line| Box::new(line) as Box<dyn Line>))
    }
}

#[test]
fn a_core_let_go_runs_before_the_next_debugger_halts_it() {
    for lets_go in ["c", "D"] {
        let answers = Arc::new(Mutex::new(Vec::new()));
        let client = |packets: &[&str]| Scripted {
            says: packets
                .iter()
                .flat_map(|p| frame_packet(p.as_bytes()))
                .collect(),
            answers: Arc::clone(&answers),
        };
        let port = Script([client(&["?", lets_go]), client(&["?", "p0", "D"])].into());
        let image = program(&LOOP, &[("Reset", CODE, 12)]);
        let board = Board::power_on(image, [None; CHANNELS], Pace::Lazy, Points::default());
        let mut debugger = Debugger::new(port, board.unwrap(), AfterDebugger::Debugger);
        for step in 1..=4 {
            debugger.run_to(step * 16_000).unwrap();
        }
        let answers = String::from_utf8(answers.lock().unwrap().clone()).unwrap();
        // In a millisecond the register counts to thousands; 0 means that the core never ran.
        assert_eq!(answers.matches(HALTED).count(), 2, "{lets_go}: {answers}");
        assert!(!answers.contains("$00000000#"), "{lets_go}: {answers}");
    }
}

#[test]
fn killing_resets_the_chip_and_the_port_stays_open() {
    let served = ServedBoard::for_ever(&LOOP);
    for kill in ["k", "vKill;1"] {
        let mut gdb = served.attach();
        assert_eq!(gdb.register(15), CODE, "{kill}");
        gdb.exchanges(&[("s", HALTED), ("s", HALTED)]);
        match kill {
            "k" => gdb.send(kill),
            _ => assert_eq!(gdb.exchange(kill), "OK"),
        }
    }
    let mut gdb = served.attach();
    assert_eq!(gdb.register(15), CODE);
    // `target extended-remote` starts again like this.
    gdb.exchanges(&[
        ("!", "OK"),
        ("s", HALTED),
        ("vKill;1", "OK"),
        ("vRun;", HALTED),
    ]);
    assert_eq!(gdb.register(15), CODE);
    gdb.exchanges(&[("s", HALTED)]);
    gdb.send("R00");
    assert_eq!(gdb.register(15), CODE);
    gdb.exchanges(&[
        ("D", "OK"),
        ("c", "E0e"),
        ("Z1,8000040,2", "E0e"),
        ("vAttach;1", HALTED),
    ]);
    assert_ne!(gdb.register(15), CODE, "it ran meanwhile");
}

#[test]
fn killing_ends_a_session_s_run() {
    let served = ServedBoard::new(&LOOP, AfterDebugger::Nothing, 20);
    let mut gdb = served.connect();
    gdb.exchanges(&[("s", HALTED)]);
    gdb.send("k");
    assert!(matches!(
        served.device.join().unwrap(),
        Err(BoardError::Killed)
    ));
}

#[test]
fn a_session_goes_on_alone_when_its_debugger_hangs_up() {
    let served = ServedBoard::new(&LOOP, AfterDebugger::Nothing, 20);
    drop(served.connect());
    let mut gdb = served.connect();
    assert_eq!(gdb.exchange(&format!("Z1,{:x},2", CODE + 6)), "OK");
    drop(gdb);
    assert!(served.device.join().unwrap().is_ok());
}

/// The image of a debugged program needs no USB port, however long it runs.
#[test]
fn an_image_that_opens_no_usb_port_is_left_running() {
    // WFI; B to it.
    let image = program(&[0xBF30, 0xE7FD], &[("Reset", CODE, 4)]);
    let outputs = [None; CHANNELS];
    let mut board = Board::power_on(image, outputs, Pace::Lazy, Points::default()).unwrap();
    let sensors = Sensors::default();
    while board.cpu.cycle < 10 * u64::from(CORE_HZ) {
        assert!(matches!(board.boot_on(&sensors, None), Ok(false)));
    }
    let limited = board.boot_on(&sensors, Some(3 * u64::from(CORE_HZ)));
    assert!(matches!(limited, Err(BoardError::NoPort { .. })));
}

/// After a debugger detaches or hangs up, an image that opens no port has the same time limit as
/// without a debugger.
#[test]
fn an_image_that_opens_no_usb_port_ends_a_session_that_is_left_alone() {
    for (packets, is_detached) in [(&["?", "D"][..], true), (&["?", "c"][..], false)] {
        let says = packets
            .iter()
            .flat_map(|p| frame_packet(p.as_bytes()))
            .collect();
        let answers = Arc::default();
        let port = Script([Scripted { says, answers }].into());
        let image = program(&[0xBF30, 0xE7FD], &[("Reset", CODE, 4)]);
        let board = Board::power_on(image, [None; CHANNELS], Pace::Lazy, Points::default());
        let mut debugger = Debugger::new(port, board.unwrap(), AfterDebugger::Nothing);
        let ended = debugger.boot(&Sensors::default());
        let is_told = matches!(ended, Err(BoardError::NoPort { .. }));
        assert!(is_told, "detached: {is_detached}, {ended:?}");
    }
}

/// Under `serve`, a core that locks up with no client attached waits for the next debugger.
#[test]
fn a_core_that_locks_up_alone_waits_for_the_next_debugger() {
    // UDF, without handlers: the core locks up.
    let served = ServedBoard::for_ever(&[0xDE00, 0xDE00]);
    for leaves in ["D", "c"] {
        let mut gdb = served.attach();
        gdb.exchanges(&[("vRun;", HALTED)]);
        gdb.send(leaves);
    }
    let mut next = served.attach();
    assert_ne!(next.register(15), CODE, "it stands where it locked up");
    next.exchanges(&[("vRun;", HALTED)]);
    assert_eq!(next.register(15), CODE);
}

#[test]
fn monitor_commands_reset_halt_and_let_run() {
    let served = ServedBoard::for_ever(&LOOP);
    let mut gdb = served.connect();
    let ok = || (String::new(), "OK".to_owned());
    gdb.exchanges(&[("s", HALTED), ("s", HALTED), ("P0=0000ffff", "OK")]);
    assert_eq!(gdb.monitor("reset halt"), ok());
    assert_eq!((gdb.register(15), gdb.register(0)), (CODE, 0));
    assert_eq!(gdb.monitor("reset run"), ok());
    while gdb.register(15) == CODE {} // until it runs
    assert_eq!(gdb.monitor("halt"), ok());
    let there = gdb.register(15);
    assert_eq!(gdb.register(15), there);
    assert_eq!(gdb.monitor("resume"), ok());
    // A launcher that continues a running core still waits for its stop.
    gdb.send("c");
    gdb.write(&[3]);
    assert_eq!(gdb.receive(), "T02thread:1;");
    let (output, answer) = gdb.monitor("help");
    assert!(
        output.contains("reset [halt|init|run]") && answer == "OK",
        "{output} {answer}"
    );
    let (output, answer) = gdb.monitor("frobnicate");
    assert!(
        output.starts_with("unknown command: frobnicate") && answer == "OK",
        "{output}"
    );
    assert_eq!(gdb.exchange(&format!("Z0,{:x},2", CODE + 6)), "OK");
    assert_eq!(gdb.monitor("clrbp"), ok());
    gdb.send("c");
    gdb.write(&[3]);
    assert_eq!(gdb.receive(), "T02thread:1;");
    gdb.exchanges(&[("qRcmd,7", "E16"), ("qRcmd,zz", "E16")]);
}

#[test]
fn flash_is_erased_and_written_as_load_does() {
    let served = ServedBoard::for_ever(&LOOP);
    let mut gdb = served.connect();
    let before = gdb.exchange("m8000000,40");
    // MOVS R0, #9 at the start of LOOP, in an erased sector.
    let vectors = unhex(before.as_bytes()).unwrap();
    gdb.exchanges(&[
        ("m8004000,2", "ffff"),
        ("vFlashErase:08000000,00004000", "OK"),
    ]);
    gdb.exchanges(&[("m8000000,4", "ffffffff")]);
    let mut packet = b"vFlashWrite:8000000:".to_vec();
    packet.extend(&vectors);
    gdb.write(&frame_packet(&packet));
    assert_eq!(gdb.receive(), "OK");
    let packet = [
        format!("vFlashWrite:{CODE:x}:").as_bytes(),
        &[0x09, 0x20, 0xFE, 0xE7],
    ]
    .concat();
    gdb.write(&frame_packet(&packet));
    assert_eq!(gdb.receive(), "OK");
    gdb.exchanges(&[("vFlashDone", "OK")]);
    assert_eq!(gdb.exchange("m8000000,40"), before);
    gdb.monitor("reset halt");
    gdb.exchanges(&[("s", HALTED)]);
    assert_eq!((gdb.register(0), gdb.register(15)), (9, CODE + 2));
    // The checksum that compare-sections compares.
    let sum = Crc::<u32>::new(&CRC_32_MPEG_2).checksum(&vectors);
    assert_eq!(gdb.exchange("qCRC:8000000,40"), format!("C{sum:x}"));
    gdb.exchanges(&[
        // Bits that are 0 stay 0; then addresses outside the flash, and half outside.
        ("vFlashWrite:8000000:\u{7f}", "E0e"),
        ("vFlashErase:20000000,4000", "E0e"),
        ("vFlashErase:80fc000,8000", "E0e"),
        ("vFlashWrite:80fffff:ab", "E0e"),
        ("vFlashWrite:7ffffff:a", "E0e"),
        ("vFlashErase:8000000", "E16"),
        ("vFlashWrite:x:a", "E16"),
        ("qCRC:30000000,4", "E0e"),
        ("qCRC:2001fff0,20", "E0e"),
        ("qCRC:0,ffffffff", "E0e"),
    ]);
    // No vector table is left: the server continues, and a start locks the core up.
    gdb.exchanges(&[("vFlashErase:8000000,100000", "OK")]);
    assert_eq!(gdb.monitor("reset halt").1, "OK");
    assert_eq!(gdb.register(15), u32::MAX - 1);
    gdb.send("c");
    assert!(gdb.receive().starts_with('O'));
    assert_eq!(gdb.receive(), "T0bthread:1;", "SIGSEGV");
}

#[test]
fn a_bkpt_stops_the_core_and_is_passed() {
    let served = ServedBoard::for_ever(&BKPT);
    let mut gdb = served.connect();
    for _ in 0..2 {
        gdb.exchanges(&[("c", HALTED)]);
        assert_eq!(gdb.register(15), CODE);
        gdb.exchanges(&[("s", HALTED)]);
        assert_eq!(gdb.register(15), CODE + 2);
    }
    gdb.exchanges(&[("c", HALTED), ("c", HALTED)]);
    assert_eq!((gdb.register(15), gdb.register(0)), (CODE, 7));
}

#[test]
fn what_a_program_says_by_semihosting_is_printed() {
    let served = ServedBoard::for_ever(&SPEAKS);
    let mut gdb = served.connect();
    gdb.exchanges(&[("c", HALTED)]);
    assert_eq!(gdb.register(15), CODE + 4, "BKPT 0xAB, and nobody hears");
    gdb.monitor("reset halt");
    let (output, answer) = gdb.monitor("arm semihosting enable");
    assert!(output.contains("BKPT 0xAB") && answer == "OK", "{output}");
    gdb.send("c");
    assert_eq!(gdb.receive(), format!("O{}", hex(b"hi\n")));
    assert_eq!(gdb.receive(), "W00");
}

#[test]
fn what_is_malformed_is_answered() {
    let served = ServedBoard::for_ever(&LOOP);
    let mut gdb = served.connect();
    gdb.exchanges(&[
        ("m", "E16"),
        ("m8000000", "E16"),
        ("mzz,4", "E16"),
        ("m8000000,123456789", "E16"),
        ("M20000000,4:00", "E16"),
        ("M20000000,1:0", "E16"),
        ("X20000000,2:a", "E16"),
        ("Z1", "E16"),
        ("Z1,zz,2", "E16"),
        ("vCont;", "E16"),
        ("vCont;x", "E16"),
        ("vCont;c:2", "E16"),
        ("c8000g", "E16"),
        ("Cxx", "E16"),
        ("Hg2", "E16"),
        ("T2", "E16"),
        ("Hg0", "OK"),
        ("Hc-1", "OK"),
        ("T1", "OK"),
        ("qXfer:features:read:other.xml:0,10", "E16"),
        ("qXfer:features:read:target.xml:ffffff,10", "E16"),
        ("qCRC:zz", "E16"),
        // An unsupported or unknown packet has an empty answer.
        ("", ""),
        ("vMustReplyEmpty", ""),
        ("QNonStop:1", ""),
        ("qTStatus", ""),
        ("\u{1}\u{7f}", ""),
        ("qAttached", "1"),
        ("qC", "QC1"),
        ("qfThreadInfo", "m1"),
        ("qsThreadInfo", "l"),
        ("qThreadExtraInfo,1", "436f727465782d4d3446"),
    ]);
    // The server asks for a damaged packet again, and the client can ask for an answer again.
    gdb.write(b"$g#00");
    assert_eq!(gdb.byte(), b'-');
    gdb.exchanges(&[("qC", "QC1")]);
    gdb.write(b"-");
    assert_eq!(gdb.receive(), "QC1");
    // A packet beyond the agreed size; an unfinished packet; bytes that are no packet.
    let long = "m".repeat(packet::LONGEST + 1);
    gdb.exchanges(&[(&long, "E07")]);
    gdb.write(b"+++\0\xFFnothing$m8000000");
    gdb.exchanges(&[("qC", "QC1")]);
    // Without acknowledgements, a wrong checksum is an error.
    gdb.exchanges(&[("QStartNoAckMode", "OK")]);
    gdb.write(b"$g#00");
    assert_eq!(gdb.receive(), "E16");
    gdb.send("qC");
    assert_eq!(gdb.byte(), b'$');
    assert_eq!(gdb.receive(), "QC1");
    // A client that disconnects within a packet leaves nothing of the packet to the next client.
    gdb.write(b"$M20000000,4:01");
    drop(gdb);
    served.attach().exchanges(&[("m20000000,4", "00000000")]);
}

/// Sends the packets of gdb for Cortex-Debug's server type `external` (its `src/external.ts`,
/// `launch`): target-select extended-remote, monitor reset halt, load, monitor reset halt, a
/// breakpoint, continue; at the end detach.
#[test]
fn cortex_debug_s_external_server_mode_is_served() {
    let served = ServedBoard::for_ever(&LOOP);
    let mut gdb = served.connect();
    gdb.write(b"+");
    let own = gdb.exchange(
        "qSupported:multiprocess+;swbreak+;hwbreak+;qRelocInsn+;fork-events+;vfork-events+;\
         exec-events+;vContSupported+;QThreadEvents+;no-resumed+;memory-tagging+",
    );
    assert!(own.contains("QStartNoAckMode+"), "{own}");
    gdb.exchanges(&[("vMustReplyEmpty", ""), ("QStartNoAckMode", "OK")]);
    let hardware = format!("{HALTED}hwbreak:;");
    gdb.exchanges(&[("!", "OK"), ("Hg0", "OK"), ("qTStatus", ""), ("?", HALTED)]);
    gdb.exchanges(&[
        ("qfThreadInfo", "m1"),
        ("qsThreadInfo", "l"),
        ("qAttached:1", "1"),
    ]);
    gdb.exchanges(&[("Hc-1", "OK"), ("qOffsets", ""), ("qSymbol::", "")]);
    assert_eq!(gdb.monitor("reset halt").1, "OK");
    let flash = gdb.exchange("m8000000,48");
    gdb.exchanges(&[("X8000000,0:", "OK"), ("vFlashErase:8000000,4000", "OK")]);
    let image = [
        &b"vFlashWrite:8000000:"[..],
        &unhex(flash.as_bytes()).unwrap(),
    ]
    .concat();
    gdb.write(&frame_packet(&image));
    assert_eq!(gdb.receive(), "OK");
    gdb.exchanges(&[("vFlashDone", "OK")]);
    assert_eq!(gdb.monitor("reset halt").1, "OK");
    assert_eq!(gdb.register(15), CODE);
    assert_eq!(gdb.exchange(&format!("Z1,{:x},2", CODE + 4)), "OK");
    gdb.exchanges(&[("vCont?", "vCont;c;C;s;S"), ("vCont;c", &hardware)]);
    assert_eq!(gdb.exchange(&format!("z1,{:x},2", CODE + 4)), "OK");
    gdb.send("vCont;c");
    gdb.write(&[3]);
    assert_eq!(gdb.receive(), "T02thread:1;");
    gdb.exchanges(&[("D;1", "OK")]);
    drop(gdb);
    // `attach`: the core is halted where it is.
    let mut gdb = served.connect();
    gdb.exchanges(&[("!", "OK"), ("?", HALTED)]);
    assert_eq!(gdb.monitor("halt").1, "OK");
    assert_ne!(gdb.register(15), CODE);
}
