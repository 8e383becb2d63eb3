//! Amplitudes that can be read from across the room.

/// Rows of a digit.
pub const ROWS: usize = 5;

/// A character as five rows of three columns; nothing for one that is not in a number.
const fn rows(of: char) -> Option<[&'static str; ROWS]> {
    Some(match of {
        '0' => ["███", "█ █", "█ █", "█ █", "███"],
        '1' => [" █ ", "██ ", " █ ", " █ ", "███"],
        '2' => ["███", "  █", "███", "█  ", "███"],
        '3' => ["███", "  █", "███", "  █", "███"],
        '4' => ["█ █", "█ █", "███", "  █", "  █"],
        '5' => ["███", "█  ", "███", "  █", "███"],
        '6' => ["███", "█  ", "███", "█ █", "███"],
        '7' => ["███", "  █", "  █", "  █", "  █"],
        '8' => ["███", "█ █", "███", "█ █", "███"],
        '9' => ["███", "█ █", "███", "  █", "███"],
        '.' => [" ", " ", " ", " ", "█"],
        _ => return None,
    })
}

/// `number` in big digits, and its unit behind the last row.
#[must_use]
pub fn big_number(number: &str, unit: &str) -> [String; ROWS] {
    let mut lines: [String; ROWS] = Default::default();
    for rows in number.chars().filter_map(rows) {
        for (line, row) in lines.iter_mut().zip(rows) {
            line.push_str(row);
            line.push(' ');
        }
    }
    if let Some(last) = lines.last_mut() {
        last.push(' ');
        last.push_str(unit);
    }
    lines
}
