//! Carries out the attached client's commands on the board.

use super::command::{self, Feature, Meaning};
use super::monitor::Order;
use super::packet::PacketEvent;
use super::refused::GdbRefusal;
use super::{AfterDebugger, Core, Debugger, SIGTRAP};
use crate::chip::board::BoardError;
use crate::chip::cpu::semihosting::Semihosting;
use firmware::link::message::ResetCause;

impl Debugger {
    /// Carries out `heard`, a packet or an interrupt (Ctrl-C) of the client.
    ///
    /// # Errors
    /// Fails if the client ended the run.
    pub(super) fn handle_event(&mut self, heard: PacketEvent) -> Result<(), BoardError> {
        let is_attached = self.is_attached();
        let meaning = match &heard {
            PacketEvent::Packet(packet) if !is_attached && command::needs_core(packet) => Err(
                GdbRefusal::Address("no program is being debugged; attach or run first"),
            ),
            PacketEvent::Packet(packet) => command::parse_command(&mut self.board, packet),
            PacketEvent::TooLong => Err(GdbRefusal::TooLong),
            PacketEvent::Damaged | PacketEvent::Again => Err(GdbRefusal::Malformed),
            PacketEvent::Interrupt => {
                if is_attached && self.core != Core::Halted {
                    self.halt("T02thread:1;".to_owned());
                }
                return Ok(());
            }
        };
        match meaning {
            Ok(Meaning::Answer(answer)) => self.send(&answer),
            Ok(Meaning::Agree(agreed, answer)) => {
                self.send(&answer);
                self.apply_agreement(agreed);
            }
            Ok(Meaning::Status) => {
                self.clear_pending_reply();
                if !is_attached {
                    self.attach();
                } else if self.core != Core::Halted {
                    self.halt(SIGTRAP.to_owned());
                }
                self.send_status();
            }
            Ok(Meaning::Go { steps }) => self.resume(steps),
            Ok(Meaning::Detach) => {
                self.send(b"OK");
                self.release_client();
                self.detach();
            }
            Ok(Meaning::Kill { is_answered }) => {
                if is_answered {
                    self.send(b"OK");
                }
                self.release_client();
                if self.outlives == AfterDebugger::Nothing {
                    return Err(BoardError::Killed);
                }
                self.clear_debugger_state();
                self.reset();
            }
            Ok(Meaning::Restart { is_answered }) => {
                self.clear_pending_reply();
                if !is_attached {
                    self.attach();
                }
                self.reset();
                if is_answered {
                    self.send_status();
                }
            }
            Ok(Meaning::Monitor(order, said)) => self.carry_out_order(order, &said),
            Err(refused) => {
                let in_words = self
                    .client
                    .as_ref()
                    .is_some_and(|client| client.reads_words);
                self.send(refused.answer(in_words).as_bytes());
            }
        }
        Ok(())
    }

    /// Notes that the client no longer waits for a stop reply.
    fn clear_pending_reply(&mut self) {
        if let Some(client) = &mut self.client {
            client.waits = false;
        }
    }

    fn apply_agreement(&mut self, agreed: Feature) {
        let Some(client) = &mut self.client else {
            return;
        };
        match agreed {
            Feature::Knows { breaks, words } => {
                (client.knows_breaks, client.reads_words) = (breaks, words);
            }
            Feature::NoAcknowledgements => client.acknowledges = false,
        }
    }

    /// Notes that the client has left, so that another client can be attached to the core.
    fn release_client(&mut self) {
        if let Some(client) = &mut self.client {
            (client.has_left, client.waits) = (true, false);
        }
    }

    fn resume(&mut self, steps: bool) {
        if let Some(client) = &mut self.client {
            client.waits = true;
        }
        if self.core == Core::Halted {
            self.start(steps);
        }
    }

    fn start(&mut self, steps: bool) {
        if self.pass_breakpoint_instruction() && steps {
            return self.halt(SIGTRAP.to_owned());
        }
        self.core = if steps { Core::Steps } else { Core::Runs };
        self.board.observer.leaves = true;
    }

    /// Resets the chip and halts the core at its first instruction.
    fn reset(&mut self) {
        self.stopped_by = None;
        self.halt(SIGTRAP.to_owned());
        if let Err(error) = self.board.reset_with_cause(ResetCause::Software) {
            self.print(&format!("{error}\n"));
        }
    }

    fn carry_out_order(&mut self, order: Order, message: &str) {
        self.print(message);
        match order {
            Order::Nothing => {}
            Order::Halt if self.core == Core::Halted => {}
            Order::Halt => self.halt(SIGTRAP.to_owned()),
            Order::Resume if self.core == Core::Halted => self.start(false),
            Order::Resume => {}
            Order::Reset { halts } => {
                self.reset();
                if !halts {
                    self.start(false);
                }
            }
            Order::Semihosting(is_on) => {
                self.board.cpu.system.semihosting = is_on.then(Semihosting::default);
            }
            Order::Clear => self.clear_points(),
        }
        self.send(b"OK");
    }
}
