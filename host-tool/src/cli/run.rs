//! `flexor run`: runs a session on any device, records it and writes its report.

use super::chip::ChipArgs;
use super::out::OutArgs;
use super::perform::{Controls, Order, SEED, perform};
use super::study::StudyArgs;
use super::{Output, moment, usage_error, watch};
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use host_core::record::{Plan, Run};
use host_core::run::{DeviceName, Keys, SessionFile};
use host_core::session::LawName;
use std::path::PathBuf;

/// Run a session on a simulator or board; write record and report
#[derive(Args, Debug)]
pub struct RunArgs {
    /// Session file (TOML), or the name of a shipped one (flexor list)
    session: PathBuf,
    /// Simulator (native, chip or qemu) or board (a serial port or tcp:HOST:PORT)
    #[arg(long, default_value = "native")]
    device: DeviceName,
    #[command(flatten)]
    out: OutArgs,
    /// Acknowledge a latched fault first, after you have found its cause
    #[arg(long)]
    acknowledge: bool,
    /// Seed of a wearer that this program simulates; default: 1
    #[arg(long)]
    seed: Option<u64>,
    /// Controller, instead of the file's
    #[arg(long, value_parser = law())]
    law: Option<LawName>,
    /// Also write the output of a simulated device as VCD; --overwrite replaces an existing file
    #[arg(long, group = "replaced")]
    vcd: Option<PathBuf>,
    /// Show the session live, with pause, intensity and markers on the keyboard
    #[arg(long)]
    watch: bool,
    #[command(flatten)]
    chip: ChipArgs,
    #[command(flatten)]
    study: StudyArgs,
}

/// # Errors
/// Fails if the session, the device or the record cannot be used. Everything recorded until then is
/// kept.
pub fn main(args: &RunArgs, output: Output) -> anyhow::Result<()> {
    let mut session = SessionFile::load(&args.session)?;
    let channels: Vec<u8> = session.session.channels.iter().map(|c| c.number).collect();
    let study = args
        .study
        .override_study(&session.session.study, &channels)?;
    if let (Some(worn), Some(pseudonym)) = (&session.session.worn, &study.pseudonym) {
        let name = &worn.wearer.name;
        anyhow::ensure!(
            pseudonym == name,
            "E660 --pseudonym is {pseudonym}, but the wearer file belongs to {name}; use the file of \
             the wearer who is stimulated"
        );
    }
    if let Some(law) = args.law {
        session.session = session.session.with_law(law)?;
    }
    if args.device.is_port() && (args.seed.is_some() || args.vcd.is_some()) {
        return usage_error(
            "--seed and --vcd need --device native, chip or qemu: a device behind a port has its \
             own seed, and its outputs cannot be recorded",
        );
    }
    if let Some(vcd) = &args.vcd {
        let mut reads = vec![args.session.as_path()];
        reads.extend(args.chip.image());
        args.out.check_vcd(vcd, &reads)?;
    }
    if args.watch && (output.json || !watch::has_terminal()) {
        return usage_error(
            "--watch needs a terminal with a keyboard, and excludes --json; flexor run without \
             --watch records the session, and flexor monitor prints a line per second",
        );
    }
    output.settle_models(&mut session.session)?;
    let seed = (!args.device.is_port()).then_some(args.seed.unwrap_or(SEED));
    let plan = Plan {
        law: args.law.map(|law| law.name().to_owned()),
        acknowledge: args.acknowledge,
        vcd: args.vcd.is_some(),
        image: args.chip.image().is_some(),
        ..Plan::new("run", &args.device.to_string())
    };
    let (title, device) = (&session.session.title, args.device.to_string());
    let mut record = Run::begin(title, &device, seed, plan, moment::now());
    record.study = study;
    let order = Order {
        session: &session,
        device: &args.device,
        chip: &args.chip,
        vcd: args.vcd.as_deref(),
        replaces: args.out.overwrites(),
        controls: if args.watch {
            Controls::Watched
        } else {
            Controls::Repeated(Keys::default())
        },
    };
    let performed = perform(&order, record, |title| args.out.claim_folder(title), output)?;
    performed.print(output)
}

/// Returns a parser for the control laws, by their names in session files.
fn law() -> impl TypedValueParser<Value = LawName> {
    let names = LawName::ALL.map(|law| PossibleValue::new(law.name()).help(law.meaning()));
    PossibleValuesParser::new(names)
        .try_map(|name| LawName::from_name(&name).ok_or("there is no controller of this name"))
}
