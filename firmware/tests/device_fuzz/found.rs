//! Inputs that random search has found, each kept as a test.

use super::hosts::Step::{self, Send, Stream, Wait};
use super::{FuzzCounts, one_run};
use crate::device_desk::ARM;
use firmware::link::Request;
use firmware::pulse::Shape::{self, *};
use firmware::pulse::{TrainSpec, Trigger};
use firmware::safety::{ChannelSpec, StageSpec, WearerSpec};
use firmware::units::{Amplitude, Micros};

const FULL: StageSpec = StageSpec::Current {
    full_scale_ua: 100_000,
};

fn wearer(max_current_ua: u32, rise_ms: u16, fall_ms: u16, host_timeout_ms: u16) -> Request {
    Request::Wearer(WearerSpec {
        max_current_ua,
        rise_ms,
        fall_ms,
        host_timeout_ms,
        ..WearerSpec::default()
    })
}

/// Returns a train from width, gap and grounding; period and offset; pulses per burst, their
/// interval and repeats. Times are in µs.
fn train(
    shape: Shape,
    (width_us, gap_us, ground_us): (u16, u16, u16),
    (period_us, offset_us): (u32, u32),
    (burst_count, burst_interval_us, repeats): (u8, u16, u16),
    triggered: bool,
) -> TrainSpec {
    TrainSpec {
        shape,
        width_us,
        max_width_us: 0,
        gap_us,
        ground_us,
        period_us,
        offset_us,
        burst_count,
        burst_interval_us,
        repeats,
        trigger: triggered.then_some(Trigger::Start),
        lists: false,
    }
}

fn channel(channel: u8, train: TrainSpec, stage: StageSpec) -> Request {
    let limit = Amplitude::new(20_000);
    let spec = ChannelSpec {
        train,
        stage,
        limit,
        start: Amplitude::new(0),
        area_mm2: ChannelSpec::ASSUMED_AREA_MM2,
    };
    Request::Channel { channel, spec }
}

fn amplitudes(mask: u16, values: &[u32]) -> Request {
    let values = values.iter().copied().map(Amplitude::new).collect();
    Request::Amplitudes {
        at: None,
        mask,
        values,
        widths: heapless::Vec::new(),
    }
}

/// Over-current between a refill's start and its DAC writes: the fault once wrote its zeros before
/// the codes of the refill, whose last code remained.
#[test]
fn over_current_during_a_refill_leaves_the_dacs_at_zero() {
    #[rustfmt::skip]
    let steps = [
        Step::Hello,
        Send(wearer(100_000, 1, 5, 20)),
        Send(channel(0, train(BiphasicCathodicFirst, (10, 0, 0), (5_000, 0), (1, 0, 0), false), FULL)),
        Send(channel(1, train(BiphasicCathodicFirst, (10, 0, 0), (5_000, 0), (1, 0, 0), false), FULL)),
        Send(ARM),
        Wait(24_000),
        Send(Request::Start),
        Send(amplitudes(3, &[0, 0])),
        Wait(36_003),
        Send(Request::KeepAlive),
        Wait(898),
        Wait(17_390),
        Wait(328),
        Send(Request::KeepAlive),
        Send(Request::KeepAlive),
        Send(Request::KeepAlive),
        Stream(11, 14_246),
        Stream(19, 8_700),
        Send(amplitudes(1, &[0])),
        Wait(15_324),
        Send(wearer(100_000, 33, 93, 87)),
        Send(Request::Stop),
        Send(Request::Start),
        Send(channel(0, train(BiphasicAnodicFirst, (303, 140, 0), (10_000, 600_245_954), (8, 2_896, 0), false), StageSpec::Voltage { full_scale_mv: 5_323, load_ohm: 80_201 })),
        Send(amplitudes(31_143, &[17_908, 11_273, 5_071, 4_198, 2_617, 19_350])),
        Wait(124),
        Step::Broken(amplitudes(33_337, &[1_593, 6_438, 9_722, 4_294_967_295, 7_428, 13_549, 4_103, 6_089]), 63_067),
        Send(amplitudes(40_135, &[10_486, 13_670, 19_008, 6_455, 18_628, 16_432, 20_001, 9_397])),
        Send(amplitudes(1, &[14_082])),
        Wait(56),
        Send(channel(3, train(MonophasicAnodic, (483, 0, 2_915), (12_732, 1_467), (3, 4_044, 0), false), FULL)),
        Send(Request::Stop),
        Wait(149),
        Wait(47_167),
        Send(Request::KeepAlive),
        Wait(416),
        Wait(374),
        Send(Request::Start),
        Wait(411),
        Stream(19, 14_643),
        Send(Request::Subscribe { period_ms: 616 }),
        Wait(27_224),
        Send(Request::Clear),
        Wait(153),
        Wait(319),
        Send(channel(0, train(MonophasicAnodic, (462, 0, 3_826), (30_048, 21_639), (6, 4_908, 0), false), StageSpec::Voltage { full_scale_mv: 44_045, load_ohm: 22_259 })),
        Send(ARM),
        Step::Hello,
        Send(channel(2, train(BiphasicCathodicFirst, (272, 148, 0), (10_000, 3_880), (3, 1_000, 0), false), FULL)),
        Step::Chunk(vec![
            Request::Stop,
            Request::Start,
            ARM,
            wearer(9_609, 2, 39_707, 242),
            wearer(99_946, 77, 46, 19),
            channel(0, train(MonophasicAnodic, (433, 0, 3_959), (42_331, 39_680), (7, 4_976, 0), true), FULL),
            amplitudes(1, &[9_280]),
            Request::Start,
            Request::KeepAlive,
            Request::Force { channel: 3, at: Some(Micros::new(1_463_634_632)), millinewton: 19_481, millinewton_per_s: Some(-1_906_972_468) },
            Request::Start,
            Request::Subscribe { period_ms: 343 },
            channel(0, train(MonophasicCathodic, (375, 0, 3_203), (1_307_375, 512_167), (6, 3_957, 7), false), FULL),
            Request::Hello { schema: 6_994_208_263_259_075_220 },
            Request::Angle { at: None, centideg: 4_257, centideg_per_s: None },
            Request::Clear,
            channel(2, train(BiphasicCathodicFirst, (335, 0, 0), (650_214, 522_159), (2, 812, 0), false), FULL),
            Request::Angle { at: None, centideg: -3_813, centideg_per_s: Some(571_090_040) },
            amplitudes(1, &[14_110]),
            Request::KeepAlive,
        ]),
        Step::OverCurrent,
    ];
    let tally = FuzzCounts::default();
    one_run(0, &steps, &tally).unwrap();
    assert_eq!(
        tally.faulted.get(),
        1,
        "the over-current is what this is about"
    );
}
