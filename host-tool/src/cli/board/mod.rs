//! `flexor board`: the boards for which there is an image, their pins, and access to their ports.

mod packs;
mod picture;

pub use packs::{header as header_name, pack};

use super::Output;
use super::chip::BoardName;
use clap::{Args, Subcommand};
use dfu::usb::UDEV_RULE;
use host_core::record::{DeviceKind, RecordError, check_writable};
use host_core::run::Board;
use packs::{Row, rows};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::PathBuf;

/// List boards, their pins and their wiring
#[derive(Args, Debug)]
pub struct BoardArgs {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand, Debug)]
enum Task {
    /// List the boards for which there is an image
    List,
    /// Show the pins of a board, what to connect to them, and how to start its boot loader
    Show(ShowArgs),
    /// Print the udev rules that let you open boards and boot loaders without root (Linux)
    Udev,
}

#[derive(Args, Debug)]
struct ShowArgs {
    /// weact, feather or reference
    #[arg(value_enum)]
    board: BoardName,
    /// Write a wiring picture to this file (SVG)
    #[arg(long)]
    svg: Option<PathBuf>,
    /// Replace an existing --svg file
    #[arg(long, requires = "svg")]
    overwrite: bool,
}

/// udev rule for the boards. ModemManager opens every serial port that may be a modem, which sends
/// bytes to the board.
const BOARD_RULE: &str = r#"# Flexor: /etc/udev/rules.d/60-flexor.rules
SUBSYSTEM=="tty", ATTRS{idVendor}=="1209", ATTRS{idProduct}=="0001", ATTRS{manufacturer}=="Flexor", TAG+="uaccess", ENV{ID_MM_DEVICE_IGNORE}="1""#;

/// # Errors
/// Fails if the picture cannot be written.
pub fn main(args: &BoardArgs, output: Output) -> anyhow::Result<()> {
    match &args.task {
        Task::List => list(output),
        Task::Show(args) => show(args, output),
        Task::Udev => {
            let rules = format!("{BOARD_RULE}\n{UDEV_RULE}\n");
            output.print(|| rules.trim_end().to_owned(), || json!({ "rules": rules }))
        }
    }
}

/// Returns the numbers of the channels that `board` has.
fn channels(board: Board) -> Vec<usize> {
    let lines = board.pins().outputs.channels;
    (0..lines.len())
        .filter(|&n| lines[n].is_some())
        .map(|n| n + 1)
        .collect()
}

fn list(output: Output) -> anyhow::Result<()> {
    let row = |board: Board| {
        let mhz = board.pins().clocks.crystal_mhz();
        let numbers: Vec<String> = channels(board).iter().map(ToString::to_string).collect();
        let kind = if board.pins().breadboard.is_some() {
            "breadboard"
        } else {
            "board"
        };
        let warning = match board.pins().breadboard {
            Some(_) => format!("\n           {}", DeviceKind::Breadboard.words()),
            None => String::new(),
        };
        format!(
            "{:<10} {kind:<11} {mhz:>3} MHz  channels {}\n           {}{warning}",
            board.name(),
            if numbers.len() == 10 {
                "1 to 10".to_owned()
            } else {
                numbers.join(", ")
            },
            pack(board).title
        )
    };
    output.print(
        || Board::ALL.map(row).join("\n"),
        || json!({ "boards": Board::ALL.map(to_json) }),
    )
}

fn to_json(board: Board) -> Value {
    let pins = board.pins();
    json!({
        "name": board.name(),
        "reported_name": board.reported_name(),
        "title": pack(board).title,
        "breadboard": pins.breadboard.is_some(),
        "crystal_hz": pins.clocks.crystal_hz,
        "channels": channels(board),
        "boot_loader": pack(board).boot_loader,
    })
}

fn show(args: &ShowArgs, output: Output) -> anyhow::Result<()> {
    let board = Board::from(args.board);
    if let Some(path) = &args.svg {
        check_writable(path, args.overwrite, &[], None)?;
        let written = std::fs::write(path, picture::picture(board));
        written.map_err(RecordError::write(path))?;
    }
    let rows = rows(board);
    output.print(
        || table(board, &rows),
        || {
            let pins = rows.iter().map(|row| {
            json!({ "use": row.usage, "chip": row.chip, "header": row.header, "connect": row.wire })
        });
            let mut board = to_json(board);
            board["pins"] = pins.collect();
            board
        },
    )
}

/// Returns the warning that every description of a breadboard begins with.
fn warning() -> String {
    format!("{}; never a person", DeviceKind::Breadboard.words())
}

/// Returns the pin table for people, at most 80 columns wide.
fn table(board: Board, rows: &[Row]) -> String {
    let mut text = format!("{}\n", pack(board).title);
    if board.pins().breadboard.is_some() {
        let _ = writeln!(text, "{}", warning());
    }
    let _ = writeln!(
        text,
        "\n{:<20} {:<6} {:<9} connect",
        "use", "chip", "header"
    );
    for row in rows {
        let header = row.header.as_deref().unwrap_or("none");
        let wire = if row.header.is_some() {
            row.wire
        } else {
            "not possible"
        };
        let _ = writeln!(text, "{:<20} {:<6} {header:<9} {wire}", row.usage, row.chip);
    }
    let _ = writeln!(text, "\nboot loader: {}", pack(board).boot_loader);
    for note in pack(board).notes {
        for (n, line) in host_core::plot::words::wrap_columns(note, 78)
            .lines()
            .enumerate()
        {
            let _ = writeln!(text, "{}{line}", if n == 0 { "- " } else { "  " });
        }
    }
    text.trim_end().to_owned()
}
