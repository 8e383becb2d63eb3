//! A TOML file held against its declared fields.
//!
//! Lives here: what a field may be (`field`), a table of a file that knows its place
//! (`table`), exact numbers (`decimal`), everything that a session or a wearer file is
//! refused for with its number (`error`) and how that is told (`refused`), schema and
//! manual made of declarations.
//! Not here: which fields a format has, and what they mean together (`session`,
//! `wearer`).
//! In: a text and declarations. Out: sound tables, or every mistake at once.

pub(crate) mod decimal;
pub(crate) mod document;
pub(crate) mod error;
pub(crate) mod field;
mod file;
mod manual;
mod refused;
mod schema;
pub(crate) mod table;
mod visible;

pub use error::Problem;
pub use field::LONGEST;
pub(crate) use file::{parse, text_of};
pub(crate) use manual::manual_of;
pub use refused::SessionError;
pub(crate) use schema::schema_of;
pub use visible::visible;
