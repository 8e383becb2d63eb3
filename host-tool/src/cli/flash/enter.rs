//! Entry of a running breadboard into its boot loader.

use super::pack;
use dfu::usb;
use firmware::link::Kind;
use firmware::link::message::HelloInfo;
use firmware::safety::State;
use host_core::link::{Connection, Interruption};
use host_core::run::{Board, DeviceName};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Longest wait for the boot loader after the request.
const LONGEST: Duration = Duration::from_secs(8);

/// Checks that the device is the breadboard `board`, idle and not used by another program.
///
/// # Errors
/// E808 if it is another device, or not idle.
pub fn check(device: &DeviceName, board: Board) -> anyhow::Result<()> {
    let port = device.connect()?;
    let (_, info) = Connection::open(port)?;
    examine(&info, board).map_err(|why| {
        anyhow::anyhow!(
            "E808 {device} {why}; give the right --board or --device, or start the boot loader by \
             hand ({}) and leave out --device",
            pack(board).boot_loader
        )
    })
}

/// Returns why the device cannot be asked to enter its boot loader, if so.
fn examine(info: &HelloInfo, board: Board) -> Result<(), String> {
    let name = info.board.as_str();
    if info.kind != Kind::Breadboard {
        return Err(format!(
            "is not a breadboard but {:?} {name}, which enters no boot loader on request",
            info.kind
        ));
    }
    if name != board.reported_name() {
        return Err(format!(
            "is the board {name}, not {}",
            board.reported_name()
        ));
    }
    let (measured, nominal) = (info.crystal_hz, board.pins().clocks.crystal_hz);
    if measured != 0 && measured.abs_diff(nominal) > nominal / 100 * 6 {
        return Err(format!(
            "measured a crystal of {measured} Hz, not {nominal} Hz"
        ));
    }
    if info.state != State::Idle {
        return Err(format!(
            "is {:?}, not Idle: stop it or acknowledge its fault",
            info.state
        ));
    }
    Ok(())
}

/// Asks the device to restart in its boot loader, and waits until a boot loader is connected.
///
/// # Errors
/// The refusals 326 and 327, E800 if no boot loader appears.
pub fn enter_boot_loader(
    device: &DeviceName,
    board: Board,
    interruption: &Interruption,
) -> anyhow::Result<()> {
    let port = device.connect()?;
    let (mut client, _) = Connection::open_interruptible(port, Some(interruption.clone()))?;
    client.enter_boot_loader()?;
    drop(client.into_port());
    let begin = Instant::now();
    while begin.elapsed() < LONGEST {
        sleep(Duration::from_millis(200));
        if usb::list().is_ok_and(|found| !found.is_empty()) {
            return Ok(());
        }
    }
    anyhow::bail!(
        "E800 the board restarted, but no boot loader appeared within {} s; {}",
        LONGEST.as_secs(),
        super::no_boot_loader(board)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::link::SCHEMA;
    use firmware::link::message::ResetCause;
    use firmware::safety::Stages;
    use firmware::units::Micros;

    fn hello() -> HelloInfo {
        HelloInfo {
            seq: 0,
            session: 1,
            schema: SCHEMA,
            version: [0, 1, 0],
            kind: Kind::Breadboard,
            unique_id: [1; 3],
            at: Micros::new(0),
            state: State::Idle,
            reset: ResetCause::PowerOn,
            last_fault: None,
            dead_time_us: 5,
            stages: Stages::Simulated { channels: 0x3FF },
            option_bytes: None,
            board: "weact-f405".try_into().unwrap(),
            crystal_hz: 8_010_000,
        }
    }

    #[test]
    fn only_the_named_breadboard_at_rest_is_asked() {
        assert_eq!(examine(&hello(), Board::Weact), Ok(()));
        assert!(
            examine(&hello(), Board::Feather)
                .unwrap_err()
                .contains("weact-f405")
        );
        let board = HelloInfo {
            kind: Kind::Board,
            ..hello()
        };
        assert!(
            examine(&board, Board::Weact)
                .unwrap_err()
                .contains("not a breadboard")
        );
        let busy = HelloInfo {
            state: State::Armed,
            ..hello()
        };
        assert!(examine(&busy, Board::Weact).unwrap_err().contains("Armed"));
        let crystal = HelloInfo {
            crystal_hz: 12_000_000,
            ..hello()
        };
        assert!(
            examine(&crystal, Board::Weact)
                .unwrap_err()
                .contains("12000000 Hz")
        );
    }
}
