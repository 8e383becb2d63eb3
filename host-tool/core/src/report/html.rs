//! Markup of a page, into which text is only inserted after escaping.

use crate::plot::canvas::{Svg, escape};
use std::borrow::Cow;
use std::fmt;
use std::ops::{Add, AddAssign};

/// Markup for a page; it is not escaped again when it is inserted.
///
/// It is made from the program's own literals in [`html!`](crate::html), from figures, and from
/// texts that are escaped on insertion. No `String` becomes markup without escaping.
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub struct Html(String);

/// A value that may fill a placeholder of [`html!`](crate::html).
pub trait Piece {
    /// Returns the value as markup. A text is escaped; markup is returned unchanged.
    fn markup(&self) -> Cow<'_, str>;
}

/// Creates markup from a literal, in which each `{}` stands for a [`Piece`]. The literal must not
/// contain names of variables, which would be inserted without escaping.
#[macro_export]
macro_rules! html {
    ($form:literal $(, $piece:expr)* $(,)?) => {
        $crate::report::Html::filled(::core::format_args!(
            ::core::concat!($form)
            $(, $crate::report::Piece::markup(&$piece))*
        ))
    };
}

impl Html {
    /// Fills the literal of [`html!`](crate::html) with values that are already escaped. Only that
    /// macro may call this function.
    #[doc(hidden)]
    #[must_use]
    pub fn filled(parts: fmt::Arguments<'_>) -> Self {
        Self(parts.to_string())
    }

    /// Converts a text into markup by escaping it.
    #[must_use]
    pub fn text(text: &str) -> Self {
        Self(escape(text))
    }

    /// Returns whether there is no markup, so that a page can leave the part out.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the markup as a text, for writing it to a file.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Joins pieces of markup. `separator` is a text that is escaped and inserted between them.
    #[must_use]
    pub fn joined(parts: impl IntoIterator<Item = Self>, separator: &str) -> Self {
        let parts: Vec<String> = parts.into_iter().map(|part| part.0).collect();
        Self(parts.join(&escape(separator)))
    }
}

impl Piece for str {
    fn markup(&self) -> Cow<'_, str> {
        Cow::Owned(escape(self))
    }
}

impl Piece for String {
    fn markup(&self) -> Cow<'_, str> {
        self.as_str().markup()
    }
}

impl Piece for Html {
    fn markup(&self) -> Cow<'_, str> {
        Cow::Borrowed(&self.0)
    }
}

impl Piece for Svg {
    fn markup(&self) -> Cow<'_, str> {
        Cow::Borrowed(self)
    }
}

impl<T: Piece + ?Sized> Piece for &T {
    fn markup(&self) -> Cow<'_, str> {
        (**self).markup()
    }
}

macro_rules! numbers {
    ($($number:ty)*) => {
        $(impl Piece for $number {
            fn markup(&self) -> Cow<'_, str> {
                Cow::Owned(self.to_string())
            }
        })*
    };
}

numbers! { u8 u64 usize }

impl From<&str> for Html {
    fn from(text: &str) -> Self {
        Self::text(text)
    }
}

impl From<String> for Html {
    fn from(text: String) -> Self {
        Self::text(&text)
    }
}

impl Add for Html {
    type Output = Self;

    fn add(mut self, other: Self) -> Self {
        self += other;
        self
    }
}

impl AddAssign for Html {
    fn add_assign(&mut self, other: Self) {
        self.0.push_str(&other.0);
    }
}

impl FromIterator<Html> for Html {
    fn from_iter<I: IntoIterator<Item = Html>>(parts: I) -> Self {
        Self(parts.into_iter().map(|part| part.0).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EVIL: &str = "\"><img src=x onerror=alert(1)>&";

    #[test]
    fn text_is_escaped_once_and_markup_is_not() {
        let cell = html!("<td>{}</td>", EVIL);
        let row = html!("<tr>{}{}</tr>", cell, Html::from(EVIL.to_owned()));
        let text = "&quot;&gt;&lt;img src=x onerror=alert(1)&gt;&amp;";
        assert_eq!(row.as_str(), format!("<tr><td>{text}</td>{text}</tr>"));
        let sequence = Html::joined([Html::text("a"), html!("<b>{}</b>", 7_u64)], " < ");
        assert_eq!(sequence.as_str(), "a &lt; <b>7</b>");
    }
}
