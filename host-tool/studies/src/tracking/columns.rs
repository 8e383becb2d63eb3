//! Rows of the tables: numbers by name, of a [`super::campaign::Score`] or of
//! [`super::widened::Failures`].

use serde_json::Value;

/// A number of a `T`, by the name that tables give it.
pub(crate) type Column<T> = (&'static str, fn(&T) -> f64);

/// The columns' names, as the head of a CSV has them.
pub(crate) fn names<T>(columns: &[Column<T>]) -> String {
    columns.iter().map(|(name, _)| format!(",{name}")).collect()
}

/// The numbers of a row of it.
pub(crate) fn cells<T>(columns: &[Column<T>], of: &T) -> String {
    let cell = |(_, number): &Column<T>| format!(",{:.3}", number(of));
    columns.iter().map(cell).collect()
}

/// The numbers for machines.
pub(crate) fn add_to_json<T>(columns: &[Column<T>], of: &T, line: &mut Value) {
    for (name, number) in columns {
        line[*name] = number(of).into();
    }
}
