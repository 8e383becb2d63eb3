//! Columns of the tables: numbers by name, of a [`super::campaign::Score`] or of
//! [`super::widened::Failures`].

use serde_json::Value;

/// A column of a table: its name, and the function that returns its number from a `T`.
pub(crate) type Column<T> = (&'static str, fn(&T) -> f64);

/// Returns the names of the columns for the header of a CSV file, each preceded by a comma.
pub(crate) fn names<T>(columns: &[Column<T>]) -> String {
    columns.iter().map(|(name, _)| format!(",{name}")).collect()
}

/// Returns the numbers of one row for a CSV file, each preceded by a comma.
pub(crate) fn cells<T>(columns: &[Column<T>], row: &T) -> String {
    let cell = |(_, number): &Column<T>| format!(",{:.3}", number(row));
    columns.iter().map(cell).collect()
}

/// Adds the numbers of one row to a JSON object, under the names of their columns.
pub(crate) fn add_to_json<T>(columns: &[Column<T>], row: &T, line: &mut Value) {
    for (name, number) in columns {
        line[*name] = number(row).into();
    }
}
