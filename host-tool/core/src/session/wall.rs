//! `[wall]`: a virtual wall on the device.

use firmware::haptics::{CoContraction, PreWall, Side, WallSpec};
use firmware::units::Amplitude;

use super::channels::{Channels, amplitude_or};
use super::control_fields::SIDES;
use super::hold::{read_sensor, read_stale};
use crate::fields::table::Table;

/// Reads `[wall]`, which must name channels of the file. Amplitudes that the file leaves out come
/// from the wearer file: the maximum is the largest amplitude in use. The pre-wall begins at the
/// smallest amplitude in use, and ends at the maximum of the wall.
pub(super) fn read_wall(t: &Table<'_>, channels: &Channels) -> Option<WallSpec> {
    let channel = channels.find(t, "channel");
    let known = channel.and_then(|channel| channels.usable_range(channel));
    let pre_wall = t.optional_table("pre_wall", |p| {
        channel?; // its own mistakes are reported
        let most = match t.has("max") {
            true => Some(Amplitude::new(t.integer("max"))),
            false => known.map(|[_, most]| most),
        };
        let begin = amplitude_or(p, "begin", known.map(|[least, _]| least));
        let end = amplitude_or(p, "end", known.and(most));
        Some(PreWall {
            depth_mdeg: p.integer("depth_deg"),
            begin: begin?,
            end: end?,
        })
    });
    let co_contraction = t.optional_table("co_contraction", |c| {
        let channel = channels.find(c, "channel")?;
        let most = channels.usable_range(channel).map(|[_, most]| most);
        Some(CoContraction {
            channel: channel.index(),
            amplitude: amplitude_or(c, "amplitude", most)?,
        })
    });
    let channel = channel.filter(|_| t.is_valid())?;
    let max = amplitude_or(t, "max", known.map(|[_, most]| most))?;
    let sensor = read_sensor(t);
    Some(WallSpec {
        at_mdeg: t.integer("at_deg"),
        side: t.choice("stops", &SIDES).unwrap_or(Side::Flexion),
        channel: channel.index(),
        max,
        stiffness: t.integer("stiffness_per_deg"),
        damping: t.integer("damping_s_per_deg"),
        cutoff_mhz: t.integer("cutoff_hz"),
        pre_wall: pre_wall?,
        co_contraction: co_contraction?,
        angle_min_mdeg: t.integer("angle_min_deg"),
        angle_max_mdeg: t.integer("angle_max_deg"),
        sensor,
        stale_after_ms: read_stale(t, sensor),
    })
}
