//! Parses packets (gdb manual, "Remote Protocol", Packets, General Query Packets).
//!
//! In: a packet's contents. Out: an answer, or an action on the core. An unknown packet has an
//! empty answer, as the protocol requires; a malformed packet is refused.

use super::memory::MAP;
use super::monitor::{self, Order};
use super::packet::{LONGEST, hex, number, unhex};
use super::points::{Points, StopReason, unwatch, watch};
use super::refused::GdbRefusal;
use super::registers;
use crate::chip::board::Board;
use crate::chip::cpu::system::WatchedAccess;
use crc::{CRC_32_MPEG_2, Crc};

/// Feature of gdb's protocol on which a client and the server have agreed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Features that the client supports in stop replies and errors, from its packet qSupported.
    Knows {
        /// Whether the client supports `swbreak` and `hwbreak`.
        breaks: [bool; 2],
        /// Whether the client supports errors in words.
        words: bool,
    },
    /// Packets are no longer acknowledged; this packet is the last (QStartNoAckMode).
    NoAcknowledgements,
}

/// Meaning of a packet from gdb: an answer to send at once, or an action on the core.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// Contents of the answer packet.
    Answer(Vec<u8>),
    /// A feature agreed on, and the answer.
    Agree(Feature, Vec<u8>),
    /// The client asks for the reason why the core stopped.
    Status,
    /// The core continues from its present instruction.
    Go {
        /// Whether the core executes only one instruction.
        steps: bool,
    },
    /// The client detaches from the core.
    Detach,
    /// The program ends.
    Kill {
        /// Whether the client waits for the answer OK.
        is_answered: bool,
    },
    /// The program restarts, halted at its first instruction.
    Restart {
        /// Whether the client waits for a stop reply.
        is_answered: bool,
    },
    /// A `monitor` command: its action, and the text to print in the client.
    Monitor(Order, String),
}

use Meaning::{Agree, Answer, Detach, Go, Kill, Monitor, Restart, Status};

type ParsedCommand = Result<Meaning, GdbRefusal>;

const OK: &[u8] = b"OK";

fn ok() -> ParsedCommand {
    Ok(Answer(OK.to_vec()))
}

fn text(answer: impl Into<String>) -> ParsedCommand {
    Ok(Answer(answer.into().into_bytes()))
}

/// Parses `packet`, the contents of a packet from gdb. Packets that access memory, registers or
/// breakpoints of `board` are served here; others become an action for the caller.
///
/// # Errors
/// Fails if the packet is malformed or cannot be carried out.
pub fn parse_command(board: &mut Board<Points>, packet: &[u8]) -> ParsedCommand {
    let Some((&first, rest)) = packet.split_first() else {
        return text("");
    };
    match first {
        b'?' => Ok(Status),
        b'!' => ok(),
        b'g' | b'G' | b'p' | b'P' => registers_of(board, first, rest),
        b'm' | b'M' | b'X' => memory_of(board, first, rest),
        b'Z' | b'z' => parse_point(board, first == b'Z', rest),
        b'c' | b's' | b'C' | b'S' => parse_resume(board, first, rest),
        b'H' => match rest.split_first() {
            Some((b'c' | b'g', thread)) if is_own_thread(thread) => ok(),
            _ => Err(GdbRefusal::Malformed),
        },
        b'T' if is_own_thread(rest) => ok(),
        b'T' => Err(GdbRefusal::Malformed),
        b'D' => Ok(Detach),
        b'k' => Ok(Kill { is_answered: false }),
        b'R' => Ok(Restart { is_answered: false }),
        b'v' => parse_v_packet(board, rest),
        b'q' | b'Q' => parse_query(board, packet),
        _ => text(""),
    }
}

/// Returns whether `packet` needs a client that is attached: it runs the program, or changes its
/// registers, memory or breakpoints.
pub fn needs_core(packet: &[u8]) -> bool {
    let first = packet.first();
    first.is_some_and(|first| b"cCsSZGPMX".contains(first))
        || packet.starts_with(b"vCont;")
        || packet.starts_with(b"vFlash")
}

const NO_REGISTER: GdbRefusal = GdbRefusal::Address("there is no register with this number");

/// Parses `address,length`, both in hexadecimal digits.
fn pair(text: &[u8]) -> Result<(u32, u32), GdbRefusal> {
    let (address, length) = split(text, b',').ok_or(GdbRefusal::Malformed)?;
    let numbers = number(address).zip(number(length));
    numbers.ok_or(GdbRefusal::Malformed)
}

fn split(text: &[u8], at: u8) -> Option<(&[u8], &[u8])> {
    let place = text.iter().position(|&byte| byte == at)?;
    Some((&text[..place], &text[place + 1..]))
}

/// Returns whether `thread` selects the only thread, or any thread.
fn is_own_thread(thread: &[u8]) -> bool {
    thread == b"-1" || matches!(number(thread), Some(0 | 1))
}

/// Serves `g` and `G` (all registers), `p` and `P` (one register).
fn registers_of(board: &mut Board<Points>, kind: u8, rest: &[u8]) -> ParsedCommand {
    let cpu = &mut board.cpu;
    match kind {
        b'g' => text(hex(&registers::read_all(cpu))),
        b'G' => {
            let bytes = unhex(rest).ok_or(GdbRefusal::Malformed)?;
            let done = registers::write_all(cpu, &bytes);
            done.ok_or(GdbRefusal::Malformed).and_then(|()| ok())
        }
        b'p' => {
            let number = number(rest).ok_or(GdbRefusal::Malformed)?;
            let value = registers::read(cpu, number as usize);
            text(hex(&value.ok_or(NO_REGISTER)?))
        }
        _ => {
            let (register, value) = split(rest, b'=').ok_or(GdbRefusal::Malformed)?;
            let number = number(register).ok_or(GdbRefusal::Malformed)? as usize;
            let value = unhex(value).ok_or(GdbRefusal::Malformed)?;
            if number >= registers::COUNT {
                return Err(NO_REGISTER);
            }
            let done = registers::write(cpu, number, &value);
            done.ok_or(GdbRefusal::Malformed).and_then(|()| ok())
        }
    }
}

/// Serves `m` (reads memory as digits), `M` and `X` (write digits or bytes).
fn memory_of(board: &mut Board<Points>, kind: u8, rest: &[u8]) -> ParsedCommand {
    if kind == b'm' {
        let (address, count) = pair(rest)?;
        let most = LONGEST / 2; // largest count that fits an answer
        return text(hex(&board.peek(address, most.min(count as usize))?));
    }
    let (place, data) = split(rest, b':').ok_or(GdbRefusal::Malformed)?;
    let data = match kind {
        b'M' => unhex(data).ok_or(GdbRefusal::Malformed)?,
        _ => data.to_vec(),
    };
    let (address, count) = pair(place)?;
    if data.len() != count as usize {
        return Err(GdbRefusal::Malformed);
    }
    board.poke(address, &data).and_then(|()| ok())
}

/// Parses `c` and `s`, and `C` and `S` with a signal, which is ignored because the program has no
/// operating system; an address may follow.
fn parse_resume(board: &mut Board<Points>, kind: u8, rest: &[u8]) -> ParsedCommand {
    let to = match kind {
        b'c' | b's' => Some(rest).filter(|to| !to.is_empty()),
        _ => {
            let (signal, to) = split(rest, b';').map_or((rest, None), |(s, to)| (s, Some(to)));
            number(signal).ok_or(GdbRefusal::Malformed)?;
            to
        }
    };
    if let Some(to) = to {
        let to = number(to).ok_or(GdbRefusal::Malformed)?;
        board.cpu.registers.r[15] = to & !1;
    }
    Ok(Go {
        steps: matches!(kind, b's' | b'S'),
    })
}

/// Sets (`Z`) or removes (`z`) a breakpoint or watchpoint, given as type, address and kind.
/// Conditions and commands are not supported.
fn parse_point(board: &mut Board<Points>, sets: bool, rest: &[u8]) -> ParsedCommand {
    let (kind, place) = split(rest, b',').ok_or(GdbRefusal::Malformed)?;
    let (address, length) = pair(place)?;
    let access = match kind {
        b"0" | b"1" => {
            let by = if kind == b"0" {
                StopReason::Software
            } else {
                StopReason::Hardware
            };
            match sets {
                true => board.observer.add(address, by)?,
                false => board.observer.remove(address, by),
            }
            return ok();
        }
        b"2" => WatchedAccess::Writes,
        b"3" => WatchedAccess::Reads,
        b"4" => WatchedAccess::Accesses,
        _ => return text(""),
    };
    let system = &mut board.cpu.system;
    match sets {
        true => watch(system, address, length, access)?,
        false => unwatch(system, address, length, access)?,
    }
    ok()
}

/// Parses packets that begin with `v`.
fn parse_v_packet(board: &mut Board<Points>, rest: &[u8]) -> ParsedCommand {
    if rest == b"Cont?" {
        return text("vCont;c;C;s;S");
    }
    if let Some(actions) = rest.strip_prefix(b"Cont;") {
        return resume(actions);
    }
    if let Some(place) = rest.strip_prefix(b"FlashErase:") {
        let (address, count) = pair(place)?;
        return board.erase(address, count).and_then(|()| ok());
    }
    if let Some(rest) = rest.strip_prefix(b"FlashWrite:") {
        let (address, data) = split(rest, b':').ok_or(GdbRefusal::Malformed)?;
        let address = number(address).ok_or(GdbRefusal::Malformed)?;
        return board.program(address, data).and_then(|()| ok());
    }
    match rest {
        b"FlashDone" => ok(),
        _ if rest.starts_with(b"Kill;") => Ok(Kill { is_answered: true }),
        _ if rest.starts_with(b"Run;") => Ok(Restart { is_answered: true }),
        _ if rest.starts_with(b"Attach;") => Ok(Status),
        _ => text(""),
    }
}

/// Parses `vCont`: the first action for the only thread counts.
fn resume(actions: &[u8]) -> ParsedCommand {
    let mut own = None;
    for action in actions.split(|&byte| byte == b';') {
        let (action, thread) = split(action, b':').unwrap_or((action, b"-1"));
        let steps = match action.split_first() {
            Some((b'c', [])) => false,
            Some((b's', [])) => true,
            Some((b'C', signal)) if number(signal).is_some() => false,
            Some((b'S', signal)) if number(signal).is_some() => true,
            _ => return Err(GdbRefusal::Malformed),
        };
        if is_own_thread(thread) {
            own.get_or_insert(Go { steps });
        }
    }
    own.ok_or(GdbRefusal::Malformed)
}

/// Parses packets that begin with `q` or `Q`.
fn parse_query(board: &mut Board<Points>, packet: &[u8]) -> ParsedCommand {
    if let Some(features) = packet.strip_prefix(b"qSupported") {
        return Ok(supported(features));
    }
    if let Some(annex) = packet.strip_prefix(b"qXfer:features:read:") {
        let place = annex.strip_prefix(b"target.xml:");
        return document_part(registers::DESCRIPTION, place.ok_or(GdbRefusal::Malformed)?);
    }
    if let Some(place) = packet.strip_prefix(b"qXfer:memory-map:read::") {
        return document_part(MAP, place);
    }
    if let Some(line) = packet.strip_prefix(b"qRcmd,") {
        let line = unhex(line).ok_or(GdbRefusal::Malformed)?;
        let (order, message) = monitor::parse_order(&String::from_utf8_lossy(&line));
        return Ok(Monitor(order, message));
    }
    if let Some(place) = packet.strip_prefix(b"qCRC:") {
        return flash_crc(board, place);
    }
    if packet.starts_with(b"qThreadExtraInfo,") {
        return text(hex(b"Cortex-M4F"));
    }
    match packet {
        b"QStartNoAckMode" => Ok(Agree(Feature::NoAcknowledgements, OK.to_vec())),
        b"qfThreadInfo" => text("m1"),
        b"qsThreadInfo" => text("l"),
        b"qC" => text("QC1"),
        // 1 means that quitting gdb detaches from the chip instead of killing the program.
        _ if packet.starts_with(b"qAttached") => text("1"),
        _ => text(""),
    }
}

fn supported(features: &[u8]) -> Meaning {
    let asked: Vec<&[u8]> = features.split(|byte| b":;".contains(byte)).collect();
    let has = |feature: &[u8]| asked.contains(&feature);
    let agreed = Feature::Knows {
        breaks: [has(b"swbreak+"), has(b"hwbreak+")],
        words: has(b"error-message+"),
    };
    let own = format!(
        "PacketSize={LONGEST:x};QStartNoAckMode+;qXfer:features:read+;qXfer:memory-map:read+;\
         vContSupported+;swbreak+;hwbreak+"
    );
    Agree(agreed, own.into_bytes())
}

/// Answers with the part `offset,length` of a document.
fn document_part(document: &str, place: &[u8]) -> ParsedCommand {
    let (offset, length) = pair(place)?;
    let rest = document.as_bytes().get(offset as usize..);
    let rest = rest.ok_or(GdbRefusal::Malformed)?;
    let length = (length as usize).min(LONGEST - 1);
    let (mark, shown) = match rest.get(..length) {
        Some(shown) if shown.len() < rest.len() => (b'm', shown),
        _ => (b'l', rest),
    };
    Ok(Answer([&[mark], shown].concat()))
}

/// Answers `qCRC`: gdb's checksum of memory, for its command `compare-sections`.
fn flash_crc(board: &Board<Points>, place: &[u8]) -> ParsedCommand {
    /// Size of the flash, bytes: gdb asks only for sections.
    const MOST: u32 = 1 << 20;
    let (address, count) = pair(place)?;
    if count > MOST {
        return Err(GdbRefusal::Address("the range is longer than 1 MiB"));
    }
    let bytes = board.peek(address, count as usize)?;
    if bytes.len() < count as usize {
        return Err(GdbRefusal::Address(
            "there is no memory or register at some of these addresses",
        ));
    }
    let sum = Crc::<u32>::new(&CRC_32_MPEG_2).checksum(&bytes);
    text(format!("C{sum:x}"))
}
