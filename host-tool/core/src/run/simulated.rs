//! Places a device in a simulated world.

use super::open_error::OpenError;
use super::wearer::{attach_electrodes, create_body};
use crate::link::SimulatedPort;
use crate::session::Session;
use firmware::units::Micros;
use hal_sim::lockstep::Device;
use hal_sim::wire::faults::Faults;
use hal_sim::world::World;

/// Creates a simulated world that contains `device` and the session's wearer with its angle sensor,
/// and returns the port of the device. `boot` is the device time at which the device has booted.
/// `seed` determines the noise of the wearer.
///
/// # Errors
/// The session describes a wearer that cannot exist.
pub fn simulated_port(
    session: &Session,
    seed: u64,
    device: Box<dyn Device>,
    boot: Micros,
) -> Result<SimulatedPort, OpenError> {
    let body = create_body(session, seed)?;
    let mut world = World::new(device, body, boot, Faults::default(), seed);
    attach_electrodes(&mut world, session);
    Ok(SimulatedPort::new(world))
}
