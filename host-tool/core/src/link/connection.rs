//! Joins a client and its port: sends requests and waits for their answers, in the port's time.

use super::clock::Fit;
use super::stall::Stalls;
use super::{Client, Error, Incoming, Interruption, Keeper, Outlet, Port, SimulatedPort};
use firmware::link::{HelloInfo, Request, Status};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Time after which a request counts as not answered, µs.
const ANSWER_US: u64 = 500_000;

/// Longest time between two checks for a signal or a stall, µs of the port's time. Virtual time
/// advances in steps that divide it evenly, so the checks do not change the result of a simulation.
const POLL_US: u64 = 2_000;

/// Result of one wait for messages.
#[derive(Clone, Debug)]
pub enum Polled {
    /// A message of the device arrived.
    Message(Incoming),
    /// No message arrived yet, and the given time is not over.
    Waiting,
    /// The given time is over, and every message that arrived by then was taken.
    Over,
}

/// Session with a device behind a port: sends requests, waits for answers, and hands out messages.
pub struct Connection<P> {
    port: P,
    client: Client,
    keeper: Option<Keeper>,
    interruption: Option<Interruption>,
    /// Time at which bytes were last requested from the port, µs of the port's time.
    asked_us: Option<u64>,
    stalls: Stalls,
    /// Lock that is held from the numbering of a frame until the frame is sent. Frames of this
    /// connection and of the keep-alive thread therefore leave in the order of their numbers.
    line: Arc<Mutex<()>>,
}

impl<P: Port> Connection<P> {
    /// Opens a session through `port`, and returns it with the device's answer to `Hello`.
    ///
    /// # Errors
    /// The device refuses (another schema, another host) or does not answer.
    pub fn open(port: P) -> Result<(Self, HelloInfo), Error> {
        Self::open_interruptible(port, None)
    }

    /// Opens a session as [`Connection::open`] does. Every wait then ends with
    /// [`Error::Interrupted`] soon after a signal. The caller decides whether to stop the device.
    ///
    /// # Errors
    /// The errors of [`Connection::open`], and the signal.
    pub fn open_interruptible(
        port: P,
        interruption: Option<Interruption>,
    ) -> Result<(Self, HelloInfo), Error> {
        let mut connection = Self {
            port,
            client: Client::default(),
            keeper: None,
            interruption,
            asked_us: None,
            stalls: Stalls::default(),
            line: Arc::default(),
        };
        let info = connection.hello()?;
        Ok((connection, info))
    }

    /// Opens the session again, for instance after the device was reset, and returns the device's
    /// answer to `Hello`.
    ///
    /// # Errors
    /// The errors of [`Connection::open`].
    pub fn hello(&mut self) -> Result<HelloInfo, Error> {
        self.keeper = None; // it speaks in the session before
        let sent_us = self.mark_attended();
        self.port.send(&Client::BREAK)?;
        let (seq, frame) = self.client.hello(sent_us);
        self.port.send(&frame)?;
        match self.await_answer("Hello", seq, sent_us)? {
            Incoming::Hello(info) => Ok(*info),
            _ => Err(no_answer("Hello")),
        }
    }

    /// Returns a copy of this session with a copy of the simulated device, whose port is as
    /// `convert` returns it; both continue independently of the originals. `None` if the device
    /// cannot be copied.
    #[must_use]
    pub fn snapshot_with<Q: Port>(
        &self,
        convert: impl FnOnce(SimulatedPort) -> Q,
    ) -> Option<Connection<Q>> {
        Some(Connection {
            port: convert(self.port.snapshot()?),
            client: self.client.snapshot(),
            keeper: None,
            interruption: self.interruption.clone(),
            asked_us: self.asked_us,
            stalls: self.stalls,
            line: Arc::default(),
        })
    }

    /// Makes all later waits ignore signals. After a signal, call this before you stop the device,
    /// so that the answer to the stop can still be awaited.
    pub fn ignore_signals(&mut self) {
        self.interruption = None;
    }

    /// Returns the port, for example to read its time.
    pub fn port(&mut self) -> &mut P {
        &mut self.port
    }

    /// Starts a thread that sends the device a keep-alive every `period`, as long as [`Self::next`]
    /// is called. Returns whether the thread was started. Where time is virtual there is no such
    /// thread, and the caller must send keep-alives itself.
    ///
    /// # Errors
    /// [`Error::Lost`]: the port failed, or the system could not start a thread.
    pub fn start_keep_alive_thread(&mut self, period: Duration) -> Result<bool, Error> {
        let Some(Outlet {
            line: mut to,
            clock,
        }) = self.port.outlet()?
        else {
            return Ok(false);
        };
        let (mut keep_alive, line) = (self.client.keep_alives(), Arc::clone(&self.line));
        let send = move || {
            let _line = locked(&line);
            to.write_all(&keep_alive())
        };
        self.keeper = Some(Keeper::start(period, clock, send)?);
        Ok(true)
    }

    /// Returns the thread that sends keep-alives, if one runs.
    pub const fn keeper(&self) -> Option<&Keeper> {
        self.keeper.as_ref()
    }

    /// Ends the session without a message to the device, and returns the port. The device notices
    /// that the host is silent.
    pub fn into_port(self) -> P {
        self.port
    }

    /// Estimates the device time at host time `host_us`, both in µs, from the times of the answers
    /// so far; `None` before the first answer.
    pub fn device_time(&self, host_us: u64) -> Option<u64> {
        self.client.device_time(host_us)
    }

    /// Returns the fit of the device's clock against the host's over the whole session; `None`
    /// before the first exchange.
    pub fn clock_fit(&self) -> Option<Fit> {
        self.client.clock_fit()
    }

    /// Requests the device's state, faults and counters, and waits for them.
    ///
    /// # Errors
    /// Returns an [`Error`] if the device refuses, does not answer or is lost.
    pub fn status(&mut self) -> Result<Status, Error> {
        match self.call("Status", Request::Status)? {
            Incoming::Status(_, status) => Ok(*status),
            _ => Err(no_answer("Status")),
        }
    }

    /// Sends a request and returns its number without waiting for the answer, which arrives later
    /// as an [`Incoming`] message.
    ///
    /// # Errors
    /// [`Error::Lost`], [`Error::TooLarge`].
    pub fn post(&mut self, request: Request) -> Result<u16, Error> {
        let now_us = self.port.now_us();
        self.send("request", request, now_us)
    }

    /// Waits until `until_us` of the port's time at the latest, and returns the next message that
    /// is not an answer to a waiting call; `None` if that time is over. Repeated calls return
    /// `None` soon after that time, even if the device sends messages without end.
    ///
    /// # Errors
    /// [`Error::Lost`].
    pub fn next(&mut self, until_us: u64) -> Result<Option<Incoming>, Error> {
        loop {
            match self.poll(until_us)? {
                Polled::Message(incoming) => return Ok(Some(incoming)),
                Polled::Waiting => {}
                Polled::Over => return Ok(None),
            }
        }
    }

    /// Returns whether a received message is stored, so that [`Self::poll`] returns it without
    /// reading from the port.
    pub fn has_message(&self) -> bool {
        self.client.has_message()
    }

    /// Performs one step of [`Self::next`]. If no received message is stored, reads from the port
    /// once, which takes at most 2 ms of the port's time.
    ///
    /// # Errors
    /// [`Error::Lost`].
    pub fn poll(&mut self, until_us: u64) -> Result<Polled, Error> {
        if let Some(keeper) = &self.keeper {
            keeper.mark_attended();
        }
        if let Some(incoming) = self.client.take_message() {
            return Ok(Polled::Message(incoming));
        }
        // Messages that arrived by then were taken; a device that never stops sending would
        // otherwise keep this call busy without end.
        if self.asked_us.is_some_and(|asked_us| asked_us >= until_us) {
            return Ok(Polled::Over);
        }
        let now_us = self.receive(until_us)?;
        Ok(match self.client.take_message() {
            Some(incoming) => Polled::Message(incoming),
            None if now_us >= until_us => Polled::Over,
            None => Polled::Waiting,
        })
    }

    /// Sends `request`, called `name` in errors, waits for its acknowledgement, and returns the
    /// device time of the acknowledgement, µs.
    pub(super) fn ack(&mut self, name: &'static str, request: Request) -> Result<u64, Error> {
        match self.call(name, request)? {
            Incoming::Acknowledged(_, at) => Ok(at),
            _ => Err(no_answer(name)),
        }
    }

    /// Makes the device check its setup and the electrodes, and arms it. The device refuses if its
    /// setup differs from the one that the requests acknowledged so far have made. Returns the
    /// device time of the acknowledgement, µs.
    ///
    /// # Errors
    /// Arming is refused or not answered, or the device is lost.
    pub fn arm(&mut self) -> Result<u64, Error> {
        let request = self.client.arm_request();
        self.ack("Arm", request)
    }

    fn call(&mut self, name: &'static str, request: Request) -> Result<Incoming, Error> {
        let sent_us = self.mark_attended();
        let seq = self.send(name, request, sent_us)?;
        self.await_answer(name, seq, sent_us)
    }

    /// Notes that the program attends to its port now, and returns the port's time, µs.
    fn mark_attended(&mut self) -> u64 {
        let now_us = self.port.now_us();
        self.stalls.record_look(now_us, 0);
        now_us
    }

    /// Waits for the answer to request number `seq`, which was sent at `sent_us`. While this
    /// computer does not run the program, the device is not to blame: the wait becomes longer by
    /// that time.
    fn await_answer(
        &mut self,
        name: &'static str,
        seq: u16,
        sent_us: u64,
    ) -> Result<Incoming, Error> {
        let before_us = self.stalls.sum_us();
        loop {
            let stalled_us = self.stalls.sum_us() - before_us;
            let until_us = sent_us + ANSWER_US + stalled_us;
            if self.port.now_us() >= until_us {
                return Err(match stalled_us >= ANSWER_US {
                    true => host_stalled(stalled_us, &format!("the device did not answer {name}")),
                    false => no_answer(name),
                });
            }
            self.receive(until_us)?;
            match self.client.take_answer(seq) {
                Some(Incoming::Refused(_, refused)) => return Err(Error::Refused(refused)),
                Some(answer) => return Ok(answer),
                None => {}
            }
        }
    }

    /// Returns the longest time within the last two seconds during which this computer did not run
    /// the program, as far as the port shows, µs; 0 if no such time exceeded 10 ms.
    pub fn recent_stall_us(&mut self) -> u64 {
        let now_us = self.port.now_us();
        self.stalls.recent_us(now_us)
    }

    /// Returns the total time since the session was opened during which this computer did not run
    /// the program, µs.
    pub(crate) fn total_stall_us(&self) -> u64 {
        self.stalls.sum_us()
    }

    fn send(&mut self, name: &'static str, request: Request, now_us: u64) -> Result<u16, Error> {
        let _line = locked(&self.line);
        let sent = self.client.request(request, now_us);
        let (seq, frame) = sent.map_err(|error| match error {
            Error::TooLarge(_) => Error::TooLarge(name),
            error => error,
        })?;
        self.port.send(&frame)?;
        Ok(seq)
    }

    /// Fails with [`Error::Interrupted`] if a signal has arrived.
    fn check_signal(&self) -> Result<(), Error> {
        let asked = self
            .interruption
            .as_ref()
            .and_then(Interruption::received_signal);
        asked.map_or(Ok(()), |signal| Err(Error::Interrupted(signal)))
    }

    /// Reads and decodes bytes that arrive by `until_us`. Returns earlier, after [`POLL_US`], if no
    /// bytes arrive, so that signals and stalls are noticed. Returns the port's time at the end,
    /// µs.
    fn receive(&mut self, until_us: u64) -> Result<u64, Error> {
        self.check_signal()?;
        let now_us = self.mark_attended();
        self.asked_us = Some(now_us);
        let until_us = until_us.min(now_us + POLL_US);
        let received = self.port.receive(until_us);
        let now_us = self.port.now_us();
        self.stalls.record_look(now_us, until_us);
        let bytes = received.map_err(|error| match self.stalls.recent_us(now_us) {
            stalled_us @ ANSWER_US.. => {
                host_stalled(stalled_us, &format!("the connection broke ({error})"))
            }
            _ => error.into(),
        })?;
        self.client.receive(&bytes, now_us)?;
        Ok(now_us)
    }
}

fn locked(line: &Mutex<()>) -> MutexGuard<'_, ()> {
    line.lock().unwrap_or_else(PoisonError::into_inner)
}

fn host_stalled(stalled_us: u64, then: &impl ToString) -> Error {
    let (stalled_ms, then) = (stalled_us / 1000, then.to_string());
    Error::HostStalled { stalled_ms, then }
}

fn no_answer(request: &'static str) -> Error {
    let waited_ms = ANSWER_US / 1000;
    Error::NoAnswer { request, waited_ms }
}
