//! Entry of a running breadboard into its boot loader.

use super::interrupt::EndedBySignal;
use super::{explain_usb, pack};
use dfu::flash::{DeviceSummary, Expected, FlashError};
use dfu::usb::{self, UsbError};
use firmware::link::Kind;
use firmware::link::message::HelloInfo;
use firmware::safety::State;
use host_core::link::{Connection, Interruption};
use host_core::run::{Board, DeviceName};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Longest wait for the boot loader after the request.
const LONGEST: Duration = Duration::from_secs(8);
/// Pause between two lists of the boot loaders.
const PAUSE: Duration = Duration::from_millis(200);

/// Running breadboard whose boot loader is to be started.
pub struct Running<'a> {
    device: &'a DeviceName,
    board: Board,
    /// Serial number of the boot loader, if the user gives it.
    serial: Option<&'a str>,
    unique_id: [u32; 3],
}

impl<'a> Running<'a> {
    /// Checks that the device is the breadboard `board`, idle and not used by another program, and
    /// that no other boot loader can be taken for the one that it starts.
    ///
    /// # Errors
    /// E808 if it is another device, or not idle; E801 if a boot loader is connected already.
    pub fn check(
        device: &'a DeviceName,
        board: Board,
        serial: Option<&'a str>,
    ) -> anyhow::Result<Self> {
        let port = device.connect()?;
        let (_, info) = Connection::open(port)?;
        let running = Self {
            device,
            board,
            serial,
            unique_id: info.unique_id,
        };
        running.examine(&info)?;
        // A list that fails is reported before the request.
        if let Ok(before) = usb::list() {
            running.expect_boot_loader(before)?;
        }
        Ok(running)
    }

    fn examine(&self, info: &HelloInfo) -> anyhow::Result<()> {
        let mut checked = examine(info, self.board);
        if checked.is_ok() && info.unique_id != self.unique_id {
            checked = Err("is another board than before the question".to_owned());
        }
        checked.map_err(|why| {
            anyhow::anyhow!(
                "E808 {} {why}; give the right --board or --device, or start the boot loader by \
                 hand ({}) and leave out --device",
                self.device,
                pack(self.board).boot_loader
            )
        })
    }

    fn expect_boot_loader(&self, before: Vec<DeviceSummary>) -> anyhow::Result<Expected> {
        let expected = Expected::new(self.unique_id, before, self.serial);
        expected.map_err(|error| explain_usb(&error.into(), self.board))
    }

    /// Asks the board to restart in its boot loader, waits until this boot loader is connected, and
    /// returns it. Checks again what [`Running::check`] checked.
    ///
    /// # Errors
    /// E801 and E808 as before; the refusals 326 and 327; E800 if no boot loader appears, E801 if
    /// only others do; E580.
    pub fn enter_boot_loader(&self, interruption: &Interruption) -> anyhow::Result<DeviceSummary> {
        let unasked = |error: anyhow::Error| match interruption.received_signal() {
            Some(signal) => {
                let when = "before the board was asked to restart; nothing was changed";
                EndedBySignal(signal, when.to_owned()).into()
            }
            None => error,
        };
        let port = self.device.connect()?;
        let opened = Connection::open_interruptible(port, Some(interruption.clone()));
        let (mut client, info) = opened.map_err(|error| unasked(error.into()))?;
        self.examine(&info)?;
        let before = usb::list().map_err(|error| explain_usb(&error, self.board))?;
        let expected = self.expect_boot_loader(before)?;
        client.enter_boot_loader()?;
        drop(client.into_port());
        self.await_boot_loader(&expected, LONGEST, interruption, &mut usb::list)
    }

    fn await_boot_loader(
        &self,
        expected: &Expected,
        longest: Duration,
        interruption: &Interruption,
        list: &mut dyn FnMut() -> Result<Vec<DeviceSummary>, UsbError>,
    ) -> anyhow::Result<DeviceSummary> {
        let begin = Instant::now();
        loop {
            if let Some(signal) = interruption.received_signal() {
                let when = "while the board restarted in its boot loader; nothing was written. Run \
                            the command again without --device, or press reset to start the old \
                            image";
                return Err(EndedBySignal(signal, when.to_owned()).into());
            }
            let selected = list().and_then(|now| Ok(expected.select(&now)?.clone()));
            let error = match selected {
                Ok(chosen) => return Ok(chosen),
                Err(error) => error,
            };
            if begin.elapsed() >= longest {
                return Err(self.explain_missing(&error, longest));
            }
            sleep(PAUSE);
        }
    }

    fn explain_missing(&self, error: &UsbError, longest: Duration) -> anyhow::Error {
        if matches!(error, UsbError::Unsuitable(FlashError::NoDevice)) {
            return anyhow::anyhow!(
                "E800 the board restarted, but no boot loader appeared within {} s; {}",
                longest.as_secs(),
                super::no_boot_loader(self.board)
            );
        }
        let explained = explain_usb(error, self.board);
        anyhow::anyhow!(
            "{explained}. The board restarted, and nothing was written: leave only its boot loader \
             connected, or give its --serial, and run the command again without --device"
        )
    }
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

    const DEVICE: DeviceName = DeviceName::Auto;

    fn running() -> Running<'static> {
        Running {
            device: &DEVICE,
            board: Board::Weact,
            serial: None,
            unique_id: [0x002D_0030, 0x3334_510B, 0x3231_3533],
        }
    }

    fn boot_loader(serial: &str, address: u8) -> DeviceSummary {
        DeviceSummary {
            serial: Some(serial.into()),
            bus: "1".into(),
            address,
        }
    }

    #[test]
    fn another_board_at_the_same_port_is_not_asked_to_restart() {
        let other = running().examine(&hello()).unwrap_err().to_string();
        assert!(
            other.contains("E808") && other.contains("another board"),
            "{other}"
        );
        let same = HelloInfo {
            unique_id: running().unique_id,
            ..hello()
        };
        assert!(running().examine(&same).is_ok());
        let busy = HelloInfo {
            state: State::Armed,
            ..same
        };
        assert!(running().examine(&busy).is_err());
    }

    #[test]
    fn only_the_boot_loader_of_the_restarted_board_is_written() {
        let running = running();
        let expected = Expected::new(running.unique_id, vec![], None).unwrap();
        let foreign = boot_loader("207A36915253", 4);
        let own = boot_loader("325E35633334", 5);
        let quiet = Interruption::default();
        let mut lists = vec![
            vec![foreign.clone(), own.clone()],
            vec![foreign.clone()],
            vec![],
        ];
        let mut list = || Ok(lists.pop().unwrap());
        let chosen = running.await_boot_loader(&expected, LONGEST, &quiet, &mut list);
        assert_eq!(chosen.unwrap(), own);
        let await_only = |found: Vec<DeviceSummary>, signal: &Interruption| {
            let mut list = || Ok(found.clone());
            let ended = running.await_boot_loader(&expected, Duration::ZERO, signal, &mut list);
            ended.unwrap_err().to_string()
        };
        let other = await_only(vec![foreign], &quiet);
        assert!(
            other.contains("E801") && other.contains("207A36915253"),
            "{other}"
        );
        assert!(other.contains("nothing was written"), "{other}");
        let none = await_only(vec![], &quiet);
        assert!(none.contains("E800 the board restarted"), "{none}");
        let signal = Interruption::default();
        signal.raise_signal(host_core::link::Signal::Interrupt);
        let ended = await_only(vec![own], &signal);
        assert!(
            ended.contains("E580 SIGINT came while the board restarted"),
            "{ended}"
        );
    }
}
