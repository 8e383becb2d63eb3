"""Setpoints of every kind, on shipped sessions."""

import flexor
import numpy as np
import pytest
from helpers import TRAIN, last, playing, running, without_prediction


def test_milliamperes(dev: flexor.Device) -> None:
    """Zero, the limit, and everything between from 0.05 mA on."""
    for amplitude in (0.05, 5, 12, 7.5):
        dev.set(ma={1: amplitude})
        dev.wait(1)
        assert last(dev, "amplitude_1_ma") == pytest.approx(amplitude, abs=0.002)
    dev.set(ma={1: 0})
    dev.wait(1)
    assert np.isnan(last(dev, "amplitude_1_ma"))


@pytest.mark.parametrize(
    "value",
    [np.float64(8), np.float32(8), np.int64(8), np.uint8(8), np.array(8.0), 8, 8.0],
    ids=lambda value: type(value).__name__,
)
def test_numbers_of_numpy(dev: flexor.Device, value: object) -> None:
    """A scalar of numpy is a number."""
    dev.set(ma={1: value})  # type: ignore[dict-item]
    dev.wait(1)
    assert last(dev, "amplitude_1_ma") == 8


@pytest.mark.parametrize("channel", [np.int64(1), np.uint8(1)])
def test_channels_of_numpy(dev: flexor.Device, channel: int) -> None:
    """A whole number of numpy is a channel."""
    dev.set(ma={channel: 8})
    dev.wait(1)
    assert last(dev, "amplitude_1_ma") == 8


def test_volts() -> None:
    """A voltage stage takes volts."""
    with flexor.connect("sim:") as dev:
        dev.channel(1, TRAIN, limit_v=30)
        readings = dev.arm()
        assert readings[1].load_ohm == pytest.approx(2000, rel=0.02)
        dev.start()
        dev.set(v={1: 20})
        dev.wait(1)
        assert last(dev, "amplitude_1_v") == 20
        with pytest.raises(flexor.Refused, match="volts: v="):
            dev.set(ma={1: 8})
        with pytest.raises(flexor.Refused, match="30 V"):
            dev.set(v={1: 31})
        assert last(dev, "amplitude_1_v") == 20


def test_a_call_is_all_or_none() -> None:
    """One wrong channel leaves the others as they were."""
    with flexor.connect("sim:") as dev:
        for number in (1, 2):
            dev.channel(number, TRAIN, limit_ma=12)
        dev.arm()
        dev.start()
        dev.set(ma={1: 5, 2: 6})
        dev.wait(1)
        with pytest.raises(flexor.Refused):
            dev.set(ma={1: 8, 2: 13})
        dev.wait(1)
        assert (last(dev, "amplitude_1_ma"), last(dev, "amplitude_2_ma")) == (5, 6)


def test_widths() -> None:
    """A width changes alone or with an amplitude, within the train's range."""
    with playing("width_ramp", all_edges=True) as dev:
        with pytest.raises(flexor.Refused, match="E795 .*same call"):
            dev.set(width_us={1: 100})
        dev.set(ma={1: 20}, width_us={1: 200})
        dev.wait(0.5)
        assert (last(dev, "amplitude_1_ma"), last(dev, "width_1_us")) == (20, 200)
        dev.set(width_us={1: np.int64(100)})
        dev.wait(0.5)
        assert (last(dev, "amplitude_1_ma"), last(dev, "width_1_us")) == (20, 100)
        for width in (100.5, 9, 301, float("nan"), -1):
            with pytest.raises(flexor.Refused, match="E793 .*whole µs from 10 to 300"):
                dev.set(width_us={1: width})
        record = dev.stop()
    assert record is not None
    edges = record.edges[record.edges["channel"] == 1]
    begins = np.flatnonzero(edges["state"] == "cathodic")
    widths = edges["t_us"][begins + 1] - edges["t_us"][begins]
    assert {100, 200} <= set(widths.tolist())


def test_a_fixed_width(dev: flexor.Device) -> None:
    """A train without a range says so."""
    dev.set(ma={1: 8}, width_us={1: 200})
    with pytest.raises(flexor.Refused, match="no max_width_us"):
        dev.set(width_us={1: 100})


def test_force() -> None:
    """The device finds the amplitude that gives the force."""
    with playing("force_ramp") as dev:
        amplitudes = []
        for newton in (2, 6, 0):
            dev.set(force_n={1: newton})
            dev.wait(2)
            assert last(dev, "wanted_1_n") == newton
            amplitudes.append(last(dev, "amplitude_1_ma"))
        assert 0 < amplitudes[0] < amplitudes[1] <= 20
        with pytest.raises(flexor.Refused, match="force control drives this channel"):
            dev.set(ma={1: 5})
        for newton in (-1, float("nan"), float("inf")):
            with pytest.raises(flexor.Refused, match="E793 force_n: .*0 N and more"):
                dev.set(force_n={1: newton})


def test_angle() -> None:
    """The finger follows its reference; the rate is the reference's slope."""
    with playing(without_prediction("hamana_exp4_two_point")) as dev:
        assert np.isnan(dev.angle_deg)
        dev.set(angle_deg=30)
        dev.wait(4)
        assert last(dev, "target_deg") == 30
        assert dev.angle_deg == pytest.approx(30, abs=3)
        assert last(dev, "true_deg") == pytest.approx(30, abs=3)
        dev.set(angle_deg=np.float32(15), rate_deg_per_s=-5)
        dev.wait(0.1)
        assert last(dev, "target_deg") <= 15
        for angle in (181, -181, float("nan"), float("inf")):
            with pytest.raises(flexor.Refused, match="E794 angle_deg: .*0 to 100°, the range of"):
                dev.set(angle_deg=angle)
        with pytest.raises(flexor.Refused, match="E794 rate_deg_per_s"):
            dev.set(angle_deg=10, rate_deg_per_s=1e9)
        with pytest.raises(TypeError, match="rate_deg_per_s needs angle_deg"):
            dev.set(rate_deg_per_s=1)


def test_a_force_at_the_hand() -> None:
    """The arm's channels answer when its posture is measured."""
    with playing("endpoint_arm") as dev:
        dev.set(endpoint_n=np.array([-2, 3, 2.5]))
        dev.wait(0.02)
        assert dev.state == "running"
        for force in ([1, 2], [1, 2, 3, 4], 5, "abc", [1, True, 3]):
            with pytest.raises(TypeError, match="endpoint_n must"):
                dev.set(endpoint_n=force)  # type: ignore[arg-type]
        for value in (float("nan"), 1e9):
            with pytest.raises(flexor.Refused, match="E794 endpoint_n: .*−1000 to 1000 N"):
                dev.set(endpoint_n=[1, value, 3])


def test_held() -> None:
    """Nothing is stimulated until the object is held and the joint has moved."""
    with playing("lift") as dev:
        dev.set(held=True)
        for step in range(20):
            for joint in range(4):
                dev.measure(61 + step, joint)
            dev.wait(0.02)
            dev.set(held=np.True_)  # type: ignore[arg-type]
        assert last(dev, "amplitude_1_ma") > 0
        with pytest.raises(TypeError, match="held must be True or False"):
            dev.set(held=1)  # type: ignore[arg-type]


def test_measurements_alone_keep_the_device_alive() -> None:
    """Keep-alives are the package's, whatever else the program sends."""
    with playing("lift") as dev:
        dev.set(held=True)
        for _ in range(50):
            for joint in range(4):
                dev.measure(61, joint)
            dev.wait(0.02)
        assert dev.state == "running"


def test_a_list_of_pulses() -> None:
    """A list plays once, after the channel has risen."""
    with playing("width_ramp", all_edges=True) as dev:
        with pytest.raises(flexor.Refused, match="E242 .*wait until its rise has ended"):
            dev.play(2, [(5, 100, 0)])
        dev.set(ma={2: 5})
        dev.wait(0.5)
        dev.play(2, [(4, 35, 0), (np.float64(3), np.int64(35), 25_000)])
        dev.wait(0.1)
        record = dev.stop()
    assert record is not None
    edges = record.edges[record.edges["channel"] == 2]
    pulses = edges[edges["state"] == "cathodic"]
    full = int(pulses["dac_code"].max())
    codes = [round(full * share) for share in (0.8, 0.6)]
    listed = [pulses[np.abs(pulses["dac_code"].astype(int) - code) <= 1] for code in codes]
    assert [len(found) for found in listed] == [1, 1]
    assert listed[1]["t_us"][0] - listed[0]["t_us"][0] == 25_000


@pytest.mark.parametrize(
    ("channel", "pulses", "kind", "message"),
    [
        (2, [], ValueError, "1 to 16 pulses"),
        (2, [(5, 100, 0)] * 17, ValueError, "1 to 16 pulses"),
        (2, [(float("nan"), 100, 0)], ValueError, "not an amplitude"),
        (2, [(-5, 100, 0)], ValueError, "not an amplitude"),
        (2, [(36, 35, 0)], flexor.Refused, "E206 .*0 to 35000 µA"),
        (2, [(5, 100, 0)], flexor.Refused, "width_us.*only 35"),
        (2, [("5", 100, 0)], TypeError, "number"),
        (2, [5], TypeError, "tuple"),
        (1, [(5, 100, 0)], flexor.Refused, "E240 .*set lists in its train"),
        (0, [(5, 100, 0)], flexor.Refused, "E791 .*no channel 0"),
    ],
)
def test_a_wrong_list(channel: int, pulses: list[object], kind: type, message: str) -> None:
    """A wrong list is refused, and stimulation goes on."""
    with playing("width_ramp") as dev:
        dev.set(ma={2: 5})
        dev.wait(0.5)
        with pytest.raises(kind, match=message):
            dev.play(channel, pulses)  # type: ignore[arg-type]
        dev.wait(0.1)
        assert dev.state == "running"
        assert last(dev, "amplitude_2_ma") == 5


def test_a_list_for_channel_11() -> None:
    """Channels count from 1 in messages."""
    with playing("width_ramp") as dev:
        error = pytest.raises(flexor.Refused, dev.play, 11, [(5, 100, 0)])
        error.match("E791 .*no channel 11")


@pytest.mark.parametrize("angle", [float("nan"), float("inf")])
def test_a_measured_angle_must_be_finite(dev: flexor.Device, angle: float) -> None:
    """NaN is no measurement."""
    with pytest.raises(ValueError, match="finite number of degrees"):
        dev.measure(angle)


def test_a_measurement_that_nothing_expects(dev: flexor.Device) -> None:
    """The device says that it has no joint."""
    with pytest.raises(flexor.Refused, match="E310"):
        dev.measure(10)
    assert dev.state == "running"


def test_programs_of_a_session_play() -> None:
    """A session's programs play by themselves."""
    with playing("reciprocal") as dev:
        dev.wait(2)
        record = dev.stop()
    assert record is not None
    whole = flexor.run("reciprocal")
    first = whole.samples[whole.samples["t_s"] < 1.9]
    mine = record.samples[record.samples["t_s"] < 1.9]
    assert (record.pulses or 0) > 50
    columns = [n for n in first.dtype.names or () if n.startswith("amplitude")]
    for column in columns:
        largest = np.fmax.reduce(first[column])
        np.testing.assert_equal(np.fmax.reduce(mine[column]), largest, err_msg=column)


def test_a_program_of_the_setup() -> None:
    """`program` adds amplitudes over time."""
    with running() as dev:
        dev.stop()
        cycle = {"on_s": 1.5, "off_s": 1, "ramp_up_s": 0.5, "ramp_down_s": 0.5}
        dev.program(kind="on-off", channels=[1], value=4, **cycle)
        dev.arm()
        dev.start()
        dev.wait(0.8)
        assert last(dev, "amplitude_1_ma") == 4
        dev.wait(1.2)
        assert np.isnan(last(dev, "amplitude_1_ma"))


SETUPS = [
    "cycling",
    "distributed",
    "endpoint_force",
    "harris_wall/3_pre_wall_co_contraction",
    "lift",
    "lift_resist",
    "open_finger",
    "reciprocal",
    "strength",
    "ten_channels",
    "trigger",
]


@pytest.mark.parametrize("name", SETUPS)
def test_a_shipped_session_sets_up_a_device(name: str) -> None:
    """Every kind of setup arms and starts, and nothing is refused for the setpoints' sake."""
    with playing(name) as dev:
        assert dev.wait(0.05) >= 0.05
        assert dev.state == "running"


def test_a_duty_cycle_of_a_channel_with_a_muscle() -> None:
    """A calibrated wearer's muscle and a duty cycle go together."""
    with flexor.connect("sim:", wearer="K01") as dev:
        dev.channel(1, flexor.Train(rate_hz=30, width_us=400))
        dev.duty(1, on_s=2, off_s=2, ramp_s=0.5)
        dev.arm()
        dev.start()
        dev.set(ma={1: 10})
        dev.wait(1)
        assert last(dev, "amplitude_1_ma") == 10
