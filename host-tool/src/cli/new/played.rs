//! Patterns of a first session: constant amplitudes, or a program.

/// On-time and off-time of each channel, s; odd and even channels alternate.
const TURN_S: f64 = 2.0;

/// Returns the end of a session file whose channels play `program`, each with its amplitude;
/// constant amplitudes are streamed at `rate_hz`.
///
/// # Errors
/// Fails if the program is unknown or `seconds` is not a number.
pub(super) fn compose(
    program: &str,
    channels: &[(u32, String)],
    seconds: &str,
    rate_hz: u32,
) -> Result<String, String> {
    let parse = seconds.parse::<f64>();
    let seconds = parse.map_err(|_| format!("seconds is {seconds}, which is not a number"))?;
    let lines: Vec<String> = match program {
        "constant" => {
            let value = |(channel, value): &(u32, String)| {
                format!("    {{ channel = {channel}, value = {value} }},\n")
            };
            let values: String = channels.iter().map(value).collect();
            let kind = "[setpoints]\nkind = \"amplitudes\"";
            vec![format!(
                "{kind}\nvalues = [\n{values}]\nrate_hz = {rate_hz}\n"
            )]
        }
        "on-off" => {
            let programs = (0_u32..).zip(channels).map(|(place, (channel, value))| {
                format!(
                    "[[program]] # repeats until `duration_s`\nkind = \"on-off\"\n\
                     channels = [{channel}]\nvalue = {value} # mA or V\n\
                     on_s = {TURN_S:?} # with both ramps\noff_s = {TURN_S:?}\n\
                     ramp_up_s = 0.5\nramp_down_s = 0.5\n\
                     delay_s = {:?} # of the first time on\n",
                    f64::from(place % 2) * TURN_S
                )
            });
            programs.collect()
        }
        "ramp" => {
            let programs = channels.iter().map(|(channel, value)| {
                format!(
                    "[[program]]\nkind = \"ramp\"\nchannels = [{channel}]\npoints = [\n    \
                     {{ at_s = 0.0, value = 0.0 }},\n    {{ at_s = {:.3}, value = {value} }},\n    \
                     {{ at_s = {seconds:?}, value = 0.0 }},\n]\n",
                    seconds / 2.0
                )
            });
            programs.collect()
        }
        "cycle" => {
            let count = channels.len().max(1);
            let phase = |(place, (channel, value)): (usize, &(u32, String))| {
                let from = 360 * place / count;
                let to = (from + 180) % 360;
                format!(
                    "    {{ channel = {channel}, value = {value}, from_deg = {from}, to_deg = {to} \
                     }},\n"
                )
            };
            let phases: String = channels.iter().enumerate().map(phase).collect();
            let kind = "[[program]]\nkind = \"cycle\"\ncadence_rpm = 40.0\nramp_down_s = 0.1";
            vec![format!("{kind}\nphases = [\n{phases}]\n")]
        }
        other => {
            return Err(format!(
                "program is {other}; allowed: constant, on-off, ramp or cycle"
            ));
        }
    };
    Ok(lines.into_iter().map(|line| format!("\n{line}")).collect())
}
