//! `flexor flash` and `flexor image`: images of the boards, into the chip or into a file.

mod enter;
mod image;

use super::board::pack;
use super::chip::BoardName;
use super::interrupt::{self, EndedBySignal};
use super::{Output, usage_error};
use clap::{ArgGroup, Args};
use dfu::chip::STM32F405;
use dfu::flash::{
    ChipState, DeviceSummary, Finish, FlashError, FlashFailure, Progress, Report, Stage,
    flash_until, select_device,
};
use dfu::protocol::{Clock, Session, Transport};
use dfu::simulated::{Simulated, SimulatedClock};
use dfu::usb::{self, UsbError};
use enter::Running;
use host_core::link::Interruption;
use host_core::record::check_writable;
use host_core::run::{Board, DeviceName};
use image::{BoardImage, Format, load};
use serde_json::json;
use std::io::{BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

/// Write an image into a board over USB, without a debug probe
///
/// The chip's own boot loader writes it. A breadboard that runs enters the boot loader by itself
/// (--device); otherwise use the board's buttons: flexor board show BOARD.
#[derive(Args, Debug)]
pub struct FlashArgs {
    /// Board that is connected
    #[arg(long, value_enum)]
    board: BoardName,
    /// Port of the running breadboard, or auto; without it, the boot loader must be running
    #[arg(long)]
    device: Option<DeviceName>,
    /// Serial number of the boot loader, if several are connected
    #[arg(long)]
    serial: Option<String>,
    /// File to write instead of the board's own image: ELF, .bin, .hex or .dfu
    #[arg(long)]
    file: Option<PathBuf>,
    /// Write without asking
    #[arg(long)]
    yes: bool,
    /// Write into a simulated boot loader, to try the command; nothing is connected or changed
    #[arg(long, conflicts_with_all = ["device", "serial"])]
    simulated: bool,
}

/// Write an image into files, for other tools
///
/// Give one or several of --bin, --hex and --dfu.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("file").multiple(true).args(["bin", "hex", "dfu"])))]
pub struct ImageArgs {
    /// Board whose image it is
    #[arg(long, value_enum)]
    board: BoardName,
    /// Raw binary for address 0x08000000
    #[arg(long)]
    bin: Option<PathBuf>,
    /// Intel HEX
    #[arg(long)]
    hex: Option<PathBuf>,
    /// DfuSe file, for dfu-util and ST's tools
    #[arg(long)]
    dfu: Option<PathBuf>,
    /// Replace an existing file
    #[arg(long, requires = "file")]
    overwrite: bool,
}

/// # Errors
/// Fails if the image cannot be built, or a file cannot be written.
pub fn image_main(args: &ImageArgs, output: Output) -> anyhow::Result<()> {
    let image = load(args.board.into(), None)?;
    let wanted = [
        (Format::Binary, &args.bin),
        (Format::Hex, &args.hex),
        (Format::Dfuse, &args.dfu),
    ];
    let files: Vec<(Format, &Path)> = wanted
        .iter()
        .filter_map(|(format, path)| Some((*format, path.as_deref()?)))
        .collect();
    for (n, (_, path)) in files.iter().enumerate() {
        if files.iter().take(n).any(|(_, other)| other == path) {
            return usage_error(format!(
                "{} is to have two formats; give each its own file",
                path.display()
            ));
        }
        check_writable(path, args.overwrite, &[], None)?;
    }
    for (format, path) in &files {
        image.write(*format, path)?;
    }
    let names: Vec<String> = files.iter().map(|(_, p)| p.display().to_string()).collect();
    output.print(
        || {
            let mut lines = vec![image.describe(), format!("from {}", image.source.display())];
            lines.extend(names.iter().map(|name| format!("written to {name}")));
            lines.join("\n")
        },
        || {
            json!({
                "board": image.record.board_name(),
                "version": image.record.version,
                "commit": image.commit(),
                "schema": format!("{:#018x}", image.record.schema),
                "crystal_hz": image.record.crystal_hz,
                "bytes": image.image.bytes().len(),
                "source": image.source,
                "files": names,
            })
        },
    )
}

/// # Errors
/// E800 to E809: no boot loader, another chip, an unsuitable image, read protection, a lost board;
/// the message says what the chip holds then.
pub fn main(args: &FlashArgs, output: Output) -> anyhow::Result<()> {
    let board = Board::from(args.board);
    let image = load(board, args.file.as_deref())?;
    if args.simulated {
        let clock = SimulatedClock::default();
        let device = Simulated::new(clock.clone());
        let size = device.transfer_size();
        let mut session = Session::new(device, clock, size, STM32F405.firmware());
        let report = write(
            &mut session,
            &image,
            board,
            output,
            &Interruption::default(),
        )?;
        return print(&image, &report, true, output);
    }
    let serial = args.serial.as_deref();
    let target = match &args.device {
        Some(device) => Target::Running(Running::check(device, board, serial)?),
        None => Target::BootLoader(connected(board, serial)?),
    };
    if !args.yes && !ask(&image, &target)? {
        return usage_error("nothing was written; answer y to the question, or give --yes");
    }
    // Only now: until the answer, a signal ends the program at once and nothing has changed.
    let interruption = interrupt::catch_signals()?;
    let chosen = match target {
        Target::Running(running) => running.enter_boot_loader(&interruption)?,
        Target::BootLoader(chosen) => chosen,
    };
    let session = usb::open(&STM32F405, &chosen);
    let mut session = session.map_err(|error| explain_usb(&error, board))?;
    let report = write(&mut session, &image, board, output, &interruption)?;
    print(&image, &report, false, output)
}

/// Chip that is written.
enum Target<'a> {
    /// The boot loader that this board is asked to start.
    Running(Running<'a>),
    /// A board whose boot loader runs already.
    BootLoader(DeviceSummary),
}

/// Returns the only boot loader, or the one with this serial number.
fn connected(board: Board, serial: Option<&str>) -> anyhow::Result<DeviceSummary> {
    let explain = |error| explain_usb(&error, board);
    let devices = usb::list().map_err(explain)?;
    let chosen = select_device(&devices, serial);
    Ok(chosen.map_err(|error| explain(error.into()))?.clone())
}

/// Asks the user at the terminal.
fn ask(image: &BoardImage, target: &Target<'_>) -> anyhow::Result<bool> {
    if !std::io::stdin().is_terminal() {
        return usage_error("writing needs your permission; use a terminal, or give --yes");
    }
    let target = match target {
        Target::Running(_) => "The board restarts in its boot loader.".to_owned(),
        Target::BootLoader(chosen) => format!("Boot loader: {}.", chosen.label()),
    };
    eprint!(
        "{target}\n\
         Disconnect every person, LED supply and output stage first.\n\
         Write {}? y/N: ",
        image.describe()
    );
    std::io::stderr().flush()?;
    let mut line = String::new();
    std::io::stdin().lock().read_line(&mut line)?;
    Ok(line.trim().eq_ignore_ascii_case("y"))
}

/// Writes the image, with progress. A signal ends it between two operations.
fn write<T: Transport, C: Clock>(
    session: &mut Session<T, C>,
    image: &BoardImage,
    board: Board,
    output: Output,
    interruption: &Interruption,
) -> anyhow::Result<Report> {
    let bar = output.bar("erasing");
    // Erasing takes about half of the time, writing and reading back a quarter each.
    let mut shown = |progress: Progress| {
        let part = f64::from(progress.done) / f64::from(progress.total.max(1));
        bar.set(match progress.stage {
            Stage::Erase => 0.5 * part,
            Stage::Write => 0.5 + 0.25 * part,
            Stage::Verify => 0.75 + 0.25 * part,
        });
    };
    let is_interrupted = || interruption.received_signal().is_some();
    let finish = Finish::Reset;
    let done = flash_until(session, &image.image, finish, &mut shown, &is_interrupted);
    bar.finish();
    done.map_err(|failure| match interruption.received_signal() {
        Some(signal) if failure.error == FlashError::Interrupted => {
            EndedBySignal(signal, interrupted_at(failure.chip).to_owned()).into()
        }
        _ => explain(&failure, board),
    })
}

/// Says when the signal came that ended writing, and how to go on.
const fn interrupted_at(chip: ChipState) -> &'static str {
    match chip {
        ChipState::Unchanged => {
            "before anything was written: the chip holds its old image. The boot loader still runs: \
             run the command again without --device, or press reset to start the old image"
        }
        _ => {
            "while the image was written: the chip holds no complete image, and starts none. The \
             boot loader still runs: run the command again without --device"
        }
    }
}

fn print(
    image: &BoardImage,
    report: &Report,
    is_simulated: bool,
    output: Output,
) -> anyhow::Result<()> {
    let (place, end) = match is_simulated {
        true => (
            " in a simulated boot loader",
            "no board was connected or changed",
        ),
        false => ("", report.ending.instruction()),
    };
    output.print(
        || {
            let sectors = report.sectors.len();
            format!(
                "{}\nwritten and verified{place}, {sectors} sectors\n{end}",
                image.describe()
            )
        },
        || {
            json!({
                "board": image.record.board_name(),
                "version": image.record.version,
                "commit": image.commit(),
                "schema": format!("{:#018x}", image.record.schema),
                "bytes": report.bytes,
                "sectors": report.sectors.iter().map(|s| s.number).collect::<Vec<_>>(),
                "transfers": report.transfers,
                "simulated": is_simulated,
                "message": end,
            })
        },
    )
}

/// Returns the number of the error for `error`.
const fn number(error: &FlashError) -> &'static str {
    match error {
        FlashError::NoDevice => "E800",
        FlashError::SeveralDevices { .. }
        | FlashError::AlreadyConnected { .. }
        | FlashError::UnknownSerial { .. } => "E801",
        FlashError::OtherChip { .. }
        | FlashError::Unsupported { .. }
        | FlashError::MissingCommand { .. } => "E802",
        FlashError::Image(_) => "E803",
        FlashError::ReadProtected { .. } => "E805",
        FlashError::Unplugged { .. } => "E806",
        FlashError::NotErased { .. }
        | FlashError::Mismatch { .. }
        | FlashError::Interrupted
        | FlashError::Protocol(_) => "E807",
    }
}

/// Causes and alternatives when the boot loader does not appear, or not reliably.
fn no_boot_loader(board: Board) -> String {
    // On the Feather, parts hold the pins of the other protocols: PB5 low, PB11, PC11 and PA10 high.
    let causes = match board {
        Board::Feather => "(reset again; the Feather often needs several tries)",
        Board::Weact | Board::Reference => {
            "(reset again), or if noise on open pins starts another protocol (10 kOhm from PB5, \
             PB11, PC11 and PA10 to 3.3 V helps)"
        }
    };
    format!(
        "to start it: {}. It does not start if the crystal is missing or slow {causes}. Other ways: \
         USART1 with BOOT0 high, or a debug probe with flexor image --hex",
        pack(board).boot_loader
    )
}

fn explain(failure: &FlashFailure, board: Board) -> anyhow::Error {
    let number = number(&failure.error);
    let more = match failure.error {
        FlashError::NoDevice => format!("; {}", no_boot_loader(board)),
        _ => String::new(),
    };
    anyhow::anyhow!("{number} {}{more}. {}", failure.error, failure.chip)
}

fn explain_usb(error: &UsbError, board: Board) -> anyhow::Error {
    match error {
        UsbError::Unsuitable(error) => {
            let more = match error {
                FlashError::NoDevice => format!("; {}", no_boot_loader(board)),
                _ => String::new(),
            };
            anyhow::anyhow!("{} {error}{more}", number(error))
        }
        other => anyhow::anyhow!("E809 {other}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::link::Signal;

    #[test]
    fn a_missing_boot_loader_names_causes_and_other_ways() {
        let explained = |board| explain_usb(&FlashError::NoDevice.into(), board).to_string();
        let [feather, weact] = [Board::Feather, Board::Weact].map(explained);
        for word in ["E800", "B0", "crystal", "USART1", "probe"] {
            assert!(feather.contains(word), "{word}: {feather}");
            assert!(weact.contains(word), "{word}: {weact}");
        }
        assert!(weact.contains("PB11"), "{weact}");
        assert!(feather.contains("tries"), "{feather}");
        assert!(
            !feather.contains("10 kOhm"),
            "parts hold the pins: {feather}"
        );
    }

    #[test]
    fn a_signal_before_writing_ends_it_and_says_how_to_go_on() {
        let mut bytes = vec![0xFF; 400];
        bytes[..8].copy_from_slice(&[0, 0xC0, 1, 0x20, 0x89, 0, 0, 8]);
        let segments = [dfu::container::Segment {
            address: STM32F405.origin,
            bytes,
        }];
        let image = BoardImage {
            image: dfu::flash::Image::new(&STM32F405, &segments).unwrap(),
            record: firmware::board::image::ImageRecord {
                board: [0; 16],
                version: [0, 1, 0],
                kind: 1,
                crystal_hz: 0,
                schema: 0,
                origin: STM32F405.origin,
                sum_at: 0,
                commit: [0; 8],
            },
            source: PathBuf::new(),
        };
        let clock = SimulatedClock::default();
        let device = Simulated::new(clock.clone());
        let mut session = Session::new(device, clock, 2048, STM32F405.firmware());
        let interruption = Interruption::default();
        interruption.raise_signal(Signal::Interrupt);
        let output = Output { json: false };
        let ended = write(&mut session, &image, Board::Weact, output, &interruption).unwrap_err();
        assert_eq!(interrupt::ending_signal(&ended), Some(Signal::Interrupt));
        let text = ended.to_string();
        assert!(text.contains("E580 SIGINT came before anything"), "{text}");
        assert!(text.contains("boot loader still runs"), "{text}");
        let device = session.into_transport();
        assert!(device.erased.is_empty() && device.written.is_empty());
    }
}
