//! A long session over a bad link: no pulse without a setpoint, no frame uncounted.

use super::{channel, open};
use firmware::link::{Event, Request};
use firmware::safety::WearerSpec;
use firmware::units::Amplitude;
use hal_sim::random::Random;
use hal_sim::trace::{State, Trace};
use hal_sim::wire::faults::{Counts, Faults, FaultyLine};
use host_core::link::{Error, Incoming};
use std::collections::HashMap;

/// Time between setpoints, µs (90 Hz).
const INTERVAL_US: u64 = 11_111;

/// Time after the start from which on all amplitudes have completed their rise, µs.
const RISEN_US: u64 = 100_000;

/// Number of frames before the stream: wearer, ten channels, arm, start.
const CONFIGURED: u64 = 13;

/// Result of a soak: a long session over a link that loses, corrupts and delays frames.
#[derive(Clone, Debug, Default)]
pub struct Soak {
    /// Simulated time, s.
    pub seconds: u64,
    /// Number of pulses that began after all amplitudes had completed their rise.
    pub pulses: u64,
    /// Number of pulses whose amplitude no accepted setpoint asked for. Must be 0.
    pub unasked: u64,
    /// Number of frames that the host sent in its session.
    pub sent: u64,
    /// Number of frames that the device understood.
    pub understood: u64,
    /// Number of frames that the device counted as lost.
    pub counted_lost: u64,
    /// Counts of frames that the simulated link lost, corrupted or delayed.
    pub wire: Counts,
    /// Number of acknowledged setpoints.
    pub accepted: u64,
    /// Number of times that the device stopped because of silence.
    pub stops: u64,
}

impl Soak {
    /// Returns whether every sent frame was understood or counted as lost.
    pub const fn is_accounted(&self) -> bool {
        self.understood + self.counted_lost == self.sent
    }
}

/// Streams random amplitudes to ten channels for `seconds`, beginning 60 s before the device's
/// clock wraps. The link loses 1 % of the frames, corrupts 1 %, and delays each frame by 0.5 ms and
/// up to 30 % of the time between setpoints. `progress` receives the finished share, 0 to 1.
///
/// # Errors
/// Fails if the simulated device refuses a frame that was not damaged.
pub fn soak(seconds: u64, seed: u64, mut progress: impl FnMut(f64)) -> Result<Soak, Error> {
    let mut random = Random::new(seed);
    let mut client = open(Faults::default(), seed)?;
    client.wearer(WearerSpec {
        rise_ms: 10,
        ..WearerSpec::default()
    })?;
    for index in 0..10u8 {
        client.channel(
            index,
            channel(20_000 - 511 * u32::from(index), 700 * u32::from(index)),
        )?;
    }
    client.arm()?;
    client.start()?;
    // Only the stream crosses the bad link, because only the stream lasts for hours.
    let faults = Faults {
        loss: 0.01,
        corruption: 0.01,
        delay_us: 500,
        jitter: 0.3,
        interval_us: INTERVAL_US,
    };
    client.port().world.wire = FaultyLine::new(faults, seed);
    let mut soak = Soak {
        seconds,
        sent: CONFIGURED,
        ..Soak::default()
    };
    let mut asked: HashMap<u16, Vec<Amplitude>> = HashMap::new();
    let mut accepted: Vec<(u64, Vec<Amplitude>)> = Vec::new();
    let begin = client.port().world.now_us();
    let end = begin + seconds * 1_000_000;
    let mut now = begin;
    while now < end {
        let values: Vec<_> = (0..10)
            .map(|_| Amplitude::new(5_000 + random.below(10_000) as u32))
            .collect();
        let request = Request::Amplitudes {
            at: None,
            mask: 0x3FF,
            values: values.iter().copied().collect(),
            widths: Default::default(),
        };
        asked.insert(client.post(request)?, values);
        soak.sent += 1;
        now += INTERVAL_US;
        while let Some(incoming) = client.next(now)? {
            match incoming {
                Incoming::Acknowledged(seq, at) => {
                    accepted.extend(asked.remove(&seq).map(|values| (at, values)));
                }
                Incoming::Event(_, Event::Electrode { .. }) => {}
                Incoming::Event(..) => soak.stops += 1,
                Incoming::Telemetry(..)
                | Incoming::Hello(_)
                | Incoming::Status(..)
                | Incoming::Refused(..) => {}
            }
        }
        progress((now - begin) as f64 / (end - begin) as f64);
    }
    soak.wire = client.port().world.wire.counts();
    // A frame over a good link closes the last gap.
    client.port().world.wire = FaultyLine::new(Faults::default(), seed);
    let counters = client.status()?.counters;
    soak.sent += 1;
    // the Hello frame opened the session
    soak.understood = u64::from(counters.frames).saturating_sub(1);
    soak.counted_lost = counters.lost_frames.into();
    soak.accepted = accepted.len() as u64;
    judge(
        &client.port().world.recorder.trace,
        &accepted,
        begin + RISEN_US,
        end,
        &mut soak,
    );
    Ok(soak)
}

/// Compares every pulse in `from_us..to_us` with the latest setpoint accepted before it.
fn judge(
    trace: &Trace,
    accepted: &[(u64, Vec<Amplitude>)],
    from_us: u64,
    to_us: u64,
    soak: &mut Soak,
) {
    for edge in trace
        .edges()
        .filter(|e| e.state == State::Cathodic && (from_us..to_us).contains(&e.t_us))
    {
        soak.pulses += 1;
        let count = accepted.partition_point(|(at, _)| *at <= edge.t_us);
        let wanted = count
            .checked_sub(1)
            .and_then(|last| accepted[last].1.get(usize::from(edge.channel)));
        // 100 mA is code 65 535; rounded down.
        let code = wanted.map(|amplitude| u64::from(amplitude.get()) * 65_535 / 100_000);
        soak.unasked += u64::from(code != Some(edge.dac_code.into()));
    }
}
