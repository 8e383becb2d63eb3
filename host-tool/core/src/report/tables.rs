//! Text and tables of the page.

use crate::analysis::{Hit, Metrics, force_metrics, hits, metrics_but_lag};
use crate::plot::canvas::escape;
use crate::record::{PaperRow, Trial};
use std::fmt::Write;

/// "9.53°": three digits, as the papers print.
pub(super) fn degrees(value: f64) -> String {
    format!("{}°", three_digits(value))
}

/// "0.0532 N": three digits.
pub(super) fn newtons(value: f64) -> String {
    format!("{} N", three_digits(value))
}

/// "10" or "0.25": as many digits as a time needs.
pub(super) fn seconds(value: f64) -> String {
    format!("{}", (value * 1000.0).round() / 1000.0)
}

fn three_digits(value: f64) -> String {
    let decimals = match value.abs() {
        v if v < 9.995 => 2,
        v if v < 99.95 => 1,
        _ => 0,
    };
    format!("{value:.decimals$}")
}

/// How each trial at a virtual wall went; nothing without one.
pub(super) fn hits_table(trials: &[Trial]) -> String {
    let mut rows = String::new();
    for trial in trials {
        let name = escape(&trial.name);
        for hit in hits(trial) {
            let cells = hit_cells(&hit);
            let _ = writeln!(rows, "<tr><th scope=\"row\">{name}</th>{cells}</tr>");
        }
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<table><thead><tr><th>Trial</th><th>Hit</th><th>Approach</th><th>Deepest</th>\
         <th>Turns</th><th>Swing late</th><th>Depth late</th></tr></thead><tbody>\n{rows}\
         </tbody></table>\n<p class=\"note\">Depths are inside the wall itself, negative in front \
         of it. Late is the third quarter of a hit.</p>\n"
    )
}

fn hit_cells(hit: &Hit) -> String {
    let cells = [
        format!("{}–{} s", seconds(hit.at_s), seconds(hit.at_s + hit.for_s)),
        format!("{:.0} °/s", hit.speed_deg_per_s),
        format!("<b>{}</b>", degrees(hit.deepest_deg)),
        hit.turns.to_string(),
        degrees(hit.late_swing_deg),
        degrees(hit.late_depth_deg),
    ];
    cells.map(|cell| format!("<td>{cell}</td>")).concat()
}

/// How each trial that followed a target went, with its metrics; nothing if none did.
pub(super) fn metrics_table(trials: &[Trial], judged: &[Option<Metrics>]) -> String {
    let mut rows = String::new();
    for (trial, judged) in trials.iter().zip(judged).filter(|(trial, _)| trial.joint) {
        let name = escape(&trial.name);
        let none = || "<td colspan=\"8\">no samples</td>".to_owned();
        let cells = judged.as_ref().map_or_else(none, metric_cells);
        let _ = writeln!(rows, "<tr><th scope=\"row\">{name}</th>{cells}</tr>");
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<table><thead><tr><th>Trial</th><th>Window</th><th>RMSE</th><th>RMSE, true \
         angle</th><th>Mean error</th><th>Largest error</th><th>Lag</th><th>Limiting</th>\
         <th>Samples</th></tr></thead><tbody>\n{rows}</tbody></table>\n"
    )
}

/// How the predicted forces followed the wanted ones; nothing without any.
pub(super) fn force_table(trials: &[Trial]) -> String {
    let mut rows = String::new();
    for trial in trials {
        let name = escape(&trial.name);
        for m in force_metrics(trial) {
            let cells = [
                m.channel.to_string(),
                format!("{}–{} s", seconds(m.from_s), seconds(m.to_s)),
                format!("<b>{}</b>", newtons(m.rmse_n)),
                newtons(m.max_abs_n),
                newtons(m.peak_n),
                m.gap.map_or("–".to_owned(), |gap| {
                    let (below, above) = (gap.below_n, newtons(gap.above_n));
                    format!("{:.0} %: {below} or {above}", gap.share * 100.0)
                }),
                m.samples.to_string(),
            ];
            let cells = cells.map(|cell| format!("<td>{cell}</td>")).concat();
            let _ = writeln!(rows, "<tr><th scope=\"row\">{name}</th>{cells}</tr>");
        }
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<table><thead><tr><th>Trial</th><th>Channel</th><th>Window</th><th>RMSE</th>\
         <th>Largest error</th><th>Most wanted</th><th>Limiting</th><th>Samples</th></tr></thead>\
         <tbody>\n{rows}</tbody></table>\n<p class=\"note\">Of the force that the muscle model \
         predicts; nothing measures force. Limiting: how often a force between two was wanted that \
         the limits cannot give, and the nearer of the two given.</p>\n"
    )
}

fn metric_cells(m: &Metrics) -> String {
    let truth = m.rmse_true_deg.map_or("–".to_owned(), degrees);
    let lag = m
        .lag_s
        .map_or("–".to_owned(), |lag| format!("{:.0} ms", lag * 1e3));
    let cells = [
        format!("{}–{} s", seconds(m.from_s), seconds(m.to_s)),
        format!("<b>{}</b>", degrees(m.rmse_deg)),
        truth,
        degrees(m.mean_abs_deg),
        degrees(m.max_abs_deg),
        lag,
        format!("{:.0} %", m.limiting_share * 100.0),
        m.samples.to_string(),
    ];
    cells.map(|cell| format!("<td>{cell}</td>")).concat()
}

/// This run beside the paper, a line per paper row; nothing without one.
pub(super) fn paper_table(trials: &[Trial], paper: &[PaperRow]) -> String {
    let mut rows = String::new();
    for trial in trials {
        let own: Vec<_> = paper.iter().filter(|row| row.trial == trial.name).collect();
        let here = metrics_but_lag(trial).map_or("–".to_owned(), |m| degrees(m.rmse_deg));
        for (position, row) in own.iter().enumerate() {
            rows.push_str("<tr>");
            if position == 0 {
                let (span, name) = (own.len(), escape(&trial.name));
                let _ = write!(
                    rows,
                    "<th scope=\"rowgroup\" rowspan=\"{span}\">{name}</th>\
                     <td rowspan=\"{span}\"><b>{here}</b></td>"
                );
            }
            let values: Vec<_> = row.values.iter().map(|value| degrees(*value)).collect();
            let mean = row.mean().map_or("–".to_owned(), degrees);
            let _ = writeln!(
                rows,
                "<td>{}</td><td>{mean}</td><td class=\"words\">{}</td></tr>",
                values.join(" · "),
                escape(&row.source)
            );
        }
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<table><thead><tr><th>Trial</th><th>RMSE here</th><th>Paper's trials</th>\
         <th>Paper's mean</th><th class=\"words\">Source</th></tr></thead><tbody>\n{rows}\
         </tbody></table>\n"
    )
}

/// Counters of all trials side by side; nothing without any.
pub(super) fn counter_table(trials: &[Trial]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in trials.iter().flat_map(|trial| &trial.counters) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    if names.is_empty() {
        return String::new();
    }
    let heads = trials
        .iter()
        .map(|trial| format!("<th>{}</th>", escape(&trial.name)));
    let mut rows = String::new();
    for name in names {
        let _ = write!(rows, "<tr><th scope=\"row\">{}</th>", escape(name));
        for trial in trials {
            let found = trial.counters.iter().find(|(own, _)| own == name);
            let value = found.map_or("–".to_owned(), |(_, value)| value.to_string());
            let _ = write!(rows, "<td>{value}</td>");
        }
        rows.push_str("</tr>\n");
    }
    let heads: String = heads.collect();
    format!(
        "<table><thead><tr><th>Counter</th>{heads}</tr></thead><tbody>\n{rows}</tbody></table>\n"
    )
}

/// What the electrode check read; nothing without one.
pub(super) fn electrode_table(trials: &[Trial]) -> String {
    let mut rows = String::new();
    for trial in trials {
        for reading in &trial.electrode_check {
            let channel = trial.channels.iter().find(|c| c.number == reading.channel);
            let unit = channel.map_or("", |channel| &channel.unit);
            let load = match reading.load_ohm {
                Some(ohm) => format!("{} kΩ", three_digits(ohm * 1e-3)),
                None => "–".to_owned(),
            };
            let _ = writeln!(
                rows,
                "<tr><th scope=\"row\">{}</th><td>{}</td><td>{:.1} {unit}</td>\
                 <td>{:.2} mA</td><td>{load}</td></tr>",
                escape(&trial.name),
                reading.channel,
                reading.applied,
                reading.current_ma,
            );
        }
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<table><thead><tr><th>Electrodes at arming</th><th>Channel</th><th>Applied</th>\
         <th>Current</th><th>Load</th></tr></thead><tbody>\n{rows}</tbody></table>\n"
    )
}

/// What happened when; nothing without events.
pub(super) fn event_table(trials: &[Trial]) -> String {
    let mut rows = String::new();
    for trial in trials {
        for (t_s, what) in &trial.events {
            let (name, what) = (escape(&trial.name), escape(what));
            let _ = writeln!(
                rows,
                "<tr><th scope=\"row\">{name}</th><td>{t_s:.3} s</td><td class=\"words\">{what}</td></tr>"
            );
        }
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<table><thead><tr><th>Trial</th><th>Time</th><th class=\"words\">Event</th></tr></thead>\
         <tbody>\n{rows}</tbody></table>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_carry_three_digits() {
        assert_eq!(degrees(8.4), "8.40°");
        assert_eq!(degrees(9.996), "10.0°");
        assert_eq!(degrees(19.04), "19.0°");
        assert_eq!(degrees(104.6), "105°");
        assert_eq!(seconds(10.0), "10");
        assert_eq!(seconds(0.25), "0.25");
    }

    #[test]
    fn markup_in_names_stays_text() {
        assert_eq!(escape("<b a=\"1\">&"), "&lt;b a=&quot;1&quot;&gt;&amp;");
    }
}
