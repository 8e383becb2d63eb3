//! Rule against documentation comments that repeat the name and type below them.
//!
//! In: all sources. Out: comments whose words, apart from stop words, all occur in the item's name
//! or type, as `file:line`.

use super::Findings;
use super::source::Source;
use quote::ToTokens;
use std::collections::BTreeSet;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{Attribute, Expr, ExprLit, Lit, Meta};

/// Words without meaning of their own.
#[rustfmt::skip]
const STOP_WORDS: [&str; 64] = [
    "a", "all", "an", "and", "any", "are", "as", "at", "be", "been", "but", "by", "can", "do",
    "does", "each", "either", "every", "for", "from", "given", "has", "have", "here", "how", "if",
    "in", "into", "is", "it", "its", "may", "no", "nor", "not", "of", "on", "one", "or", "other",
    "own", "per", "so", "such", "than", "that", "the", "their", "them", "then", "there", "these",
    "this", "those", "to", "was", "what", "when", "where", "which", "who", "whose", "with", "would",
];

/// Returns the comments of a source that repeat their items.
pub(super) fn judge(source: &Source) -> Findings {
    if !source.is_rust() {
        return Findings::new();
    }
    let Ok(file) = syn::parse_file(&source.text) else {
        return Findings::new();
    };
    let mut comments = Comments {
        source,
        findings: Findings::new(),
    };
    comments.visit_file(&file);
    comments.findings
}

/// Visitor of every documented item.
struct Comments<'s> {
    source: &'s Source,
    findings: Findings,
}

impl Comments<'_> {
    /// Judges the comment among `attributes` of an item whose name and type are `parts`.
    fn look(&mut self, attributes: &[Attribute], parts: &[&dyn ToTokens]) {
        let mut comments = attributes
            .iter()
            .filter_map(|attribute| Some((attribute, comment(attribute)?)))
            .peekable();
        let Some((first, _)) = comments.peek() else {
            return;
        };
        let line = first.span().start().line;
        let text: String = comments.map(|(_, text)| text + "\n").collect();
        let item: String = parts
            .iter()
            .map(|part| part.to_token_stream().to_string() + " ")
            .collect();
        if stems(&text).is_subset(&stems(&item)) {
            let text = text.trim();
            self.findings
                .push(format!("{}:{line}: {text}", self.source.path));
        }
    }
}

/// Returns the text of a documentation comment.
fn comment(attribute: &Attribute) -> Option<String> {
    let Meta::NameValue(pair) = &attribute.meta else {
        return None;
    };
    let Expr::Lit(ExprLit {
        lit: Lit::Str(text),
        ..
    }) = &pair.value
    else {
        return None;
    };
    pair.path.is_ident("doc").then(|| text.value())
}

/// Returns the words of a comment, or of names in snake or camel case, without stop words and
/// endings.
fn stems(text: &str) -> BTreeSet<String> {
    let mut spaced = String::new();
    let mut before = ' ';
    for letter in text.replace("'s", "").chars() {
        if letter.is_uppercase() && before.is_lowercase() {
            spaced.push(' ');
        }
        spaced.push(letter);
        before = letter;
    }
    spaced
        .to_lowercase()
        .split(|letter: char| !letter.is_alphanumeric())
        .filter(|word| !word.is_empty() && !STOP_WORDS.contains(word))
        .map(stem)
        .collect()
}

/// Removes the ending of a plural or verb form.
fn stem(word: &str) -> String {
    let ending = ["ing", "ed", "es", "s"]
        .into_iter()
        .find(|ending| word.len() > ending.len() + 2 && word.ends_with(ending));
    let stem = ending.map_or(word, |ending| &word[..word.len() - ending.len()]);
    stem.trim_end_matches('e').to_owned()
}

impl<'ast> Visit<'ast> for Comments<'_> {
    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        self.look(&item.attrs, &[&item.sig]);
        visit::visit_item_fn(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        self.look(&item.attrs, &[&item.sig]);
        visit::visit_impl_item_fn(self, item);
    }

    fn visit_trait_item_fn(&mut self, item: &'ast syn::TraitItemFn) {
        self.look(&item.attrs, &[&item.sig]);
        visit::visit_trait_item_fn(self, item);
    }

    fn visit_item_struct(&mut self, item: &'ast syn::ItemStruct) {
        self.look(&item.attrs, &[&item.ident]);
        visit::visit_item_struct(self, item);
    }

    fn visit_item_enum(&mut self, item: &'ast syn::ItemEnum) {
        self.look(&item.attrs, &[&item.ident]);
        visit::visit_item_enum(self, item);
    }

    fn visit_item_trait(&mut self, item: &'ast syn::ItemTrait) {
        self.look(&item.attrs, &[&item.ident]);
        visit::visit_item_trait(self, item);
    }

    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        self.look(&item.attrs, &[&item.ident]);
        visit::visit_item_mod(self, item);
    }

    fn visit_item_type(&mut self, item: &'ast syn::ItemType) {
        self.look(&item.attrs, &[&item.ident, &item.ty]);
        visit::visit_item_type(self, item);
    }

    fn visit_item_const(&mut self, item: &'ast syn::ItemConst) {
        self.look(&item.attrs, &[&item.ident, &item.ty]);
        visit::visit_item_const(self, item);
    }

    fn visit_item_static(&mut self, item: &'ast syn::ItemStatic) {
        self.look(&item.attrs, &[&item.ident, &item.ty]);
        visit::visit_item_static(self, item);
    }

    fn visit_impl_item_const(&mut self, item: &'ast syn::ImplItemConst) {
        self.look(&item.attrs, &[&item.ident, &item.ty]);
        visit::visit_impl_item_const(self, item);
    }

    fn visit_trait_item_const(&mut self, item: &'ast syn::TraitItemConst) {
        self.look(&item.attrs, &[&item.ident, &item.ty]);
        visit::visit_trait_item_const(self, item);
    }

    fn visit_trait_item_type(&mut self, item: &'ast syn::TraitItemType) {
        self.look(&item.attrs, &[&item.ident]);
        visit::visit_trait_item_type(self, item);
    }

    fn visit_field(&mut self, item: &'ast syn::Field) {
        self.look(&item.attrs, &[&item.ident, &item.ty]);
        visit::visit_field(self, item);
    }

    fn visit_variant(&mut self, item: &'ast syn::Variant) {
        self.look(&item.attrs, &[&item.ident, &item.fields]);
        visit::visit_variant(self, item);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(text: &str) -> usize {
        judge(&Source::new("a/src/b.rs", text.to_owned())).len()
    }

    #[test]
    fn a_comment_that_repeats_its_item_is_found() {
        assert_eq!(found("/// The seed.\nconst SEED: u64 = 1;"), 1);
        assert_eq!(found("/// Whose.\nstruct Wearer;"), 1);
        assert_eq!(
            found("struct A {\n    /// Of the phases.\n    phase_us: u32,\n}"),
            1
        );
        assert_eq!(
            found("enum A {\n    /// A wearer's fault.\n    WearerFault,\n}"),
            1
        );
        assert_eq!(
            found("impl A {\n    /// Counts pulses.\n    fn pulse_count(&self) {}\n}"),
            1
        );
    }

    #[test]
    fn a_comment_that_adds_a_meaning_unit_or_range_is_not() {
        assert_eq!(
            found("/// Seed of the random draws.\nconst SEED: u64 = 1;"),
            0
        );
        assert_eq!(found("/// Width, 10–500.\nconst WIDTH: u64 = 1;"), 0);
        assert_eq!(found("/// Width, µs.\nconst WIDTH: u64 = 1;"), 0);
        assert_eq!(found("const WIDTH: u64 = 1;"), 0);
        assert_eq!(found("not rust at all"), 0);
    }
}
