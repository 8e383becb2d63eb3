//! A simulated world around a device.

use super::open_error::OpenError;
use super::wearer::{body_of, fit};
use crate::link::SimulatedPort;
use crate::session::Session;
use firmware::units::Micros;
use hal_sim::lockstep::Device;
use hal_sim::wire::faults::Faults;
use hal_sim::world::World;

/// A simulated world around `device`, which boots at `boot`, with the
/// session's wearer and angle sensor.
///
/// # Errors
/// The session names a wearer that cannot be.
pub fn simulated(
    session: &Session,
    seed: u64,
    device: Box<dyn Device>,
    boot: Micros,
) -> Result<SimulatedPort, OpenError> {
    let body = body_of(session, seed)?;
    let mut world = World::new(device, body, boot, Faults::default(), seed);
    fit(&mut world, session);
    Ok(SimulatedPort::new(world))
}
