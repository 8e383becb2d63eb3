//! Draws amplitudes in large digits that can be read from across the room.

/// Height of a digit, in rows.
pub const ROWS: usize = 5;

/// Returns a character of a number as five rows of three columns; `None` for any other character.
const fn rows(character: char) -> Option<[&'static str; ROWS]> {
    Some(match character {
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

/// Draws `number` in large digits, with its unit after the last row.
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
