//! Limits of what a device may do to a wearer: `[limits]` of a wearer file, `[wearer]` of a
//! session.

use firmware::safety::{ChannelSpec, SetupError, WearerSpec};

use super::unit::Unit;
use crate::fields::decimal::format_scaled;
use crate::fields::error::Problem;
use crate::fields::field::Need::{Or, OrWord};
use crate::fields::field::{Kind, Section, field, number_in};
use crate::fields::table::Table;

/// Returns the fields that hold a wearer's limits. The default of each is the device's own limit.
#[rustfmt::skip]
pub(crate) fn limits() -> Section {
    type W = WearerSpec;
    let d = W::default();
    vec![
        field("max_current_ma", number_in("mA", 3, W::MAX_CURRENT_UA), Or(d.max_current_ua.into()), "largest current"),
        field("max_charge_uc", number_in("µC", 3, W::MAX_CHARGE_NC), Or(d.max_charge_nc.into()), "largest charge of one phase"),
        field("max_rms_ma", number_in("mA", 3, W::MAX_RMS_UA), Or(d.max_rms_ua.into()), "largest rms current of a channel"),
        field("rise_ms", number_in("ms", 0, W::RISE_MS), Or(d.rise_ms.into()), "time in which an amplitude rises from zero"),
        field("fall_ms", number_in("ms", 0, W::FALL_MS), Or(d.fall_ms.into()), "time in which amplitudes fall when stimulation ends"),
        field("host_timeout_ms", number_in("ms", 0, W::HOST_TIMEOUT_MS), Or(d.host_timeout_ms.into()), "host silence that ends stimulation"),
        field("max_sum_ma", number_in("mA", 3, W::MAX_SUM_UA), Or(d.max_sum_ua.into()), "largest sum of all channels over the common return at any microsecond"),
        field("max_sum_rms_ma", number_in("mA", 3, W::MAX_SUM_RMS_UA), Or(d.max_sum_rms_ua.into()), "largest rms current of all channels together"),
        field("return_area_mm2", number_in("mm²", 0, W::RETURN_AREA_MM2), Or(d.return_area_mm2.into()), "area of the common return electrode, for the limit of 2 mA/cm² rms"),
        field("hand_stop_required", Kind::Flag, OrWord("false"), "whether arming requires a closed hand-held stop, which ends stimulation when it opens; the arm key alone is then not enough"),
        field("rise_bursts", number_in("", 0, W::RISE_BURSTS), Or(d.rise_bursts.into()), "smallest number of bursts of this rise"),
        field("max_session_s", number_in("s", 0, W::MAX_SESSION_S), Or(d.max_session_s.into()), "longest total stimulation since power-on"),
        field("max_dose_mc", number_in("mC", 0, W::MAX_DOSE_MC), Or(d.max_dose_mc.into()), "largest total charge through a channel since power-on, counting one phase of each pulse"),
        field("max_step_ma", number_in("mA", 3, W::MAX_STEP_UA), Or(d.max_step_ua.into()), "largest increase of an amplitude above zero from burst to burst"),
        field("max_step_ma_per_s", number_in("mA", 3, W::MAX_STEP_UA_PER_S), Or(d.max_step_ua_per_s.into()), "largest increase of an amplitude above zero within a second"),
    ]
}

/// Returns the limits that a table gives. A limit that the table leaves out is the device's own.
pub(crate) fn read_limits(t: &Table<'_>) -> WearerSpec {
    WearerSpec {
        max_current_ua: t.integer("max_current_ma"),
        max_charge_nc: t.integer("max_charge_uc"),
        max_rms_ua: t.integer("max_rms_ma"),
        rise_ms: t.integer("rise_ms"),
        fall_ms: t.integer("fall_ms"),
        host_timeout_ms: t.integer("host_timeout_ms"),
        max_sum_ua: t.integer("max_sum_ma"),
        max_sum_rms_ua: t.integer("max_sum_rms_ma"),
        return_area_mm2: t.integer("return_area_mm2"),
        hand_stop_required: t.flag("hand_stop_required"),
        rise_bursts: t.integer("rise_bursts"),
        max_session_s: t.integer("max_session_s"),
        max_dose_mc: t.integer("max_dose_mc"),
        max_step_ua: t.integer("max_step_ma"),
        max_step_ua_per_s: t.integer("max_step_ma_per_s"),
    }
}

/// Returns the error for a channel that exceeds one of its own limits, with the value and the
/// limit. Returns `None` if `e` is a mistake of another kind. `ma` returns the rms current of the
/// channel's train as text.
pub(crate) fn channel_limit_problem(
    spec: &ChannelSpec,
    unit: Unit,
    ma: impl Fn() -> String,
    e: SetupError,
) -> Option<Problem> {
    let milli = |value: u32| format_scaled(value.into(), 3);
    let stage = spec.stage.validate().ok()?;
    let current_ua = stage.current(spec.limit).get();
    let limit = format!(
        "{} {} ({} mA)",
        milli(spec.limit.get()),
        unit.symbol(),
        milli(current_ua)
    );
    Some(match e {
        SetupError::Current { max } => Problem::CurrentLimit {
            limit,
            max_ma: milli(max.get()),
            by: match max == stage.max_current() {
                true => "the maximum of this kind of stage",
                false => "`wearer.max_current_ma`",
            },
        },
        SetupError::Charge { max_nc } => Problem::ChargeLimit {
            limit,
            // The product of µA and µs is in pC.
            uc: format_scaled(i64::from(current_ua) * i64::from(spec.train.width_us), 6),
            max_uc: milli(max_nc),
        },
        SetupError::Rms { max } => Problem::RmsLimit {
            limit,
            ma: ma(),
            max_ma: milli(max.get()),
        },
        SetupError::Density { max } => Problem::DensityLimit {
            limit,
            ma: ma(),
            area_mm2: spec.area_mm2,
            max_ma: milli(max.get()),
        },
        _ => return None,
    })
}
