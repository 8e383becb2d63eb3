//! A client and its port: requests that wait for their answers, in the port's time.

use super::clock::Fit;
use super::stall::Stalls;
use super::{Client, Error, Incoming, Interruption, Keeper, Outlet, Port, SimulatedPort};
use firmware::link::{HelloInfo, Request, Status};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How long an ordinary answer may take, µs.
const ANSWER_US: u64 = 500_000;

/// Longest wait between two looks for a signal or a stall, µs of port time; a multiple
/// of the steps in which virtual time goes on, so that it changes nothing there.
const POLL_US: u64 = 2_000;

/// What a wait for messages came to.
#[derive(Clone, Debug)]
pub enum Polled {
    /// A message.
    Message(Incoming),
    /// None yet: the time that was given is not over.
    Waiting,
    /// The time is over, and every message that came by then was taken.
    Over,
}

/// A session with a device behind a port.
pub struct Connection<P> {
    port: P,
    client: Client,
    keeper: Option<Keeper>,
    interruption: Option<Interruption>,
    /// When the port was last asked for bytes, µs.
    asked_us: Option<u64>,
    stalls: Stalls,
    /// Held while a frame is numbered and sent: one at a time, in the order of numbers.
    line: Arc<Mutex<()>>,
}

impl<P: Port> Connection<P> {
    /// Opens a session through `port`.
    ///
    /// # Errors
    /// The device refuses (another schema, another host) or does not answer.
    pub fn open(port: P) -> Result<(Self, HelloInfo), Error> {
        Self::open_interruptible(port, None)
    }

    /// The same, and every wait ends soon after a signal, with
    /// [`Error::Interrupted`]. What to stop is the caller's to decide.
    ///
    /// # Errors
    /// As [`Connection::open`], and the signal.
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

    /// Opens the session again, for instance after a reset.
    ///
    /// # Errors
    /// As [`Connection::open`].
    pub fn hello(&mut self) -> Result<HelloInfo, Error> {
        self.keeper = None; // it speaks in the session before
        let sent_us = self.attend();
        self.port.send(&Client::BREAK)?;
        let (seq, frame) = self.client.hello(sent_us);
        self.port.send(&frame)?;
        match self.await_answer("Hello", seq, sent_us)? {
            Incoming::Hello(info) => Ok(*info),
            _ => Err(no_answer("Hello")),
        }
    }

    /// The same session with a copy of the simulated device, which goes on alone; nothing
    /// where that cannot be copied.
    #[must_use]
    pub fn snapshot(&self) -> Option<Connection<SimulatedPort>> {
        Some(Connection {
            port: self.port.snapshot()?,
            client: self.client.snapshot(),
            keeper: None,
            interruption: self.interruption.clone(),
            asked_us: self.asked_us,
            stalls: self.stalls,
            line: Arc::default(),
        })
    }

    /// From now on waits last as long as they must: for the answer to a stop.
    pub fn ignore_signals(&mut self) {
        self.interruption = None;
    }

    /// The port.
    pub fn port(&mut self) -> &mut P {
        &mut self.port
    }

    /// From now on a thread of its own tells the device every `period` that the host is
    /// alive, as long as [`Self::next`] is called. Whether it does: where time is virtual,
    /// the caller must.
    ///
    /// # Errors
    /// [`Error::Lost`]: the port, or the system gives no thread.
    pub fn keep_alive_apart(&mut self, period: Duration) -> Result<bool, Error> {
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

    /// What sends keep-alives by itself, if something does.
    pub const fn keeper(&self) -> Option<&Keeper> {
        self.keeper.as_ref()
    }

    /// Gives the port back; the device notices silence.
    pub fn into_port(self) -> P {
        self.port
    }

    /// Device time at host time `host_us`, µs, as far as answers tell.
    pub fn device_time(&self, host_us: u64) -> Option<u64> {
        self.client.device_time(host_us)
    }

    /// The device's clock against the host's, over the whole session.
    pub fn clock_fit(&self) -> Option<Fit> {
        self.client.clock_fit()
    }

    /// Asks for state, faults and counters.
    ///
    /// # Errors
    /// [`Error`].
    pub fn status(&mut self) -> Result<Status, Error> {
        match self.call("Status", Request::Status)? {
            Incoming::Status(_, status) => Ok(*status),
            _ => Err(no_answer("Status")),
        }
    }

    /// Sends a request without waiting; its answer comes as [`Incoming`].
    ///
    /// # Errors
    /// [`Error::Lost`], [`Error::TooLarge`].
    pub fn post(&mut self, request: Request) -> Result<u16, Error> {
        let now_us = self.port.now_us();
        self.send("request", request, now_us)
    }

    /// The next message that nobody waits for, by `until_us` at the latest: asked again
    /// and again, it says `None` soon after that, however many messages come.
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

    /// Whether a message waits, so that [`Self::poll`] does not look at the port.
    pub fn has_message(&self) -> bool {
        self.client.has_message()
    }

    /// One step of [`Self::next`]: looks at the port once where no message waits, for 2 ms
    /// of its time at most.
    ///
    /// # Errors
    /// [`Error::Lost`].
    pub fn poll(&mut self, until_us: u64) -> Result<Polled, Error> {
        if let Some(keeper) = &self.keeper {
            keeper.attend();
        }
        if let Some(incoming) = self.client.take_message() {
            return Ok(Polled::Message(incoming));
        }
        // What had come by then was taken: more would have no end if the device has none.
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

    /// Sends `request`, called `name` in errors, and waits for its acknowledgement:
    /// the device time of it, µs.
    pub(super) fn ack(&mut self, name: &'static str, request: Request) -> Result<u64, Error> {
        match self.call(name, request)? {
            Incoming::Acknowledged(_, at) => Ok(at),
            _ => Err(no_answer(name)),
        }
    }

    /// Checks the draft and the electrodes, and arms: the setup that the requests
    /// acknowledged so far come to, and no other.
    ///
    /// # Errors
    /// Refused, not answered, or the device is lost.
    pub fn arm(&mut self) -> Result<u64, Error> {
        let request = self.client.arm_request();
        self.ack("Arm", request)
    }

    fn call(&mut self, name: &'static str, request: Request) -> Result<Incoming, Error> {
        let sent_us = self.attend();
        let seq = self.send(name, request, sent_us)?;
        self.await_answer(name, seq, sent_us)
    }

    /// The program is here at this time, µs.
    fn attend(&mut self) -> u64 {
        let now_us = self.port.now_us();
        self.stalls.look(now_us, 0);
        now_us
    }

    /// Waits for the answer to the request `seq`, sent at `sent_us`. The time in which this
    /// computer does not run the program is not the device's: it has as much longer.
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
                    true => host_stalled(stalled_us, &format!("no answer to {name} came then")),
                    false => no_answer(name),
                });
            }
            self.receive(until_us)?;
            match self.client.answer(seq) {
                Some(Incoming::Refused(_, refused)) => return Err(Error::Refused(refused)),
                Some(answer) => return Ok(answer),
                None => {}
            }
        }
    }

    /// The longest time of the last two seconds in which this computer did not run the
    /// program, as far as the port shows, µs; 0 for none above 10 ms.
    pub fn stalled_us(&mut self) -> u64 {
        let now_us = self.port.now_us();
        self.stalls.recent_us(now_us)
    }

    /// The sum of all such times since the session was opened, µs.
    pub(crate) fn stalled_in_sum_us(&self) -> u64 {
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

    /// Whether to go on waiting.
    fn heed_signal(&self) -> Result<(), Error> {
        let asked = self.interruption.as_ref().and_then(Interruption::asked);
        asked.map_or(Ok(()), |signal| Err(Error::Interrupted(signal)))
    }

    /// Takes what arrives by `until_us`, or nothing before that: after [`POLL_US`] signals and
    /// stalls are looked for. Returns the port's time then, µs.
    fn receive(&mut self, until_us: u64) -> Result<u64, Error> {
        self.heed_signal()?;
        let now_us = self.attend();
        self.asked_us = Some(now_us);
        let until_us = until_us.min(now_us + POLL_US);
        let received = self.port.receive(until_us);
        let now_us = self.port.now_us();
        self.stalls.look(now_us, until_us);
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
