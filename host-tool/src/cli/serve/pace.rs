//! Device time of a served simulator: follows the wall clock, or waits for its host.

use firmware::link::{Decoder, Event, Request, Response, ToDevice};
use firmware::safety::WearerSpec;
use hal_sim::world::World;
use std::time::{Duration, Instant};

/// Keeps device time in step with the wall clock, by steps that are small enough for the traffic on
/// the wire.
pub(super) struct Pace {
    start: Instant,
    /// Device time at `start`, µs.
    origin: u64,
    was_slow: bool,
    /// State of the host for which device time waits; `None` if device time does not wait.
    host: Option<Host>,
}

impl Pace {
    /// Largest step of device time between two transfers on the wire.
    const STEP_US: u64 = 2_000;
    /// Largest lag behind the wall clock that is caught up, µs. To catch up a longer lag, device
    /// time would advance so fast that the device would notice silence of the host, whose default
    /// limit is 100 ms.
    const LAG_US: u64 = 50_000;

    /// Starts at device time `now_us`. If `waits`, no stall of the host or of this computer counts
    /// as silence of the host.
    pub(super) fn new(now_us: u64, waits: bool) -> Self {
        Self {
            start: Instant::now(),
            origin: now_us,
            was_slow: false,
            host: waits.then(Host::default),
        }
    }

    fn due(&self) -> u64 {
        let elapsed = u64::try_from(self.start.elapsed().as_micros()).unwrap_or(u64::MAX);
        let due = self.origin.saturating_add(elapsed);
        let waits_at = self.host.as_ref().and_then(Host::wait_limit_us);
        due.min(waits_at.unwrap_or(u64::MAX))
    }

    /// Returns whether the simulation must wait for the wall clock or the host.
    pub(super) fn is_ahead(&self, world: &World) -> bool {
        world.now_us() >= self.due()
    }

    /// Records the bytes that the host sent at device time `now_us`, possibly none.
    pub(super) fn note_received(&mut self, now_us: u64, bytes: &[u8], is_connected: bool) {
        let Some(host) = &mut self.host else {
            return;
        };
        let waited = host.wait_limit_us().is_some_and(|until| now_us >= until);
        host.note_received(now_us, bytes, is_connected);
        // Time spent waiting for the host is not caught up.
        if waited && !bytes.is_empty() {
            (self.start, self.origin) = (Instant::now(), now_us);
        }
    }

    /// Records the bytes that the device sent.
    pub(super) fn note_sent(&mut self, bytes: &[u8]) {
        if let Some(host) = &mut self.host {
            host.note_sent(bytes);
        }
    }

    /// Advances `world` by a step. Returns `true` only when the simulation falls too far behind the
    /// wall clock for the first time.
    pub(super) fn advance_world(&mut self, world: &mut World) -> std::io::Result<bool> {
        let now = world.now_us();
        world.run_until(self.due().min(now + Self::STEP_US))?;
        let is_slow = self.due() > world.now_us() + Self::LAG_US;
        if is_slow {
            (self.start, self.origin) = (Instant::now(), world.now_us());
        }
        let is_news = is_slow && !self.was_slow;
        self.was_slow |= is_slow;
        Ok(is_news)
    }
}

/// State of a host, derived from its frames and the device's frames: whether, and for how long, it
/// may be silent.
struct Host {
    from_host: Decoder,
    from_device: Decoder,
    timeout_us: u64,
    /// Number of the start request whose stimulation a silence would end; `None` if a silence ends
    /// nothing.
    started: Option<u16>,
    /// Device time of the host's last bytes, µs.
    last_us: u64,
    /// Wall-clock time of the host's last bytes.
    last: Instant,
}

impl Default for Host {
    fn default() -> Self {
        Self {
            from_host: Decoder::default(),
            from_device: Decoder::default(),
            timeout_us: timeout_us(&WearerSpec::default()),
            started: None,
            last_us: 0,
            last: Instant::now(),
        }
    }
}

const fn timeout_us(wearer: &WearerSpec) -> u64 {
    wearer.host_timeout_ms as u64 * 1_000
}

impl Host {
    /// Silence after which the host counts as gone. Device time then continues, and the device
    /// notices the silence.
    const PATIENCE: Duration = Duration::from_secs(30);

    /// Returns the device time at which the simulation begins to wait for the host, µs: three
    /// quarters of the host timeout after the host's last bytes. Hosts send once in each quarter.
    /// `None` if the simulation does not wait.
    fn wait_limit_us(&self) -> Option<u64> {
        let waits = self.started.is_some() && self.last.elapsed() < Self::PATIENCE;
        waits.then(|| self.last_us + self.timeout_us * 3 / 4)
    }

    fn note_received(&mut self, now_us: u64, bytes: &[u8], is_connected: bool) {
        if !is_connected {
            self.started = None;
            return;
        }
        if !bytes.is_empty() {
            (self.last_us, self.last) = (now_us, Instant::now());
        }
        let mut rest = bytes;
        while !rest.is_empty() {
            let Some(message) = self.from_host.push_until_delimiter(&mut rest) else {
                continue;
            };
            let decoded_frame: Option<ToDevice> = message
                .ok()
                .and_then(|message| postcard::from_bytes(message).ok());
            self.from_host.clear();
            if let Some(frame) = decoded_frame {
                self.note_request(&frame);
            }
        }
    }

    fn note_request(&mut self, frame: &ToDevice) {
        match &frame.request {
            Request::Clear => self.timeout_us = timeout_us(&WearerSpec::default()),
            Request::Wearer(wearer) => self.timeout_us = timeout_us(wearer),
            Request::Start => self.started = Some(frame.seq),
            Request::Stop | Request::Hello { .. } => self.started = None,
            _ => {}
        }
    }

    fn note_sent(&mut self, bytes: &[u8]) {
        let mut rest = bytes;
        while !rest.is_empty() {
            let Some(message) = self.from_device.push_until_delimiter(&mut rest) else {
                continue;
            };
            let response: Option<Response<'_>> = message
                .ok()
                .and_then(|message| postcard::from_bytes(message).ok());
            let is_over = match response {
                Some(Response::Event { event, .. }) => matches!(
                    event,
                    Event::Stopping(_) | Event::Stopped(_) | Event::Faulted(_)
                ),
                Some(Response::Refused { seq, .. }) => seq.is_some() && seq == self.started,
                _ => false,
            };
            self.from_device.clear();
            self.started = self.started.filter(|_| !is_over);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::link::{Code, Refusal, SCHEMA, SetupSum, encode};
    use firmware::safety::StopCause;
    use firmware::units::Micros;

    fn said(host: &mut Host, now_us: u64, request: Request) {
        let message = ToDevice {
            session: 1,
            seq: 1,
            request,
        };
        host.note_received(now_us, &encode(&message).unwrap(), true);
    }

    fn told(host: &mut Host, event: Event) {
        let at = Micros::new(0);
        host.note_sent(&encode(&Response::Event { at, event }).unwrap());
    }

    #[test]
    fn device_time_waits_for_a_host_whose_silence_would_end_something_and_for_no_other() {
        let mut host = Host::default();
        said(&mut host, 10, Request::Hello { schema: SCHEMA });
        let wearer = WearerSpec {
            host_timeout_ms: 40,
            ..WearerSpec::default()
        };
        said(&mut host, 20, Request::Wearer(wearer));
        assert_eq!(host.wait_limit_us(), None, "nothing is armed");
        let setup = SetupSum::default().total();
        said(&mut host, 1_000, Request::Arm { setup });
        assert_eq!(host.wait_limit_us(), None, "nothing has started");
        said(&mut host, 2_000, Request::Start);
        assert_eq!(host.wait_limit_us(), Some(32_000));
        said(&mut host, 9_000, Request::KeepAlive);
        assert_eq!(host.wait_limit_us(), Some(39_000));
        // Half a frame is a sign of life, too.
        host.note_received(12_000, &[3, 1], true);
        assert_eq!(host.wait_limit_us(), Some(42_000));
        host.note_received(13_000, &[0], true);
        said(&mut host, 14_000, Request::Stop);
        assert_eq!(host.wait_limit_us(), None, "it waits for the stop");
        said(&mut host, 15_000, Request::Start);
        told(&mut host, Event::Recovered);
        assert!(host.wait_limit_us().is_some());
        told(&mut host, Event::Stopped(StopCause::Finished));
        assert_eq!(host.wait_limit_us(), None, "it ended by itself");
        said(&mut host, 16_000, Request::Start);
        let refusal = Refusal::new(Code::NotArmed, "state");
        let refused = Response::Refused {
            seq: Some(1),
            refusal,
        };
        host.note_sent(&encode(&refused).unwrap());
        assert_eq!(host.wait_limit_us(), None, "it was refused");
        said(&mut host, 16_500, Request::Start);
        host.note_received(17_000, &[], false);
        assert_eq!(host.wait_limit_us(), None, "it has gone");
    }
}
