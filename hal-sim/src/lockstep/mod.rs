//! Devices that live in virtual time, driven in lock-step.
//!
//! Lives here: [`Device`], what every simulated device can do, the [`Output`]
//! of its channels, and [`Remote`], one at the other end of a line. Not here: the device code in this process
//! (`native`) and in an emulator (`qemu`).
//! In: bytes, sensors and how far time goes. Out: levels, DAC codes, bytes.

mod remote;

pub use remote::Remote;

use crate::body::Drive;
use firmware::lockstep::{Sensors, Sink};
use firmware::units::Micros;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard};

/// How a channel's code becomes volts or milliamperes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output {
    /// Full scale at code 65 535.
    pub full_scale: Drive,
    /// Whether the rest of its group is grounded while it pulses.
    pub conducted: bool,
}

impl Output {
    /// What it drives at `code`.
    #[must_use]
    pub fn drives(self, code: u16) -> Drive {
        let part = f64::from(code) / 65_535.0;
        match self.full_scale {
            Drive::Volts(v) => Drive::Volts(v * part),
            Drive::Milliamps(ma) => Drive::Milliamps(ma * part),
        }
    }
}

/// A device that lives in virtual time.
pub trait Device: Send {
    /// Bytes arrive, the last one at `at`; see `Lockstep::receive`.
    ///
    /// # Errors
    /// The device cannot be reached any more.
    fn receive(
        &mut self,
        at: Micros,
        bytes: &[u8],
        sensors: &Sensors,
        sink: &mut dyn Sink,
    ) -> io::Result<()>;

    /// Time goes on to `to`; see `Lockstep::advance`.
    ///
    /// # Errors
    /// The device cannot be reached any more.
    fn advance(&mut self, to: Micros, sensors: &Sensors, sink: &mut dyn Sink) -> io::Result<()>;

    /// How `channel` drives what it is set to; `None` if it is not set up or
    /// the device cannot be looked into.
    fn output(&self, _channel: usize) -> Option<Output> {
        None
    }

    /// A device like this one, which goes on alone from here; `None` if it cannot be copied.
    fn fork(&self) -> Option<Box<dyn Device>> {
        None
    }
}

/// A device that somebody else looks into between the world's steps.
impl<D: Device> Device for Arc<Mutex<D>> {
    fn receive(
        &mut self,
        at: Micros,
        bytes: &[u8],
        sensors: &Sensors,
        sink: &mut dyn Sink,
    ) -> io::Result<()> {
        lock_device(self)?.receive(at, bytes, sensors, sink)
    }

    fn advance(&mut self, to: Micros, sensors: &Sensors, sink: &mut dyn Sink) -> io::Result<()> {
        lock_device(self)?.advance(to, sensors, sink)
    }

    fn output(&self, channel: usize) -> Option<Output> {
        lock_device(self).ok()?.output(channel)
    }
}

fn lock_device<D>(device: &Mutex<D>) -> io::Result<MutexGuard<'_, D>> {
    let lost = "the simulated device was left in the middle of a step";
    device.lock().map_err(|_| io::Error::other(lost))
}
