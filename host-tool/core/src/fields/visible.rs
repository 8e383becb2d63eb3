//! Makes the text of a file safe to print: terminals execute control characters, and direction
//! marks change the order in which text appears.

fn is_terminal_control(c: char) -> bool {
    let turns = ['\u{61c}', '\u{200e}', '\u{200f}'].contains(&c);
    let embeds = ('\u{202a}'..='\u{202e}').contains(&c) || ('\u{2066}'..='\u{2069}').contains(&c);
    c.is_control() && c != '\t' || turns || embeds
}

/// Returns a line in which control characters and direction marks are replaced by escapes such as
/// `\u{1b}`, so that it is safe to print.
#[must_use]
pub fn escape_control_chars(line: &str) -> String {
    let mut text = String::with_capacity(line.len());
    for c in line.chars() {
        match is_terminal_control(c) {
            true => text.extend(c.escape_unicode()),
            false => text.push(c),
        }
    }
    text
}

/// Returns a text in which control characters and direction marks are replaced by harmless
/// characters. Tabs and line ends stay. Each replacement has as many bytes as the original, so that
/// all places in the text stay the same.
pub(super) fn blank_control_chars(text: &str) -> String {
    let blank = |c: char| match c.len_utf8() {
        _ if !is_terminal_control(c) || c == '\n' => c,
        _ if c == '\r' => ' ',
        1 => '?',
        2 => '¿',
        _ => char::REPLACEMENT_CHARACTER,
    };
    text.chars().map(blank).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_printed_is_obeyed_and_places_stay() {
        let text = "a\u{1b}[2Jb\0\u{9b}µ\u{202e}\u{61c}筋\u{7f}\t\r\n";
        assert!(
            escape_control_chars(text)
                .chars()
                .all(|c| !is_terminal_control(c))
        );
        assert_eq!(escape_control_chars("筋 45°"), "筋 45°");
        let blanked = blank_control_chars(text);
        assert_eq!(blanked, "a?[2Jb?¿µ\u{fffd}¿筋?\t \n");
        assert_eq!(blanked.len(), text.len());
    }
}
