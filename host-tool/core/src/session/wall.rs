//! `[wall]`: a virtual wall on the device.

use firmware::haptics::{CoContraction, PreWall, Side, WallSpec};
use firmware::units::Amplitude;

use super::channels::Channels;
use super::control_fields::SIDES;
use super::hold::{read_sensor, read_stale};
use super::table::Table;

/// Reads `[wall]`; it names channels of the file.
pub(super) fn read_wall(t: &Table<'_>, channels: &Channels) -> Option<WallSpec> {
    let channel = channels.find(t, "channel");
    let pre_wall = t.part("pre_wall", |p| {
        Some(PreWall {
            depth_mdeg: p.whole("depth_deg"),
            begin: Amplitude::new(p.whole("begin")),
            end: Amplitude::new(p.whole("end")),
        })
    });
    let co_contraction = t.part("co_contraction", |c| {
        let channel = channels.find(c, "channel")?;
        Some(CoContraction {
            channel: channel.index(),
            amplitude: Amplitude::new(c.whole("amplitude")),
        })
    });
    let channel = channel.filter(|_| t.is_sound())?;
    let sensor = read_sensor(t);
    Some(WallSpec {
        at_mdeg: t.whole("at_deg"),
        side: t.named("stops", &SIDES).unwrap_or(Side::Flexion),
        channel: channel.index(),
        max: Amplitude::new(t.whole("max")),
        stiffness: t.whole("stiffness_per_deg"),
        damping: t.whole("damping_s_per_deg"),
        cutoff_mhz: t.whole("cutoff_hz"),
        pre_wall: pre_wall?,
        co_contraction: co_contraction?,
        angle_min_mdeg: t.whole("angle_min_deg"),
        angle_max_mdeg: t.whole("angle_max_deg"),
        sensor,
        stale_after_ms: read_stale(t, sensor),
    })
}
