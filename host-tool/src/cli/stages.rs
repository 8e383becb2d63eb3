//! `flexor stages`: prints the output stages of a board, or stores them on it.

use super::{Output, interrupt, usage_error};
use anyhow::Context;
use clap::{Args, ValueEnum};
use firmware::link::HelloInfo;
use firmware::pulse::CHANNELS;
use firmware::safety::{Origin, StageKind, StageSupply, StageTable, Stages, State};
use host_core::link::{Connection, Port};
use host_core::run::{DeviceName, describe_option_bytes, describe_stages};
use serde_json::json;
use std::io::{BufRead, IsTerminal, Write};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Time that a board may take to store the stages and restart: erasing takes up to 2 s for each
/// copy.
const RESTART: Duration = Duration::from_secs(20);

/// Print or store which output stages a board has
#[derive(Args, Debug)]
pub struct StagesArgs {
    /// A serial port or tcp:HOST:PORT
    #[arg(long)]
    device: DeviceName,
    /// Channels and full scale, such as 1-5=100mA or 6=60V: the board stores these, notes that all
    /// other channels have no stage, and restarts
    #[arg(long, value_name = "CHANNELS=FULL SCALE", num_args = 1.., requires = "supply")]
    store: Vec<String>,
    /// Supply of the stored stages (docs/reference/hardware.md)
    #[arg(long, requires = "store")]
    supply: Option<SupplyName>,
    /// Store without asking
    #[arg(long, requires = "store")]
    yes: bool,
}

/// Supply of a board's output stages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SupplyName {
    /// One high-voltage supply and one return: no opposite directions at the same time
    Common,
    /// Each stage drives either direction, independent of the others
    Separate,
}

impl From<SupplyName> for StageSupply {
    fn from(name: SupplyName) -> Self {
        match name {
            SupplyName::Common => Self::Common,
            SupplyName::Separate => Self::Separate,
        }
    }
}

/// # Errors
/// Fails if the options make no valid table, if no board answers or it refuses, or if the restarted
/// board reports another table.
pub fn main(args: &StagesArgs, output: Output) -> anyhow::Result<()> {
    let wanted = match args.supply {
        Some(supply) => Some((parse(&args.store)?, StageSupply::from(supply))),
        None => None, // clap requires both options or neither
    };
    if !args.device.is_port() {
        return usage_error(format!(
            "--device is {}, which has the stages of its session; give a board's port",
            args.device
        ));
    }
    let interruption = interrupt::catch_signals()?;
    let port = args.device.connect()?;
    let (mut client, info) = Connection::open_interruptible(port, Some(interruption))?;
    let Some((stages, supply)) = wanted else {
        return print_stages(&info, output);
    };
    let table = StageTable {
        origin: Origin::Owner,
        supply: Some(supply),
        stages,
    };
    anyhow::ensure!(
        info.state == State::Idle,
        "E538 the board is {:?} and stores stages only when Idle; first stop it or acknowledge its \
         fault",
        info.state
    );
    let will = describe_stages(&Stages::Stored(table)).join("\n");
    if !args.yes && !ask_permission(&args.device, &will)? {
        return usage_error("nothing was stored; answer y to the question, or give --yes");
    }
    client.store_stages(stages, supply)?;
    let info = reconnect(&args.device, client.into_port())?;
    anyhow::ensure!(
        info.stages == Stages::Stored(table),
        "E539 the board restarted with stages that differ from those sent: {}; store them again",
        describe_stages(&info.stages).join(", ")
    );
    print_stages(&info, output)
}

fn print_stages(info: &HelloInfo, output: Output) -> anyhow::Result<()> {
    let mut lines = describe_stages(&info.stages);
    let options = info
        .option_bytes
        .map_or_else(Vec::new, |found| describe_option_bytes(&found));
    lines.extend(options.iter().map(|line| format!("option bytes: {line}")));
    output.print(
        || lines.join("\n"),
        || json!({ "stages": info.stages, "unique_id": info.unique_id, "option_bytes": options }),
    )
}

/// Asks the user at the terminal for permission to store.
fn ask_permission(device: &DeviceName, will: &str) -> anyhow::Result<bool> {
    if !std::io::stdin().is_terminal() {
        return usage_error("storing needs your permission; use a terminal, or give --yes");
    }
    eprint!(
        "{device} will store\n{will}\nand restart. A wrong table causes wrong currents. \
         Continue? y/N: "
    );
    std::io::stderr().flush().context("standard error")?;
    let mut line = String::new();
    std::io::stdin().lock().read_line(&mut line)?;
    Ok(line.trim().eq_ignore_ascii_case("y"))
}

/// Waits for the board to restart and returns its greeting. The old port may disappear.
fn reconnect(device: &DeviceName, port: Box<dyn Port>) -> anyhow::Result<HelloInfo> {
    drop(port);
    let begin = Instant::now();
    loop {
        sleep(Duration::from_millis(500));
        let opened = device.connect().map_err(anyhow::Error::from);
        match opened.and_then(|port| Ok(Connection::open(port)?.1)) {
            Ok(info) => return Ok(info),
            Err(error) if begin.elapsed() > RESTART => {
                return Err(error.context("the board did not answer after its restart"));
            }
            Err(_) => {}
        }
    }
}

/// Parses the options into a table, and reports all mistakes at once.
fn parse(options: &[String]) -> anyhow::Result<[Option<StageKind>; CHANNELS]> {
    let mut stages = [None; CHANNELS];
    let mut mistakes = Vec::new();
    for option in options {
        match parse_range(option) {
            Err(mistake) => mistakes.push(format!("`{option}`: {mistake}")),
            Ok((channels, kind)) => {
                for channel in channels {
                    // Channels are 1 to 10, as parsed.
                    if stages[channel - 1].replace(kind).is_some() {
                        mistakes.push(format!("`{option}`: channel {channel} is named twice"));
                    }
                }
            }
        }
    }
    let table = StageTable {
        origin: Origin::Owner,
        supply: None,
        stages,
    };
    if let Err(error) = table.validate() {
        mistakes.push(error.to_string());
    }
    match mistakes.is_empty() {
        true => Ok(stages),
        false => usage_error(format!("--store: {}", mistakes.join("; "))),
    }
}

/// Parses one option such as "1-5=100mA".
fn parse_range(option: &str) -> Result<(std::ops::RangeInclusive<usize>, StageKind), String> {
    let form = "write channels and full scale, as 1-5=100mA or 6=60V";
    let (channels, scale) = option.split_once('=').ok_or(form)?;
    let (first, last) = channels.split_once('-').unwrap_or((channels, channels));
    let number = |text: &str| {
        let number = text.trim().parse().ok();
        let number = number.filter(|n| (1..=CHANNELS).contains(n));
        number.ok_or_else(|| format!("channels are 1 to {CHANNELS}"))
    };
    let (first, last) = (number(first)?, number(last)?);
    if last < first {
        return Err("write the lower channel first, as 1-5".to_owned());
    }
    let milli = |text: &str| {
        let value = text.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        let milli = value.map(|v| (v * 1e3).round());
        let milli = milli.filter(|v| (0.0..1e9).contains(v)).ok_or(form)?;
        Ok::<u32, String>(milli as u32) // fits, being below 2^32
    };
    let scale = scale.trim();
    let kind = if let Some(ma) = scale.strip_suffix("mA") {
        StageKind::Current {
            full_scale_ua: milli(ma)?,
        }
    } else if let Some(v) = scale.strip_suffix('V') {
        StageKind::Voltage {
            full_scale_mv: milli(v)?,
        }
    } else {
        return Err(form.to_owned());
    };
    Ok((first..=last, kind))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_made_of_stretches_and_every_mistake_is_told() {
        let options =
            |texts: &[&str]| parse(&texts.iter().map(|&t| t.to_owned()).collect::<Vec<_>>());
        let stages = options(&["1-5=100mA", "7=60V"]).unwrap();
        let amps = StageKind::Current {
            full_scale_ua: 100_000,
        };
        let volts = StageKind::Voltage {
            full_scale_mv: 60_000,
        };
        assert_eq!(stages[..5], [Some(amps); 5]);
        assert_eq!((stages[5], stages[6], stages[9]), (None, Some(volts), None));
        let wild = [
            "0=100mA", "3-2=1V", "2=60W", "4=999mA", "5=1e99V", "6=nanV", "x",
        ];
        let message = options(&wild).unwrap_err().to_string();
        for wrong in [
            "`0=",
            "`3-2=",
            "`2=60W`",
            "full_scale_ua is 999000",
            "`5=",
            "`6=",
            "`x`",
        ] {
            assert!(message.contains(wrong), "{wrong} in {message}");
        }
        let twice = options(&["1-3=100mA", "3=60V"]).unwrap_err().to_string();
        assert!(twice.contains("channel 3 is named twice"), "{twice}");
    }
}
