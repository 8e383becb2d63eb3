//! Numbers that the whole device must show, measured on a simulator from its
//! outputs and its answers: latency, host silence, a noisy soak.
//!
//! Lives here: the measurements. Not here: what is allowed (`tests` asserts,
//! `flexor selftest` prints). In: seeds and sizes. Out: plain numbers.

mod latency;
mod silence;
mod soak;
mod subject;

pub use latency::{Distribution, Latency, Path, latency};
pub use silence::{Silence, silence};
pub use soak::{Soak, soak};
pub use subject::Subject;

use crate::link::{Client, Error, SimulatedPort};
use firmware::pulse::{Shape, TrainSpec};
use firmware::safety::{ChannelSpec, StageSpec};
use firmware::units::{Amplitude, Micros};
use hal_sim::body::{Body, Still};
use hal_sim::native::native;
use hal_sim::wire::faults::Faults;
use hal_sim::world::World;

/// Every measurement begins 60 s before the 32-bit clock wraps.
pub const BOOT: Micros = Micros(u32::MAX - 60_000_000 + 1);

/// A client of a native board with dummy loads.
fn open(faults: Faults, seed: u64) -> Result<Client<SimulatedPort>, Error> {
    open_with(Box::new(Still::new(0.0)), faults, seed)
}

fn open_with(
    body: Box<dyn Body>,
    faults: Faults,
    seed: u64,
) -> Result<Client<SimulatedPort>, Error> {
    let world = World::new(Box::new(native(BOOT)), body, BOOT, faults, seed);
    Ok(Client::open(SimulatedPort::new(world))?.0)
}

/// A current channel, biphasic 200 µs, limit 20 mA.
fn channel(period_us: u32, offset_us: u32) -> ChannelSpec {
    ChannelSpec {
        train: TrainSpec {
            shape: Shape::BiphasicCathodicFirst,
            width_us: 200,
            gap_us: 50,
            ground_us: 0,
            period_us,
            offset_us,
            burst_count: 1,
            burst_interval_us: 0,
            repeats: 0,
            triggered: false,
        },
        stage: StageSpec::Current {
            full_scale_ua: 100_000,
        },
        limit: Amplitude(20_000),
    }
}

/// Lets time go on to `until_us` and drops what arrives.
fn idle_until(client: &mut Client<SimulatedPort>, until_us: u64) -> Result<(), Error> {
    while client.next(until_us)?.is_some() {}
    Ok(())
}

/// A small generator of uniform numbers (splitmix64), so that every number
/// here depends on its seed alone.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in `0..end`; `end` is above zero and far below 2^64.
    fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }
}
