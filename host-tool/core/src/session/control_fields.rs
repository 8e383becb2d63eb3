//! The fields of `[joint]`, of `[wall]` and of tables that both share, declared in the same way as
//! the others in `fields`.

use firmware::control::differentiator::Differentiator;
use firmware::control::pid::Pid;
use firmware::control::refusal::{ANGLE_MAX_MDEG, ANGLE_MIN_MDEG};
use firmware::control::super_twisting::{Paper, Recommended, SuperTwisting};
use firmware::control::{HoldPolicy, LawSpec, PointSpec, ResponseSpec, SensorSource, WearerModel};
use firmware::haptics::{CoContraction, PreWall, Side, WallSpec};

use super::law::LAWS;
use crate::fields::decimal::in_units;
use crate::fields::field::Need::{Optional, Or, OrFile, OrTold, OrWord, Required};
use crate::fields::field::{Kind, Need, Section, UNIT, channel, f, list, n, nb, one_of};

/// Directions of motion that a wall stops, and their names in session files.
pub(super) const SIDES: [(&str, Side); 2] =
    [("flexion", Side::Flexion), ("extension", Side::Extension)];
/// Default of the longest extrapolation after a lost setpoint, ms: nine setpoints of a 90 Hz
/// stream.
const MAX_EXTRAPOLATION_MS: i64 = 100;
/// Default ages at which a measurement is stale, ms: of the board's converter, ten readings, and of
/// the host, four and a half readings of a 90 Hz glove.
pub(super) const STALE_AFTER_MS: (u16, u16) = (10, 50);
/// Default calibration of the board's angle sensor, as codes at 0° and 100°: 25 codes per degree,
/// so that a broken or shorted wire reads −32° or +132°, outside the range that the device accepts
/// for a joint of 0–100°.
const FINGER_CODES: (i64, i64) = (800, 3300);
/// Default calibration of the angle sensor of a wall, as codes at 0° and 100°: 20 codes per degree,
/// so that an elbow's 0–150° and 20° on either side are measurable.
const ELBOW_CODES: (i64, i64) = (500, 2500);
/// Default curvature of recruitment, thousandths: the mean of ln(Fmax/Fmin) over Lee 2020, table 2.
const LEE_CURVATURE_MILLI: i64 = 1_200;

/// Returns the kind of a channel's amplitude, in thousandths of its unit.
pub(super) fn amplitude() -> Kind {
    nb(UNIT, 3, PointSpec::MAX, "to the channel's `limit`")
}

#[rustfmt::skip]
pub(super) fn hold(meaning: &'static str) -> Section {
    vec![
        f("hold", Kind::Choice(vec!["extrapolate", "hold"]), OrWord("extrapolate"), meaning),
        f("max_extrapolation_ms", n("ms", 0, HoldPolicy::MAX_MS), Or(MAX_EXTRAPOLATION_MS), "longest extrapolation").when("hold", &["extrapolate"]),
    ]
}

#[rustfmt::skip]
fn sensor(codes: (i64, i64)) -> Section {
    let (adc, host) = STALE_AFTER_MS;
    vec![
        f("sensor", Kind::Choice(vec!["adc", "host"]), Required, "who measures"),
        f("code_at_0_deg", n("", 0, SensorSource::CODE_AT_0), Or(codes.0), "the converter's code at 0°").when("sensor", &["adc"]),
        f("code_at_100_deg", nb("", 0, SensorSource::CODE_AT_100, "≥ 100 from the other"), Or(codes.1), "and at 100°").when("sensor", &["adc"]),
        f("stale_after_ms", n("ms", 0, SensorSource::STALE_AFTER_MS), OrTold(format!("{adc} adc, {host} host")), "age at which a measurement is a fault"),
    ]
}

#[rustfmt::skip]
fn angles(most_mdeg: i64) -> Section {
    vec![
        f("angle_min_deg", n("°", 3, ANGLE_MIN_MDEG), Or(0), "lowest angle"),
        f("angle_max_deg", nb("°", 3, ANGLE_MAX_MDEG, "above the lowest"), Or(most_mdeg), "highest angle"),
    ]
}

#[rustfmt::skip]
fn point() -> Section {
    vec![
        f("channel", channel(), Required, "a channel of the file"),
        f("threshold", nb(UNIT, 3, PointSpec::THRESHOLD, "to `max`"), OrFile, "amplitude at no effort"),
        f("max", amplitude(), OrFile, "amplitude at full effort"),
    ]
}

#[rustfmt::skip]
pub(super) fn joint() -> Section {
    let by_law = |of: fn(LawSpec) -> i64, places| {
        let told = LAWS.map(|(_, law)| {
            let [alone, known] = [false, true].map(|wearer| of(law.spec(wearer)));
            match alone == known {
                true => in_units(alone, places),
                false => format!("{} (with a `wearer` {})", in_units(alone, places), in_units(known, places)),
            }
        });
        OrTold(format!("{} by law", told.join(", ")))
    };
    let mut all = vec![
        f("law", one_of(&LAWS), OrWord("recommended"), "control law"),
        f("gains", Kind::Table(recommended_gains()), Optional, "gains to change").when("law", &["recommended"]),
        f("gains", Kind::Table(paper_gains()), Optional, "gains to change").when("law", &["paper"]),
        f("gains", Kind::Table(pid_gains()), Optional, "gains to change").when("law", &["pid"]),
        f("law_period_ms", n("ms", 0, Differentiator::STEP_MS), by_law(|law| law.default_period_ms().into(), 0), "period of the law"),
        f("cutoff_hz", n("Hz", 3, Differentiator::CUTOFF_MHZ), by_law(|law| law.default_cutoff_mhz().into(), 3), "cutoff of its differentiator"),
        f("flexors", list(point(), 1, Some(2), "points"), Required, "flexor points"),
        f("extensor", Kind::Table(point()), Required, "extensor point"),
        f("wearer", Kind::Table(wearer_model()), Optional, "the nominal wearer of the feed-forward"),
        f("response", Kind::Table(response()), Optional, "how that wearer answers in time"),
    ];
    all.extend(hold("between and after setpoints"));
    all.extend(angles(100_000));
    all.extend(sensor(FINGER_CODES));
    all
}

/// Returns the default of a gain: the value `alone` of the control law and, if a law with a model
/// of the wearer has another, also that value.
fn own(alone: u32, with_wearer: u32) -> Need {
    let [alone, other] = [alone, with_wearer].map(|milli| in_units(milli.into(), 3));
    OrTold(match alone == other {
        true => alone,
        false => format!("{alone}, with a `wearer` {other}"),
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
        f("lambda", n("", 3, Recommended::LAMBDA_MILLI), own(a[0], w[0]), "slope of the sliding surface"),
        f("k1", nb("", 3, SuperTwisting::k1_milli(1_000, 1), "h·b·k1 to 200"), own(a[1], w[1]), "of the root of the sliding variable"),
        f("k2", n("", 3, Recommended::K2_MILLI), own(a[2], w[2]), "of its sign, integrated"),
        f("b", n("", 3, SuperTwisting::B_MILLI), own(a[3], w[3]), "of the plant that the law assumes"),
        f("k3", nb("", 3, SuperTwisting::k3_milli(1_000, 1), "h·b·k3 to 7"), own(a[4], w[4]), "of the sliding variable itself"),
        f("ki", n("", 3, Recommended::KI_MILLI), own(a[5], w[5]), "of the error, integrated"),
    ]
}

#[rustfmt::skip]
fn paper_gains() -> Section {
    let [lambda, w] = match LawSpec::PAPER {
        LawSpec::Paper { lambda_milli, w_milli } => [lambda_milli, w_milli],
        _ => [0; 2],
    };
    vec![
        f("lambda", n("", 3, Paper::LAMBDA_MILLI), own(lambda, lambda), "slope of the sliding surface"),
        f("w", n("", 3, Paper::W_MILLI), own(w, w), "the paper's W"),
    ]
}

#[rustfmt::skip]
fn pid_gains() -> Section {
    let [kp, ki, kd] = match LawSpec::PID {
        LawSpec::Pid { kp_milli, ki_milli, kd_milli } => [kp_milli, ki_milli, kd_milli],
        _ => [0; 3],
    };
    vec![
        f("kp", n("", 3, Pid::KP_MILLI), own(kp, kp), "of the error"),
        f("ki", n("", 3, Pid::KI_MILLI), own(ki, ki), "of its integral"),
        f("kd", n("", 3, Pid::KD_MILLI), own(kd, kd), "of its rate"),
    ]
}

#[rustfmt::skip]
fn wearer_model() -> Section {
    type W = WearerModel;
    let [leads, _, pid] = LAWS.map(|(_, law)| law.spec(true).default_lead_ms());
    vec![
        f("rest_deg", n("°", 3, W::REST_MDEG), Required, "angle of the relaxed joint"),
        f("stiffness_nm_per_rad", n("N·m/rad", 6, W::STIFFNESS_UNM_PER_RAD), Required, "towards it"),
        f("damping_nm_s_per_rad", n("N·m·s/rad", 6, W::DAMPING_UNM_S_PER_RAD), Or(0), "viscous friction"),
        f("flexion_nm", n("N·m", 6, W::FLEXION_UNM), Required, "all flexors at `max`, at `angle_min_deg`"),
        f("extension_nm", n("N·m", 6, W::EXTENSION_UNM), Required, "the extensor at `max`, at `angle_max_deg`"),
        f("torque_loss", n("", 3, W::TORQUE_LOSS_MILLI), Or(0), "part that a muscle loses over the range"),
        f("curvature", n("", 3, W::CURVATURE_MILLI), Or(LEE_CURVATURE_MILLI), "of force between threshold and `max`"),
        f("lead_ms", n("ms", 0, W::LEAD_MS), OrTold(format!("{leads}, `pid` {pid}")), "how far ahead the target is taken"),
    ]
}

#[rustfmt::skip]
fn response() -> Section {
    type R = ResponseSpec;
    let d = ResponseSpec::RECOMMENDED;
    let by_strength = |milli: u32| OrTold(format!("{}·s", in_units(milli.into(), 3)));
    vec![
        f("gain_rad", n("rad", 3, R::GAIN_MRAD), by_strength(d.gain_mrad.into()), "angle per full effort; 0: no predictor"),
        f("muscle_ms", n("ms", 0, R::MUSCLE_MS), Or(d.muscle_ms.into()), "time constant of the muscle"),
        f("joint_ms", n("ms", 0, R::JOINT_MS), Or(d.joint_ms.into()), "time constant of the joint"),
        f("delay_ms", n("ms", 0, R::DELAY_MS), Or(d.delay_ms.into()), "from effort to angle"),
        f("scale_learning", n("1/(rad·s)", 3, R::SCALE_MILLI), by_strength(d.scale_milli), "of the feed-forward's scale"),
        f("damping_learning", n("1/rad²", 3, R::DAMPING_MILLI), Or(d.damping_milli.into()), "of effort per rate of the target"),
    ]
}

#[rustfmt::skip]
pub(super) fn wall() -> Section {
    type W = WallSpec;
    let pre_wall = vec![
        f("depth_deg", n("°", 3, PreWall::DEPTH_MDEG), Required, "in front of the wall"),
        f("begin", nb(UNIT, 3, PreWall::BEGIN, "to `end`"), OrFile, "amplitude where it begins"),
        f("end", nb(UNIT, 3, PreWall::END, "to the wall's `max`"), OrFile, "amplitude at the wall"),
    ];
    let antagonist = vec![
        f("channel", channel(), Required, "a channel of the file"),
        f("amplitude", nb(UNIT, 3, CoContraction::AMPLITUDE, "to the channel's `limit`"), OrFile, "inside the wall"),
    ];
    let mut all = vec![
        f("at_deg", nb("°", 3, W::AT_MDEG, "within the angles"), Required, "where it stands"),
        f("stops", one_of(&SIDES), OrWord("flexion"), "what it stops: larger or smaller angles"),
        f("channel", channel(), Required, "the muscle that pulls out"),
        f("max", nb(UNIT, 3, W::MAX, "to the channel's `limit`"), OrFile, "highest amplitude there"),
        f("stiffness_per_deg", n("unit per °", 3, W::STIFFNESS), Required, "amplitude per penetration"),
        f("damping_s_per_deg", n("unit·s per °", 3, W::DAMPING), Or(0), "amplitude per rate of penetration; the paper has none"),
        f("cutoff_hz", n("Hz", 3, W::CUTOFF_MHZ), Or(10_000), "cutoff of the damping's differentiator"),
        f("pre_wall", Kind::Table(pre_wall), Optional, "ramp from `begin` to `end` over `depth_deg` in front of the wall; the paper's is 9° to `max`"),
        f("co_contraction", Kind::Table(antagonist), Optional, "the antagonist and its amplitude inside the wall"),
    ];
    all.extend(angles(150_000));
    all.extend(sensor(ELBOW_CODES));
    all
}
