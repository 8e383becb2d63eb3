//! Frames packets of the remote protocol: `$`, contents, `#`, two digits of a checksum (gdb manual,
//! "Remote Protocol", Overview).
//!
//! In: arbitrary bytes in any portions. Out: packets, and the events between them.

/// Largest size of a packet's contents on the wire, bytes; the server states it in qSupported.
pub const LONGEST: usize = 0x4000;

/// An event in the bytes from a client.
#[derive(Debug, PartialEq, Eq)]
pub enum PacketEvent {
    /// A packet with a correct checksum: its contents without escapes.
    Packet(Vec<u8>),
    /// A packet with a wrong or missing checksum.
    Damaged,
    /// A packet with a correct checksum and more than [`LONGEST`] bytes.
    TooLong,
    /// A request to repeat the last answer, which was damaged (`-`).
    Again,
    /// Ctrl-C: the client wants the core to halt.
    Interrupt,
}

#[derive(Clone, Copy, Debug, Default)]
enum Place {
    #[default]
    Between,
    Contents,
    /// After `#`, where the first digit of the checksum follows.
    Sum,
    /// After the first digit of the checksum, which is stored here.
    LastDigit(u8),
}

/// State machine that splits received bytes into packets.
#[derive(Debug, Default)]
pub struct Receiver {
    place: Place,
    contents: Vec<u8>,
    sum: u8,
    is_too_long: bool,
}

impl Receiver {
    /// Takes the next byte, and returns the event that it completes. `$` always begins a packet and
    /// discards an unfinished one. Meaningless bytes between packets are ignored.
    pub fn push(&mut self, byte: u8) -> Option<PacketEvent> {
        if byte == b'$' {
            *self = Self {
                place: Place::Contents,
                ..Self::default()
            };
            return None;
        }
        match (self.place, byte) {
            (Place::Between, 0x03) => return Some(PacketEvent::Interrupt),
            (Place::Between, b'-') => return Some(PacketEvent::Again),
            (Place::Between, _) => {}
            (Place::Contents, b'#') => self.place = Place::Sum,
            (Place::Contents, _) => {
                self.sum = self.sum.wrapping_add(byte);
                match self.contents.len() < LONGEST {
                    true => self.contents.push(byte),
                    false => self.is_too_long = true,
                }
            }
            (Place::Sum, high) => self.place = Place::LastDigit(high),
            (Place::LastDigit(high), low) => return Some(self.end(high, low)),
        }
        None
    }

    fn end(&mut self, high: u8, low: u8) -> PacketEvent {
        let ended = std::mem::take(self);
        if number(&[high, low]) != Some(ended.sum.into()) {
            return PacketEvent::Damaged;
        }
        match ended.is_too_long {
            true => PacketEvent::TooLong,
            false => PacketEvent::Packet(without_escapes(&ended.contents)),
        }
    }
}

fn without_escapes(contents: &[u8]) -> Vec<u8> {
    let mut bytes = contents.iter();
    let mut plain = Vec::with_capacity(contents.len());
    while let Some(&byte) = bytes.next() {
        match byte {
            b'}' => plain.extend(bytes.next().map(|escaped| escaped ^ 0x20)),
            _ => plain.push(byte),
        }
    }
    plain
}

/// Makes a packet of `contents`, in which no byte needs an escape: adds `$`, `#` and the checksum.
pub fn frame_packet(contents: &[u8]) -> Vec<u8> {
    let sum = contents.iter().copied().fold(0, u8::wrapping_add);
    let mut packet = vec![b'$'];
    packet.extend(contents);
    packet.extend(format!("#{sum:02x}").bytes());
    packet
}

/// Converts bytes into hexadecimal digits, two per byte.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Converts hexadecimal digits into bytes; returns `None` for other characters or an odd count.
pub fn unhex(digits: &[u8]) -> Option<Vec<u8>> {
    let (pairs, rest) = digits.as_chunks::<2>();
    let bytes = pairs.iter().map(|pair| Some(number(pair)? as u8)); // two digits
    rest.is_empty().then(|| bytes.collect())?
}

/// Parses a hexadecimal number of 32 bits; returns `None` for other text or a larger number.
pub fn number(digits: &[u8]) -> Option<u32> {
    if digits.is_empty() {
        return None;
    }
    digits.iter().try_fold(0u32, |value, &digit| {
        let digit = char::from(digit).to_digit(16)?;
        Some(value.checked_mul(16)? | digit)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heard(bytes: &[u8]) -> Vec<PacketEvent> {
        let mut receiver = Receiver::default();
        bytes.iter().filter_map(|&b| receiver.push(b)).collect()
    }

    #[test]
    fn packets_are_found_between_whatever_stands_there() {
        let packet = |text: &str| PacketEvent::Packet(text.into());
        assert_eq!(
            heard(b"+$g#67\x03$?#3f"),
            [packet("g"), PacketEvent::Interrupt, packet("?")]
        );
        assert_eq!(heard(b"no packet }*#00"), []);
        assert_eq!(heard(b"$g#68$g#6"), [PacketEvent::Damaged]);
        assert_eq!(heard(b"$g#zz-"), [PacketEvent::Damaged, PacketEvent::Again]);
        // An unfinished packet, then a complete one.
        assert_eq!(heard(b"$m0800$g#67"), [packet("g")]);
        assert_eq!(heard(b"$m08#$g#67"), [packet("g")]);
        assert_eq!(heard(&frame_packet(b"")), [packet("")]);
    }

    #[test]
    fn escapes_stand_for_the_bytes_of_the_frame() {
        let packet = frame_packet(b"X0,3:}\x03}\x04}]");
        assert_eq!(heard(&packet), [PacketEvent::Packet(b"X0,3:#$}".to_vec())]);
        // The byte of an interrupt is data within a packet.
        assert_eq!(
            heard(&frame_packet(b"X\x03")),
            [PacketEvent::Packet(b"X\x03".to_vec())]
        );
    }

    #[test]
    fn a_packet_beyond_the_longest_is_told_as_such() {
        let longest = vec![b'a'; LONGEST];
        assert_eq!(
            heard(&frame_packet(&longest)),
            [PacketEvent::Packet(longest.clone())]
        );
        let longer = frame_packet(&[&longest[..], b"a"].concat());
        assert_eq!(heard(&longer), [PacketEvent::TooLong]);
        assert_eq!(heard(&[&longer[..], b"$g#67"].concat()).len(), 2);
    }

    #[test]
    fn numbers_and_bytes_are_digits_and_nothing_else() {
        assert_eq!(number(b"fFffffff"), Some(u32::MAX));
        for wrong in ["", "100000000", "g", "+1", "-1", " 1"] {
            assert_eq!(number(wrong.as_bytes()), None, "{wrong}");
        }
        assert_eq!(unhex(b"00fF"), Some(vec![0, 255]));
        assert_eq!(
            (unhex(b"0"), unhex(b"0x"), unhex(b"")),
            (None, None, Some(vec![]))
        );
        assert_eq!(hex(&[1, 0xAB]), "01ab");
    }
}
