//! Requests to the device, and its messages, during a calibration.

use super::{Conduct, Procedure, describe_position};
use crate::calibration::instrument::Instrument;
use crate::calibration::{CalibrationError, Entry, Level};
use crate::link::{Error, Incoming, Port};
use crate::run::describe_event;
use firmware::link::{Event, Request};
use firmware::safety::StopCause;

/// Longest time for which the program waits, after a stop, for the device's report that the outputs
/// are disconnected, µs.
const STOP_US: u64 = 300_000;

impl<P: Port, M: Procedure> Conduct<'_, '_, P, M> {
    /// Configures and arms the electrode with the index `at` in the plan, and starts its train at
    /// amplitude 0.
    pub(super) fn arm(&mut self, at: usize) -> Result<(), CalibrationError> {
        if self.is_armed {
            self.stop()?;
        }
        self.clear_observations();
        (self.is_given, self.ended) = (false, None);
        self.instrument = Instrument::default();
        let Some(session) = self.sessions.get(at) else {
            return Ok(());
        };
        let requests = session.setup_requests();
        for request in requests {
            self.client.request(request)?;
        }
        self.is_armed = true;
        self.client.arm()?;
        let channel = self.machine.view(0).channel;
        let check_ma = self.arming_current_ma(channel)?;
        self.client.start()?;
        self.set_level(channel, Level(0))?;
        self.record(&Entry::Armed { channel, check_ma })
    }

    /// Returns the current that the electrode check measured on a channel when the device was
    /// armed, mA; `None` if the device reported none. The check uses a pulse below the threshold.
    pub(super) fn arming_current_ma(
        &mut self,
        channel: u8,
    ) -> Result<Option<f64>, CalibrationError> {
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
                read = Some(f64::from(current_ua) / 1e3);
            }
        }
        Ok(read)
    }

    pub(super) fn set_level(&mut self, channel: u8, level: Level) -> Result<(), CalibrationError> {
        let index = channel.saturating_sub(1);
        self.is_given |= level > Level(0);
        self.client.set_amplitudes(&[(index, level.amplitude())])?;
        self.is_given = level > Level(0);
        self.due_us = self.client.port().now_us() + self.keep_alive_us;
        Ok(())
    }

    /// Stops the device, and waits until it reports that the outputs are disconnected.
    pub(super) fn stop(&mut self) -> Result<(), Error> {
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

    /// Handles messages of the device until the time `until_us` of the port, and sends keep-alives
    /// unless a separate thread does.
    pub(super) fn wait_until(&mut self, until_us: u64) -> Result<(), CalibrationError> {
        while self.client.port().now_us() < until_us {
            if !self.is_kept && self.client.port().now_us() >= self.due_us {
                self.client.post(Request::KeepAlive)?;
                self.due_us = self.client.port().now_us() + self.keep_alive_us;
            }
            let soon_us = match self.is_kept {
                true => until_us,
                false => until_us.min(self.due_us),
            };
            while let Some(incoming) = self.client.next(soon_us)? {
                self.handle_message(incoming)?;
            }
        }
        Ok(())
    }

    pub(super) fn handle_message(&mut self, incoming: Incoming) -> Result<(), CalibrationError> {
        match incoming {
            Incoming::Event(
                _,
                happened @ (Event::Stopping(_) | Event::Stopped(_) | Event::Faulted(_)),
            ) => {
                self.note_end(&happened);
                let (view, hint) = (self.view(), advice(&happened));
                Err(CalibrationError::Ended(
                    describe_event(&happened),
                    describe_position(&view),
                    hint,
                ))
            }
            Incoming::Refused(_, refused) => Err(Error::Refused(refused).into()),
            _ => Ok(()),
        }
    }
}

/// Returns advice for the operator after the device ended stimulation with this event.
fn advice(event: &Event) -> &'static str {
    match event {
        Event::Faulted(_) => {
            "find the cause (an electrode, its lead), acknowledge the fault with --acknowledge"
        }
        Event::Stopping(StopCause::HostSilent) | Event::Stopped(StopCause::HostSilent) => {
            "the device received nothing from this computer; check the cable, close other \
             programs that use the port"
        }
        _ => "find the cause (for example the opened hand-held stop)",
    }
}
