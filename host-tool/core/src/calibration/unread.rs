//! Splits input into lines of orders, even if it arrives in pieces, is too long, or is not text.

/// Greatest length of a line of input that is kept, bytes. A longer line is not a valid command.
const LONGEST: usize = 16_384;

/// Beginning of a line of input whose end has not arrived yet.
#[derive(Debug, Default)]
pub struct PartialLine {
    bytes: Vec<u8>,
    is_long: bool,
}

impl PartialLine {
    /// Adds `bytes` of input and returns the lines that end in them, whatever they contain. With
    /// `is_last`, the rest without a line end is also returned. A line that is too long is cut, and
    /// a character is added that makes it an invalid command.
    pub fn take_lines(&mut self, bytes: &[u8], is_last: bool) -> Vec<String> {
        let mut lines = Vec::new();
        for byte in bytes {
            match byte {
                b'\n' => lines.push(self.line()),
                _ if self.bytes.len() < LONGEST => self.bytes.push(*byte),
                _ => self.is_long = true,
            }
        }
        if is_last && !self.bytes.is_empty() {
            lines.push(self.line());
        }
        lines
    }

    fn line(&mut self) -> String {
        let mut bytes = std::mem::take(&mut self.bytes);
        if std::mem::take(&mut self.is_long) {
            // The added character makes the line invalid, whatever it begins with.
            bytes.push(b'?');
        }
        String::from_utf8_lossy(&bytes).trim_end().to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::Order;

    #[test]
    fn every_line_is_read_whatever_is_in_it() {
        let mut unread = PartialLine::default();
        let long = format!("{{\"order\":\"raise\"}}{}", " ".repeat(40_000));
        let text = format!("one\n\u{fffd}\n{long}\nla");
        let lines = unread.take_lines(text.as_bytes(), false);
        assert_eq!(lines[..2], ["one", "\u{fffd}"]);
        assert!(lines.len() == 3 && Order::parse(&lines[2]).is_err());
        assert!(unread.bytes.capacity() <= 2 * LONGEST);
        assert_eq!(unread.take_lines(b"st", true), ["last"]);
        assert!(unread.take_lines(b"", true).is_empty());
        let broken = unread.take_lines(b"\xff\xfe\nnext\n", false);
        assert!(Order::parse(&broken[0]).is_err());
        assert_eq!(broken[1], "next");
    }
}
