//! Places a device in a simulated world.

use super::open_error::OpenError;
use super::wearer::{attach_electrodes, create_body};
use crate::link::SimulatedPort;
use crate::session::Session;
use firmware::units::Micros;
use hal_sim::body::Body;
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
    Ok(simulated_port_with(body, session, seed, device, boot))
}

/// Creates a simulated world as [`simulated_port`] does, with a wearer of the caller's own instead
/// of the session's.
#[must_use]
pub fn simulated_port_with(
    body: Box<dyn Body>,
    session: &Session,
    seed: u64,
    device: Box<dyn Device>,
    boot: Micros,
) -> SimulatedPort {
    let mut world = World::new(device, body, boot, Faults::default(), seed);
    attach_electrodes(&mut world, session);
    SimulatedPort::new(world)
}
