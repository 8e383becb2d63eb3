//! Source files, and their text without comments, strings and tests. Removed text becomes spaces,
//! so that offsets stay the same.

use proc_macro2::{Span, TokenStream, TokenTree};

/// Text file of the working tree.
#[derive(Debug)]
pub(in crate::verify) struct Source {
    /// Path relative to the workspace's root, with `/`.
    pub path: String,
    /// Unchanged contents of the file.
    pub text: String,
    /// Contents without comments and without the text of strings (Rust files only).
    pub code: String,
    /// `code` without test modules; empty if the file is a test.
    pub shipped: String,
}

impl Source {
    pub fn new(path: &str, text: String) -> Self {
        let is_rust = is_rust(path);
        let code = if is_rust {
            blank_non_code(&text)
        } else {
            String::new()
        };
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

    /// Returns `file:line: text` for byte offsets into the text.
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

    /// Returns whether a comment is on the line at offset `at` or on the line above.
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

/// Returns the byte offsets of `word` where it is not part of a longer word.
pub(super) fn find_word(code: &str, word: &str) -> Vec<usize> {
    let bytes = code.as_bytes();
    let joins = |byte: Option<&u8>| byte.is_some_and(|b| b.is_ascii_alphanumeric() || *b == b'_');
    let is_whole = |at: &usize| {
        let before = at.checked_sub(1).and_then(|before| bytes.get(before));
        !joins(before) && !joins(bytes.get(at + word.len()))
    };
    let positions = code.match_indices(word).map(|(at, _)| at);
    positions.filter(is_whole).collect()
}

/// Returns `text` with comments and literals blanked; unchanged if it is not Rust.
fn blank_non_code(text: &str) -> String {
    let Ok(tokens) = text.parse::<TokenStream>() else {
        return text.to_owned();
    };
    let mut out = text.as_bytes().to_vec();
    blank(&mut out, 0, text.len());
    copy(text, tokens, &mut out);
    String::from_utf8_lossy(&out).into_owned()
}

/// Copies the names and punctuation of `tokens` from `text` to the same offsets of `out`.
fn copy(text: &str, tokens: TokenStream, out: &mut [u8]) {
    let mut inside = Vec::new();
    let mut put = |span: Span| {
        let range = span.byte_range();
        out[range.clone()].copy_from_slice(&text.as_bytes()[range]);
    };
    for token in tokens {
        // The tokens of a documentation comment have the comment's place.
        let place = &text[token.span().byte_range()];
        if place.starts_with("//") || place.starts_with("/*") {
            continue;
        }
        match token {
            TokenTree::Group(group) => {
                put(group.span_open());
                put(group.span_close());
                inside.push(group.stream());
            }
            TokenTree::Ident(_) | TokenTree::Punct(_) => put(token.span()),
            TokenTree::Literal(_) => {}
        }
    }
    inside
        .into_iter()
        .for_each(|tokens| copy(text, tokens, out));
}

/// Overwrites bytes with spaces, except for line ends.
fn blank(bytes: &mut [u8], from: usize, to: usize) {
    for byte in &mut bytes[from..to] {
        if *byte != b'\n' {
            *byte = b' ';
        }
    }
}

/// Returns `code` with every item under `#[cfg(test)]` blanked.
fn without_tests(code: &str) -> String {
    const MARK: &str = "#[cfg(test)]";
    let mut out = code.as_bytes().to_vec();
    let mut from = 0;
    while let Some(at) = code[from..].find(MARK) {
        let start = from + at;
        from = start + MARK.len() + item_length(&code[start + MARK.len()..]);
        blank(&mut out, start, from);
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// Returns the length of the item at the start of `code`, up to its `;` or closing brace.
fn item_length(code: &str) -> usize {
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
        let left = blank_non_code(text);
        assert_eq!(left.len(), text.len());
        assert_eq!(left.split_whitespace().collect::<String>(), "abcdef");
        assert_eq!(left.find('\n'), text.find('\n'));
    }

    #[test]
    fn characters_are_no_strings_and_lifetimes_no_characters() {
        let text = "f('\"', '\\'', 'é', b'{') g<'a>(x: &'a str, r#type) h('x')";
        let left = blank_non_code(text).replace(' ', "");
        assert_eq!(left, "f(,,,)g<'a>(x:&'astr,r#type)h()");
    }

    #[test]
    fn what_is_no_rust_stays_as_it_is() {
        for text in ["\"open", "/* open", "r#\"open", "'\\", "f(", "\"\\"] {
            assert_eq!(blank_non_code(text), text);
        }
    }
    #[test]
    fn test_modules_are_not_shipped() {
        let text = "fn a() {}\n#[cfg(test)]\nmod tests { fn b() { {} } }\nfn c() {}\n\
                    #[cfg(test)]\nextern crate std;\nfn d() {}";
        let source = Source::new("x/a.rs", text.to_owned());
        for (name, is_shipped) in [("a", true), ("b", false), ("c", true), ("d", true)] {
            let found = !find_word(&source.shipped, name).is_empty();
            assert_eq!(found, is_shipped, "{name}");
        }
        assert!(find_word(&source.shipped, "std").is_empty());
        assert!(Source::new("x/tests/a.rs", text.into()).shipped.is_empty());
    }

    #[test]
    fn places_are_lines_that_an_editor_opens() {
        let source = Source::new("a.rs", "one\n  two // why\nthree".to_owned());
        let at = |word| find_word(&source.text, word);
        assert_eq!(source.places(at("two")), ["a.rs:2: two // why"]);
        let has_comment = |word| source.has_comment(at(word)[0]);
        assert!(!has_comment("one"));
        assert!(has_comment("two"));
        assert!(has_comment("three"));
    }
}
