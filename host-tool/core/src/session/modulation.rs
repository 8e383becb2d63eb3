//! `[[modulation]]`: joints whose muscles are stimulated by their angles while an object is held.

use firmware::device::{Mistake, Part, Rule};
use firmware::haptics::{
    Extreme, Form, JOINTS as MOST, ModulatedSpec, ModulationError, ModulationSpec, MotionPhase,
    QuarticSpec,
};
use firmware::units::Amplitude;

use super::channels::{Channels, amplitude_or};
use super::modulation_fields::{JOINTS, MODES, Mode};
use super::setpoints::read_time;
use crate::fields::decimal::format_scaled;
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// A joint whose muscles are stimulated according to its angle, with the angles that a simulated
/// wearer moves through.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SessionJoint {
    /// Modulation as the device receives it.
    pub spec: ModulationSpec,
    /// Angles of the joint as (time in µs, angle in 0.01°). The host sends them as if they were
    /// measured. The first time is 0, the angle changes linearly between the entries, and the last
    /// angle stays.
    pub angles: Vec<(u64, i16)>,
}

impl SessionJoint {
    /// Returns the joint's simulated angle `t_us` after the start, in 0.01°.
    #[must_use]
    pub fn angle_at(&self, t_us: u64) -> i16 {
        let next = self.angles.partition_point(|&(at_us, _)| at_us <= t_us);
        let before = self.angles.get(next.saturating_sub(1));
        let Some(&(from_us, from)) = before else {
            return 0; // there is a first one: checked
        };
        let Some(&(to_us, to)) = self.angles.get(next) else {
            return from;
        };
        let part = (t_us - from_us) as f64 / (to_us - from_us) as f64;
        from + (part * f64::from(to - from)).round() as i16 // within ±180°
    }
}

/// Returns the unique quartic through five values in millionths, as its Bernstein coefficients to
/// the nearest millionth. The values belong to five equally spaced positions: both ends of a range
/// and the quarters between them.
#[must_use]
pub fn quartic_through(values: [i64; 5]) -> QuarticSpec {
    let [a, b, c, d, e] = values;
    let over = |sum: i64, by: i64| (sum + by / 2).div_euclid(by) as i32; // saturation is refused
    QuarticSpec([
        over(a, 1),
        over(-13 * a + 48 * b - 36 * c + 16 * d - 3 * e, 12),
        over(13 * a - 64 * b + 120 * c - 64 * d + 13 * e, 18),
        over(-3 * a + 16 * b - 36 * c + 48 * d - 13 * e, 12),
        over(e, 1),
    ])
}

/// Reads every `[[modulation]]`. Their muscles must name channels of the file.
pub(super) fn read_modulations(root: &Table<'_>, channels: &Channels) -> Vec<SessionJoint> {
    let tables = root.tables("modulation");
    let mut joints: Vec<SessionJoint> = Vec::new();
    for t in tables.iter().take(MOST) {
        let Some(joint) = read_joint(t, channels) else {
            continue;
        };
        match joints
            .iter()
            .any(|session_joint| session_joint.spec.joint == joint.spec.joint)
        {
            true => t.report("joint", Problem::JointTwice {}),
            false => joints.push(joint),
        }
    }
    if let Some(first) = tables.first() {
        check_combination(root, first);
    }
    joints
}

/// Reports tables that cannot be used together with modulated joints, and setpoints that never let
/// the device know that an object is held.
fn check_combination(root: &Table<'_>, first: &Table<'_>) {
    let setpoints = root.table("setpoints");
    let kind = setpoints.map(|t| t.word("kind"));
    let beside = ["joint", "wall"].into_iter().find(|text| root.has(text));
    match (beside, kind) {
        (Some(other), _) => {
            let other = format!("a `[{other}]`");
            first.report("joint", Problem::ModulationBeside { other });
        }
        (None, Some("endpoint-force")) => {
            let other = "forces at the hand".into();
            first.report("joint", Problem::ModulationBeside { other });
        }
        _ => {}
    }
    if let (Some(t), Some(kind)) = (setpoints, kind)
        && !matches!(kind, "held" | "" | "endpoint-force")
    {
        t.report("kind", Problem::NeverGrabbed {});
    }
}

/// Returns the peak amplitudes of a joint that exceed the limits of their channels. The device does
/// not check the peaks of a joint that it refuses because of its shares, so this function finds
/// these further mistakes.
pub(super) fn peak_mistakes<'a>(
    spec: &'a ModulationSpec,
    channels: &'a Channels,
) -> impl Iterator<Item = Mistake> + use<'a> {
    let mut has_peaks = true; // only shares whose coefficients are in range
    spec.report_mistakes(&mut |mistake| {
        has_peaks &= !matches!(mistake, ModulationError::Range(_));
    });
    let demands = has_peaks.then(|| spec.demands()).into_iter().flatten();
    demands.filter_map(|(index, peak, field)| {
        let channel = channels
            .list
            .iter()
            .find(|channel| channel.index() == index)?;
        let (part, limit) = (Part::Modulation(spec.joint), channel.spec.limit);
        let rule = Rule::AboveLimit {
            channel: index,
            field,
            limit,
        };
        (peak > limit).then_some(Mistake { part, rule })
    })
}

fn read_joint(t: &Table<'_>, channels: &Channels) -> Option<SessionJoint> {
    let muscle = |name| {
        t.optional_table(name, |m| read_muscle(m, channels))
            .flatten()
    };
    let (flexor, extensor) = (muscle("flexor"), muscle("extensor"));
    let (lift, drop) = (read_share(t, "lift"), read_share(t, "drop"));
    let angles = read_angles(t);
    if !t.is_valid() {
        return None;
    }
    let joint = t.choice("joint", &JOINTS)?;
    let (mut flexor, mut extensor) = (flexor?, extensor?);
    let (lift, drop) = (lift?, drop?);
    match t.choice("mode", &MODES)? {
        Mode::Assist => (flexor.lift, extensor.drop) = (lift, drop),
        // To resist a movement, the antagonist is stimulated by the muscle's share.
        Mode::Resist => (extensor.lift, flexor.drop) = (lift, drop),
    }
    let spec = ModulationSpec {
        joint,
        phase_joint: elbow_number(joint),
        dead_band_centideg_per_s: t.integer("dead_band_deg_per_s"),
        cutoff_mhz: t.integer("cutoff_hz"),
        angle_min_mdeg: t.integer("angle_min_deg"),
        angle_max_mdeg: t.integer("angle_max_deg"),
        stale_after_ms: t.integer("stale_after_ms"),
        max_hold_ms: t.integer("longest_hold_s"),
        flexor,
        extensor,
    };
    check_angles(t, &spec);
    let angles = angles?;
    Some(SessionJoint { spec, angles })
}

/// Returns the name in session files of the joint with this number, for example "left-elbow".
#[must_use]
pub fn joint_name(joint: u8) -> &'static str {
    let found = JOINTS.iter().find(|(_, number)| *number == joint);
    found.map_or("joint", |(name, _)| name)
}

/// Returns the number of the elbow on the same arm as this joint, which is an elbow or a shoulder.
const fn elbow_number(joint: u8) -> u8 {
    joint & !1
}

fn read_muscle(t: &Table<'_>, channels: &Channels) -> Option<ModulatedSpec> {
    let channel = channels.find(t, "channel")?;
    let known = channels.usable_range(channel);
    let base = amplitude_or(t, "base", known.map(|[_, most]| most));
    let form = match t.word("form") {
        "above-threshold" => {
            let electrode = channels.electrode(channel.number);
            let threshold = electrode.map(|electrode| electrode.motor_threshold);
            let threshold = amplitude_or(t, "threshold", threshold)?;
            Form::AboveThreshold { threshold }
        }
        _ => Form::Scaled,
    };
    Some(ModulatedSpec {
        channel: channel.index(),
        base: base?,
        form,
        lift: None,
        drop: None,
    })
}

/// Reads the five values of a share and fits a quartic to them. Returns `Some(None)` if the field
/// is left out, and `None` if it has an error.
fn read_share(t: &Table<'_>, name: &str) -> Option<Option<QuarticSpec>> {
    if !t.has(name) {
        return Some(None);
    }
    let values: Vec<i64> = t.integers(name).iter().map(|(value, _)| *value).collect();
    let found = <[i64; 5]>::try_from(values).ok();
    if found.is_none() && !t.integers(name).is_empty() {
        let allowed = "five numbers: at the lowest angle, at a quarter, half and three quarters \
                       of the range, and at the highest angle";
        t.report_out_of_range(name, allowed.into());
    }
    found.map(|values| Some(quartic_through(values)))
}

fn read_angles(t: &Table<'_>) -> Option<Vec<(u64, i16)>> {
    let mut angles: Vec<(u64, i16)> = Vec::new();
    // The angles after one with an error cannot be judged.
    for item in t
        .tables("angles")
        .iter()
        .take_while(|table| table.is_valid())
    {
        let at_us = read_time(item, angles.last().map(|&(at_us, _)| at_us), "angle")?;
        angles.push((at_us, item.integer("deg")));
    }
    Some(angles)
}

/// Reports angles outside the range of the joint.
fn check_angles(t: &Table<'_>, spec: &ModulationSpec) {
    let (low, high) = (spec.angle_min_mdeg, spec.angle_max_mdeg);
    for item in t.tables("angles").iter().filter(|table| table.is_valid()) {
        let mdeg = i32::from(item.integer::<i16>("deg")) * 10;
        if !(low..=high).contains(&mdeg) && low < high {
            let range = format!(
                "{} to {}",
                format_scaled(low.into(), 3),
                format_scaled(high.into(), 3)
            );
            item.report_out_of_range("deg", format!("{range}, the joint's range"));
        }
    }
}

/// Reports a mistake that the device finds in the modulated joint numbered `joint`. `root` is the
/// file, and `joints` are the joints of the file that could be read.
pub(super) fn report_modulation_mistake(
    root: &Table<'_>,
    channels: &Channels,
    joints: &[SessionJoint],
    joint: u8,
    mistake: Mistake,
) {
    let is_it = |t: &&Table<'_>| t.choice("joint", &JOINTS) == Some(joint);
    let Some(t) = root.tables("modulation").iter().find(is_it) else {
        return;
    };
    let spec = joints
        .iter()
        .map(|session_joint| &session_joint.spec)
        .find(|modulation_spec| modulation_spec.joint == joint);
    let muscle = |index: u8| {
        let muscles = ["flexor", "extensor"]
            .into_iter()
            .filter_map(|text| t.table(text));
        muscles.filter(move |m| m.integer::<u8>("channel") == index + 1) // at most 10
    };
    match mistake.rule {
        // An elbow that is in the file but has errors was already reported.
        Rule::NoPhaseJoint { joint: elbow } if names_joint(root, elbow) => {}
        Rule::NoPhaseJoint { .. } => {
            let elbow = joint_name(elbow_number(joint));
            t.report("joint", Problem::NoPhaseJoint { elbow });
        }
        Rule::Modulation(ModulationError::ChannelTwice { channel: index }) => {
            if let Some(m) = muscle(index).next_back() {
                let channel = index + 1; // at most 10
                m.report("channel", Problem::ChannelTwice { channel });
            }
        }
        Rule::Modulation(ModulationError::Share { phase, extreme, .. }) => {
            let (share, at_deg) = (
                millionths(extreme),
                spec.map_or(0.0, |modulation_spec| degrees(modulation_spec, extreme)),
            );
            t.report(phase.field(), Problem::ShareOutside { share, at_deg });
        }
        Rule::AboveLimit {
            channel: index,
            field,
            ..
        } => {
            let found = channels
                .list
                .iter()
                .find(|channel| channel.index() == index);
            if let (Some(m), Some(channel), Some(spec)) = (muscle(index).next(), found, spec) {
                let (peak, at_deg) = phase_peak(spec, index, field);
                let (peak, limit) = (
                    channel.format_amplitude(peak),
                    channel.format_amplitude(channel.spec.limit),
                );
                let channel = channel.number;
                let problem = Problem::PeakAboveLimit {
                    channel,
                    peak,
                    at_deg,
                    limit,
                };
                m.report("base", problem);
            }
        }
        // A range of amplitudes belongs to a muscle's table, and both muscles may have the field.
        Rule::Modulation(ModulationError::Range(e)) if matches!(e.field, "base" | "threshold") => {
            let has_value =
                |m: &&Table<'_>| m.has(e.field) && i64::from(m.integer::<u32>(e.field)) == e.value;
            let muscles = ["flexor", "extensor"]
                .into_iter()
                .filter_map(|text| t.table(text));
            muscles
                .into_iter()
                .find(has_value)
                .unwrap_or(t)
                .report_refusal(e);
        }
        // The coefficients exceed those of any share between 0 and 1.
        Rule::Modulation(ModulationError::Range(e)) if matches!(e.field, "lift" | "drop") => {
            let allowed = "five values whose quartic stays between 0 and 1";
            t.report_out_of_range(e.field, allowed.into());
        }
        // Reported where the channels are named, and for all joints at once.
        Rule::NoTrain { .. } | Rule::JointAndModulation => {}
        _ => t.report_refusal(mistake),
    }
}

/// Returns whether the file has a joint of this number, with or without errors. Returns true also
/// if the name of any joint in the file is unknown, because that could be the joint.
fn names_joint(root: &Table<'_>, joint: u8) -> bool {
    let mut tables = root.tables("modulation").iter();
    tables.any(|t| {
        t.choice("joint", &JOINTS)
            .is_none_or(|value| value == joint)
    })
}

/// Formats the share at an extreme of its quartic with six decimals, for example "-0.000213".
fn millionths(extreme: Extreme) -> String {
    format_scaled(extreme.millionths().into(), 6)
}

/// Returns the joint angle at which a share has its extreme, °, rounded to a hundredth.
fn degrees(spec: &ModulationSpec, extreme: Extreme) -> f64 {
    let (low, high) = (spec.angle_min_mdeg, spec.angle_max_mdeg);
    let mdeg = f64::from(low) + f64::from(high - low) * f64::from(extreme.at) / 16_384.0;
    (mdeg / 10.0).round() / 100.0
}

/// Returns the largest amplitude that a channel receives while the elbow flexes (phase `lift`) or
/// extends (phase `drop`), and the joint angle at which it receives it, °.
fn phase_peak(spec: &ModulationSpec, channel: u8, phase: &str) -> (Amplitude, f64) {
    let phases = [MotionPhase::Lift, MotionPhase::Drop];
    let phase = phases
        .into_iter()
        .find(|motion_phase| motion_phase.field() == phase);
    let muscle = spec
        .muscles()
        .find(|modulated_spec| modulated_spec.channel == channel);
    let found = muscle.zip(phase).and_then(|(muscle, phase)| {
        let highest = muscle.share(phase)?.highest();
        Some((muscle.peak(phase)?, degrees(spec, highest)))
    });
    found.unwrap_or((Amplitude::ZERO, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quartic_goes_through_its_five_values() {
        let values = [150_000, 420_000, 660_000, 550_000, 300_000];
        let QuarticSpec(b) = quartic_through(values);
        for (nth, value) in (0..5).zip(values) {
            let u = f64::from(nth) / 4.0;
            let terms = (0..5).zip([1.0, 4.0, 6.0, 4.0, 1.0]).zip(b);
            let terms = terms.map(|((k, over), b)| {
                f64::from(b) * over * f64::powi(u, k) * f64::powi(1.0 - u, 4 - k)
            });
            let found: f64 = terms.sum();
            assert!(
                (found - value as f64).abs() <= 0.5,
                "{nth}: {found} {value}"
            );
        }
        let QuarticSpec(flat) = quartic_through([1_000_000; 5]);
        assert_eq!(flat, [1_000_000; 5]);
    }

    #[test]
    fn angles_go_straight_from_one_to_the_next() {
        let angles = vec![(0, 2_000), (1_000_000, 12_000), (3_000_000, -1_000)];
        let times_us = [0, 1, 500_000, 1_000_000, 2_000_000, 9_000_000];
        let joint = |spec| SessionJoint {
            spec,
            angles: angles.clone(),
        };
        let muscle = ModulatedSpec {
            channel: 0,
            base: Amplitude::new(1),
            form: Form::Scaled,
            lift: None,
            drop: None,
        };
        let joint = joint(ModulationSpec {
            joint: 0,
            phase_joint: 0,
            dead_band_centideg_per_s: 800,
            cutoff_mhz: 3_000,
            angle_min_mdeg: 0,
            angle_max_mdeg: 1,
            stale_after_ms: 50,
            max_hold_ms: 1_000,
            flexor: muscle,
            extensor: muscle,
        });
        let found = times_us.map(|t_us| joint.angle_at(t_us));
        assert_eq!(found, [2_000, 2_000, 7_000, 12_000, 5_500, -1_000]);
    }
}
