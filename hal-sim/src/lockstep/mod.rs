//! Interface of a device that runs in virtual time, advanced in lock-step.
//!
//! [`Device`] is the trait of every simulated device, [`Output`] describes its channels, and
//! [`Remote`] is a device at the other end of a byte stream. The device code in this process is in
//! `native`, that in an emulator in `qemu`.
//! In: bytes, sensor values and the time to advance to. Out: levels, DAC codes, bytes.

mod remote;

pub use remote::Remote;

use crate::body::Drive;
use firmware::lockstep::{Sensors, Sink};
use firmware::units::Micros;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard};

/// Conversion of a channel's DAC code into volts or milliamperes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output {
    /// Amplitude at code 65 535.
    pub full_scale: Drive,
    /// Whether the other channels of its group are grounded during a pulse.
    pub conducted: bool,
}

impl Output {
    /// Returns the amplitude at `code`.
    #[must_use]
    pub fn drives(self, code: u16) -> Drive {
        let part = f64::from(code) / 65_535.0;
        match self.full_scale {
            Drive::Volts(v) => Drive::Volts(v * part),
            Drive::Milliamps(ma) => Drive::Milliamps(ma * part),
        }
    }
}

/// A device that runs in virtual time.
pub trait Device: Send {
    /// Delivers `bytes`, the last one at `at`; see `Lockstep::receive`.
    ///
    /// # Errors
    /// Fails if the device cannot be reached any more.
    fn receive(
        &mut self,
        at: Micros,
        bytes: &[u8],
        sensors: &Sensors,
        sink: &mut dyn Sink,
    ) -> io::Result<()>;

    /// Advances the device to `to`; see `Lockstep::advance`.
    ///
    /// # Errors
    /// Fails if the device cannot be reached any more.
    fn advance(&mut self, to: Micros, sensors: &Sensors, sink: &mut dyn Sink) -> io::Result<()>;

    /// Returns how `channel` converts its code into an amplitude; `None` if the channel is not set
    /// up or the device cannot be inspected.
    fn output(&self, _channel: usize) -> Option<Output> {
        None
    }

    /// Copies the device; the copy advances independently. Returns `None` if it cannot be copied.
    fn fork(&self) -> Option<Box<dyn Device>> {
        None
    }
}

/// A device that another owner inspects between the steps of the world.
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
    let lost = "the simulated device was interrupted during a step";
    device.lock().map_err(|_| io::Error::other(lost))
}
