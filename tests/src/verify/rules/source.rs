//! A source file, and what is left of it without comments, strings and tests.
//! Everything removed becomes spaces, so that places stay the same.

/// One text file of the working tree.
#[derive(Debug)]
pub(in crate::verify) struct Source {
    /// From the workspace's root, with `/`.
    pub path: String,
    /// As it is.
    pub text: String,
    /// Without comments and the contents of strings (Rust files only).
    pub code: String,
    /// `code` without test modules; empty if the file is a test.
    pub shipped: String,
}

impl Source {
    pub fn new(path: &str, text: String) -> Self {
        let is_rust = is_rust(path);
        let code = if is_rust { code(&text) } else { String::new() };
        let shipped = if is_test(path) {
            String::new()
        } else {
            without_tests(&code)
        };
        Self {
            path: path.into(),
            text,
            code,
            shipped,
        }
    }

    pub fn is_test(&self) -> bool {
        is_test(&self.path)
    }

    pub fn is_rust(&self) -> bool {
        is_rust(&self.path)
    }

    /// `file:line: text` for byte offsets into the text.
    pub fn places(&self, mut offsets: Vec<usize>) -> Vec<String> {
        offsets.sort_unstable();
        let place = |at: usize| {
            let number = self.text[..at].matches('\n').count();
            let line = self.text.lines().nth(number).unwrap_or_default().trim();
            let line: String = line.chars().take(60).collect();
            format!("{}:{}: {line}", self.path, number + 1)
        };
        offsets.into_iter().map(place).collect()
    }

    /// Whether a comment is on the line at offset `at` or on the line above.
    pub fn has_comment(&self, at: usize) -> bool {
        let number = self.text[..at].matches('\n').count();
        let mut lines = self.text.lines().skip(number.saturating_sub(1));
        let lines = lines.by_ref().take(if number == 0 { 1 } else { 2 });
        lines.into_iter().any(|line| line.contains("//"))
    }
}

fn is_test(path: &str) -> bool {
    path.contains("/tests/") || path.ends_with("/tests.rs")
}

fn is_rust(path: &str) -> bool {
    std::path::Path::new(path)
        .extension()
        .is_some_and(|e| e == "rs")
}

/// Byte offsets of `word` where it is not part of a longer one.
pub(super) fn words(code: &str, word: &str) -> Vec<usize> {
    let bytes = code.as_bytes();
    let joins = |byte: Option<&u8>| byte.is_some_and(|b| b.is_ascii_alphanumeric() || *b == b'_');
    let is_whole = |at: &usize| {
        let before = at.checked_sub(1).and_then(|before| bytes.get(before));
        !joins(before) && !joins(bytes.get(at + word.len()))
    };
    let all = code.match_indices(word).map(|(at, _)| at);
    all.filter(is_whole).collect()
}

/// `text` with comments and string contents blanked.
fn code(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut out = bytes.to_vec();
    let mut at = 0;
    while at < bytes.len() {
        let end = skipped(bytes, at);
        blank(&mut out, at, end);
        at = end.max(at + 1);
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// The end of the comment, string or character that begins at `at`; `at` if
/// there is none.
fn skipped(bytes: &[u8], at: usize) -> usize {
    let rest = &bytes[at..];
    let after_name = at > 0 && (bytes[at - 1].is_ascii_alphanumeric() || bytes[at - 1] == b'_');
    match rest {
        [b'/', b'/', ..] => at + find(rest, b"\n").unwrap_or(rest.len()),
        [b'/', b'*', ..] => at + block_comment(rest),
        [b'r', b'"' | b'#', ..] if !after_name => at + raw_string(rest),
        [b'b', b'r', b'"' | b'#', ..] if !after_name => at + 1 + raw_string(&rest[1..]),
        [b'"', ..] => at + quoted(rest),
        // A character, not a lifetime: '\n', 'x', 'é'.
        [b'\'', b'\\', ..] => at + quoted(rest),
        [b'\'', ..] => {
            let shortest = 2..=5.min(rest.len().saturating_sub(1));
            let closing = shortest.into_iter().find(|&i| rest[i] == b'\'');
            let is_character = closing.is_some_and(|i| {
                std::str::from_utf8(&rest[1..i]).is_ok_and(|c| c.chars().count() == 1)
            });
            at + if is_character {
                closing.unwrap_or(0) + 1
            } else {
                0
            }
        }
        _ => at,
    }
}

fn find(bytes: &[u8], what: &[u8]) -> Option<usize> {
    bytes.windows(what.len()).position(|window| window == what)
}

/// Length of a block comment; they nest.
fn block_comment(rest: &[u8]) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < rest.len() {
        match &rest[at..] {
            [b'/', b'*', ..] => (depth, at) = (depth + 1, at + 2),
            [b'*', b'/', ..] if depth == 1 => return at + 2,
            [b'*', b'/', ..] => (depth, at) = (depth - 1, at + 2),
            _ => at += 1,
        }
    }
    rest.len()
}

/// Length of `r"…"` or `r#"…"#`; 0 for a raw name such as `r#type`.
fn raw_string(rest: &[u8]) -> usize {
    let hashes = rest[1..].iter().take_while(|b| **b == b'#').count();
    let open = 1 + hashes;
    if rest.get(open) != Some(&b'"') {
        return 0;
    }
    let close = [&b"\""[..], &b"#".repeat(hashes)].concat();
    let body = &rest[open + 1..];
    find(body, &close).map_or(rest.len(), |at| open + 1 + at + close.len())
}

/// Length of a literal in quotes with escapes; the first byte is the quote.
fn quoted(rest: &[u8]) -> usize {
    let mut at = 1;
    while at < rest.len() {
        match rest[at] {
            b'\\' => at += 2,
            byte if byte == rest[0] => return at + 1,
            _ => at += 1,
        }
    }
    rest.len()
}

/// Overwrites with spaces, keeping line ends.
fn blank(bytes: &mut [u8], from: usize, to: usize) {
    for byte in &mut bytes[from..to] {
        if *byte != b'\n' {
            *byte = b' ';
        }
    }
}

/// `code` with every item under `#[cfg(test)]` blanked.
fn without_tests(code: &str) -> String {
    const MARK: &str = "#[cfg(test)]";
    let mut out = code.as_bytes().to_vec();
    let mut from = 0;
    while let Some(at) = code[from..].find(MARK) {
        let start = from + at;
        from = start + MARK.len() + item(&code[start + MARK.len()..]);
        blank(&mut out, start, from);
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// Length of the item that `code` begins with: to its `;` or closing brace.
fn item(code: &str) -> usize {
    let mut depth = 0usize;
    for (at, byte) in code.bytes().enumerate() {
        match byte {
            b'{' => depth += 1,
            b'}' if depth <= 1 => return at + 1,
            b'}' => depth -= 1,
            b';' if depth == 0 => return at + 1,
            _ => {}
        }
    }
    code.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_strings_are_blanked_in_place() {
        let text = "a // x\nb /* y /* z */ */ c \"s\\\"t\" d r#\"u\"v\"# e b\"w\" f";
        let left = code(text);
        assert_eq!(left.len(), text.len());
        assert_eq!(left.split_whitespace().collect::<String>(), "abcdebf");
        assert_eq!(left.find('\n'), text.find('\n'));
    }

    #[test]
    fn characters_are_no_strings_and_lifetimes_no_characters() {
        let text = "f('\"', '\\'', 'é', b'{') g<'a>(x: &'a str, r#type) h('x')";
        let left = code(text).replace(' ', "");
        assert_eq!(left, "f(,,,b)g<'a>(x:&'astr,r#type)h()");
    }

    #[test]
    fn what_never_ends_ends_with_the_file() {
        for text in [
            "\"open", "/* open", "r#\"open", "'\\", "'", "r", "br", "\"\\",
        ] {
            assert_eq!(code(text).len(), text.len(), "{text}");
        }
    }

    #[test]
    fn test_modules_are_not_shipped() {
        let text = "fn a() {}\n#[cfg(test)]\nmod tests { fn b() { {} } }\nfn c() {}\n\
                    #[cfg(test)]\nextern crate std;\nfn d() {}";
        let source = Source::new("x/a.rs", text.to_owned());
        for (name, is_shipped) in [("a", true), ("b", false), ("c", true), ("d", true)] {
            let found = !words(&source.shipped, name).is_empty();
            assert_eq!(found, is_shipped, "{name}");
        }
        assert!(words(&source.shipped, "std").is_empty());
        assert!(Source::new("x/tests/a.rs", text.into()).shipped.is_empty());
    }

    #[test]
    fn places_are_lines_that_an_editor_opens() {
        let source = Source::new("a.rs", "one\n  two // why\nthree".to_owned());
        let at = |word| words(&source.text, word);
        assert_eq!(source.places(at("two")), ["a.rs:2: two // why"]);
        let has_comment = |word| source.has_comment(at(word)[0]);
        assert!(!has_comment("one"));
        assert!(has_comment("two"));
        assert!(has_comment("three"));
    }
}
