use super::*;
use crate::pulse::TrainSpec;
use crate::safety::{StageSpec, WearerSpec};
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

/// The rate of a channel outside of an isolated group may change.
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

/// 8 µC let 20 mA last 400 µs: there it heats most, and is judged; at 500 µs 16 mA
/// remain.
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
    let highest = [10, 400, 401, 500].map(|w| channel.highest_at(w, &wearer).get());
    assert_eq!(highest, [20_000, 20_000, 19_950, 16_000]);
    // 20 mA for two phases of 400 µs in 20 ms: 4 mA rms, which 200 mm² take.
    spec.area_mm2 = 200;
    assert!(spec.validate(&wearer).is_ok());
    spec.area_mm2 = 199;
    let max = MicroAmps::new(199 * 20);
    assert_eq!(spec.validate(&wearer), Err(SetupError::Density { max }));
    // Alone, without the charge's limit, the widest phase counts.
    let free = WearerSpec::default().validate().unwrap();
    spec.area_mm2 = 2_500;
    assert_eq!(spec.validate(&free).unwrap().judged_width_us, 500);
    assert_eq!(CHANNEL.validate(&free).unwrap().judged_width_us, 200);
}

#[test]
fn wearer_limits_can_only_be_tighter() {
    let loose = WearerSpec {
        max_current_ua: 100_001,
        ..WearerSpec::default()
    };
    assert_eq!(loose.validate().unwrap_err().field, "max_current_ua");
    let tight = WearerSpec {
        max_current_ua: 10_000,
        ..WearerSpec::default()
    };
    assert_eq!(
        CHANNEL.validate(&tight.validate().unwrap()),
        Err(SetupError::Current {
            max: MicroAmps::new(10_000)
        })
    );
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
