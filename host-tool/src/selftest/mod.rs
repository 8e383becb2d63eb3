//! Numbers that the whole device must show, measured on a simulator from its
//! outputs and its answers: latency, host silence, a noisy soak, full load;
//! and how late this computer's keep-alives are.
//!
//! Lives here: the measurements. Not here: what is allowed (`tests` asserts,
//! `flexor selftest` prints). In: seeds and sizes. Out: plain numbers.

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

/// Every measurement begins 60 s before the 32-bit clock wraps.
pub const BOOT: Micros = Micros::new(u32::MAX - 60_000_000 + 1);

/// A client of a native board with dummy loads.
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

/// A current channel, biphasic 200 µs, limit 20 mA.
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

/// Lets time go on to `until_us` and drops what arrives.
fn idle_until(client: &mut Connection<SimulatedPort>, until_us: u64) -> Result<(), Error> {
    while client.next(until_us)?.is_some() {}
    Ok(())
}
