//! `flexor chart accuracy`: charts the errors of muscle integrators against their cycles.

use super::choice;
use crate::cli::Output;
use anyhow::{Context, ensure};
use clap::Args;
use methods::bench::OUTPUTS_US;
use methods::muscle::{Reading, Setting};
use serde_json::{Value, json};
use std::path::PathBuf;
use studies::accuracy::range::{self, Place, RangeErrors};
use studies::accuracy::range_of_all::{MUSCLES, RangeRow, all_range_errors, range_csv};
use studies::accuracy::{Chart, Point, WANTED_PCT, cases, digits, measure};
use studies::accuracy::{study, table};
use studies::figures::accuracy_picture;

/// Chart the muscle model's integrators: error against cycles
#[derive(Args, Debug)]
pub struct Accuracy {
    /// Folder for accuracy.csv, accuracy_range.csv and accuracy.svg
    #[arg(long, default_value = "docs/charts")]
    out: PathBuf,
    /// Number of random muscles over the whole range that the device accepts
    #[arg(long, default_value_t = 4000)]
    draws: usize,
    /// Measure nothing, and name the cheapest method with at most this error, % of peak
    #[arg(long, requires = "readings_hz", conflicts_with_all = ["out", "draws"])]
    error: Option<f64>,
    /// Readings of the force per second for --error, 1 to 1000
    #[arg(long, requires = "error")]
    readings_hz: Option<f64>,
}

/// Seed of the random muscles over the whole range.
const RANGE_SEED: u32 = 13;
/// Number of worst cases that are listed.
const WORST: usize = 3;

/// # Errors
/// Fails if the image fails, a file cannot be written, or host and chip disagree.
pub fn main(args: &Accuracy, output: Output) -> anyhow::Result<()> {
    if let (Some(error_pct), Some(readings_hz)) = (args.error, args.readings_hz) {
        return choice::main(error_pct, readings_hz, output);
    }
    ensure!(
        args.out.is_dir(),
        "E555 --out {}: no such folder; run in the checkout or name a folder that exists",
        args.out.display()
    );
    let bar = output.bar("accuracy");
    let chart = measure(&cases::all_cases(), |part| bar.set(part / 2.0));
    let chart = chart?;
    let everywhere = all_range_errors(|part| bar.set(0.5 + part / 2.0));
    bar.finish();
    let table = chart.csv();
    let rows = table::rows(&table).context("accuracy.csv, as it is written")?;
    for (name, contents) in [
        ("accuracy.csv", table),
        ("accuracy_range.csv", range_csv(&everywhere)),
        ("accuracy.svg", accuracy_picture(&rows)),
    ] {
        let path = args.out.join(name);
        std::fs::write(&path, contents).with_context(|| {
            format!(
                "E556 cannot write {}; check the path, the permissions and the free space",
                path.display()
            )
        })?;
    }
    let again = study::rerun_study();
    let range = range::study(RANGE_SEED, args.draws);
    let people = || {
        let (study, range) = (study_text(&again), range_text(&range));
        let (text, fronts) = (text(&chart), front_text(&chart, &everywhere));
        format!("{study}\n{range}\n{fronts}\n{}", text.trim_end())
    };
    output.print(people, || json_report(&chart, &again, &range, &everywhere))?;
    ensure!(
        chart.differing.is_empty(),
        "E557 these cases give different results on host and chip: {}; please report this",
        chart.differing.join(", ")
    );
    Ok(())
}

/// Writes the cost of changing parameters once a second, as for a muscle that fatigues.
fn write_change_costs(out: &mut String, chart: &Chart) {
    let every = OUTPUTS_US.map(|us| format!("{} ms", us / 1000));
    out.push_str(&format!(
        "Cycles per second if parameters change once a second\n  {:<26}{:>10}{:>11}{:>11}\n",
        "",
        "change",
        format!("read {}", every[0]),
        format!("read {}", every[1])
    ));
    for (setting, cycles) in &chart.makes {
        out.push_str(&format!("  {:<26}{cycles:>10}", setting.to_string()));
        for output_us in OUTPUTS_US {
            let run = chart.point(*setting, output_us);
            let total = run.map_or(0, |point| point.cycles_per_s + cycles);
            out.push_str(&format!("{total:>11}"));
        }
        out.push('\n');
    }
}

/// Cycles at one output period, the time between two readings of the force: the shipped setting
/// beside the cheapest accurate one and the paper's.
struct Verdict<'a> {
    shipped: &'a Point,
    cheapest: &'a Point,
    paper: &'a Point,
}

impl<'a> Verdict<'a> {
    fn at_output_period(chart: &'a Chart, output_us: u32) -> Option<Self> {
        Some(Self {
            shipped: chart.point(Setting::SHIPPED, output_us)?,
            cheapest: chart.cheapest(output_us)?,
            paper: chart.point(Setting::PAPER, output_us)?,
        })
    }

    /// Returns the cycles of the shipped setting, divided by those of the cheapest setting whose
    /// error is small enough.
    fn ratio_to_cheapest(&self) -> f64 {
        self.shipped.cycles_per_s as f64 / self.cheapest.cycles_per_s as f64
    }

    /// Returns the cycles of the paper's setting, divided by those of the shipped setting.
    fn paper_to_shipped_ratio(&self) -> f64 {
        self.paper.cycles_per_s as f64 / self.shipped.cycles_per_s as f64
    }
}

/// Formats the repetition of an earlier study of integrators: our errors beside those that the
/// study found in the same cases.
fn study_text(again: &[study::MethodError]) -> String {
    let head = "Worst error of 30 cases (20, 30, 40 Hz) in f64, % of peak";
    let mut out = format!("{head}\n  {:<34}{:>10}{:>10}\n", "", "ours", "study");
    for row in again {
        let step = match row.step_us {
            Setting::WHOLE_US => "pulse to pulse".to_owned(),
            us => format!("{} ms", us / 1000),
        };
        let name = row.method.name();
        let [ours, theirs] = [row.error_pct, row.study_pct].map(|e| match e < 1000.0 {
            true => digits(e),
            false => "diverges".to_owned(),
        });
        out.push_str(&format!("  {name:<19}{step:>15}{ours:>10}{theirs:>10}\n"));
    }
    out
}

/// Formats the errors of the shipped model over the whole range that the device accepts.
fn range_text(found: &RangeErrors) -> String {
    let mut out = format!(
        "The shipped model over the whole range that the device accepts ({} muscles\n\
         that it refuses are tested with the shortest τ1 that it accepts)\n",
        found.refused
    );
    for (name, places) in [
        ("corners of the range", &found.corners),
        ("random muscles", &found.drawn),
    ] {
        let above = range::above_pct(places);
        let count = places.len();
        out.push_str(&format!(
            "  {count} {name}: the error of {above:.2} % of them is above {WANTED_PCT} %\n"
        ));
        for Place {
            spec,
            rate_hz,
            error_pct,
        } in places.iter().take(WORST)
        {
            out.push_str(&format!(
                "    {} % at K {}e-6, τc {}, τ1 {}, τ2 {} µs, {rate_hz:.1} Hz\n",
                digits(*error_pct),
                spec.k_micro,
                spec.tau_c_us,
                spec.tau1_us,
                spec.tau2_us
            ));
        }
    }
    out
}

/// Formats the errors of the settings on the front over random muscles of the accepted range.
fn front_text(chart: &Chart, everywhere: &[RangeRow]) -> String {
    let mut out = format!(
        "Errors of the front over {MUSCLES} random muscles of the accepted range, %\n  \
         {:<38}{:>9}{:>9}{:>9}\n",
        "", "median", "95 %", "worst"
    );
    for (point, row) in chart.points.iter().zip(everywhere) {
        if point.on_front {
            out.push_str(&format!(
                "  {:<38}{:>9}{:>9}{:>9}  {:>2} ms\n",
                row.setting.to_string(),
                digits(row.median_pct),
                digits(row.most_pct),
                digits(row.worst_pct),
                row.output_us / 1000
            ));
        }
    }
    out
}

fn text(chart: &Chart) -> String {
    let mut out = String::new();
    for output_us in OUTPUTS_US {
        write_interval(&mut out, chart, output_us);
    }
    let corners = OUTPUTS_US.into_iter().zip(&chart.corners);
    for (output_us, [cycles, worst_tick]) in corners {
        out.push_str(&format!(
            "Shipped setting at the corner of its ranges, force read every {} ms:\n  \
             {cycles} cycles per s, worst tick {worst_tick} cycles\n",
            output_us / 1000
        ));
    }
    write_change_costs(&mut out, chart);
    out.push_str(&format!(
        "\n{} settings; host and chip agree bit for bit in {} of them",
        chart.points.len(),
        chart.points.len() - chart.differing.len()
    ));
    out
}

fn write_interval(out: &mut String, chart: &Chart, output_us: u32) {
    out.push_str(&format!("Force read every {} ms\n", output_us / 1000));
    out.push_str(&format!(
        "  {:<38}{:>9}{:>14}{:>12}\n",
        "Pareto front", "error, %", "cycles per s", "worst tick"
    ));
    let mut front: Vec<_> = chart.read_every(output_us).filter(|p| p.on_front).collect();
    front.sort_by_key(|p| p.cycles_per_s);
    let line = |p: &Point| {
        format!(
            "  {:<38}{:>9}{:>14}{:>12}",
            p.setting.to_string(),
            digits(p.error_pct),
            p.cycles_per_s,
            p.worst_tick
        )
    };
    for point in front {
        out.push_str(&format!("{}\n", line(point)));
    }
    let Some(verdict) = Verdict::at_output_period(chart, output_us) else {
        return out.push('\n');
    };
    out.push_str("  shipped setting, then the paper's setting:\n");
    out.push_str(&format!("{}\n", line(verdict.shipped)));
    out.push_str(&format!("{}\n", line(verdict.paper)));
    if verdict.cheapest.setting == Setting::SHIPPED {
        out.push_str(&format!(
            "  The shipped setting is the cheapest with an error of at most {WANTED_PCT} %.\n"
        ));
    } else {
        out.push_str(&format!(
            "  The shipped setting is {} the front. With an error of at most {WANTED_PCT} %,\n  {} \
             is cheapest: 1/{:.2} of the shipped cycles.\n",
            if verdict.shipped.on_front {
                "on"
            } else {
                "not on"
            },
            verdict.cheapest.setting,
            verdict.ratio_to_cheapest()
        ));
    }
    out.push_str(&format!(
        "  The paper's setting takes {:.1} times the shipped cycles, because its step is\n  \
         finer than this error needs.\n\n",
        verdict.paper_to_shipped_ratio()
    ));
}

fn json_report(
    chart: &Chart,
    again: &[study::MethodError],
    range: &RangeErrors,
    everywhere: &[RangeRow],
) -> Value {
    let points = chart.points.iter().zip(everywhere).map(|(point, row)| {
        let mut value = point_json(point);
        value["range_errors_pct"] = json!({
            "median": row.median_pct, "p95": row.most_pct, "worst": row.worst_pct,
        });
        value
    });
    let points: Vec<Value> = points.collect();
    let verdicts = OUTPUTS_US.into_iter().filter_map(|output_us| {
        let verdict = Verdict::at_output_period(chart, output_us)?;
        Some(json!({
            "output_us": output_us,
            "wanted_pct": WANTED_PCT,
            "shipped": point_json(verdict.shipped),
            "cheapest": point_json(verdict.cheapest),
            "paper": point_json(verdict.paper),
            "shipped_on_front_at_wanted": verdict.cheapest.setting == Setting::SHIPPED,
            "shipped_over_cheapest": verdict.ratio_to_cheapest(),
            "paper_over_shipped": verdict.paper_to_shipped_ratio(),
        }))
    });
    let makes = chart
        .makes
        .iter()
        .map(|(setting, cycles)| json!({ "setting": setting.to_string(), "cycles": cycles }));
    let again = again.iter().map(|row| {
        json!({
            "method": row.method.name(),
            "step_us": (row.step_us != Setting::WHOLE_US).then_some(row.step_us),
            "error_pct": row.error_pct,
            "study_pct": row.study_pct,
        })
    });
    json!({
        "study": again.collect::<Vec<_>>(),
        "range": {
            "refused": range.refused,
            "corners": places_json(&range.corners),
            "drawn": places_json(&range.drawn),
        },
        "corner_cycles": chart.corners,
        "makes": makes.collect::<Vec<_>>(),
        "points": points,
        "verdicts": verdicts.collect::<Vec<_>>(),
        "differing": chart.differing,
    })
}

fn places_json(places: &[Place]) -> Value {
    let worst = places.iter().take(WORST).map(|place| {
        json!({
            "spec": place.spec,
            "rate_hz": place.rate_hz,
            "error_pct": place.error_pct,
        })
    });
    json!({
        "count": places.len(),
        "above_wanted_pct": range::above_pct(places),
        "worst": worst.collect::<Vec<_>>(),
    })
}

fn point_json(p: &Point) -> Value {
    json!({
        "method": p.setting.method.name(),
        "arithmetic": p.setting.number.name(),
        "step_us": (p.setting.step_us != Setting::WHOLE_US).then_some(p.setting.step_us),
        "output_us": p.output_us,
        // JSON has no infinity: the value is null if the method diverges.
        "error_pct": p.error_pct,
        "cycles_per_s": p.cycles_per_s,
        "front": p.on_front,
        "tuned": p.setting.is_tuned(),
        "cubic": p.setting.reading == Reading::Cubic,
        "on_demand": p.setting.reading == Reading::Demand,
        "worst_tick_cycles": p.worst_tick,
    })
}
