//! The log that a debug probe would show: the steps of the boot, verdicts and faults, each with its
//! time.

use super::{image, powered};
use crate::chip_faults::{Bench, spec};
use firmware::link::Request;
use hal_sim::chip::rtt::Log;
use host_core::run::Board;
use std::io::{self, Write};
use std::sync::{Arc, Mutex};
use tests::desk;

#[derive(Clone, Default)]
struct Lines(Arc<Mutex<Vec<u8>>>);

impl Write for Lines {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

struct Logged {
    bench: Bench,
    log: Log,
    lines: Lines,
}

impl Logged {
    fn boot(board: Board) -> Self {
        let lines = Lines::default();
        let (bench, _) = Bench::boot_and_greet(powered(board));
        let log = Log::new(&image(board), Box::new(lines.clone())).unwrap();
        Self { bench, log, lines }
    }

    /// Returns the new lines, each as its time, s, its level and its text.
    fn take(&mut self) -> Vec<(f64, String, String)> {
        self.log
            .drain(&mut self.bench.board.around.soc.ram)
            .unwrap();
        let bytes = std::mem::take(&mut *self.lines.0.lock().unwrap());
        let text = String::from_utf8(bytes).unwrap();
        text.lines()
            .map(|line| {
                let (time, rest) = line.trim_start().split_once(' ').unwrap();
                let (level, text) = rest.split_once(' ').unwrap();
                (time.parse().unwrap(), level.into(), text.trim().into())
            })
            .collect()
    }

    fn texts(&mut self) -> Vec<String> {
        self.take().into_iter().map(|line| line.2).collect()
    }
}

#[test]
fn the_boot_is_logged_step_by_step() {
    for board in Board::ALL {
        let mut logged = Logged::boot(board);
        let lines = logged.take();
        let texts: Vec<&str> = lines.iter().map(|line| line.2.as_str()).collect();
        assert_eq!(
            [texts[0], texts[2], texts[3]],
            [
                format!("{}: reset cause power on", board.reported_name()).as_str(),
                "the core runs at 168 MHz",
                "device time and tape run",
            ]
        );
        assert!(texts[1].starts_with("crystal "), "{texts:?}");
        assert!(lines.iter().all(|line| line.1 == "info"), "{lines:?}");
        // The cycle counter starts after the RAM test, and device time with the last line.
        let times: Vec<f64> = lines.iter().map(|line| line.0).collect();
        println!("{}: {times:?}", board.name());
        assert!(times[0] < times[1] && times[1] < times[2], "{times:?}");
        assert!(times[2] < 0.3 && times[3] < 0.001, "{times:?}");
    }
}

#[test]
fn verdicts_and_faults_are_logged_with_their_time() {
    let mut logged = Logged::boot(Board::Reference);
    logged.take();
    let refused = logged.bench.refusal(desk::ARM).unwrap();
    let expected = format!("refused with {}: {}", refused.0, refused.1);
    assert_eq!(logged.texts(), [expected]);
    logged.bench.send(Request::Wearer(desk::wearer(100)));
    let spec = spec(0);
    logged.bench.send(Request::Channel { channel: 0, spec });
    logged.bench.send(desk::ARM);
    logged.bench.run_us(60_000);
    assert_eq!(logged.texts(), ["armed"]);
    logged.bench.sensors.over_current = true;
    let at_us = logged.bench.board.now_us();
    logged.bench.run_us(5_000);
    let lines = logged.take();
    let (time, level, text) = &lines[0];
    assert!(text.starts_with("fault 6, detail 0"), "{lines:?}");
    assert_eq!(level, "error");
    let late = time - at_us as f64 / 1e6;
    assert!((0.0..0.005).contains(&late), "{late} s");
}
