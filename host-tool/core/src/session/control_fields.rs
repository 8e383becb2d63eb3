//! The fields of `[joint]`, of `[wall]` and of tables that both share, declared in the same way as
//! the others in `fields`.

use firmware::control::differentiator::Differentiator;
use firmware::control::pid::Pid;
use firmware::control::refusal::{ANGLE_MAX_MDEG, ANGLE_MIN_MDEG};
use firmware::control::super_twisting::{Paper, Recommended, SuperTwisting};
use firmware::control::{HoldPolicy, LawSpec, PointSpec, ResponseSpec, SensorSource, WearerModel};
use firmware::haptics::{CoContraction, PreWall, Side, WallSpec};

use super::law::LAWS;
use crate::fields::decimal::format_scaled;
use crate::fields::field::Need::{Optional, Or, OrFile, OrTold, OrWord, Required};
use crate::fields::field::{
    Kind, Need, Section, UNIT, bounded_number, channel_number, field, list, number_in, one_of,
};

/// Directions of motion that a wall stops, and their names in session files.
pub(super) const SIDES: [(&str, Side); 2] =
    [("flexion", Side::Flexion), ("extension", Side::Extension)];
/// Default of `max_extrapolation_ms`, the longest time for which the device extrapolates a
/// reference when no new setpoint arrives, ms: nine setpoints of a 90 Hz stream.
const MAX_EXTRAPOLATION_MS: i64 = 100;
/// Default ages from which a measurement is stale, ms. The first is for the board's converter (ten
/// readings), the second for the host (four and a half readings of a 90 Hz glove).
pub(super) const STALE_AFTER_MS: (u16, u16) = (10, 50);
/// Default calibration of the board's angle sensor on a joint: the converter's codes at 0° and at
/// 100°. With these 25 codes per degree, a broken or shorted wire reads −32° or +132°. The device
/// refuses both for a joint of 0–100°.
const FINGER_CODES: (i64, i64) = (800, 3300);
/// Default calibration of the board's angle sensor in a session with a wall: the converter's codes
/// at 0° and at 100°. These 20 codes per degree cover an elbow's 0–150° and at least 20° on either
/// side.
const ELBOW_CODES: (i64, i64) = (500, 2500);
/// Default curvature of the recruitment between threshold and `max`, thousandths: the mean of
/// ln(Fmax/Fmin) in Lee 2020, table 2.
const LEE_CURVATURE_MILLI: i64 = 1_200;

/// Returns the kind of a field that holds an amplitude, in thousandths of the channel's unit (mA or
/// V).
pub(super) fn amplitude() -> Kind {
    bounded_number(UNIT, 3, PointSpec::MAX, "at most the channel's `limit`")
}

#[rustfmt::skip]
pub(super) fn hold(meaning: &'static str) -> Section {
    vec![
        field("hold", Kind::Choice(vec!["extrapolate", "hold"]), OrWord("extrapolate"), meaning),
        field("max_extrapolation_ms", number_in("ms", 0, HoldPolicy::MAX_MS), Or(MAX_EXTRAPOLATION_MS), "longest extrapolation after the last setpoint").when("hold", &["extrapolate"]),
    ]
}

#[rustfmt::skip]
fn sensor(codes: (i64, i64)) -> Section {
    let (adc, host) = STALE_AFTER_MS;
    vec![
        field("sensor", Kind::Choice(vec!["adc", "host"]), Required, "source of the angle: the converter of the board (`\"adc\"`) or the host"),
        field("code_at_0_deg", number_in("", 0, SensorSource::CODE_AT_0), Or(codes.0), "code of the converter at 0°").when("sensor", &["adc"]),
        field("code_at_100_deg", bounded_number("", 0, SensorSource::CODE_AT_100, "at least 100 from the other code"), Or(codes.1), "code of the converter at 100°").when("sensor", &["adc"]),
        field("stale_after_ms", number_in("ms", 0, SensorSource::STALE_AFTER_MS), OrTold(format!("{adc} adc, {host} host")), "age from which a measurement is stale, which is a fault"),
    ]
}

#[rustfmt::skip]
fn angles(most_mdeg: i64) -> Section {
    vec![
        field("angle_min_deg", number_in("°", 3, ANGLE_MIN_MDEG), Or(0), "lowest angle of the range"),
        field("angle_max_deg", bounded_number("°", 3, ANGLE_MAX_MDEG, "above the lowest"), Or(most_mdeg), "highest angle of the range"),
    ]
}

#[rustfmt::skip]
fn point() -> Section {
    vec![
        field("channel", channel_number(), Required, "a channel of the file"),
        field("threshold", bounded_number(UNIT, 3, PointSpec::THRESHOLD, "at most `max`"), OrFile, "amplitude at zero effort"),
        field("max", amplitude(), OrFile, "amplitude at full effort"),
    ]
}

#[rustfmt::skip]
pub(super) fn joint() -> Section {
    let by_law = |quantity: fn(LawSpec) -> i64, places| {
        let defaults = LAWS.map(|(name, law)| {
            let [alone, known] = [false, true].map(|wearer| quantity(law.spec(wearer)));
            let [alone, known] = [alone, known].map(|value| format_scaled(value, places));
            match alone == known {
                true => format!("{name} {alone}"),
                false => format!("{name} {alone}, with a `wearer` {known}"),
            }
        });
        OrTold(defaults.join("; "))
    };
    let mut fields = vec![
        field("law", one_of(&LAWS), OrWord("recommended"), "controller: `\"recommended\"` is the default controller, `\"paper\"` the paper's, `\"pid\"` a PID controller"),
        field("gains", Kind::Table(recommended_gains()), Optional, "gains that differ from the defaults").when("law", &["recommended"]),
        field("gains", Kind::Table(paper_gains()), Optional, "gains that differ from the defaults").when("law", &["paper"]),
        field("gains", Kind::Table(pid_gains()), Optional, "gains that differ from the defaults").when("law", &["pid"]),
        field("law_period_ms", number_in("ms", 0, Differentiator::STEP_MS), by_law(|law| law.default_period_ms().into(), 0), "period of the controller"),
        field("cutoff_hz", number_in("Hz", 3, Differentiator::CUTOFF_MHZ), by_law(|law| law.default_cutoff_mhz().into(), 3), "cutoff frequency of its differentiator"),
        field("flexors", list(point(), 1, Some(2), "points"), Required, "flexor points"),
        field("extensor", Kind::Table(point()), Required, "extensor point"),
        field("wearer", Kind::Table(wearer_model()), Optional, "model of the wearer for the feed-forward"),
        field("response", Kind::Table(response()), Optional, "response of this wearer over time"),
    ];
    fields.extend(hold("what to do between and after setpoints: extrapolate the reference or hold it"));
    fields.extend(angles(100_000));
    fields.extend(sensor(FINGER_CODES));
    fields
}

/// Returns the default of a gain, as text for the manual: the value `alone`, which applies to a
/// control law without a model of the wearer, and `with_wearer` if that is a different value.
fn gain_default(alone: u32, with_wearer: u32) -> Need {
    let [alone, other] = [alone, with_wearer].map(|milli| format_scaled(milli.into(), 3));
    OrTold(match alone == other {
        true => alone,
        false => format!("{alone}; {other} with a `wearer`"),
    })
}

#[rustfmt::skip]
fn recommended_gains() -> Section {
    // The smallest b and the shortest period give the largest ranges of k1 and k3.
    let [a, w] = [LawSpec::ALONE, LawSpec::RECOMMENDED].map(|law| match law {
        LawSpec::Recommended { lambda_milli, k1_milli, k2_milli, b_milli, k3_milli, ki_milli } => [lambda_milli, k1_milli, k2_milli, b_milli, k3_milli, ki_milli],
        _ => [0; 6],
    });
    vec![
        field("lambda", number_in("", 3, Recommended::LAMBDA_MILLI), gain_default(a[0], w[0]), "slope of the sliding surface"),
        field("k1", bounded_number("", 3, SuperTwisting::k1_milli(1_000, 1), "h·b·k1 at most 200"), gain_default(a[1], w[1]), "gain of the root of the sliding variable"),
        field("k2", number_in("", 3, Recommended::K2_MILLI), gain_default(a[2], w[2]), "gain of the integrated sign of the sliding variable"),
        field("b", number_in("", 3, SuperTwisting::B_MILLI), gain_default(a[3], w[3]), "gain of the plant that the controller assumes"),
        field("k3", bounded_number("", 3, SuperTwisting::k3_milli(1_000, 1), "h·b·k3 at most 7"), gain_default(a[4], w[4]), "gain of the sliding variable itself"),
        field("ki", number_in("", 3, Recommended::KI_MILLI), gain_default(a[5], w[5]), "gain of the integrated error"),
    ]
}

#[rustfmt::skip]
fn paper_gains() -> Section {
    let [lambda, w] = match LawSpec::PAPER {
        LawSpec::Paper { lambda_milli, w_milli } => [lambda_milli, w_milli],
        _ => [0; 2],
    };
    vec![
        field("lambda", number_in("", 3, Paper::LAMBDA_MILLI), gain_default(lambda, lambda), "slope of the sliding surface"),
        field("w", number_in("", 3, Paper::W_MILLI), gain_default(w, w), "gain W of the paper"),
    ]
}

#[rustfmt::skip]
fn pid_gains() -> Section {
    let [kp, ki, kd] = match LawSpec::PID {
        LawSpec::Pid { kp_milli, ki_milli, kd_milli } => [kp_milli, ki_milli, kd_milli],
        _ => [0; 3],
    };
    vec![
        field("kp", number_in("", 3, Pid::KP_MILLI), gain_default(kp, kp), "gain of the error"),
        field("ki", number_in("", 3, Pid::KI_MILLI), gain_default(ki, ki), "gain of the integral of the error"),
        field("kd", number_in("", 3, Pid::KD_MILLI), gain_default(kd, kd), "gain of the rate of the error"),
    ]
}

#[rustfmt::skip]
fn wearer_model() -> Section {
    type W = WearerModel;
    let [leads, _, pid] = LAWS.map(|(_, law)| law.spec(true).default_lead_ms());
    vec![
        field("rest_deg", number_in("°", 3, W::REST_MDEG), Required, "angle of the relaxed joint"),
        field("stiffness_nm_per_rad", number_in("N·m/rad", 6, W::STIFFNESS_UNM_PER_RAD), Required, "stiffness towards the rest angle"),
        field("damping_nm_s_per_rad", number_in("N·m·s/rad", 6, W::DAMPING_UNM_S_PER_RAD), Or(0), "viscous friction"),
        field("flexion_nm", number_in("N·m", 6, W::FLEXION_UNM), Required, "torque of all flexors at `max`, at `angle_min_deg`"),
        field("extension_nm", number_in("N·m", 6, W::EXTENSION_UNM), Required, "torque of the extensor at `max`, at `angle_max_deg`"),
        field("torque_loss", number_in("", 3, W::TORQUE_LOSS_MILLI), Or(0), "share of its torque that a muscle loses over the range of angles"),
        field("curvature", number_in("", 3, W::CURVATURE_MILLI), Or(LEE_CURVATURE_MILLI), "curvature of the force between threshold and `max`"),
        field("lead_ms", number_in("ms", 0, W::LEAD_MS), OrTold(format!("{leads}, `pid` {pid}")), "time by which the reference is taken ahead"),
    ]
}

#[rustfmt::skip]
fn response() -> Section {
    type R = ResponseSpec;
    let d = ResponseSpec::RECOMMENDED;
    let by_strength = |milli: u32| OrTold(format!("{}·s", format_scaled(milli.into(), 3)));
    vec![
        field("gain_rad", number_in("rad", 3, R::GAIN_MRAD), by_strength(d.gain_mrad.into()), "change of angle at full effort; 0 turns the predictor off"),
        field("muscle_ms", number_in("ms", 0, R::MUSCLE_MS), Or(d.muscle_ms.into()), "time constant of the muscle"),
        field("joint_ms", number_in("ms", 0, R::JOINT_MS), Or(d.joint_ms.into()), "time constant of the joint"),
        field("delay_ms", number_in("ms", 0, R::DELAY_MS), Or(d.delay_ms.into()), "delay from effort to angle"),
        field("scale_learning", number_in("1/(rad·s)", 3, R::SCALE_MILLI), by_strength(d.scale_milli), "learning rate of the feed-forward's scale"),
        field("damping_learning", number_in("1/rad²", 3, R::DAMPING_MILLI), Or(d.damping_milli.into()), "learning rate of the effort per rate of the reference"),
    ]
}

#[rustfmt::skip]
pub(super) fn wall() -> Section {
    type W = WallSpec;
    let pre_wall = vec![
        field("depth_deg", number_in("°", 3, PreWall::DEPTH_MDEG), Required, "depth of the pre-wall in front of the wall"),
        field("begin", bounded_number(UNIT, 3, PreWall::BEGIN, "at most `end`"), OrFile, "amplitude at the beginning of the pre-wall"),
        field("end", bounded_number(UNIT, 3, PreWall::END, "at most the wall's `max`"), OrFile, "amplitude at the wall"),
    ];
    let antagonist = vec![
        field("channel", channel_number(), Required, "a channel of the file"),
        field("amplitude", bounded_number(UNIT, 3, CoContraction::AMPLITUDE, "at most the channel's `limit`"), OrFile, "amplitude of the antagonist inside the wall"),
    ];
    let mut fields = vec![
        field("at_deg", bounded_number("°", 3, W::AT_MDEG, "within the angles"), Required, "angle of the wall"),
        field("stops", one_of(&SIDES), OrWord("flexion"), "direction that the wall stops: flexion (larger angles) or extension (smaller angles)"),
        field("channel", channel_number(), Required, "channel of the muscle that pulls the limb out of the wall"),
        field("max", bounded_number(UNIT, 3, W::MAX, "at most the channel's `limit`"), OrFile, "largest amplitude of this channel"),
        field("stiffness_per_deg", number_in("unit per °", 3, W::STIFFNESS), Required, "amplitude per degree of penetration"),
        field("damping_s_per_deg", number_in("unit·s per °", 3, W::DAMPING), Or(0), "amplitude per rate of penetration; the paper uses none"),
        field("cutoff_hz", number_in("Hz", 3, W::CUTOFF_MHZ), Or(10_000), "cutoff frequency of the differentiator for the damping"),
        field("pre_wall", Kind::Table(pre_wall), Optional, "ramp from `begin` to `end` over `depth_deg` in front of the wall; the paper's is 9° to `max`"),
        field("co_contraction", Kind::Table(antagonist), Optional, "antagonist that is also stimulated inside the wall, and its amplitude"),
    ];
    fields.extend(angles(150_000));
    fields.extend(sensor(ELBOW_CODES));
    fields
}
