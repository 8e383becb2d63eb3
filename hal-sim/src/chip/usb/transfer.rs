//! Runs control transfers on the host's side: selects the next request and applies the device's
//! answers.

use super::request::{ADDRESS, ADDRESS_RECOVERY_MS, Control, Request};
use super::schedule::Pipe;
use super::{Failure, Host};
use crate::chip::Cycle;

impl Host {
    /// Begins `request` with the frame after `at`.
    pub(super) fn request(&mut self, request: Request, at: Cycle) {
        self.outlook = None;
        let control = Control::new(request, &self.device, self.total, at, self.hz);
        self.control = Some(control);
        self.control_pipe = Pipe {
            eligible: self.frames.start(self.frames.index(at) + 1),
            ..Pipe::default()
        };
    }

    pub(super) fn fail(&mut self, failure: Failure) {
        self.failure = Some(failure);
        self.control = None;
        self.open = false;
    }

    /// Handles a STALL in answer to a request: goes on to the next request if the device may refuse
    /// this one, otherwise fails.
    pub(super) fn handle_stall(&mut self, at: Cycle) {
        let Some(control) = self.control.take() else {
            return;
        };
        if control.request.may_stall() {
            self.request_next(control.request, at);
        } else {
            self.fail(Failure::Stalled(control.request.name()));
        }
    }

    /// Applies the answer of a fully served request, and begins the next request.
    pub(super) fn finish_request(&mut self, at: Cycle) {
        let Some(control) = self.control.take() else {
            return;
        };
        match control.request.accept(&control.received, &mut self.device) {
            Ok(total) => self.total = total.unwrap_or(self.total),
            Err(failure) => {
                self.fail(failure);
                return;
            }
        }
        match control.request {
            Request::Address => self.address = ADDRESS,
            Request::Configure => self.configure(),
            Request::Open => self.open = true,
            _ => {}
        }
        self.request_next(control.request, at);
    }

    fn request_next(&mut self, served: Request, at: Cycle) {
        let own = match served {
            Request::Foreign(_) => self.interrupted.take(),
            _ => served.next(&self.device),
        };
        if let Some((setup, data)) = self.foreign.pop_front() {
            self.interrupted = own;
            self.begin_other_request(setup, data, at + self.rest_after(served));
            return;
        }
        let next = own.or(self.line_state.take());
        if let Some(next) = next {
            self.request(next, at + self.rest_after(served));
        }
    }

    fn rest_after(&self, served: Request) -> Cycle {
        match served {
            Request::Address => ADDRESS_RECOVERY_MS * self.hz / 1_000,
            _ => 0,
        }
    }

    /// Begins another program's request with the frame after `at`.
    pub(super) fn begin_other_request(&mut self, setup: [u8; 8], data: Vec<u8>, at: Cycle) {
        self.request(Request::Foreign(setup), at);
        self.control = self.control.take().map(|control| control.with_data(data));
    }

    /// Prepares the pipes of a configured device; all endpoints begin with DATA0 (USB 2.0 9.1.1.5).
    fn configure(&mut self) {
        let pipe = |endpoint: super::Endpoint| Pipe {
            number: endpoint.number,
            max_packet: endpoint.max_packet,
            // Hosts round the interval down to a power of two (EHCI and xHCI lists).
            interval: 1 << u64::from(endpoint.interval.max(1)).ilog2(),
            ..Pipe::default()
        };
        self.notify = pipe(self.device.notify);
        self.data_in = pipe(self.device.data_in);
        self.data_out = pipe(self.device.data_out);
        self.configured = true;
    }

    /// Sends `request`, which sets or clears DTR and RTS, at `at` or as soon as endpoint 0 is free.
    pub(super) fn request_line_state(&mut self, request: Request, at: Cycle) {
        if !self.configured {
            return;
        }
        match self.control {
            Some(_) => self.line_state = Some(request),
            None => self.request(request, at),
        }
    }
}
