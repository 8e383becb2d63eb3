//! The built-in sessions, which are part of the program.

use std::path::Path;

macro_rules! sessions {
    ($($name:literal)*) => {
        &[$(($name, include_str!(concat!("../../../sessions/", $name, ".toml")))),*]
    };
}

/// Name and text of each session in `host-tool/sessions`. A name is a path in that folder, without
/// `.toml`.
#[rustfmt::skip]
pub const SHIPPED: &[(&str, &str)] = sessions![
    "cycling"
    "distributed"
    "drop_foot"
    "endpoint_arm"
    "endpoint_force"
    "five_channels"
    "force_ramp"
    "full_load"
    "gentle_force"
    "hamana_exp2/one_point_a_conducted"
    "hamana_exp2/one_point_a_isolated"
    "hamana_exp2/one_point_b_conducted"
    "hamana_exp2/one_point_b_isolated"
    "hamana_exp2/two_point_00_conducted_0us"
    "hamana_exp2/two_point_01_conducted_50us_a_to_b"
    "hamana_exp2/two_point_01_conducted_50us_b_to_a"
    "hamana_exp2/two_point_02_conducted_100us_a_to_b"
    "hamana_exp2/two_point_02_conducted_100us_b_to_a"
    "hamana_exp2/two_point_03_conducted_150us_a_to_b"
    "hamana_exp2/two_point_03_conducted_150us_b_to_a"
    "hamana_exp2/two_point_04_conducted_200us_a_to_b"
    "hamana_exp2/two_point_04_conducted_200us_b_to_a"
    "hamana_exp2/two_point_05_conducted_500us_a_to_b"
    "hamana_exp2/two_point_05_conducted_500us_b_to_a"
    "hamana_exp2/two_point_06_conducted_1000us_a_to_b"
    "hamana_exp2/two_point_06_conducted_1000us_b_to_a"
    "hamana_exp2/two_point_07_isolated_1000us_a_to_b"
    "hamana_exp2/two_point_07_isolated_1000us_b_to_a"
    "hamana_exp2/two_point_08_conducted_2000us_a_to_b"
    "hamana_exp2/two_point_08_conducted_2000us_b_to_a"
    "hamana_exp2/two_point_09_isolated_2000us_a_to_b"
    "hamana_exp2/two_point_09_isolated_2000us_b_to_a"
    "hamana_exp2/two_point_10_conducted_5000us_a_to_b"
    "hamana_exp2/two_point_10_conducted_5000us_b_to_a"
    "hamana_exp2/two_point_11_isolated_5000us_a_to_b"
    "hamana_exp2/two_point_11_isolated_5000us_b_to_a"
    "hamana_exp2/two_point_12_conducted_10000us"
    "hamana_exp2/two_point_13_isolated_10000us"
    "hamana_exp4_one_point_a"
    "hamana_exp4_one_point_a_finger"
    "hamana_exp4_one_point_b"
    "hamana_exp4_one_point_b_finger"
    "hamana_exp4_two_point"
    "hamana_exp4_two_point_finger"
    "hamana_exp4_two_point_wearer"
    "harris_wall/1_pre_wall"
    "harris_wall/3_pre_wall_co_contraction"
    "lift"
    "lift_resist"
    "open_finger"
    "reciprocal"
    "strength"
    "ten_channels"
    "ten_channels_and_finger"
    "ten_channels_and_hand"
    "ten_forces"
    "trigger"
    "width_ramp"
];

/// Returns the text of the built-in session that `path` names, with or without `.toml`. Returns
/// `None` if a file of that path exists, because the file has precedence.
pub(super) fn builtin_session(path: &Path) -> Option<&'static str> {
    let name = path.to_str()?;
    let name = name.strip_suffix(".toml").unwrap_or(name);
    let found = SHIPPED.iter().find(|(own, _)| *own == name);
    found.filter(|_| !path.exists()).map(|(_, text)| *text)
}
