//! Ports carry frames to a device in real time or to a simulated world.

use crate::clock::Clock;
use firmware::limb::AXES;
use hal_sim::world::World;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Second path by which another thread sends frames to the device of a [`Port`].
pub struct Outlet {
    /// Writer to which frames are written.
    pub line: Box<dyn Write + Send>,
    /// Clock by which that thread measures time.
    pub clock: Box<dyn Clock>,
}

/// Byte path to a device, together with its time.
pub trait Port: Send {
    /// Returns the host time, µs, which never decreases. In a simulation this is the virtual time.
    fn now_us(&mut self) -> u64;
    /// Sends one frame.
    ///
    /// # Errors
    /// The device is gone.
    fn send(&mut self, frame: &[u8]) -> io::Result<()>;
    /// Waits for bytes and returns them as soon as some arrive. Returns no bytes if the time
    /// `until_us` is reached or a signal arrives.
    ///
    /// # Errors
    /// The device is gone.
    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>>;
    /// Returns a second path for frames, which another thread may use; `None` where time is
    /// virtual. A caller that uses both paths must send one frame at a time.
    ///
    /// # Errors
    /// The device is gone.
    fn outlet(&mut self) -> io::Result<Option<Outlet>> {
        Ok(None)
    }
    /// Returns the simulated world behind this port, if there is one.
    fn world(&mut self) -> Option<&mut World> {
        None
    }
    /// Returns the path of the image that a simulated chip or QEMU runs; `None` for other devices.
    fn image(&self) -> Option<&Path> {
        None
    }
    /// Returns a copy of the simulated world behind this port in its present state. The copy
    /// continues independently. `None` if the device or its wearer cannot be copied. The native
    /// simulator can be copied, and the chip simulator without a debugger or log; QEMU and boards
    /// cannot.
    fn snapshot(&self) -> Option<SimulatedPort> {
        None
    }
    /// Returns the true joint angle of a simulated wearer, degrees; `None` if there is none.
    fn true_deg(&mut self) -> Option<f64> {
        self.world().map(|world| world.body.angle_deg())
    }
    /// Returns the angle that the data glove of a simulated wearer measures, degrees; `None` if
    /// there is no glove.
    fn glove_deg(&mut self) -> Option<f64> {
        self.world().map(|world| world.body.sensed_deg())
    }
    /// Returns the nine angles that are measured on a simulated wearer's arm, degrees; `None` if
    /// there is no simulated arm.
    fn posture_deg(&mut self) -> Option<[f64; AXES]> {
        self.world().and_then(|world| world.body.posture_deg())
    }
    /// Returns the true force that a simulated wearer's hand exerts on the object that holds the
    /// hand, N. The components point backward, to the right and upward. `None` if there is no
    /// simulated arm.
    fn hand_force_n(&mut self) -> Option<[f64; 3]> {
        self.world().and_then(|world| world.body.hand_force_n())
    }
}

impl<P: Port + ?Sized> Port for Box<P> {
    fn now_us(&mut self) -> u64 {
        (**self).now_us()
    }

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        (**self).send(frame)
    }

    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>> {
        (**self).receive(until_us)
    }

    fn outlet(&mut self) -> io::Result<Option<Outlet>> {
        (**self).outlet()
    }

    fn world(&mut self) -> Option<&mut World> {
        (**self).world()
    }

    fn image(&self) -> Option<&Path> {
        (**self).image()
    }

    fn snapshot(&self) -> Option<SimulatedPort> {
        (**self).snapshot()
    }
}

/// Port of a simulated world. Virtual time advances only while a caller waits for the port.
pub struct SimulatedPort {
    /// Simulated world in which the device runs and receives the port's frames.
    pub world: World,
    /// Path of the image that the device runs; `None` if it runs none.
    pub image: Option<PathBuf>,
}

impl SimulatedPort {
    /// Creates the port of a world whose device runs in this process without an image.
    #[must_use]
    pub const fn new(world: World) -> Self {
        let image = None;
        Self { world, image }
    }
}

impl Port for SimulatedPort {
    fn snapshot(&self) -> Option<SimulatedPort> {
        Some(SimulatedPort {
            world: self.world.snapshot()?,
            image: self.image.clone(),
        })
    }

    fn image(&self) -> Option<&Path> {
        self.image.as_deref()
    }

    fn world(&mut self) -> Option<&mut World> {
        Some(&mut self.world)
    }

    fn now_us(&mut self) -> u64 {
        self.world.now_us()
    }

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        self.world.send(frame);
        Ok(())
    }

    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>> {
        while !self.world.has_received() && self.world.now_us() < until_us {
            self.world
                .run_until(until_us.min(self.world.now_us() + 1000))?;
        }
        let mut data = Vec::new();
        for bytes in self.world.received() {
            data.extend_from_slice(&bytes);
        }
        Ok(data)
    }
}
