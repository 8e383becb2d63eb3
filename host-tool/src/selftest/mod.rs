//! Measures figures of the whole device on a simulator, from its outputs and answers: latency, host
//! silence, a soak over a noisy link, full load; also the lateness of this computer's keep-alives.
//!
//! Receives seeds and sizes; returns plain numbers. `tests` asserts their bounds, `flexor selftest`
//! prints them.

pub mod bench;
mod full_load;
mod keep_alive;
mod latency;
mod silence;
mod soak;
mod subject;

pub use full_load::{FullLoad, full_load};
pub use keep_alive::{KeepAlives, keep_alives};
pub use latency::{Distribution, Latency, Path, latency};
pub use silence::{Silence, silence};
pub use soak::{Soak, soak};
pub use subject::Subject;

use firmware::pulse::TrainSpec;
use firmware::safety::{ChannelSpec, StageSpec};
use firmware::units::{Amplitude, Micros};
use hal_sim::body::{Body, FixedLoad};
use hal_sim::native::native;
use hal_sim::wire::faults::Faults;
use hal_sim::world::World;
use host_core::link::{Connection, Error, SimulatedPort};

/// Boot time of every measurement: 60 s before the 32-bit clock wraps.
pub const BOOT: Micros = Micros::new(u32::MAX - 60_000_000 + 1);

/// Opens a native device with dummy loads.
fn open(faults: Faults, seed: u64) -> Result<Connection<SimulatedPort>, Error> {
    open_with(Box::new(FixedLoad::new(0.0)), faults, seed)
}

fn open_with(
    body: Box<dyn Body>,
    faults: Faults,
    seed: u64,
) -> Result<Connection<SimulatedPort>, Error> {
    let world = World::new(Box::new(native(BOOT)), body, BOOT, faults, seed);
    Ok(Connection::open(SimulatedPort::new(world))?.0)
}

/// Returns the setup of a channel with a current stage, a limit of 20 mA, and biphasic pulses of
/// 200 µs per phase.
fn channel(period_us: u32, offset_us: u32) -> ChannelSpec {
    ChannelSpec {
        train: TrainSpec {
            offset_us,
            ..TrainSpec::biphasic(200, 50, period_us)
        },
        stage: StageSpec::Current {
            full_scale_ua: 100_000,
        },
        limit: Amplitude::new(20_000),
        start: Amplitude::new(0),
        area_mm2: ChannelSpec::ASSUMED_AREA_MM2,
    }
}

/// Advances time to `until_us` and discards everything that arrives.
fn idle_until(client: &mut Connection<SimulatedPort>, until_us: u64) -> Result<(), Error> {
    while client.next(until_us)?.is_some() {}
    Ok(())
}
