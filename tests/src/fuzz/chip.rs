//! External inputs of the chip simulator: the file of an image, and gdb's bytes.

use hal_sim::chip::board::{Board, BoardError};
use hal_sim::chip::gdb::{AfterDebugger, Debugger, Line, Points, Port};
use hal_sim::chip::image::{FLASH, Image, ImageError};
use hal_sim::chip::soc::Pace;
use std::cell::OnceCell;
use std::collections::VecDeque;
use std::io;
use std::path::Path;

/// Fuzzes an image's file. Either the file is refused with an error number, or the image fits the
/// flash, starts in it and has valid symbols, and a chip that runs it for about a thousand
/// instructions ends in a state that it can report.
pub fn elf(data: &[u8]) {
    let image = match Image::parse(Path::new("image.elf"), data) {
        Ok(image) => image,
        Err(error) => {
            let message = error.to_string();
            assert!(message.starts_with("E53"), "{message}");
            let is_told = !matches!(error, ImageError::Unreadable(..));
            return assert!(is_told, "{message}");
        }
    };
    let end = FLASH.start + image.flash.len() as u32;
    assert!(end <= FLASH.end, "{} bytes of flash", image.flash.len());
    assert!((FLASH.start..end).contains(&image.reset) && image.reset.is_multiple_of(2));
    for symbol in image.symbols.functions() {
        assert!(!image.symbols.describe(symbol.address).is_empty());
    }
    image.symbols.describe(image.reset);
    let board = Board::power_on(image, [None; _], Pace::Lazy, ());
    match board.and_then(|mut board| board.run_to(RUN)) {
        Ok(()) => {}
        Err(BoardError::Stopped { stop, .. }) => assert!(!stop.to_string().is_empty()),
        Err(other) => panic!("{other}"),
    }
}

/// Length of a run of a fuzzed image, cycles.
const RUN: u64 = 2_000;

/// Fuzzes the port for gdb: for any bytes the board stops or continues as gdb requests, and sends
/// only packets that gdb can read.
pub fn gdb(data: &[u8]) {
    thread_local!(static BOARD: OnceCell<Board<Points>> = const { OnceCell::new() });
    let power_on = || {
        let bytes = include_bytes!("../../fuzz/corpus/elf/made");
        let image = Image::parse(Path::new("made.elf"), bytes).expect("a committed image");
        Board::power_on(image, [None; _], Pace::Lazy, Points::default()).expect("it starts")
    };
    let board = BOARD.with(|board| board.get_or_init(power_on).clone());
    let port = SingleClient(Some(Script::from_lines(data)));
    let mut debugger = Debugger::new(port, board, AfterDebugger::Nothing);
    for step in 1..=4 {
        match debugger.run_to(step * RUN) {
            Ok(()) => {}
            Err(BoardError::Killed | BoardError::Stopped { .. }) => return,
            Err(other) => panic!("{other}"),
        }
    }
}

/// Port to which one client connects.
struct SingleClient(Option<Script>);

impl Port for SingleClient {
    fn accept(&mut self) -> io::Result<Option<Box<dyn Line>>> {
        let script = self.0.take().ok_or(io::ErrorKind::ConnectionReset)?;
        Ok(Some(Box::new(script)))
    }
}

/// A gdb whose bytes are all known; it disconnects once they are sent.
struct Script {
    bytes: VecDeque<u8>,
    said: PacketPosition,
}

impl Script {
    /// Creates packets with valid checksums, because a packet with an invalid one is only requested
    /// again. Each line is one packet; a line that begins with `!` is sent as it is.
    fn from_lines(data: &[u8]) -> Self {
        let mut bytes = VecDeque::new();
        for line in data.split(|byte| *byte == b'\n') {
            if let Some(raw) = line.strip_prefix(b"!") {
                bytes.extend(raw);
                continue;
            }
            let sum = line.iter().copied().fold(0, u8::wrapping_add);
            bytes.push_back(b'$');
            bytes.extend(line);
            bytes.extend(format!("#{sum:02x}+").bytes());
        }
        let start = PacketPosition::Between;
        Self { bytes, said: start }
    }
}

/// Position within the replies to gdb.
#[derive(Clone, Copy, PartialEq)]
enum PacketPosition {
    Between,
    Packet(u8),
    Sum(u8, Option<u8>),
}

impl Script {
    /// Checks one byte of a reply to gdb.
    fn check_reply_byte(&mut self, byte: u8) {
        let digit = |byte: u8| char::from(byte).to_digit(16).expect("a digit of a sum") as u8;
        self.said = match (self.said, byte) {
            (PacketPosition::Between, b'+' | b'-') => PacketPosition::Between,
            (PacketPosition::Between, b'$') => PacketPosition::Packet(0),
            (PacketPosition::Between, other) => {
                panic!("gdb receives {other:#04x} outside of a packet")
            }
            (PacketPosition::Packet(sum), b'#') => PacketPosition::Sum(sum, None),
            (PacketPosition::Packet(sum), byte) => PacketPosition::Packet(sum.wrapping_add(byte)),
            (PacketPosition::Sum(sum, None), byte) => PacketPosition::Sum(sum, Some(digit(byte))),
            (PacketPosition::Sum(sum, Some(high)), byte) => {
                assert_eq!(16 * high + digit(byte), sum, "gdb receives a wrong sum");
                PacketPosition::Between
            }
        };
    }
}

impl Line for Script {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = buffer.len().min(self.bytes.len());
        for (to, byte) in buffer.iter_mut().zip(self.bytes.drain(..count)) {
            *to = byte;
        }
        match count {
            0 => Err(io::ErrorKind::ConnectionReset.into()),
            count => Ok(count),
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        bytes.iter().for_each(|&byte| self.check_reply_byte(byte));
        Ok(())
    }

    fn name(&self) -> String {
        "a script".to_owned()
    }
}
