//! Rule for words that Flexor does not use: `docs/words.toml` lists them with their replacements.
//!
//! In: the list and all sources. Out: uses of such words, as `file:line`.

use super::Findings;
use super::source::Source;
use proc_macro2::{TokenStream, TokenTree};
use serde::Deserialize;
use std::collections::BTreeSet;

/// Path of the list, relative to the workspace's root.
const LIST: &str = "docs/words.toml";

/// Largest number of exceptions; with more, the list does not fit the code.
const MOST_EXCEPTIONS: usize = 40;

/// Document that keeps old words.
const HISTORY: &str = "CHANGELOG.md";

/// Contents of `docs/words.toml`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    word: Vec<Word>,
    #[serde(default)]
    exception: Vec<Exception>,
}

/// Words with a common replacement.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Word {
    /// Names, or words and phrases of prose.
    find: Vec<String>,
    r#in: BTreeSet<Place>,
    r#use: String,
}

/// Word that one file may use.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Exception {
    file: String,
    find: String,
    reason: String,
}

/// Kinds of places at which words occur.
#[derive(Clone, Copy, Debug, Deserialize, Eq, Ord, PartialEq, PartialOrd)]
#[serde(rename_all = "lowercase")]
enum Place {
    /// Any identifier.
    Name,
    /// Name of a struct, enum, trait or alias at its definition.
    Type,
    /// Name of a function at its definition.
    Function,
    /// Comment in Rust code.
    Comment,
    /// String literal outside tests.
    Text,
    /// Markdown file.
    Document,
}

/// Piece of a source: kind of place, byte offset, and text.
type Piece<'s> = (Place, usize, &'s str);

/// Returns every use of a listed word that is not an exception, and mistakes in the list itself.
/// Without a list nothing is found.
pub(super) fn judge(sources: &[Source]) -> Findings {
    let Some(source) = sources.iter().find(|source| source.path == LIST) else {
        return Findings::new();
    };
    let list: List = match toml::from_str(&source.text) {
        Ok(list) => list,
        Err(error) => return vec![format!("{LIST}: {error}")],
    };
    let mut findings = mistakes(&list);
    let mut unused: BTreeSet<_> = list
        .exception
        .iter()
        .map(|exception| (&*exception.file, &*exception.find))
        .collect();
    for source in sources.iter().filter(|source| source.path != LIST) {
        for (offset, word, replacement) in uses(&list, source) {
            if list
                .exception
                .iter()
                .any(|exception| exception.file == source.path && exception.find == word)
            {
                unused.remove(&(source.path.as_str(), word));
            } else {
                let line = source.text[..offset].matches('\n').count() + 1;
                findings.push(format!(
                    "{}:{line}: `{word}`: use {replacement}",
                    source.path
                ));
            }
        }
    }
    findings.extend(
        unused.into_iter().map(|(file, word)| {
            format!("{LIST}: the exception for `{word}` in {file} is not needed")
        }),
    );
    findings
}

/// Returns mistakes in the list.
fn mistakes(list: &List) -> Findings {
    let mut findings = Findings::new();
    let count = list.exception.len();
    if count > MOST_EXCEPTIONS {
        findings.push(format!(
            "{LIST}: {count} exceptions; allowed: at most {MOST_EXCEPTIONS}"
        ));
    }
    for exception in &list.exception {
        if exception.reason.trim().is_empty() {
            findings.push(format!(
                "{LIST}: the exception in {} has no reason",
                exception.file
            ));
        }
    }
    findings
}

/// Returns each use of a listed word: byte offset, word and replacement.
fn uses<'l>(list: &'l List, source: &Source) -> Vec<(usize, &'l str, &'l str)> {
    let mut found = Vec::new();
    for (place, offset, text) in pieces(source) {
        let prose = matches!(place, Place::Comment | Place::Text | Place::Document);
        let lower = if prose {
            text.to_lowercase()
        } else {
            String::new()
        };
        for word in list.word.iter().filter(|word| word.r#in.contains(&place)) {
            for find in &word.find {
                if !prose {
                    found.extend((text == find).then_some((offset, &**find, &*word.r#use)));
                    continue;
                }
                // Lower case may change the length, so the place is approximate.
                let offsets = super::find_word(&lower, &find.to_lowercase());
                found.extend(offsets.into_iter().map(|at| {
                    let at = (offset + at).min(source.text.len());
                    let at = (0..=at).rev().find(|at| source.text.is_char_boundary(*at));
                    (at.unwrap_or(0), &**find, &*word.r#use)
                }));
            }
        }
    }
    found
}

/// Returns the names, comments and texts of a source, or the whole of a document.
fn pieces(source: &Source) -> Vec<Piece<'_>> {
    let is_document = source.path.ends_with(".md") && !source.path.ends_with(HISTORY);
    if is_document {
        return vec![(Place::Document, 0, &source.text)];
    }
    let Some(tokens) = source.is_rust().then(|| source.text.parse().ok()).flatten() else {
        return Vec::new();
    };
    let mut pieces = Vec::new();
    read(source, tokens, &mut pieces);
    pieces.extend(comments(source));
    pieces
}

/// Collects the names and string literals of a token stream.
fn read<'s>(source: &'s Source, tokens: TokenStream, pieces: &mut Vec<Piece<'s>>) {
    let mut before = String::new();
    for token in tokens {
        let span = token.span().byte_range();
        let text = &source.text[span.clone()];
        // A documentation comment is a token stream with the comment's place.
        if text.starts_with("//") || text.starts_with("/*") {
            continue;
        }
        match &token {
            TokenTree::Group(group) => read(source, group.stream(), pieces),
            TokenTree::Ident(_) => {
                pieces.push((Place::Name, span.start, text));
                match &*before {
                    "struct" | "enum" | "trait" | "union" | "type" => {
                        pieces.push((Place::Type, span.start, text));
                    }
                    "fn" => pieces.push((Place::Function, span.start, text)),
                    _ => {}
                }
            }
            TokenTree::Literal(_) if is_shipped_text(source, span.start, text) => {
                pieces.push((Place::Text, span.start, text));
            }
            _ => {}
        }
        before = token.to_string();
    }
}

/// Returns whether a literal at `offset` is a string outside tests.
fn is_shipped_text(source: &Source, offset: usize, text: &str) -> bool {
    let is_string = text.ends_with(['"', '#']);
    // Test modules are at the end of a file.
    let tests = source.code.find("#[cfg(test)]\nmod tests");
    is_string && !source.is_test() && tests.is_none_or(|tests| offset < tests)
}

/// Returns comments, one piece per line, as the text after `//`.
fn comments(source: &Source) -> Vec<Piece<'_>> {
    let mut offset = 0;
    let mut pieces = Vec::new();
    for line in source.text.split_inclusive('\n') {
        let is_comment = line.trim_start().starts_with("//");
        let at = match is_comment {
            true => line.find("//"),
            // After code: a URL in a string also has slashes, but no space after them.
            false => line.find(" // ").filter(|_| !line.contains('"')),
        };
        if let Some(at) = at {
            pieces.push((Place::Comment, offset + at, &line[at..]));
        }
        offset += line.len();
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(path: &str, text: &str, list: &str) -> Findings {
        let sources = [(LIST, list), (path, text)];
        judge(&sources.map(|(path, text)| Source::new(path, text.to_owned())))
    }

    const WORDS: &str = "[[word]]\nfind = [\"it\"]\nin = [\"name\"]\nuse = \"a noun\"\n\
        [[word]]\nfind = [\"Told\"]\nin = [\"type\"]\nuse = \"a noun\"\n\
        [[word]]\nfind = [\"put out\"]\nin = [\"comment\", \"text\", \"document\"]\nuse = \"emit\"\n";

    #[test]
    fn names_are_found_whole_and_where_they_are_defined() {
        let text = "fn f(its: Told) { g(|it| h!(it)); }\nstruct Told;\n";
        let found = found("a/src/b.rs", text, WORDS);
        let expected = [
            "a/src/b.rs:1: `it`: use a noun",
            "a/src/b.rs:1: `it`: use a noun",
            "a/src/b.rs:2: `Told`: use a noun",
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn prose_is_found_in_comments_texts_and_documents_in_any_case() {
        let text = "/// Put out.\nfn f() { g(\"is put out\"); } // put out\nfn put_out() {}\n\
                    #[cfg(test)]\nmod tests { fn f() { g(\"put out\"); } }\n";
        assert_eq!(found("a/src/b.rs", text, WORDS).len(), 2);
        assert_eq!(
            found("a/src/b.rs", "fn f() {} // it is put out\n", WORDS).len(),
            1
        );
        assert_eq!(
            found("docs/b.md", "It is\nput out, and output outright.", WORDS).len(),
            1
        );
        assert!(found("CHANGELOG.md", "put out", WORDS).is_empty());
        assert!(found("a/tests/b.rs", "fn f() { g(\"put out\") }", WORDS).is_empty());
    }

    #[test]
    fn an_exception_has_a_reason_and_is_needed() {
        let exception = |reason| {
            let head = "[[exception]]\nfile = \"docs/b.md\"\nfind = \"put out\"\nreason = ";
            format!("{WORDS}{head}\"{reason}\"\n")
        };
        assert!(found("docs/b.md", "put out", &exception("a quotation")).is_empty());
        assert_eq!(found("docs/b.md", "put out", &exception(" ")).len(), 1);
        let unneeded = found("docs/b.md", "output", &exception("a quotation"));
        assert!(unneeded[0].ends_with("is not needed"), "{unneeded:?}");
    }

    #[test]
    fn a_list_that_cannot_be_read_is_a_finding() {
        assert_eq!(found("docs/b.md", "", "[[word]]\nfind = 1").len(), 1);
    }
}
