//! `[wall]`: a virtual wall on the device.

use firmware::haptics::{CoContraction, PreWall, Side, Wall, WallError, WallSpec};
use firmware::units::Amplitude;

use super::channel::Channels;
use super::control_fields::SIDES;
use super::error::Problem;
use super::hold::{read_sensor, read_stale};
use super::table::Table;

/// Reads `[wall]`, and checks it against the channels.
pub(super) fn read_wall(t: &Table<'_>, channels: &Channels) -> Option<WallSpec> {
    let channel = channels.find_free(t, "channel");
    let pre_wall = t.part("pre_wall", |p| {
        Some(PreWall {
            depth_mdeg: p.whole("depth_deg"),
            begin: Amplitude(p.whole("begin")),
            end: Amplitude(p.whole("end")),
        })
    });
    let co_contraction = t.part("co_contraction", |c| {
        let channel = channels.find_free(c, "channel")?;
        Some(CoContraction {
            channel: channel.index(),
            amplitude: channel.read_amplitude(c, "amplitude")?,
        })
    });
    let channel = channel.filter(|_| t.is_sound())?;
    let sensor = read_sensor(t);
    let spec = WallSpec {
        at_mdeg: t.whole("at_deg"),
        side: t.named("stops", &SIDES).unwrap_or(Side::Flexion),
        channel: channel.index(),
        max: channel.read_amplitude(t, "max")?,
        stiffness: t.whole("stiffness_per_deg"),
        damping: t.whole("damping_s_per_deg"),
        cutoff_mhz: t.whole("cutoff_hz"),
        pre_wall: pre_wall?,
        co_contraction: co_contraction?,
        angle_min_mdeg: t.whole("angle_min_deg"),
        angle_max_mdeg: t.whole("angle_max_deg"),
        sensor,
        stale_after_ms: read_stale(t, sensor),
    };
    let refused = |e| match e {
        WallError::ChannelTwice { channel } => {
            let (field, channel) = ("wall".into(), channel + 1); // at most 10
            let problem = Problem::ChannelTwice { field, channel };
            t.table("co_contraction")
                .unwrap_or(t)
                .say("channel", problem);
        }
        e => t.refuse(e),
    };
    Wall::new(&spec).map_err(refused).ok()?;
    Some(spec)
}
