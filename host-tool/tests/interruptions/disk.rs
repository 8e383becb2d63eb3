//! Tests of a disk that becomes full after a number of bytes.

use crate::program::{one_channel, test_folder};
use host_core::link::Port;
use host_core::record::{self, Disk, Recorder, Run};
use host_core::run::{RunError, SessionFile, begin_trial, run, simulated_port};
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Accepts `left` more bytes, then none.
#[derive(Clone, Debug)]
struct Full {
    left: Arc<AtomicUsize>,
}

struct FullFile {
    left: Arc<AtomicUsize>,
    file: std::fs::File,
}

impl Disk for Full {
    fn create(&self, path: &Path) -> io::Result<Box<dyn Write + Send>> {
        let left = Arc::clone(&self.left);
        let file = std::fs::File::create(path)?;
        Ok(Box::new(FullFile { left, file }))
    }
}

impl Write for FullFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let fits = bytes.len().min(self.left.load(Ordering::Relaxed));
        if fits == 0 && !bytes.is_empty() {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.left.fetch_sub(fits, Ordering::Relaxed);
        self.file.write_all(&bytes[..fits])?;
        Ok(fits)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Runs a session of 50 ms on a disk with room for `bytes`. Returns `None` if everything fits.
fn run_on(bytes: usize, file: &SessionFile, out: &Path) -> Option<()> {
    let disk = Full {
        left: Arc::new(AtomicUsize::new(bytes)),
    };
    let is_numbered = |error: &str| {
        assert!(error.contains("E582 cannot write"), "{bytes}: {error}");
        assert!(error.contains("is kept"), "{bytes}: {error}");
    };
    let trial = begin_trial(file);
    let mut recorder = match Recorder::create_on(Box::new(disk), out, 0, &trial) {
        Ok(recorder) => recorder,
        Err(error) => {
            is_numbered(&error.to_string());
            record::load(out).unwrap();
            return Some(());
        }
    };
    let boot = firmware::units::Micros::new(0);
    let device = Box::new(hal_sim::native::native(boot));
    let port = simulated_port(&file.session, 1, device, boot).unwrap();
    let (outcome, port) = run(file, port, Some(&mut recorder), |_| ());
    let mut port = port.unwrap();
    // The full disk led to a stop, not to host silence.
    let stopped_us = port.now_us();
    port.world.run_until(stopped_us + 60_000).unwrap();
    assert_eq!(port.world.recorder.trace.last_levels().0, 0, "{bytes}");
    let closed = recorder.finish(&outcome.trial.counters, outcome.trial.duration_s);
    let loaded = record::load(out).unwrap();
    assert!(loaded.ending.is_incomplete());
    let kept = &loaded.trials[0].samples;
    let mut expected_samples = outcome.trial.samples.clone();
    expected_samples.truncate(kept.len());
    assert_eq!(*kept, expected_samples, "{bytes}");
    match (outcome.error, closed) {
        (Some(error), _) => {
            assert!(matches!(error, RunError::Record(_)), "{bytes}: {error}");
            is_numbered(&error.to_string());
            assert!(kept.len() >= outcome.trial.samples.len().saturating_sub(1));
        }
        (None, Err(error)) => is_numbered(&error.to_string()),
        (None, Ok(())) => return None,
    }
    Some(())
}

/// Tries every byte at which the disk can become full in a short run.
#[test]
fn a_disk_that_fills_at_any_byte_stops_the_run_and_keeps_its_rows() {
    let text = one_channel(0.05, 2);
    let file = SessionFile::parse("short.toml", &text).unwrap();
    let out = test_folder("interruptions/disk");
    record::write_run(&out, &Run::default()).unwrap();
    let mut bytes = 0;
    while run_on(bytes, &file, &out).is_some() {
        bytes += 1;
    }
    println!("full at each of {bytes} bytes");
    assert!(bytes > 1_000, "{bytes}");
}
