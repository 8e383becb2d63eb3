//! Runs a search on a device, with ordinary requests.

use super::declaration::{Observer, Rating};
use super::milli::Milli;
use super::plan::Search;
use super::stair::Probe;
use crate::link::{Connection, Error, Incoming, Interruption, Port};
use crate::run::describe_event;
use crate::session::Session;
use firmware::link::{Event, Request};
use firmware::safety::StopCause;
use firmware::units::Amplitude;
use hal_sim::random::standard_normal;
use std::fmt;
use std::time::Duration;

/// Interval between two readings of the angle sensor, µs.
const READ_US: u64 = 10_000;

/// Longest wait after a stop for the device's report that the outputs are isolated, µs.
const STOP_US: u64 = 300_000;

/// A question to the operator or the wearer. Answers are numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Question {
    /// May the level be raised from the first to the second? The answer is 1 for yes, 0 for no.
    Raise(Milli, Milli),
    /// How did this level feel? The answer is 0 (nothing) to 10 (unbearable).
    Rating(Milli),
    /// Did the joint move at this level? The answer is 1 for yes, 0 for no.
    Moved(Milli),
}

impl Question {
    /// Returns the largest valid answer; the smallest is always 0.
    #[must_use]
    pub const fn most(&self) -> u8 {
        match self {
            Self::Rating(_) => 10,
            Self::Raise(..) | Self::Moved(_) => 1,
        }
    }
}

impl fmt::Display for Question {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Raise(from, to) => write!(f, "raise from {from} to {to}?"),
            Self::Rating(level) => write!(f, "{level}: rating, 0 (nothing) to 10 (unbearable)?"),
            Self::Moved(level) => write!(f, "{level}: did the joint move?"),
        }
    }
}

/// The operator, who answers questions if the wearer is not simulated. The methods must never
/// block, because the device needs keep-alives in the meantime.
pub trait Operator {
    /// Shows a question without waiting for its answer.
    fn ask(&mut self, question: Question);

    /// Returns the answer to the last question, 0 to [`Question::most`], or `None` if there is none
    /// yet.
    fn reply(&mut self) -> Option<u8>;
}

/// Reason why a search on a device ended early.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// The link to the device failed.
    #[error(transparent)]
    Link(#[from] Error),
    /// The search needs the joint's angle, which this device measures only in closed loop.
    #[error(
        "E528 this device measures the joint only in closed loop; let the operator watch the \
         joint with observer = \"eye\""
    )]
    NoSensor,
    /// The device ended the search by itself; contains its event in words.
    #[error("E537 the device ended the search ({0}); remove this cause, then search again")]
    Ended(String),
    /// The device ended the search because this computer sent nothing for so long, ms.
    #[error(
        "E698 this computer stalled for {0} ms; the device received nothing meanwhile and ended \
         stimulation; close other programs, or use another computer, then search again"
    )]
    Stalled(u128),
}

/// A device that is armed for one search. Its channels are silent between presentations. Joint,
/// wall, force control and muscle models of the session are not sent to the device.
pub struct OnDevice<'a, P> {
    client: Connection<P>,
    search: &'a Search,
    /// The operator who answers; `None` if the device is simulated in this process.
    operator: Option<&'a mut dyn Operator>,
    host_timeout_us: u64,
    /// Time at which the next keep-alive is due, µs.
    due_us: u64,
    /// Whether a separate thread sends the keep-alives, so that this one need not.
    is_kept: bool,
    pulses: u64,
    counted: u32,
    seed: u64,
    rated: u64,
}

impl<'a, P: Port> OnDevice<'a, P> {
    /// Opens a session through `port`, configures and arms the device as `session` says, and starts
    /// its trains at amplitude 0. `operator` answers questions unless the device is simulated in
    /// this process. `seed` determines the noise of a simulated wearer.
    ///
    /// Fails if the device fails, or if the search needs an angle that the device does not measure.
    pub fn start(
        port: P,
        session: &Session,
        search: &'a Search,
        operator: &'a mut dyn Operator,
        interruption: Option<Interruption>,
        seed: u64,
    ) -> Result<Self, DeviceError> {
        let (mut client, _) = Connection::open_interruptible(port, interruption)?;
        let is_simulated = client.port().world().is_some();
        let needs_sensor = search.declaration().needs_baseline();
        let has_eye = search.declaration().observer == Observer::Eye && !is_simulated;
        if needs_sensor && !has_eye && client.port().glove_deg().is_none() {
            return Err(DeviceError::NoSensor);
        }
        for request in session.setup_requests() {
            let is_plain = matches!(
                request,
                Request::Clear
                    | Request::Wearer(_)
                    | Request::Channel { .. }
                    | Request::Groups(_)
                    | Request::Sync { .. }
            );
            if is_plain {
                client.request(request)?;
            }
        }
        client.arm()?;
        let host_timeout_us = u64::from(session.wearer.host_timeout_ms) * 1000;
        let is_kept = client.start_keep_alive_thread(Duration::from_micros(host_timeout_us / 4))?;
        let mut probe = Self {
            client,
            search,
            operator: (!is_simulated).then_some(operator),
            host_timeout_us,
            due_us: 0,
            is_kept,
            pulses: 0,
            counted: 0,
            seed,
            rated: 0,
        };
        // Excludes the pulses of the electrode check.
        probe.counted = probe.client.status()?.counters.pulses;
        probe.client.start()?;
        probe.set_level(Milli(0))?;
        Ok(probe)
    }

    /// Stops the device, waits until its outputs are isolated, and returns the port.
    ///
    /// # Errors
    /// Fails if the stop was not acknowledged; the device then stops by itself after its timeout.
    pub fn stop(mut self) -> Result<P, Error> {
        self.client.ignore_signals();
        self.client.stop()?;
        let until = self.client.port().now_us() + STOP_US;
        while let Some(incoming) = self.client.next(until)? {
            if let Incoming::Event(_, Event::Stopped(_) | Event::Faulted(_)) = incoming {
                break;
            }
        }
        Ok(self.client.into_port())
    }

    /// Sets the amplitudes of all channels of the search to those that belong to `level`.
    fn set_level(&mut self, level: Milli) -> Result<(), DeviceError> {
        let sites = self.search.sites().iter();
        let list: Vec<(u8, Amplitude)> = sites
            .map(|site| (site.channel - 1, Amplitude::new(site.amplitude(level).0)))
            .collect();
        self.client.set_amplitudes(&list)?;
        self.due_us = self.client.port().now_us() + self.host_timeout_us / 4;
        Ok(())
    }

    /// Waits until `until_us` and sends keep-alives meanwhile.
    fn wait_until(&mut self, until_us: u64) -> Result<(), DeviceError> {
        while self.client.port().now_us() < until_us {
            if !self.is_kept && self.client.port().now_us() >= self.due_us {
                self.client.post(Request::KeepAlive)?;
                self.due_us = self.client.port().now_us() + self.host_timeout_us / 4;
            }
            let soon = match self.is_kept {
                true => until_us,
                false => until_us.min(self.due_us),
            };
            while let Some(incoming) = self.client.next(soon)? {
                match incoming {
                    Incoming::Event(
                        _,
                        happened @ (Event::Stopping(_) | Event::Stopped(_) | Event::Faulted(_)),
                    ) => return Err(self.end_error(&happened)),
                    Incoming::Refused(_, refused) => return Err(Error::Refused(refused).into()),
                    _ => {}
                }
            }
        }
        Ok(())
    }

    /// Returns the error for an event with which the device ended the search. If this computer
    /// stalled, the error says so.
    fn end_error(&self, happened: &Event) -> DeviceError {
        let silence = StopCause::HostSilent;
        let is_silence =
            *happened == Event::Stopping(silence) || *happened == Event::Stopped(silence);
        let keeper = self.client.keeper().filter(|_| is_silence);
        match keeper
            .and_then(|keeper| keeper.explaining_pause(Duration::from_micros(self.host_timeout_us)))
        {
            Some(pause) => DeviceError::Stalled(pause.as_millis()),
            None => DeviceError::Ended(describe_event(happened)),
        }
    }

    fn wait_ms(&mut self, ms: u32) -> Result<(), DeviceError> {
        let until_us = self.client.port().now_us() + u64::from(ms) * 1000;
        self.wait_until(until_us)
    }

    /// Measures `count` windows and returns the mean angle in each, °; empty without a sensor.
    fn windows(&mut self, count: u32) -> Result<Vec<f64>, DeviceError> {
        let length_us = u64::from(self.search.declaration().window_ms) * 1000;
        let begin_us = self.client.port().now_us();
        let mut means = Vec::new();
        for window in 1..=u64::from(count) {
            let (mut sum, mut readings) = (0.0, 0_u32);
            let end_us = begin_us + window * length_us;
            while self.client.port().now_us() < end_us {
                let next_us = end_us.min(self.client.port().now_us() + READ_US);
                self.wait_until(next_us)?;
                if let Some(deg) = self.client.port().glove_deg() {
                    (sum, readings) = (sum + deg, readings + 1);
                }
            }
            means.extend((readings > 0).then(|| sum / f64::from(readings)));
        }
        Ok(means)
    }

    /// Asks the operator and sends keep-alives until the answer comes; returns `None` if the device
    /// is simulated.
    fn ask(&mut self, question: Question) -> Result<Option<u8>, DeviceError> {
        let Some(operator) = &mut self.operator else {
            return Ok(None);
        };
        operator.ask(question);
        loop {
            if let Some(reply) = self.operator.as_mut().and_then(|o| o.reply()) {
                return Ok(Some(reply));
            }
            self.wait_ms(20)?;
        }
    }

    /// Adds the pulses that the device has emitted since the last call to the search's count.
    fn count(&mut self) -> Result<(), DeviceError> {
        let now = self.client.status()?.counters.pulses;
        self.pulses += u64::from(now.wrapping_sub(self.counted));
        self.counted = now;
        Ok(())
    }
}

impl<P: Port> Probe for OnDevice<'_, P> {
    type Error = DeviceError;

    fn may_raise(&mut self, from: Milli, to: Milli) -> Result<bool, DeviceError> {
        Ok(self.ask(Question::Raise(from, to))? != Some(0))
    }

    fn rest(&mut self, has_baseline: bool) -> Result<Vec<f64>, DeviceError> {
        let declared = self.search.declaration();
        let rest_ms = (declared.rest_s * 1e3).round() as u32; // at most 600 s
        let windows = if has_baseline {
            declared.baseline_windows
        } else {
            0
        };
        self.wait_ms(rest_ms.saturating_sub(windows * declared.window_ms))?;
        self.windows(windows)
    }

    fn present(&mut self, level: Milli, has_windows: bool) -> Result<Vec<f64>, DeviceError> {
        let declared = self.search.declaration();
        let (settle_ms, windows) = (declared.settle_ms, declared.windows);
        let set = self.set_level(level).and_then(|()| self.wait_ms(settle_ms));
        let seen = set.and_then(|()| match has_windows {
            true => self.windows(windows),
            false => {
                let passed = self.wait_ms(windows * declared.window_ms);
                passed.map(|()| Vec::new())
            }
        });
        // After any failure the amplitudes are set to 0 first, and the pulses are counted.
        if seen.is_err() {
            self.client.ignore_signals();
        }
        let (silent, counted) = (self.set_level(Milli(0)), self.count());
        let windows = seen?;
        silent.and(counted)?;
        Ok(windows)
    }

    fn rating(&mut self, level: Milli) -> Result<u8, DeviceError> {
        if let Some(rating) = self.ask(Question::Rating(level))? {
            return Ok(rating);
        }
        self.rated += 1;
        let deviate = standard_normal(self.seed, self.rated);
        let person = self.search.declaration().simulated_rating;
        // Without a configured simulated wearer, every level is rated intolerable.
        Ok(person.map_or(10, |person: Rating| person.rate(level, deviate)))
    }

    fn observed_movement(&mut self, level: Milli) -> Result<Option<bool>, DeviceError> {
        Ok(self.ask(Question::Moved(level))?.map(|moved| moved > 0))
    }

    fn pulses(&self) -> u64 {
        self.pulses
    }
}
