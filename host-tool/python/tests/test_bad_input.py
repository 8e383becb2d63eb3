"""Bad input that a Python user gives first: class, number, advice, and that stimulation goes on."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import flexor
import numpy as np
import pytest
from helpers import TRAIN, last, prepared, running, without_prediction

NAN, INF = float("nan"), float("inf")


@pytest.fixture
def steady(dev: flexor.Device) -> flexor.Device:
    """Return a device that plays 5 mA."""
    dev.set(ma={1: 5})
    dev.wait(1)
    return dev


@pytest.mark.parametrize("value", [NAN, INF, -INF, -1, 12.001, 1000, 0.0001, 0.0015, 1e300])
def test_an_amplitude_out_of_range(steady: flexor.Device, value: float) -> None:
    """The message has the limit and the least step with their unit."""
    with pytest.raises(flexor.Refused, match="0, or 0.05 mA to 12 mA") as caught:
        steady.set(ma={1: value})
    error = caught.value
    assert isinstance(error, ValueError)
    assert (error.number, error.field) == (793, "ma")
    assert error.allowed is not None
    assert error.value is not None
    steady.wait(0.1)
    assert (steady.state, last(steady, "amplitude_1_ma")) == ("running", 5)


def test_amperes_for_milliamperes(steady: flexor.Device) -> None:
    """No one stimulates with less than a thousandth of the limit: it is a value in amperes."""
    with pytest.raises(flexor.Refused, match="8 mA"):
        steady.set(ma={1: 0.008})


def test_seconds_for_microseconds() -> None:
    """The message has the width that was meant."""
    with (
        flexor.connect("sim:") as dev,
        pytest.raises(flexor.Refused, match="did you mean 200 µs") as caught,
    ):
        dev.channel(1, flexor.Train(rate_hz=30, width_us=0.0002), limit_ma=12)
    assert (caught.value.number, caught.value.field) == (405, "channel.train.width_us")


@pytest.mark.parametrize(
    "value",
    [True, False, "8", b"8", None, [8], (8,), 8 + 0j, np.True_, np.array([8.0]), np.ones(3), {}],
    ids=repr,
)
def test_an_amplitude_that_is_no_number(steady: flexor.Device, value: Any) -> None:
    """The message names argument and channel."""
    with pytest.raises(TypeError, match=r"ma\[1\] must be a number, not"):
        steady.set(ma={1: value})
    steady.wait(0.1)
    assert (steady.state, last(steady, "amplitude_1_ma")) == ("running", 5)


@pytest.mark.parametrize("values", [8, [8], np.array([8.0]), "8", [(1, 8)], None.__class__])
def test_amplitudes_that_are_no_dictionary(steady: flexor.Device, values: Any) -> None:
    """The message has an example."""
    with pytest.raises(TypeError, match=r"dictionary from channel to value, such as ma=\{1: 8\}"):
        steady.set(ma=values)
    assert steady.state == "running"


@pytest.mark.parametrize("channel", [0, 2, 10, 11, 255])
def test_a_channel_that_is_not_set_up(steady: flexor.Device, channel: int) -> None:
    """The message lists the channels that are."""
    with pytest.raises(flexor.Refused, match=f"no channel {channel} .*channels are 1") as caught:
        steady.set(ma={channel: 8})
    assert (caught.value.number, caught.value.value) == (791, str(channel))


@pytest.mark.parametrize("channel", [-1, 256, True, "1", 1.0, 1.5, None])
def test_a_channel_that_is_no_number(steady: flexor.Device, channel: Any) -> None:
    """Channels are whole numbers from 1."""
    with pytest.raises(TypeError, match="numbered from 1 to 10"):
        steady.set(ma={channel: 8})


def test_the_other_stage_s_unit(steady: flexor.Device) -> None:
    """The message names the argument that fits."""
    with pytest.raises(flexor.Refused, match="current stage; give its amplitude in mA: ma=") as e:
        steady.set(v={1: 8})
    assert (e.value.number, e.value.field) == (792, "v")


def test_all_mistakes_at_once(steady: flexor.Device) -> None:
    """One exception has every mistake of a call."""
    with pytest.raises(flexor.Refused) as caught:
        steady.set(ma={1: 99, 2: 3}, force_n={1: 2}, angle_deg=NAN)
    numbers = [mistake.number for mistake in caught.value.mistakes]
    assert numbers == [793, 791, 792, 792]
    assert str(caught.value).count("\n") == 3


@pytest.mark.parametrize("arguments", [{}, {"ma": None}, {"ma": {}}])
def test_a_call_without_a_value(steady: flexor.Device, arguments: dict[str, Any]) -> None:
    """The message says what is missing."""
    if arguments.get("ma") == {}:
        with pytest.raises(ValueError, match="ma names no channel"):
            steady.set(**arguments)
    else:
        with pytest.raises(ValueError, match=r"needs a value, such as ma=\{1: 8\}"):
            steady.set(**arguments)


def test_values_have_a_unit_in_their_name(steady: flexor.Device) -> None:
    """There is no positional value."""
    with pytest.raises(TypeError, match="positional"):
        steady.set({1: 8})  # type: ignore[misc]
    with pytest.raises(TypeError, match="amplitude"):
        steady.set(amplitude={1: 8})  # type: ignore[call-arg]


@pytest.mark.parametrize("seconds", [-1, NAN, INF, 86_401])
def test_a_time_out_of_range(steady: flexor.Device, seconds: float) -> None:
    """A wait is at most a day."""
    before = steady.time_s
    with pytest.raises(ValueError, match="between 0 and 86400 s"):
        steady.wait(seconds)
    assert steady.time_s == before


@pytest.mark.parametrize("seconds", [True, "1", None, [1], np.ones(2), np.True_], ids=repr)
def test_a_time_that_is_no_number(steady: flexor.Device, seconds: Any) -> None:
    """The message says that seconds are meant."""
    with pytest.raises(TypeError, match="must be a number of seconds"):
        steady.wait(seconds)
    with pytest.raises(TypeError, match="held_s must be a number of seconds"):
        steady.trigger(seconds)


@pytest.mark.parametrize("seconds", [np.float32(0.5), np.int64(1), np.array(0.5)])
def test_times_of_numpy(steady: flexor.Device, seconds: Any) -> None:
    """A scalar of numpy is a time."""
    before = steady.time_s
    assert steady.wait(seconds) == pytest.approx(before + float(seconds), abs=0.01)


def test_no_limit() -> None:
    """There is no default limit."""
    with (
        flexor.connect("sim:") as dev,
        pytest.raises(flexor.Refused, match="no limit: give limit_ma=, or wearer="),
    ):
        dev.channel(1, TRAIN)
    with (
        flexor.connect("sim:", wearer="K01") as dev,
        pytest.raises(flexor.Refused, match="channel 2 has no limit"),
    ):
        dev.channel(2, TRAIN)


@pytest.mark.parametrize(
    ("limit", "number"),
    [(0, 407), (-1, 407), (200, 407), (NAN, 406), (INF, 406), (True, 403), ("12", 403)],
)
def test_a_limit_that_is_not_possible(limit: Any, number: int) -> None:
    """A limit is a number within the stage's range."""
    with flexor.connect("sim:") as dev:
        with pytest.raises(flexor.Refused) as caught:
            dev.channel(1, TRAIN, limit_ma=limit)
        assert (caught.value.number, caught.value.field) == (number, "channel.limit")
        with pytest.raises(flexor.Refused, match="`channel` is missing"):
            dev.arm()
        assert dev.state == "idle"


def test_limits_in_both_units() -> None:
    """A stage has one unit."""
    with flexor.connect("sim:") as dev, pytest.raises(TypeError, match="limit_ma .*or limit_v"):
        dev.channel(1, TRAIN, limit_ma=12, limit_v=30)


@pytest.mark.parametrize("number", [0, 11, -1, 300, True, "1", 1.5, None, NAN, [1, 2]], ids=repr)
def test_a_channel_that_does_not_exist(idle: flexor.Device, number: Any) -> None:
    """The board has channels 1 to 10."""
    with pytest.raises(flexor.Refused) as caught:
        idle.channel(number, TRAIN, limit_ma=12)
    assert caught.value.field == "channel.number"
    assert caught.value.number in (403, 404, 405, 406, 407)
    assert list(idle.arm()) == [1]


def test_a_channel_number_of_numpy(idle: flexor.Device) -> None:
    """It replaces the channel, and names it without its type."""
    idle.channel(np.int64(1), TRAIN, limit_ma=3)
    idle.duty(np.int64(1), on_s=2, off_s=2, ramp_s=0.5)
    idle.duty(np.array([1]), on_s=2, off_s=2, ramp_s=0.5)
    assert 'name = "channel 1"' in idle.session_text
    assert list(idle.arm()) == [1]


@pytest.mark.parametrize(
    ("train", "field"),
    [
        ({"rate_hz": 0, "width_us": 200}, "rate_hz"),
        ({"rate_hz": 1000, "width_us": 200}, "rate_hz"),
        ({"rate_hz": NAN, "width_us": 200}, "rate_hz"),
        ({"rate_hz": "30", "width_us": 200}, "rate_hz"),
        ({"rate_hz": True, "width_us": 200}, "rate_hz"),
        ({"rate_hz": 30, "width_us": 5000}, "width_us"),
        ({"rate_hz": 30, "width_us": 200.5}, "width_us"),
        ({"rate_hz": 30, "width_us": 200, "shape": "square"}, "shape"),
        ({"rate_hz": 30, "width_us": 200, "shape": "monophasic-cathodic"}, "ground_us"),
    ],
)
def test_a_train_that_is_not_possible(train: dict[str, Any], field: str) -> None:
    """The field has the package's name, not the session file's."""
    with flexor.connect("sim:") as dev, pytest.raises(flexor.Refused) as caught:
        dev.channel(1, flexor.Train(**train), limit_ma=12)
    assert caught.value.field == f"channel.train.{field}"
    assert f"channel.train.{field}" in str(caught.value)


@pytest.mark.parametrize("train", [None, {"rate_hz": 30, "width_us": 200}, 30])
def test_what_is_no_train(train: Any) -> None:
    """The message has an example."""
    with flexor.connect("sim:") as dev, pytest.raises(TypeError, match=r"must be a Train, such as"):
        dev.channel(1, train, limit_ma=12)


@pytest.mark.parametrize(
    ("arguments", "number"),
    [
        ({"on_s": -2, "off_s": 2}, 407),
        ({"on_s": NAN, "off_s": 2}, 406),
        ({"on_s": "2", "off_s": 2}, 403),
        ({"on_s": 0, "off_s": 0}, 407),
        ({"on_s": 2, "off_s": 2, "ramp_s": 3}, 489),
        ({"on_s": 2, "off_s": 2, "ramp_s": 0}, 485),
    ],
)
def test_a_duty_cycle_that_is_not_possible(
    idle: flexor.Device, arguments: dict[str, Any], number: int
) -> None:
    """It is refused before anything is armed, and the setup stays as it was."""
    before = idle.session_text
    with pytest.raises(flexor.Refused) as caught:
        idle.duty(1, **arguments)
    assert caught.value.number == number
    assert idle.session_text == before


@pytest.mark.parametrize("channel", [True, [], [True]])
def test_a_duty_cycle_for_no_channel(idle: flexor.Device, channel: Any) -> None:
    """Truth values and empty lists are no channels."""
    with pytest.raises(TypeError, match="from 1 to 10"):
        idle.duty(channel, on_s=2, off_s=2, ramp_s=0.5)


def test_a_duty_cycle_for_another_channel(idle: flexor.Device) -> None:
    """The channel is set up first."""
    with pytest.raises(flexor.Refused, match="channel 2, which the file does not have"):
        idle.duty(2, on_s=2, off_s=2, ramp_s=0.5)


@pytest.mark.parametrize(
    "address",
    ["", "sim", "sim:fast", "/dev/ttyACM0", "COM3", "serial:", "tcp:", "usb:1", "chip", "native"],
)
def test_an_address_of_no_kind(address: str) -> None:
    """The message lists what an address can be."""
    with pytest.raises(ValueError, match='"sim:", "sim:realtime", "serial:/dev/ttyACM0" or "tcp:'):
        flexor.connect(address)


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("serial:/dev/nonesuch", "plug the board in"),
        ("tcp:127.0.0.1:1", "flexor serve"),
        ("tcp:127.0.0.1", "invalid socket address"),
        ("tcp:127.0.0.1:99999", "invalid port"),
    ],
)
def test_an_address_where_nothing_is(address: str, message: str) -> None:
    """The message says what to look at."""
    with pytest.raises(flexor.ConnectionLost, match=message) as caught:
        flexor.connect(address)
    assert isinstance(caught.value, ConnectionError)
    assert caught.value.number == 504


@pytest.mark.parametrize(
    ("arguments", "kind", "message"),
    [
        ({"seed": -1}, ValueError, "seed must be between 0 and"),
        ({"seed": 2**64}, ValueError, "seed must be between 0 and"),
        ({"seed": 1.5}, TypeError, "seed must be a whole number"),
        ({"seed": True}, TypeError, "seed must be a whole number"),
        ({"seed": "1"}, TypeError, "seed must be a whole number"),
        ({"lease_s": 0}, ValueError, "lease_s must be between 0.05 and 10 s"),
        ({"lease_s": 60}, ValueError, "lease_s must be between 0.05 and 10 s"),
        ({"lease_s": NAN}, ValueError, "lease_s must be between 0.05 and 10 s"),
        ({"lease_s": "1"}, TypeError, "lease_s must be a number of seconds"),
        ({"telemetry_ms": 0}, ValueError, "telemetry_ms must be between 1 and 1000"),
        ({"telemetry_ms": 1001}, ValueError, "telemetry_ms must be between 1 and 1000"),
        ({"wearer": "nobody"}, flexor.Refused, "E650 .*nobody"),
        ({"session": "nothing"}, flexor.Refused, "E400 .*nothing"),
        ({"limb": 5}, TypeError, "limb must be a function"),
    ],
)
def test_arguments_of_connect(arguments: dict[str, Any], kind: type, message: str) -> None:
    """The message names the argument and its range."""
    with pytest.raises(kind, match=message):
        flexor.connect("sim:", **arguments)


@pytest.mark.parametrize("seed", [-1, 1.5, True, "1"])
def test_a_seed_that_is_not_possible(seed: Any) -> None:
    """A seed is checked alike everywhere."""
    with prepared() as dev:
        for call in (
            lambda: flexor.run("reciprocal", seed=seed),
            lambda: flexor.run_many("reciprocal", [seed]),
            lambda: flexor.edges("reciprocal", 1, seed=seed),
            lambda: dev.reset(seed),
        ):
            with pytest.raises((TypeError, ValueError), match="seed must be"):
                call()


def test_a_setup_does_not_change_while_armed(idle: flexor.Device) -> None:
    """A new limit would not protect before the next `arm`, so it is refused until then."""
    calls: list[Callable[[], None]] = [
        lambda: idle.channel(1, TRAIN, limit_ma=3),
        lambda: idle.body(kind="still"),
        lambda: idle.sync(1),
        lambda: idle.program(kind="on-off", channels=[1], value=1.0, on_s=2, off_s=2),
    ]
    for prepare in (idle.arm, idle.start):
        prepare()
        for call in calls:
            with pytest.raises(flexor.FlexorError, match=r"E772 .*call stop\(\) first"):
                call()
        assert "limit = 12" in idle.session_text
    idle.stop()
    calls[0]()
    assert "limit = 3" in idle.session_text
    idle.close()
    with pytest.raises(flexor.FlexorError, match="E775"):
        calls[0]()


def test_a_part_of_a_setup_is_removed() -> None:
    """Without its joint the channels of a session take amplitudes."""
    with flexor.connect("sim:", session="hamana_exp4_two_point_finger") as dev:
        dev.remove("joint")
        with pytest.raises(ValueError, match="no joint"):
            dev.remove("joint")
        dev.arm()
        dev.start()
        dev.set(v={1: 22})
        dev.wait(0.5)


def test_a_fault_that_no_call_has_seen_yet() -> None:
    """A setpoint that arrives just after the device ended stimulation raises the fault."""

    def jumps(pulses: list[flexor.Pulse], t_s: float) -> tuple[float, dict[int, float]]:
        return 500.0 if t_s > 0.3 else 20.0, dict.fromkeys((1, 2, 3), 2000.0)

    with flexor.connect(
        "sim:", session=without_prediction("hamana_exp4_two_point"), limb=jumps
    ) as dev:
        dev.arm()
        dev.start()
        with pytest.raises(flexor.DeviceFault):
            for _ in range(2000):
                dev.set(angle_deg=20)
        assert dev.state == "idle"
        assert dev.record is not None
        assert dev.record.error is not None


def test_a_record_names_the_exception_that_ended_it(tmp_path: Path) -> None:
    """A trial that an exception ended is not a complete one."""
    with pytest.raises(ZeroDivisionError), running(record=tmp_path / "out") as dev:
        dev.set(ma={1: 8})
        dev.wait(0.3)
        raise ZeroDivisionError
    (record,) = flexor.Record.load(tmp_path / "out")
    assert record.error == "ZeroDivisionError left the with block"
    assert dev.record is not None
    assert dev.record.error == record.error


@pytest.mark.parametrize("wrong", [{"angle_deg": 10}, {"held": True}, {"endpoint_n": [1, 2, 3]}])
def test_a_setpoint_without_its_part(steady: flexor.Device, wrong: dict[str, Any]) -> None:
    """Nothing of the call takes effect if the setup lacks what one of its values is for."""
    with pytest.raises(flexor.Refused, match="E792 .*the setup has no") as caught:
        steady.set(ma={1: 9}, **wrong)
    assert caught.value.field in wrong
    steady.wait(1)
    assert last(steady, "amplitude_1_ma") == 5


@pytest.mark.parametrize("value", [np.complex128(5), np.array(True), np.bool_(True), np.array("5")])
def test_other_kinds_of_numpy(steady: flexor.Device, value: Any) -> None:
    """Numbers of numpy are numbers; its truth values, texts and complex numbers are not."""
    calls: list[Callable[[], Any]] = [
        lambda: steady.set(ma={1: value}),
        lambda: steady.wait(value),
        lambda: steady.play(1, [(value, 200, 0)]),
        lambda: flexor.connect("sim:").channel(1, TRAIN, limit_ma=value),
    ]
    for call in calls:
        with pytest.raises((TypeError, flexor.Refused)):
            call()
    steady.wait(0.5)
    assert last(steady, "amplitude_1_ma") == 5


def test_a_structure_that_contains_itself() -> None:
    """It is refused instead of followed for ever."""
    endless: dict[str, Any] = {}
    endless["body"] = endless
    deep: Any = 1
    for _ in range(5000):
        deep = [deep]
    with pytest.raises(TypeError, match="contains itself"):
        flexor.run(endless)
    with pytest.raises(TypeError, match="nested too deeply"):
        flexor.run({"title": deep})


@pytest.mark.parametrize(
    "arguments",
    [
        {"limit_ma": 12, "start_v": 5},
        {"limit_ma": 12, "load_ohm": 900},
        {"limit_v": 12, "start_ma": 5},
        {"limit_v": 12, "full_scale_ma": 50},
    ],
)
def test_fields_of_the_other_stage(arguments: dict[str, Any]) -> None:
    """They are refused by name, not ignored."""
    name = list(arguments)[1]
    with flexor.connect("sim:") as dev, pytest.raises(flexor.Refused, match=f"has no {name}"):
        dev.channel(1, TRAIN, **arguments)


@pytest.mark.parametrize("steps", [(0.05, 0.02), (1, 0), (1, -1), (NAN, 0.1), (INF, 0.1)])
def test_steps_that_do_not_fit(steady: flexor.Device, steps: tuple[float, float]) -> None:
    """The time is a whole number of steps."""
    with pytest.raises(ValueError, match="whole number of steps"):
        next(steady.steps(*steps))


def test_a_stream_has_a_length(steady: flexor.Device) -> None:
    """A length that is no time is refused instead of being no rows."""
    for seconds in (NAN, -1):
        with pytest.raises(ValueError, match="seconds must be between 0"):
            next(steady.stream(seconds))
