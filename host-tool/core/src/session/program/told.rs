//! Errors of programs that are reported from several places.

use firmware::safety::Stimulus;

use super::super::channel::Channel;
use super::played::Programs;
use crate::fields::decimal::format_scaled;
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// Reports, at `field`, that a channel needs more time to change between two stimuli. `before_us`
/// is the time of the first stimulus. `least_us` is the time that the change needs; `None` if no
/// time is long enough.
pub(super) fn report_too_short(
    t: &Table<'_>,
    field: &str,
    found: &Channel,
    (from, to): (Stimulus, Stimulus),
    least_us: Option<u64>,
    before_us: u64,
) {
    let channel = found.number;
    let [from, to] = [from, to].map(|stimulus| match found.has_live_width() {
        true => format!(
            "{} for {} µs",
            found.format_amplitude(stimulus.amplitude),
            stimulus.width_us
        ),
        false => found.format_amplitude(stimulus.amplitude),
    });
    let problem = match least_us {
        Some(least_us) => Problem::RampTooShort {
            channel,
            from,
            to,
            least: seconds(least_us),
            nearest: match field {
                "value" => "begin with a smaller amplitude".into(),
                _ => format!("give at least {} s", seconds(before_us + least_us)),
            },
        },
        None => Problem::NoSmoothRamp { channel, from, to },
    };
    t.report(field, problem);
}

/// Formats a time in µs as seconds without a unit, for example "0.25".
pub(super) fn seconds(us: u64) -> String {
    format_scaled(us.cast_signed(), 6)
}

/// Reports setpoints for a channel that a program drives, and a setpoint rate that is lower than
/// the burst rate of a program's train.
pub(in crate::session) fn check_setpoints(setpoints: &Table<'_>, programs: &Programs) {
    let is_played = |t: &Table<'_>| {
        let number: u8 = t.integer("channel");
        programs.channels().any(|channel| channel + 1 == number) // at most 10
    };
    let lists = ["values", "list", "bounds", "forces"];
    let lists = lists.into_iter().flat_map(|name| setpoints.tables(name));
    for t in lists
        .chain([setpoints])
        .filter(|t| t.is_valid() && t.has("channel"))
    {
        if is_played(t) {
            let channel = t.integer("channel");
            t.report("channel", Problem::Programmed { channel });
        }
    }
    let (rate_hz, period_us) = (setpoints.real("rate_hz"), programs.shortest_period_us());
    if let Some((rate_hz, period_us)) = rate_hz.zip(period_us)
        && rate_hz * (period_us as f64) < 1e6 * (1.0 - 1e-9)
    {
        let least_hz = format!("{}", (1e10 / period_us as f64).ceil() / 1e4);
        setpoints.report("rate_hz", Problem::RateBelowTrain { least_hz });
    }
}
