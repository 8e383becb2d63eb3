//! Measures how long the outputs are driven after the last message of a silent host.

use super::{channel, idle_until, open};
use firmware::safety::WearerSpec;
use firmware::units::Amplitude;
use hal_sim::wire::faults::Faults;
use host_core::link::Error;

/// Result of the measurement with one host timeout.
#[derive(Clone, Copy, Debug)]
pub struct Silence {
    /// Host timeout, ms.
    pub timeout_ms: u16,
    /// Time in which amplitudes fall to zero when stimulation ends, ms.
    pub fall_ms: u16,
    /// Time from the host's last setpoint until every output is disconnected, µs; `u64::MAX` if
    /// some output never is.
    pub until_isolated_us: u64,
}

impl Silence {
    /// Returns the largest allowed [`Self::until_isolated_us`], µs: the host timeout plus the fall.
    pub const fn allowed_us(&self) -> u64 {
        (self.timeout_ms as u64 + self.fall_ms as u64) * 1000
    }
}

/// Stimulates ten channels, falls silent, and waits until all outputs are disconnected.
///
/// # Errors
/// Fails if the simulated device refuses.
pub fn silence(timeout_ms: u16, fall_ms: u16) -> Result<Silence, Error> {
    let mut client = open(Faults::default(), 1)?;
    client.wearer(WearerSpec {
        rise_ms: 1,
        fall_ms,
        host_timeout_ms: timeout_ms,
        ..WearerSpec::default()
    })?;
    for index in 0..10u8 {
        // Rates of 40 to 85 Hz, so that some pulse is always about to start.
        client.channel(index, channel(25_000 - 1_471 * u32::from(index), 0))?;
    }
    client.arm()?;
    client.start()?;
    let amplitudes: Vec<_> = (0..10).map(|c| (c, Amplitude::new(10_000))).collect();
    let mut heard = 0;
    for _ in 0..3 {
        heard = client.port().world.now_us();
        client.set_amplitudes(&amplitudes)?;
        idle_until(&mut client, heard + 10_000)?;
    }
    let wait_us = (u64::from(timeout_ms) + u64::from(fall_ms) + 50) * 1000;
    idle_until(&mut client, heard + wait_us)?;
    let last = client.port().world.recorder.trace.levels.last().copied();
    // The last change must disconnect all outputs; otherwise they never were.
    let until_isolated_us = match last {
        Some((t_us, levels)) if levels.0 == 0 => t_us.saturating_sub(heard),
        _ => u64::MAX,
    };
    Ok(Silence {
        timeout_ms,
        fall_ms,
        until_isolated_us,
    })
}
