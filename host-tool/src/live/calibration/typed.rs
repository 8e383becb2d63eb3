//! Parses the bytes of a terminal into keys. Keys that end the calibration are recognized
//! everywhere; pasted text is ignored.

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

/// Longest escape sequence, bytes.
const LONGEST: usize = 32;

/// Number of successive turns of the calibration without input, after which a paste counts as
/// finished.
const QUIET: u32 = 40;

const ESCAPE: u8 = 0x1b;

/// Bytes that are not yet a complete key.
#[derive(Debug, Default)]
pub struct PendingInput {
    rest: Vec<u8>,
    is_pasting: bool,
    quiet: u32,
}

/// The first element of the input, with its length in bytes.
enum InputStart {
    Key(usize, KeyCode),
    Control(usize, char),
    Paste(usize, bool),
    Nothing(usize),
    /// The beginning of a key or sequence whose other bytes have not arrived.
    Part,
}

impl PendingInput {
    /// Returns the keys that `bytes` complete. At a turn (`is_turn`) without input, an incomplete
    /// escape sequence becomes Escape and other incomplete bytes are discarded.
    pub fn parse_keys(&mut self, bytes: &[u8], is_turn: bool) -> Vec<KeyEvent> {
        let mut keys = Vec::new();
        if bytes.is_empty() && is_turn {
            self.quiet = self.quiet.saturating_add(1);
            self.is_pasting &= self.quiet < QUIET;
            if self.rest.first() == Some(&ESCAPE) {
                keys.push(KeyEvent::from(KeyCode::Esc));
            }
            self.rest.clear();
        } else if !bytes.is_empty() {
            self.quiet = 0;
        }
        self.rest.extend_from_slice(bytes);
        let input = std::mem::take(&mut self.rest);
        let mut rest = input.as_slice();
        while !rest.is_empty() {
            let count = match parse_input(rest) {
                InputStart::Key(count, code) => {
                    if !self.is_pasting || code == KeyCode::Esc {
                        keys.push(KeyEvent::from(code));
                    }
                    count
                }
                InputStart::Control(count, key) => {
                    keys.push(KeyEvent::new(KeyCode::Char(key), KeyModifiers::CONTROL));
                    count
                }
                InputStart::Paste(count, begins) => {
                    self.is_pasting = begins;
                    count
                }
                InputStart::Nothing(count) => count,
                InputStart::Part => break,
            };
            rest = rest.get(count..).unwrap_or_default();
        }
        self.rest = rest.to_vec();
        keys
    }
}

fn parse_input(bytes: &[u8]) -> InputStart {
    match bytes {
        [ESCAPE] => InputStart::Part,
        // Function keys of the Linux console.
        [ESCAPE, b'[', b'[', last, ..] if *last >= b' ' => InputStart::Nothing(4),
        [ESCAPE, b'[', b'['] => InputStart::Part,
        [ESCAPE, b'[', b'[', ..] => InputStart::Key(3, KeyCode::Esc),
        [ESCAPE, b'[', rest @ ..] => parse_sequence(rest),
        [ESCAPE, b'O'] => InputStart::Part,
        [ESCAPE, b'O', last, ..] => parse_arrow(3, *last),
        // Escape followed by another byte counts as Escape, because ending is safe.
        [ESCAPE, ..] => InputStart::Key(1, KeyCode::Esc),
        [3, ..] => InputStart::Control(1, 'c'),
        [4, ..] => InputStart::Control(1, 'd'),
        [b'\r' | b'\n', ..] => InputStart::Key(1, KeyCode::Enter),
        [8 | 0x7f, ..] => InputStart::Key(1, KeyCode::Backspace),
        [first, ..] if *first < b' ' => InputStart::Nothing(1),
        _ => parse_character(bytes),
    }
}

/// Parses a control sequence; `rest` is the part after the introducer.
fn parse_sequence(rest: &[u8]) -> InputStart {
    let is_last = |byte: &u8| !(0x20..0x40).contains(byte);
    let Some(end) = rest.iter().take(LONGEST).position(is_last) else {
        return match rest.len() < LONGEST {
            true => InputStart::Part,
            false => InputStart::Key(2 + LONGEST, KeyCode::Esc),
        };
    };
    let (parameters, last) = (&rest[..end], rest[end]);
    match (parameters, last) {
        (b"200", b'~') => InputStart::Paste(end + 3, true),
        (b"201", b'~') => InputStart::Paste(end + 3, false),
        (_, 0x40..=0x7e) => parse_arrow(end + 3, last),
        // The sequence was interrupted; a new one begins here.
        _ => InputStart::Key(end + 2, KeyCode::Esc),
    }
}

const fn parse_arrow(count: usize, last: u8) -> InputStart {
    match last {
        b'A' => InputStart::Key(count, KeyCode::Up),
        b'B' => InputStart::Key(count, KeyCode::Down),
        ESCAPE | 3 | 4 => InputStart::Key(count - 1, KeyCode::Esc),
        _ => InputStart::Nothing(count),
    }
}

fn parse_character(bytes: &[u8]) -> InputStart {
    let first = bytes.utf8_chunks().next();
    let valid = first
        .as_ref()
        .and_then(|chunk| chunk.valid().chars().next());
    match (valid, first) {
        (Some(c), _) => InputStart::Key(c.len_utf8(), KeyCode::Char(c)),
        (None, Some(chunk)) if chunk.invalid().len() < bytes.len() => {
            InputStart::Nothing(chunk.invalid().len().max(1))
        }
        // A part of a character, or invalid bytes.
        _ if bytes.len() < 4 => InputStart::Part,
        _ => InputStart::Nothing(1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use KeyCode::{Backspace, Char, Down, Enter, Esc, Up};

    fn codes(typed: &mut PendingInput, bytes: &[u8]) -> Vec<KeyCode> {
        let keys = typed.parse_keys(bytes, true);
        keys.into_iter().map(|key| key.code).collect()
    }

    #[test]
    fn bytes_are_keys() {
        let mut typed = PendingInput::default();
        let bytes = "a\u{1b}[A\u{1b}[B\u{1b}OA\u{1b}[1;5B\u{1b}[3~\u{1b}[[Aé+\r\u{7f}\u{1}";
        let keys = [
            Char('a'),
            Up,
            Down,
            Up,
            Down,
            Char('é'),
            Char('+'),
            Enter,
            Backspace,
        ];
        assert_eq!(codes(&mut typed, bytes.as_bytes()), keys);
        // The same bytes one at a time.
        let mut pieces = Vec::new();
        for byte in bytes.as_bytes() {
            pieces.extend(codes(&mut typed, &[*byte]));
        }
        assert_eq!(pieces, keys);
        assert!(codes(&mut typed, b"").is_empty());
    }

    #[test]
    fn escape_is_known_when_nothing_follows() {
        let mut typed = PendingInput::default();
        assert!(codes(&mut typed, b"\x1b").is_empty());
        assert!(typed.parse_keys(b"", false).is_empty());
        assert_eq!(codes(&mut typed, b""), [Esc]);
        assert!(codes(&mut typed, b"").is_empty());
        for broken in [
            &b"\x1bx"[..],
            b"\x1b\x1b",
            b"\x1b[\x1b",
            b"\x1b[12\x03",
            b"\x1bO\x03",
        ] {
            let mut typed = PendingInput::default();
            assert_eq!(codes(&mut typed, broken)[0], Esc, "{broken:?}");
        }
        let long = [&b"\x1b["[..], &[b'1'; 40]].concat();
        assert_eq!(codes(&mut typed, &long)[0], Esc);
    }

    #[test]
    fn what_is_pasted_is_no_key_and_control_c_is_one() {
        let mut typed = PendingInput::default();
        assert!(codes(&mut typed, b"\x1b[200~+n+n+n").is_empty());
        assert_eq!(codes(&mut typed, b"+n\x03+n"), [Char('c')]);
        assert_eq!(codes(&mut typed, b"tq\x1b[201~+"), [Char('+')]);
        // A paste whose end marker is lost.
        assert!(codes(&mut typed, b"\x1b[200~+").is_empty());
        (0..QUIET).for_each(|_| assert!(codes(&mut typed, b"").is_empty()));
        assert_eq!(codes(&mut typed, b"+"), [Char('+')]);
    }

    #[test]
    fn no_bytes_hide_control_c() {
        for byte in 0..=u8::MAX {
            for before in [vec![byte], vec![byte, byte], vec![ESCAPE, b'[', byte]] {
                let mut typed = PendingInput::default();
                let input = [&before[..], &[3]].concat();
                let keys = typed.parse_keys(&input, true);
                let is_end = |key: &KeyEvent| {
                    key.code == Esc || key.modifiers.contains(KeyModifiers::CONTROL)
                };
                assert!(keys.iter().any(is_end), "{input:?}");
            }
        }
    }
}
