//! `flexor chart stability`: maps where each method fails and where theory predicts failure.

use super::write;
use crate::cli::{Output, usage_error};
use anyhow::ensure;
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use studies::figures::map_picture;
use studies::stability::{MAPS, Map, SEED, Source};

/// Map where each method fails, and where theory predicts failure
#[derive(Args, Debug)]
pub struct Stability {
    /// Names of the maps; all maps if none is given
    names: Vec<String>,
    /// Seed of `loss`, `pulse_rate`, `sensor`, `shipped_muscle`; the other maps are not random
    #[arg(long)]
    seed: Option<u64>,
    /// Folder for the numbers, texts and pictures
    #[arg(long, default_value = "docs/maps")]
    out: PathBuf,
}

/// Maps with random numbers.
const RANDOM: [&str; 4] = ["loss", "pulse_rate", "sensor", "shipped_muscle"];

/// # Errors
/// E518: no such map. E565: no such folder. E575: a file cannot be written.
pub fn main(args: &Stability, output: Output) -> anyhow::Result<()> {
    ensure!(
        args.out.is_dir(),
        "E565 --out {}: no such folder; run in the checkout or name a folder that exists",
        args.out.display()
    );
    let entries = selected_draws(&args.names)?;
    let has_chance = |name: &String| RANDOM.contains(&&**name);
    if args.seed.is_some() && !args.names.is_empty() && !args.names.iter().any(has_chance) {
        return usage_error(
            "--seed has an effect only on the maps `loss`, `pulse_rate`, `sensor` and \
             `shipped_muscle`; name one of them, or leave it out",
        );
    }
    let bar = output.bar("stability");
    let mut maps = Vec::new();
    for (source, n) in entries.iter().zip(0u32..) {
        let done = |part| bar.set((f64::from(n) + part) / entries.len() as f64);
        maps.push(source.draw(args.seed.unwrap_or(SEED), &mut { done }));
    }
    bar.finish();
    for map in &maps {
        let file = |extension| args.out.join(format!("{}.{extension}", map.name));
        write(&file("csv"), &map.csv())?;
        write(&file("txt"), &map.text())?;
        write(&file("svg"), &map_picture(map))?;
    }
    output.print(|| text_report(&maps, &args.out), || json_report(&maps))?;
    Ok(())
}

fn selected_draws(names: &[String]) -> anyhow::Result<Vec<Source>> {
    if names.is_empty() {
        return Ok(MAPS.map(|(_, source)| source).to_vec());
    }
    let find = |name: &String| match MAPS.iter().find(|(known, _)| known == name) {
        Some((_, source)) => Ok(*source),
        None => {
            let known = MAPS.map(|(known, _)| known).join(", ");
            usage_error(format!("there is no map `{name}`; the maps are {known}"))
        }
    };
    names.iter().map(find).collect()
}

fn text_report(maps: &[Map], out: &Path) -> String {
    let mut lines = vec![format!(
        "{:<16}{:>7}{:>9}{:>9}",
        "map", "cells", "worse", "better"
    )];
    for map in maps {
        let found = map.agreement();
        lines.push(format!(
            "{:<16}{:>7}{:>9}{:>9}",
            map.name, found.predicted, found.worse, found.better
        ));
    }
    lines.push(format!(
        "worse, better: number of cells that are worse or better than theory predicts\nnumbers, texts \
         and pictures: {}",
        out.display()
    ));
    lines.join("\n")
}

fn json_report(maps: &[Map]) -> Value {
    let entry = |map: &Map| {
        let found = map.agreement();
        let panel = |p: &studies::stability::Panel| {
            let rows: Vec<Vec<Option<f64>>> = (p.rows.iter())
                .map(|row| {
                    row.iter()
                        .map(|c| c.number.is_finite().then_some(c.number))
                        .collect()
                })
                .collect();
            json!({ "title": p.title, "numbers": rows, "remarks": p.remarks })
        };
        json!({
            "name": map.name, "title": map.title, "quantity": map.quantity,
            "across": { "name": map.across.caption(), "labels": map.across.labels },
            "down": { "name": map.down.caption(), "labels": map.down.labels },
            "cells_with_prediction": found.predicted,
            "worse_than_predicted": found.worse,
            "better_than_predicted": found.better,
            "panels": map.panels.iter().map(panel).collect::<Vec<_>>(),
        })
    };
    json!({ "maps": maps.iter().map(entry).collect::<Vec<_>>() })
}
