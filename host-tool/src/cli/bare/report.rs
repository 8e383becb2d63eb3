//! Report about a run of `flexor chip`.

use super::{ProgramOutput, RunEnd, pin_name};
use hal_sim::chip::bare::{Bare, EarlyEnd};
use hal_sim::chip::soc::rcc::Cause;
use serde_json::{Map, Value, json};

/// Largest number of pins that the text lists; the JSON output has all.
const MOST_PINS: usize = 12;
/// Largest number of faults that the text lists.
const MOST_FAULTS: usize = 3;

/// Result of a run, for text and JSON.
pub struct Report {
    ending: &'static str,
    status: Option<u32>,
    seconds: f64,
    cycles: u64,
    instructions: u64,
    clock_hz: u32,
    pc: u32,
    function: String,
    sleeps: bool,
    /// Number of edges of each pin that changed, by name.
    pins: Vec<(String, u64)>,
    resets: Vec<(f64, &'static str)>,
    faults: Vec<Fault>,
    unclocked: u64,
    usb: Option<String>,
    console: String,
    uart: String,
}

/// Time of a fault, s; its description; its registers.
type Fault = (f64, String, Vec<(&'static str, u32)>);

impl Report {
    /// Collects the results of `bare` after it ended with `ended`.
    pub fn new(bare: &Bare, ended: &RunEnd, heard: &ProgramOutput) -> Self {
        let (ending, status) = match ended {
            RunEnd::Time => ("time", None),
            RunEnd::Signal(_) => ("signal", None),
            RunEnd::Itself(EarlyEnd::Exit(status)) => ("exit", Some(*status)),
            RunEnd::Itself(EarlyEnd::InHandler) => ("fault", None),
            RunEnd::Itself(EarlyEnd::Stopped(_)) => ("stopped", None),
        };
        let toggles = bare.wires.toggles().iter().enumerate();
        let pins = toggles.flat_map(|(port, pins)| {
            let counts = pins.iter().enumerate();
            counts.map(move |(pin, count)| (pin_name(port, pin), *count))
        });
        let symbols = &bare.image().symbols;
        let faults = bare.faults().iter();
        let (pc, function) = bare.location();
        Self {
            ending,
            status,
            seconds: bare.now_ns() as f64 * 1e-9,
            cycles: bare.cycles(),
            instructions: bare.instructions(),
            clock_hz: bare.wires.soc.hz(),
            pc,
            function,
            sleeps: bare.sleeps_for_good(),
            pins: pins.filter(|(_, count)| *count > 0).collect(),
            resets: (bare.resets().iter())
                .map(|(ns, cause)| (*ns as f64 * 1e-9, name(*cause)))
                .collect(),
            faults: faults
                .map(|fault| {
                    (
                        fault.ns as f64 * 1e-9,
                        fault.describe(symbols),
                        fault.registers(),
                    )
                })
                .collect(),
            unclocked: bare.wires.soc.unclocked,
            usb: bare.wires.host().map(|host| match host.failure() {
                Some(failure) => failure.to_string(),
                None if host.is_open() => "open".to_owned(),
                None => "no serial port appeared".to_owned(),
            }),
            console: String::from_utf8_lossy(&heard.console).into_owned(),
            uart: String::from_utf8_lossy(&heard.uart).into_owned(),
        }
    }

    /// Formats the report for people.
    pub fn to_text(&self) -> String {
        let mut out = format!(
            "{:.6} s of device time, {} cycles, {} instructions; the core's clock is {} Hz\n",
            self.seconds, self.cycles, self.instructions, self.clock_hz
        );
        let place = format!("pc {:#010x}, in {}", self.pc, self.function);
        out.push_str(&match (self.ending, self.status) {
            (_, Some(status)) => format!("ended: the image exited with status {status}\n"),
            ("time", _) if self.sleeps => {
                format!(
                    "ended: the given time is over; the core sleeps, nothing wakes it ({place})\n"
                )
            }
            ("time", _) => format!("ended: the given time is over ({place})\n"),
            ("signal", _) => format!("ended: by a signal ({place})\n"),
            _ => format!("ended: the image stopped ({place})\n"),
        });
        for (at, words, registers) in self.faults.iter().take(MOST_FAULTS) {
            out.push_str(&format!("fault after {at:.6} s: {words}\n"));
            let registers = registers
                .iter()
                .map(|(name, value)| format!("{name} {value:#010x}"));
            let registers: Vec<String> = registers.collect();
            for row in registers.chunks(4) {
                out.push_str(&format!("  {}\n", row.join("  ")));
            }
        }
        write_omitted_count(&mut out, "faults", self.faults.len(), MOST_FAULTS);
        if let Some((at, cause)) = self.resets.last() {
            let count = self.resets.len();
            out.push_str(&format!(
                "resets: {count}, the last by {cause} after {at:.6} s\n"
            ));
        }
        if self.unclocked > 0 {
            out.push_str(&format!(
                "accesses to peripherals without a clock (reads give 0, writes do nothing): {}\n",
                self.unclocked
            ));
        }
        if let Some(usb) = &self.usb {
            out.push_str(&format!("USB: {usb}\n"));
        }
        if self.pins.is_empty() {
            out.push_str("pins: none changed\n");
        }
        for (name, count) in self.pins.iter().take(MOST_PINS) {
            out.push_str(&format!("pin {name}: {count} edges\n"));
        }
        write_omitted_count(&mut out, "pins", self.pins.len(), MOST_PINS);
        out.trim_end().to_owned()
    }

    /// Formats the report as JSON.
    pub fn to_json(&self) -> Value {
        let pins: Map<String, Value> = (self.pins.iter())
            .map(|(name, count)| (name.clone(), json!(count)))
            .collect();
        let faults = self.faults.iter().map(|(at, words, registers)| {
            let registers: Map<String, Value> = (registers.iter())
                .map(|(name, value)| ((*name).to_owned(), json!(value)))
                .collect();
            json!({ "seconds": at, "what": words, "registers": registers })
        });
        let resets = self.resets.iter();
        let resets = resets.map(|(at, cause)| json!({ "seconds": at, "cause": cause }));
        json!({
            "ended": self.ending, "status": self.status, "seconds": self.seconds,
            "cycles": self.cycles, "instructions": self.instructions,
            "clock_hz": self.clock_hz, "pc": self.pc, "function": self.function,
            "sleeps_for_good": self.sleeps, "pin_edges": pins,
            "resets": resets.collect::<Vec<_>>(), "faults": faults.collect::<Vec<_>>(),
            "unclocked_accesses": self.unclocked, "usb": self.usb,
            "console": self.console, "uart": self.uart,
        })
    }
}

fn write_omitted_count(out: &mut String, noun: &str, count: usize, most: usize) {
    if count > most {
        out.push_str(&format!(
            "and {} more {noun}; --json lists all\n",
            count - most
        ));
    }
}

const fn name(cause: Cause) -> &'static str {
    match cause {
        Cause::PowerOn => "power",
        Cause::BrownOut => "brown-out",
        Cause::Pin => "NRST",
        Cause::Software => "software",
        Cause::Watchdog => "the watchdog",
    }
}
