//! `flexor muscle`: predicts a force with the muscle model alone.

use super::{Output, WrongUse, check_range, usage_error};
use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use firmware::muscle::{CalciumForce, CalciumForceSpec};
use firmware::range::OutOfRange;
use hal_sim::body::muscle::Parameters;
use hal_sim::input;
use host_core::models::{ResponseRow, device_response, reference_response};
use host_core::record::{RecordError, check_writable};
use std::path::{Path, PathBuf};

/// Time between two rows of the CSV file, µs.
const ROW_US: u64 = 10_000;

/// Predict the force of a pulse train with the calcium-force model
///
/// Lee 2020, equations 2 and 3.
#[derive(Args, Debug)]
#[command(allow_negative_numbers = true)]
pub struct Muscle {
    /// Force scaling factor A, N/s
    #[arg(long)]
    a_n_per_s: f64,
    /// Sensitivity K to calcium
    #[arg(long)]
    k: f64,
    /// Time constant of calcium, ms
    #[arg(long)]
    tau_c_ms: f64,
    /// Time constant of force without calcium, ms
    #[arg(long)]
    tau1_ms: f64,
    /// Increase of tau1 at full activation, ms
    #[arg(long)]
    tau2_ms: f64,
    /// Pulse rate of a regular train, Hz
    #[arg(long, requires = "train_s", required_unless_present = "pulses_us")]
    frequency_hz: Option<f64>,
    /// Length of the regular train, s
    #[arg(long, requires = "frequency_hz")]
    train_s: Option<f64>,
    /// File with pulse times in µs, one per line, in ascending order
    #[arg(long, conflicts_with = "frequency_hz")]
    pulses_us: Option<PathBuf>,
    /// Length of the prediction, s
    #[arg(long)]
    seconds: f64,
    /// The device's fixed-point model, or the f64 reference
    #[arg(long, value_enum, default_value_t = Model::Fixed)]
    model: Model,
    /// File for t_s,c,force_n every 10 ms
    #[arg(long)]
    csv: PathBuf,
    /// Replace an existing --csv file
    #[arg(long)]
    overwrite: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Model {
    Fixed,
    Reference,
}

/// # Errors
/// Fails if a parameter is out of range (named in the message) or a file cannot be read or written.
pub fn main(args: &Muscle, output: Output) -> anyhow::Result<()> {
    check_range("--seconds", args.seconds, 0.01, 3600.0)?;
    let reads: Vec<&Path> = args.pulses_us.iter().map(PathBuf::as_path).collect();
    check_writable(&args.csv, args.overwrite, &reads, None)?;
    let pulses = args.pulses()?;
    let rows = match args.model {
        Model::Fixed => args.fixed_point_rows(&pulses)?,
        Model::Reference => args.reference_rows(&pulses)?,
    };
    let mut csv = csv::Writer::from_path(&args.csv)
        .with_context(|| format!("cannot write {}", args.csv.display()))?;
    csv.write_record(["t_s", "c", "force_n"])?;
    for row in &rows {
        csv.write_record([
            format!("{:.2}", row.t_s),
            row.c.to_string(),
            row.force_n.to_string(),
        ])?;
    }
    csv.flush()?;
    let peak = rows.iter().max_by(|a, b| a.force_n.total_cmp(&b.force_n));
    let (peak_n, at_s) = peak.map_or((0.0, 0.0), |row| (row.force_n, row.t_s));
    output.print(
        || format!("{} rows in {}; largest force {peak_n:.4} N at {at_s:.2} s", rows.len(), args.csv.display()),
        || serde_json::json!({ "csv": args.csv, "rows": rows.len(), "peak_n": peak_n, "peak_s": at_s }),
    )?;
    Ok(())
}

impl Muscle {
    /// Returns pulse times in whole µs: those of the file, or i / f rounded to the nearest.
    fn pulses(&self) -> anyhow::Result<Vec<u64>> {
        if let Some(path) = &self.pulses_us {
            return read_pulses(path);
        }
        let (frequency, train) = (
            self.frequency_hz.unwrap_or(0.0),
            self.train_s.unwrap_or(0.0),
        );
        check_range("--frequency-hz", frequency, 0.5, 200.0)?;
        check_range("--train-s", train, 0.0, 3600.0)?;
        let count = (frequency * train - 1e-9).ceil().max(0.0) as u64;
        Ok((0..count)
            .map(|i| (i as f64 * 1e6 / frequency).round() as u64)
            .collect())
    }

    /// Returns for each parameter the device's field, the option, its value, and the number of the
    /// device's units in one unit of the option.
    #[rustfmt::skip]
    const fn parameters(&self) -> [(&'static str, &'static str, f64, f64); 5] {
        [
            ("a_mn_per_s", "--a-n-per-s", self.a_n_per_s, 1e3),
            ("k_micro", "--k", self.k, 1e6),
            ("tau_c_us", "--tau-c-ms", self.tau_c_ms, 1e3),
            ("tau1_us", "--tau1-ms", self.tau1_ms, 1e3),
            ("tau2_us", "--tau2-ms", self.tau2_ms, 1e3),
        ]
    }

    /// Returns the device's muscle model. The reference uses the same ranges, so that both models
    /// answer soon. A value that is not a number, negative or too large for the link becomes 0 or
    /// the maximum, which the device refuses; a value finer than the device's units is refused
    /// here.
    fn device_model(&self) -> anyhow::Result<CalciumForce> {
        for (_, name, value, factor) in self.parameters() {
            let finer = (value * factor - (value * factor).round()).abs();
            if finer > 1e-6 * (value * factor).abs().max(1.0) {
                let step = 1.0 / factor;
                return usage_error(format!(
                    "{name} is {value}; the device works in steps of {step}"
                ));
            }
        }
        let [a_mn_per_s, k_micro, tau_c_us, tau1_us, tau2_us] =
            (self.parameters()).map(|(_, _, value, factor)| (value * factor).round() as u32);
        let spec = CalciumForceSpec {
            a_mn_per_s,
            k_micro,
            tau_c_us,
            tau1_us,
            tau2_us,
        };
        CalciumForce::new(spec).map_err(|e| self.range_error(&e))
    }

    /// Refuses pulses that raise C, eq. (2), beyond the range of the fixed point.
    fn check_pulses(&self, pulses: &[u64]) -> anyhow::Result<()> {
        let end = CalciumForce::CALCIUM_END;
        let (mut c, mut last) = (0.0, 0);
        for &at in pulses {
            let passed_ms = (at - last) as f64 * 1e-3; // times rise, so this is not negative
            c = c * libm::exp(-passed_ms / self.tau_c_ms) + 1.0;
            last = at;
            if c >= f64::from(end) {
                let at_s = at as f64 * 1e-6;
                return usage_error(format!(
                    "the pulse at {at_s} s raises C to {c:.1}, but the device's fixed-point range \
                     ends at {end}; give fewer pulses per second, a shorter --tau-c-ms, or \
                     --model reference"
                ));
            }
        }
        Ok(())
    }

    fn fixed_point_rows(&self, pulses: &[u64]) -> anyhow::Result<Vec<ResponseRow>> {
        let muscle = self.device_model()?;
        self.check_pulses(pulses)?;
        Ok(device_response(&muscle, pulses, self.duration_us(), ROW_US))
    }

    /// Rewrites the device's refusal in terms of this command's options.
    fn range_error(&self, e: &OutOfRange) -> anyhow::Error {
        let parameters = self.parameters();
        let Some((_, name, given, factor)) = parameters.into_iter().find(|pair| pair.0 == e.field)
        else {
            return anyhow::anyhow!("{e}"); // a calcium-force model has no others
        };
        let [min, max] = [e.min, e.max].map(|bound| f64::from(bound) / factor);
        let why = match e.min > CalciumForceSpec::TAU1_US.min && name == "--tau1-ms" {
            true => " with this --k and --tau2-ms",
            false => "",
        };
        WrongUse(format!("{name} is {given}; allowed: {min} to {max}{why}")).into()
    }

    fn reference_rows(&self, pulses: &[u64]) -> anyhow::Result<Vec<ResponseRow>> {
        self.device_model()?;
        let parameters = Parameters {
            a_n_per_s: self.a_n_per_s,
            k: self.k,
            tau_c_s: self.tau_c_ms * 1e-3,
            tau1_s: self.tau1_ms * 1e-3,
            tau2_s: self.tau2_ms * 1e-3,
        };
        // Exact i / f if a rate is given: the reference does not round to µs.
        let times: Vec<f64> = match (self.frequency_hz, &self.pulses_us) {
            (Some(f), None) => (0..pulses.len()).map(|i| i as f64 / f).collect(),
            _ => pulses.iter().map(|&us| us as f64 * 1e-6).collect(),
        };
        let duration_s = self.duration_us() as f64 * 1e-6;
        let row_s = ROW_US as f64 * 1e-6;
        Ok(reference_response(&parameters, &times, duration_s, row_s))
    }

    fn duration_us(&self) -> u64 {
        (self.seconds * 1e6).round() as u64
    }
}

fn read_pulses(path: &Path) -> anyhow::Result<Vec<u64>> {
    let text = input::read_text(path, input::LONGEST_DOCUMENT);
    let text = text.map_err(RecordError::io(path))?;
    let mut pulses: Vec<u64> = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let at: u64 = match line.trim() {
            "" => continue,
            text => text.parse().with_context(|| {
                format!(
                    "E526 {}, line {number}: {text:?} is not a time in whole µs; write one time per \
                     line, such as 25000",
                    path.display()
                )
            })?,
        };
        if at > 3_600_000_000 || pulses.last().is_some_and(|&last| at <= last) {
            bail!(
                "E519 {}, line {number}: {at} µs; times must increase and be at most 1 h",
                path.display()
            );
        }
        pulses.push(at);
    }
    Ok(pulses)
}
