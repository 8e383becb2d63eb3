//! Wiring picture of a board.

use super::packs::{Connection, Row, pack, rows};
use host_core::plot::canvas::standalone;
use host_core::plot::ink::{GRID, INK, MUTED, PALETTE, SHADE};
use host_core::plot::{Canvas, Color, Paint, Shape, Stroke, Words, words};
use host_core::run::Board;

/// Height of a row, and sizes of letters, CSS pixels.
const ROW: f64 = 22.0;
const LETTERS: f64 = 12.0;
const TITLE: f64 = 16.0;
/// Left and right edge of the board, and width of the picture, CSS pixels.
const BOARD: (f64, f64) = (250.0, 430.0);
const WIDTH: f64 = 820.0;
const TOP: f64 = 84.0;

const fn color(connection: Connection) -> Color {
    match connection {
        Connection::Output => PALETTE[0],
        Connection::Supply => PALETTE[1],
        Connection::Signal => PALETTE[2],
        Connection::Open => MUTED,
    }
}

/// Returns the picture as an SVG file: the board with the pins that Flexor uses, and what to connect
/// to each.
#[must_use]
pub fn picture(board: Board) -> String {
    let rows = rows(board);
    let mut canvas = Canvas::default();
    let bottom = TOP + ROW * rows.len() as f64;
    let height = bottom + 24.0 + 18.0 * pack(board).notes.len() as f64 * 2.0;
    let title = pack(board).title;
    canvas.text((16.0, 24.0), title, Words::new(TITLE, INK).bold());
    let warning = match board.pins().breadboard {
        Some(_) => super::warning(),
        None => {
            "output stages: nobody is connected before all of docs/reference/hardware.md is done"
                .into()
        }
    };
    canvas.text(
        (16.0, 48.0),
        &warning,
        Words::new(LETTERS, PALETTE[1]).bold(),
    );
    let (left, right) = BOARD;
    canvas.area((left, TOP - 12.0), (right, bottom), Paint::Full(SHADE));
    canvas.area((left, TOP - 12.0), (right, bottom), Paint::Ring(GRID, 1.0));
    for (n, row) in rows.iter().enumerate() {
        draw_row(&mut canvas, row, TOP + ROW * n as f64 + 4.0);
    }
    let mut y = bottom + 24.0;
    for note in pack(board).notes {
        for line in words::wrap_text(LETTERS, note, WIDTH - 32.0) {
            canvas.text((16.0, y), &line, Words::new(LETTERS, MUTED));
            y += 16.0;
        }
    }
    let description = format!("{title}: pins and what to connect to them");
    standalone(&canvas.svg((WIDTH, height), &description))
}

fn draw_row(canvas: &mut Canvas, row: &Row, y: f64) {
    let color = color(row.connection);
    let (left, right) = BOARD;
    let name = Words::new(LETTERS, INK);
    canvas.text((left - 14.0, y), &row.usage, name.right_aligned());
    let header = row.header.as_deref().unwrap_or("no header");
    canvas.text((left + 14.0, y), header, name.bold());
    canvas.text(
        (right - 14.0, y),
        &row.chip,
        Words::new(LETTERS, MUTED).right_aligned(),
    );
    if row.header.is_none() {
        return;
    }
    canvas.mark((right, y), Shape::Disc, 4.0, Paint::Full(color));
    if row.connection != Connection::Open {
        let wire = [(right, y), (right + 60.0, y)];
        canvas.line(&wire, Stroke { color, width: 2.0 });
    }
    canvas.text((right + 70.0, y), row.wire, Words::new(LETTERS, color));
}
