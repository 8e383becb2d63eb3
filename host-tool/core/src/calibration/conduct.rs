//! The course of a calibration on a device: the machine's actions, one electrode armed at
//! a time, the host alive, the instrument read.

use super::instrument::{Instrument, READ_US};
use super::journal::Entry;
use super::operator::Gone;
use super::{
    Action, CalibrationError, Files, Found, Journal, Level, Machine, Operator, Phase, Plan,
    Refusal, Told, View, setup, worn,
};
use crate::link::{Client, Error, Incoming, Interruption, Port};
use crate::run::{acknowledge, event};
use crate::session::Session;
use firmware::link::{Event, Request};
use std::path::Path;

/// From look to look at operator and machine, µs.
const LOOK_US: u64 = 5_000;

/// Longest wait for the outputs to be reported isolated after a stop, µs.
const STOP_US: u64 = 300_000;

/// Where a course writes, and who is asked.
pub struct Course<'a> {
    /// What is calibrated.
    pub plan: &'a Plan,
    /// The wearer file.
    pub out: &'a Path,
    /// Where files go.
    pub files: &'a dyn Files,
    /// What happened before, of an earlier journal; its head's entry included.
    pub before: &'a [Entry],
    /// Who and what the file's history names.
    pub head: &'a super::Head,
    /// Ends it at once.
    pub interruption: Option<Interruption>,
    /// Whether a latched fault is acknowledged first.
    pub acknowledges: bool,
}

/// What a course came to.
#[derive(Clone, PartialEq, Debug)]
pub struct Finished {
    /// By electrode of the plan.
    pub found: Vec<Found>,
    /// How long it took, s of the device's time.
    pub t_s: f64,
    /// Presentations.
    pub given: usize,
}

/// A device under way.
struct Conduct<'a, P> {
    client: Client<P>,
    course: &'a Course<'a>,
    sessions: Vec<Session>,
    machine: Machine,
    journal: &'a mut Journal,
    operator: &'a mut dyn Operator,
    instrument: Instrument,
    /// What the last presentation came to, for the view.
    seen: View,
    /// When the device is owed a sign of life, and the instrument a reading, µs.
    due_us: u64,
    read_us: u64,
    begun_us: u64,
    keep_alive_us: u64,
    is_armed: bool,
    given: usize,
}

/// Carries out `course` through `port` and gives the port back, as far as there is one.
/// Whatever ends it, the device is asked to stop first.
///
/// # Errors
/// [`CalibrationError`]: what ended it; journal and wearer file are whole.
pub fn calibrate<P: Port>(
    port: P,
    course: &Course<'_>,
    journal: &mut Journal,
    operator: &mut dyn Operator,
) -> (Result<Finished, CalibrationError>, Option<P>) {
    let opened = setup::sessions(course.plan).and_then(|sessions| {
        let port = match course.acknowledges {
            true => acknowledge(port)?,
            false => port,
        };
        let (client, _) = Client::open_interruptible(port, course.interruption.clone())?;
        Ok((sessions, client))
    });
    let (sessions, mut client) = match opened {
        Ok(opened) => opened,
        Err(error) => return (Err(error), None),
    };
    let begun_us = client.port().now_us();
    let timeout_ms = sessions.first().map_or(40, |it| it.wearer.host_timeout_ms);
    let mut conduct = Conduct {
        client,
        sessions,
        machine: Machine::new(course.plan.clone(), course.before),
        course,
        journal,
        operator,
        instrument: Instrument::default(),
        seen: View::default(),
        due_us: begun_us,
        read_us: begun_us,
        begun_us,
        keep_alive_us: u64::from(timeout_ms) * 1000 / 4,
        is_armed: false,
        given: 0,
    };
    let result = conduct.run();
    conduct.close(result)
}

impl<P: Port> Conduct<'_, P> {
    fn run(&mut self) -> Result<(), CalibrationError> {
        let entry = Entry::Begun(self.course.head.clone());
        self.record(&entry)?;
        let first = self.machine.begin();
        self.act(first)?;
        while !self.machine.is_over() {
            let until_us = self.client.port().now_us() + LOOK_US;
            self.pass(until_us)?;
            self.look()?;
        }
        self.record(&Entry::Done)
    }

    /// Stops the device, whatever happened; then the journal says why.
    fn close(
        mut self,
        result: Result<(), CalibrationError>,
    ) -> (Result<Finished, CalibrationError>, Option<P>) {
        self.client.ignore_signals();
        let stopped = match self.is_armed {
            true => self.stop(),
            false => Ok(()),
        };
        let result = result.and(stopped.map_err(CalibrationError::from));
        if let Err(error) = &result {
            let why = error.to_string();
            let _ = self.record(&Entry::Ended { why }); // the first error is the one to tell
        }
        let finished = Finished {
            found: self.machine.found().to_vec(),
            t_s: self.t_us() as f64 * 1e-6,
            given: self.given,
        };
        (result.map(|()| finished), Some(self.client.into_port()))
    }

    fn t_us(&mut self) -> u64 {
        self.client.port().now_us().saturating_sub(self.begun_us)
    }

    /// Device, instrument, operator and machine, once.
    fn look(&mut self) -> Result<(), CalibrationError> {
        self.read();
        let t_us = self.t_us();
        let was_on = self.machine.is_on();
        let actions = self.machine.pass(t_us);
        let is_given = was_on && !self.machine.is_on();
        self.act(actions)?;
        if is_given {
            self.judge()?;
        }
        let view = self.view();
        match self.operator.order(&view) {
            Ok(None) => Ok(()),
            Ok(Some(Ok(order))) => {
                let t_us = self.t_us();
                let was_on = self.machine.is_on();
                match self.machine.order(t_us, &order) {
                    Ok(actions) => {
                        if order.raises() || (was_on && !self.machine.is_on()) {
                            self.forget();
                        }
                        self.act(actions)
                    }
                    Err(refusal) => {
                        self.tell_refusal(&refusal);
                        Ok(())
                    }
                }
            }
            Ok(Some(Err(nonsense))) => {
                self.operator.tell(Told::Nonsense(&nonsense), &view);
                Ok(())
            }
            Err(Gone) => Err(CalibrationError::Gone(place(&view))),
        }
    }

    fn tell_refusal(&mut self, refusal: &Refusal) {
        let view = self.view();
        self.operator.tell(Told::Refused(refusal), &view);
    }

    fn act(&mut self, actions: Vec<Action>) -> Result<(), CalibrationError> {
        // Silence first, then everything that may take time.
        for action in actions {
            match action {
                Action::Arm(at) => self.arm(at)?,
                Action::Give(channel, level) => self.give(channel, level)?,
                Action::Record(entry) => self.record(&entry)?,
                Action::Write => self.write()?,
                Action::Tell(refusal) => self.tell_refusal(&refusal),
                Action::Abort => {
                    let view = self.view();
                    return Err(CalibrationError::Aborted(place(&view)));
                }
            }
        }
        Ok(())
    }

    fn record(&mut self, entry: &Entry) -> Result<(), CalibrationError> {
        let t_s = self.t_us() as f64 * 1e-6;
        if matches!(entry, Entry::Given { .. }) {
            self.given += 1;
        }
        self.journal.add(t_s, entry)?;
        let view = self.view();
        self.operator.tell(Told::Recorded(entry), &view);
        Ok(())
    }

    /// The wearer file, with all that is complete.
    fn write(&mut self) -> Result<(), CalibrationError> {
        let found = self.machine.found();
        let limits = self.sessions.first().map(|it| it.wearer);
        let (plan, head) = (self.course.plan, self.course.head);
        let limits = limits.unwrap_or_default();
        let wearer = worn::wearer(plan, self.course.before, head, limits, found);
        let electrodes = wearer.electrodes.len();
        if electrodes > 0 {
            worn::write(self.course.files, self.course.out, &wearer)?;
            self.record(&Entry::Written { electrodes })?;
            let view = self.view();
            self.operator.tell(Told::Written, &view);
        }
        Ok(())
    }

    /// Configures and arms one electrode, and starts its train in silence.
    fn arm(&mut self, at: usize) -> Result<(), CalibrationError> {
        if self.is_armed {
            self.stop()?;
        }
        self.forget();
        self.instrument = Instrument::default();
        let Some(session) = self.sessions.get(at) else {
            return Ok(());
        };
        let requests = session.requests();
        for request in requests {
            self.client.request(request)?;
        }
        self.is_armed = true;
        self.client.arm()?;
        let channel = self.course.plan.electrodes[at].channel;
        let check_ma = self.checked(channel)?;
        self.client.start()?;
        self.give(channel, Level(0))?;
        self.record(&Entry::Armed { channel, check_ma })
    }

    /// What arming's sub-threshold pulse read of a channel, mA.
    fn checked(&mut self, channel: u8) -> Result<Option<f64>, CalibrationError> {
        let now_us = self.client.port().now_us();
        let mut read = None;
        while let Some(incoming) = self.client.next(now_us)? {
            if let Incoming::Event(
                _,
                Event::Electrode {
                    channel: index,
                    current_ua,
                    ..
                },
            ) = incoming
                && index + 1 == channel
            {
                read = Some(f64::from(current_ua) * 1e-3);
            }
        }
        Ok(read)
    }

    fn give(&mut self, channel: u8, level: Level) -> Result<(), CalibrationError> {
        let index = channel.saturating_sub(1);
        self.client.amplitudes(&[(index, level.amplitude())])?;
        self.due_us = self.client.port().now_us() + self.keep_alive_us;
        Ok(())
    }

    /// Asks for a stop, and waits until the outputs are reported isolated.
    fn stop(&mut self) -> Result<(), Error> {
        self.is_armed = false;
        self.client.stop()?;
        let until_us = self.client.port().now_us() + STOP_US;
        while let Some(incoming) = self.client.next(until_us)? {
            if let Incoming::Event(_, Event::Stopped(_) | Event::Faulted(_)) = incoming {
                break;
            }
        }
        Ok(())
    }

    /// Lets time pass until `until_us`, the host alive.
    fn pass(&mut self, until_us: u64) -> Result<(), CalibrationError> {
        while self.client.port().now_us() < until_us {
            if self.client.port().now_us() >= self.due_us {
                self.client.post(Request::KeepAlive)?;
                self.due_us = self.client.port().now_us() + self.keep_alive_us;
            }
            let soon_us = until_us.min(self.due_us);
            while let Some(incoming) = self.client.next(soon_us)? {
                self.heed(incoming)?;
            }
        }
        Ok(())
    }

    fn heed(&mut self, incoming: Incoming) -> Result<(), CalibrationError> {
        match incoming {
            Incoming::Event(
                _,
                happened @ (Event::Stopping(_) | Event::Stopped(_) | Event::Faulted(_)),
            ) => {
                let (view, what) = (self.view(), advice(&happened));
                Err(CalibrationError::Ended(
                    event(&happened),
                    place(&view),
                    what,
                ))
            }
            Incoming::Refused(_, refused) => Err(Error::Refused(refused).into()),
            _ => Ok(()),
        }
    }

    /// Reads the instrument, and what a simulated wearer shows.
    fn read(&mut self) {
        let now_us = self.client.port().now_us();
        if now_us < self.read_us {
            return;
        }
        self.read_us = now_us + READ_US;
        let t_us = self.t_us();
        let is_on = self.machine.is_on();
        let Some(world) = self.client.port().world() else {
            return;
        };
        // Nobody looks back at what was put out long ago.
        let (reading, moving) = (world.body.instrument_n(), world.body.seen_moving());
        self.seen.complains = world.body.complains();
        self.seen.reading_n = reading;
        if is_on {
            self.seen.moving = moving;
        }
        if let Some(n) = reading {
            self.instrument.read(t_us, n, is_on);
        }
    }

    fn judge(&mut self) -> Result<(), CalibrationError> {
        self.seen.judged = self.instrument.judge()?;
        if let Some(judged) = self.seen.judged {
            let channel = self.machine.view(0).channel;
            self.record(&Entry::Judged {
                channel,
                moved: judged.moved,
                deviation_n: judged.deviation_n,
                bound_n: judged.bound_n,
            })?;
        }
        Ok(())
    }

    fn forget(&mut self) {
        self.seen.judged = None;
        self.seen.moving.clear();
    }

    fn view(&mut self) -> View {
        let t_us = self.t_us();
        let view = self.machine.view(t_us);
        View {
            reading_n: self.seen.reading_n,
            is_rested: self.seen.reading_n.is_none() || self.instrument.is_rested(),
            judged: self.seen.judged,
            moving: self.seen.moving.clone(),
            complains: self.seen.complains,
            ..view
        }
    }
}

/// Where it stood, in words.
fn place(view: &View) -> String {
    match view.phase {
        Phase::Done => "the end".to_owned(),
        _ => format!(
            "electrode {} of {} (channel {}), {}",
            view.electrode,
            view.of,
            view.channel,
            view.step.name()
        ),
    }
}

/// What to do when a device ends it.
fn advice(event: &Event) -> &'static str {
    match event {
        Event::Faulted(_) => {
            "find the cause (an electrode, its lead), acknowledge the fault with --acknowledge"
        }
        _ => "find out why (the hand-held stop, a stalled computer)",
    }
}
