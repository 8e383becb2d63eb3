//! Communication of a client with the native simulator over a simulated wire.

use firmware::link::Code;
use firmware::pulse::TrainSpec;
use firmware::safety::{ChannelSpec, StageSpec, State, WearerSpec};
use firmware::units::{Amplitude, Micros};
use hal_sim::body::FixedLoad;
use hal_sim::native::native;
use hal_sim::wire::faults::Faults;
use hal_sim::world::World;
use host_core::link::{Connection, Error, Port, SimulatedPort};

const BOOT: Micros = Micros::new(u32::MAX - 2_000_000);

fn channel(offset_us: u32) -> ChannelSpec {
    ChannelSpec {
        train: TrainSpec {
            offset_us,
            ..TrainSpec::biphasic(200, 100, 20_000)
        },
        stage: StageSpec::Current {
            full_scale_ua: 100_000,
        },
        limit: Amplitude::new(20_000),
        start: Amplitude::new(0),
        area_mm2: ChannelSpec::ASSUMED_AREA_MM2,
    }
}

/// Returns a native device that boots at `boot`, with a wearer who does not move.
pub fn native_world(boot: Micros) -> World {
    let body = Box::new(FixedLoad::new(0.0));
    World::new(Box::new(native(boot)), body, boot, Faults::default(), 1)
}

#[test]
fn ten_channels_pulse_until_stopped() {
    let (mut client, _) = Connection::open(SimulatedPort::new(native_world(BOOT))).unwrap();
    let wearer = WearerSpec {
        rise_ms: 10,
        ..WearerSpec::default()
    };
    client.wearer(wearer).unwrap();
    for c in 0..10u8 {
        client.channel(c, channel(u32::from(c) * 700)).unwrap();
    }
    match client.set_amplitudes(&[(0, Amplitude::new(1000))]) {
        Err(Error::Refused(refused)) => assert_eq!(refused.code(), Some(Code::NotArmed)),
        other => panic!("{other:?}"),
    }
    client.arm().unwrap();
    client.start().unwrap();
    let amplitudes: Vec<_> = (0..10).map(|c| (c, Amplitude::new(10_000))).collect();
    let begin = client.port().now_us();
    for tick in 1..=180 {
        client.set_amplitudes(&amplitudes).unwrap();
        let next = begin + tick * 11_111;
        while client.next(next).unwrap().is_some() {}
    }
    let status = client.status().unwrap();
    assert_eq!(status.state, State::Stimulating);
    assert!(status.counters.pulses > 990, "{status:?}");
    client.stop().unwrap();
    let end = client.port().now_us() + 200_000;
    while client.next(end).unwrap().is_some() {}
    let status = client.status().unwrap();
    assert_eq!(status.state, State::Idle);
    assert_eq!(client.port().world.recorder.trace.last_levels().0, 0);
}
