//! Checks of a TOML file against its declared fields.
//!
//! This module has the declarations of fields (`field`), tables of a file that know their place
//! (`table`), exact numbers (`decimal`), all errors for which a session or a wearer file is
//! refused, with their numbers (`error`), their presentation (`refused`), and the schema and manual
//! that are generated from declarations. Which fields a format has, and what they mean together, is
//! in `session` and `wearer`.
//!
//! Input: a text and declarations. Output: tables without errors, or all errors at once.

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
pub(crate) use file::{parse, read_text};
pub(crate) use manual::fields_as_markdown;
pub use refused::SessionError;
pub(crate) use schema::json_schema;
pub use visible::escape_control_chars;
