//! Disks that become full after a number of bytes: stimulation ends first, and no result is lost.

use super::scene::*;
use hal_sim::body::bench::SensorSpec;
use host_core::calibration::{Auto, Files, OnDisk, journal_path};
use std::cell::Cell;
use std::io::{self, Write};
use std::path::Path;
use std::rc::Rc;

/// A disk that accepts `left` more bytes.
#[derive(Clone)]
struct Full {
    left: Rc<Cell<usize>>,
}

struct FullFile {
    left: Rc<Cell<usize>>,
    file: Box<dyn Write>,
}

impl Write for FullFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let fits = bytes.len().min(self.left.get());
        if fits == 0 && !bytes.is_empty() {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.left.set(self.left.get() - fits);
        self.file.write_all(&bytes[..fits])?;
        Ok(fits)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Files for Full {
    fn append(&self, path: &Path) -> io::Result<Box<dyn Write>> {
        let (left, file) = (Rc::clone(&self.left), OnDisk.append(path)?);
        Ok(Box::new(FullFile { left, file }))
    }

    fn replace(&self, path: &Path, text: &str) -> io::Result<()> {
        if text.len() > self.left.get() {
            return Err(io::ErrorKind::StorageFull.into());
        }
        OnDisk.replace(path, text)
    }
}

#[test]
fn a_full_disk_ends_stimulation_first_and_leaves_everything_whole() {
    let order = plan_with_electrodes(2);
    let folder = folder("disk");
    let (_, _, reference) = run_whole_calibration(&order, &folder.join("reference.toml"));
    let out = folder.join("w.toml");
    let (mut tried, mut room) = (0, 0);
    loop {
        let _ = std::fs::remove_file(&out);
        let _ = std::fs::remove_file(journal_path(&out));
        let full = Full {
            left: Rc::new(Cell::new(room)),
        };
        let port = array_port(&order.0, SEED, SensorSpec::default());
        let (result, _, port) = run_calibration(port, &order, &out, &full, &mut Auto);
        let Err(error) = result else {
            break;
        };
        let message = error.to_string();
        assert!(
            message.starts_with("E675 cannot write"),
            "{room}: {message}"
        );
        assert!(message.contains("--resume"), "{message}");
        let mut port = port.unwrap();
        let end_us = port.world.now_us();
        silent_after(&mut port.world, end_us);
        if out.exists() {
            host_core::wearer::Wearer::read(&out).unwrap();
        }
        // There is space again.
        let port = array_port(&order.0, SEED, SensorSpec::default());
        run_calibration(port, &order, &out, &OnDisk, &mut Auto)
            .0
            .unwrap();
        let resumed = std::fs::read_to_string(&out).unwrap();
        assert_eq!(resumed, reference, "{room}");
        room += 97;
        tried += 1;
    }
    println!("full at each 97th of {room} bytes: {tried} disks");
    assert!(tried > 50, "{tried}");
}
