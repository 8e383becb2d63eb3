use super::*;
use crate::pulse::TrainSpec;
use crate::range::{OutOfRange, Range};
use crate::safety::{StageSpec, Wearer, WearerSpec};
use crate::units::{Amplitude, DacCode, MicroAmps};

pub(crate) const CHANNEL: ChannelSpec = ChannelSpec {
    train: TrainSpec::biphasic(200, 100, 20_000),
    stage: StageSpec::Current {
        full_scale_ua: 100_000,
    },
    limit: Amplitude::new(20_000),
    start: Amplitude::new(0),
    area_mm2: 2_500,
};

fn try_channel(change: impl FnOnce(&mut ChannelSpec)) -> Result<Channel, SetupError> {
    let mut spec = CHANNEL;
    change(&mut spec);
    spec.validate(&WearerSpec::default().validate().unwrap())
}

#[test]
fn each_limit_is_named() {
    assert!(try_channel(|_| ()).is_ok());
    assert_eq!(
        try_channel(|c| (c.limit, c.train.width_us) = (Amplitude::new(80_001), 500)),
        Err(SetupError::Charge { max_nc: 40_000 })
    );
    assert!(try_channel(|c| (c.limit, c.train.width_us) = (Amplitude::new(80_000), 500)).is_ok());
    // 80 mA, 2 · 500 µs, 8 pulses in 20 ms: 80 · sqrt(8/20) = 50.6 mA rms.
    let octuplet = |c: &mut ChannelSpec| {
        (c.limit, c.train.width_us) = (Amplitude::new(80_000), 500);
        (c.train.burst_count, c.train.burst_interval_us) = (8, 1_200);
    };
    assert_eq!(
        try_channel(octuplet),
        Err(SetupError::Rms {
            max: MicroAmps::new(50_000)
        })
    );
    let volts = StageSpec::Voltage {
        full_scale_mv: 60_000,
        load_ohm: 2_000,
    };
    assert!(try_channel(|c| (c.stage, c.limit) = (volts, Amplitude::new(40_000))).is_ok());
    assert_eq!(
        try_channel(|c| (c.stage, c.limit) = (volts, Amplitude::new(40_001))),
        Err(SetupError::Current {
            max: MicroAmps::new(20_000)
        })
    );
}

/// Only members of an isolated group must keep their pulse rate; other channels' rates may change.
#[test]
fn only_a_groups_own_members_must_keep_their_rate() {
    let steady = try_channel(|_| ()).unwrap();
    let later = try_channel(|c| c.train.offset_us = 5_000).unwrap();
    let changing = Channel {
        max_period_us: later.max_period_us + 1,
        ..later
    };
    let group = |second, third| {
        let mut channels = [None; CHANNELS];
        channels[..3].copy_from_slice(&[Some(steady), Some(second), Some(third)]);
        let spec = GroupSpec {
            members: 0b11,
            partner: Partner::Isolated,
        };
        let trains = channels.map(|c: Option<Channel>| c.map(|c| c.train));
        check_group(&spec, &channels, &trains).map(|group| group.members())
    };
    assert_eq!(group(later, changing), Ok(0b11));
    let refused = GroupError::RateChanges { channel: 1 };
    assert_eq!(group(changing, later), Err(refused));
}

/// A charge of 8 µC allows 20 mA for 400 µs, the width that heats most and is checked; at 500 µs,
/// 16 mA remain.
#[test]
fn a_live_width_is_judged_where_it_heats_most() {
    let wearer = WearerSpec {
        max_charge_nc: 8_000,
        ..WearerSpec::default()
    };
    let mut spec = CHANNEL;
    spec.train.max_width_us = 500;
    let wearer = wearer.validate().unwrap();
    let channel = spec.validate(&wearer).unwrap();
    assert_eq!(channel.judged_width_us, 400);
    let highest = [10, 400, 401, 500].map(|w| channel.max_amplitude_at(w, &wearer).get());
    assert_eq!(highest, [20_000, 20_000, 19_950, 16_000]);
    // 20 mA for two phases of 400 µs in 20 ms: 4 mA rms, for which 200 mm² suffice.
    spec.area_mm2 = 200;
    assert!(spec.validate(&wearer).is_ok());
    spec.area_mm2 = 199;
    let max = MicroAmps::new(199 * 20);
    assert_eq!(spec.validate(&wearer), Err(SetupError::Density { max }));
    // Without the charge limit, the widest phase is checked.
    let free = WearerSpec::default().validate().unwrap();
    spec.area_mm2 = 2_500;
    assert_eq!(spec.validate(&free).unwrap().judged_width_us, 500);
    assert_eq!(CHANNEL.validate(&free).unwrap().judged_width_us, 200);
}

/// A field of the wearer's limits, and a function that sets it.
type Field = (Range, fn(&mut WearerSpec, u32));

/// All numeric fields of the wearer's limits.
const FIELDS: [Field; 14] = [
    (WearerSpec::MAX_CURRENT_UA, |w, n| w.max_current_ua = n),
    (WearerSpec::MAX_CHARGE_NC, |w, n| w.max_charge_nc = n),
    (WearerSpec::MAX_RMS_UA, |w, n| w.max_rms_ua = n),
    (WearerSpec::RISE_MS, |w, n| w.rise_ms = n as u16),
    (WearerSpec::FALL_MS, |w, n| w.fall_ms = n as u16),
    (WearerSpec::HOST_TIMEOUT_MS, |w, n| {
        w.host_timeout_ms = n as u16
    }),
    (WearerSpec::MAX_SUM_UA, |w, n| w.max_sum_ua = n),
    (WearerSpec::MAX_SUM_RMS_UA, |w, n| w.max_sum_rms_ua = n),
    (WearerSpec::RETURN_AREA_MM2, |w, n| w.return_area_mm2 = n),
    (WearerSpec::RISE_BURSTS, |w, n| w.rise_bursts = n as u16),
    (WearerSpec::MAX_SESSION_S, |w, n| w.max_session_s = n),
    (WearerSpec::MAX_DOSE_MC, |w, n| w.max_dose_mc = n),
    (WearerSpec::MAX_STEP_UA, |w, n| w.max_step_ua = n),
    (WearerSpec::MAX_STEP_UA_PER_S, |w, n| {
        w.max_step_ua_per_s = n
    }),
];

fn wearer_with(set: fn(&mut WearerSpec, u32), n: u32) -> Result<Wearer, OutOfRange> {
    let mut spec = WearerSpec::default();
    set(&mut spec, n);
    spec.validate()
}

/// Each end of each range is accepted, and values beyond it are refused with the field's name. The
/// hard limits are repeated as literals, so that a wider range fails the test.
#[test]
fn wearer_limits_can_only_be_tighter() {
    let hard: [(&str, u32, u32); FIELDS.len()] = [
        ("max_current_ua", 100, 100_000),
        ("max_charge_nc", 1, 40_000),
        ("max_rms_ua", 10, 50_000),
        ("rise_ms", 1, 5_000),
        ("fall_ms", 5, 100),
        ("host_timeout_ms", 20, 1_000),
        ("max_sum_ua", 100, 200_000),
        ("max_sum_rms_ua", 10, 50_000),
        ("return_area_mm2", 10, 40_000),
        ("rise_bursts", 1, 1_000),
        ("max_session_s", 1, 86_400),
        ("max_dose_mc", 1, 4_320_000),
        ("max_step_ua", 10, 100_000),
        ("max_step_ua_per_s", 10, 100_000),
    ];
    for ((range, set), (field, least, most)) in FIELDS.into_iter().zip(hard) {
        assert_eq!(range.field, field);
        for inside in [least, most] {
            assert!(wearer_with(set, inside).is_ok(), "{field} = {inside}");
        }
        for outside in [least - 1, most + 1] {
            let refused = wearer_with(set, outside).unwrap_err();
            assert_eq!(refused.field, field, "{outside}");
        }
    }
}

/// Each limit of a channel's setup is refused by name when the wearer's limit is just below, and
/// accepted when it is just reached: 20 mA in two phases of 200 µs at 50 Hz are 4 µC a phase and
/// 2.83 mA rms.
#[test]
fn a_tighter_limit_is_the_one_that_counts() {
    let try_on = |set: fn(&mut WearerSpec, u32), n| {
        CHANNEL.validate(&wearer_with(set, n).unwrap()).map(|_| ())
    };
    let current: fn(&mut WearerSpec, u32) = |w, n| w.max_current_ua = n;
    assert_eq!(try_on(current, 20_000), Ok(()));
    let max = MicroAmps::new(19_999);
    assert_eq!(try_on(current, 19_999), Err(SetupError::Current { max }));
    let charge: fn(&mut WearerSpec, u32) = |w, n| w.max_charge_nc = n;
    assert_eq!(try_on(charge, 4_000), Ok(()));
    let refused = Err(SetupError::Charge { max_nc: 3_999 });
    assert_eq!(try_on(charge, 3_999), refused);
    let rms: fn(&mut WearerSpec, u32) = |w, n| w.max_rms_ua = n;
    assert_eq!(try_on(rms, 2_829), Ok(()));
    let max = MicroAmps::new(2_828);
    assert_eq!(try_on(rms, 2_828), Err(SetupError::Rms { max }));
}

#[test]
fn codes_never_exceed_what_was_asked() {
    let stage = CHANNEL.stage.validate().unwrap();
    for ua in (0..=100_000).step_by(37) {
        let code = stage.code(Amplitude::new(ua));
        assert!(u64::from(code.get()) * 100_000 <= u64::from(ua) * 65_535);
        assert!(stage.amplitude(code) <= Amplitude::new(ua));
    }
    assert_eq!(stage.code(Amplitude::new(100_000)), DacCode::new(65_535));
}
