//! Parses `monitor` commands that launchers send, from the servers of OpenOCD, J-Link and pyOCD.
//!
//! In: a line. Out: an action on the core, and a text to print. A command without meaning here is
//! answered with an explanation, so that a launcher continues and the user reads the reason.

/// Action of a `monitor` command on the core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// No action on the core.
    Nothing,
    /// Halts the core.
    Halt,
    /// Lets the core run.
    Resume,
    /// Resets the chip; the core halts at its first instruction or runs.
    Reset {
        /// Whether the core halts after the reset.
        halts: bool,
    },
    /// Turns semihosting on or off: whether BKPT 0xAB calls the debugger.
    Semihosting(bool),
    /// Removes breakpoints and watchpoints.
    Clear,
}

const HELP: &str = "\
reset [halt|init|run]  reset the chip; the core halts at its first instruction, or (run) runs
halt, resume           stop the core, let it run
clear                  remove all breakpoints and watchpoints
arm semihosting enable|disable  print semihosting output (BKPT 0xAB) here
version                print name and version of this server
help                   print this text
";

const NO_PROBE: &str = "nothing to do: the chip is simulated, so there is no probe\n";
const NO_TRACE: &str = "refused: the simulated chip has no trace port (ITM, SWO, TPIU, ETM)\n";

/// Returns the action of the `monitor` command `line`, and the text to print in the client.
pub fn parse_order(line: &str) -> (Order, String) {
    let words: Vec<&str> = line.split_whitespace().collect();
    let (order, text) = match *words.as_slice() {
        ["reset"] => (Order::Reset { halts: true }, ""),
        ["reset", "halt" | "init" | "0" | "1" | "2"] | ["soft_reset_halt" | "jtag_reset"] => {
            (Order::Reset { halts: true }, "")
        }
        ["reset", "run"] => (Order::Reset { halts: false }, ""),
        ["halt"] => (Order::Halt, ""),
        ["resume" | "go"] => (Order::Resume, ""),
        ["clear" | "clrbp"] | ["rbp" | "rwp", "all"] => (Order::Clear, ""),
        ["arm", "semihosting", "enable" | "1"] | ["semihosting", "enable" | "1"] => (
            Order::Semihosting(true),
            "semihosting output of the program (BKPT 0xAB) is printed here\n",
        ),
        ["arm", "semihosting", "disable" | "0"] | ["semihosting", "disable" | "0"] => {
            (Order::Semihosting(false), "")
        }
        ["version"] => (
            Order::Nothing,
            concat!(
                "Flexor's chip simulator ",
                env!("CARGO_PKG_VERSION"),
                ", STM32F405RG\n"
            ),
        ),
        [] | ["help"] => (Order::Nothing, HELP),
        ["swo" | "tpiu" | "itm" | "etm" | "SWO", ..] | [_, "swo" | "tpiu" | "itm", ..] => {
            (Order::Nothing, NO_TRACE)
        }
        [
            "speed"
            | "adapter"
            | "adapter_khz"
            | "interface"
            | "transport"
            | "endian"
            | "gdb_breakpoint_override"
            | "wait_halt"
            | "sleep"
            | "poll"
            | "gdb_sync"
            | "select"
            | "device",
            ..,
        ]
        | ["flash", "breakpoints" | "device" | "download", ..] => (Order::Nothing, NO_PROBE),
        _ => {
            let text = format!("unknown command: {line}; `monitor help` lists the commands\n");
            return (Order::Nothing, text);
        }
    };
    (order, text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn launchers_commands_are_understood() {
        for (line, order) in [
            ("reset halt", Order::Reset { halts: true }),
            ("  reset   init ", Order::Reset { halts: true }),
            ("reset", Order::Reset { halts: true }),
            ("reset run", Order::Reset { halts: false }),
            ("halt", Order::Halt),
            ("resume", Order::Resume),
            ("clrbp", Order::Clear),
            ("arm semihosting enable", Order::Semihosting(true)),
            ("semihosting disable", Order::Semihosting(false)),
        ] {
            assert_eq!(parse_order(line).0, order, "{line}");
        }
    }

    #[test]
    fn what_has_no_meaning_is_answered_in_words() {
        for (line, words) in [
            ("help", "reset [halt|init|run]"),
            ("version", "STM32F405"),
            ("speed 4000", "no probe"),
            ("adapter speed 2000", "no probe"),
            ("flash breakpoints = 1", "no probe"),
            ("swo enable", "refused"),
            ("SWO EnableTarget 0 0 1 0", "refused"),
            ("stm32f4x.tpiu enable", "unknown"),
            ("tpiu config internal", "refused"),
            ("itm port 0 on", "refused"),
            ("reset hlat", "unknown command: reset hlat"),
            ("flash erase_sector 0 0 1", "unknown"),
        ] {
            let (order, text) = parse_order(line);
            assert_eq!(order, Order::Nothing, "{line}");
            assert!(
                text.contains(words) && text.ends_with('\n'),
                "{line}: {text}"
            );
        }
    }
}
