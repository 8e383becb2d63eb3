"""A simulated limb of the user's own."""

import math
from typing import Any

import flexor
import numpy as np
import pytest
from helpers import last, prepared, run_python, running, without_prediction


def test_a_limb_gets_pulses_and_time() -> None:
    """It is called every millisecond, in order, with the pulses since the call before."""
    calls: list[tuple[float, list[flexor.Pulse]]] = []

    def limb(pulses: list[flexor.Pulse], t_s: float) -> float:
        calls.append((t_s, pulses))
        return 10 * t_s

    with running(limb=limb) as dev:
        dev.set(ma={1: 8})
        dev.wait(1)
        # The limb's time counts from the start of the simulation, before the trains.
        assert last(dev, "true_deg") == pytest.approx(10 * calls[-1][0], abs=0.2)
        record = dev.stop()
    times = [t_s for t_s, _ in calls]
    np.testing.assert_allclose(times, np.arange(len(times)) / 1000, atol=1e-9)
    assert calls[0] == (0.0, [])
    pulses = [pulse for _, given in calls for pulse in given]
    assert record is not None
    played = [pulse for pulse in pulses if pulse.amplitude > 1.5]
    assert len(played) == pytest.approx(record.pulses, abs=8)
    assert {(p.channel, p.unit, p.width_us) for p in played} == {(1, "mA", 200)}
    assert max(p.amplitude for p in played) == pytest.approx(8, abs=0.01)
    for t_s, given in calls[1:]:
        # A pulse is handed over after its first phase, so it may have begun in the call before.
        assert all(t_s - 0.002 < pulse.t_s <= t_s for pulse in given)


def test_the_period_of_a_limb() -> None:
    """A limb may be called less often."""
    times: list[float] = []

    def limb(pulses: list[flexor.Pulse], t_s: float) -> float:
        times.append(t_s)
        return 0.0

    with running(limb=limb, limb_period_s=0.01) as dev:
        dev.wait(0.5)
    np.testing.assert_allclose(np.diff(times), 0.01, atol=1e-9)


def test_a_limb_with_the_device_s_controller() -> None:
    """The device's joint controller moves the user's finger to its reference."""
    state = {"force": 0.0, "angle": 5.0}

    def limb(pulses: list[flexor.Pulse], t_s: float) -> tuple[float, dict[int, float]]:
        for pulse in pulses:
            sign = -1 if pulse.channel == 3 else 1
            state["force"] += sign * 0.4 * max(pulse.amplitude - 2, 0)
        state["force"] *= math.exp(-0.001 / 0.15)
        state["angle"] += 0.001 * (4 * state["force"] - 2 * (state["angle"] - 5))
        return state["angle"], dict.fromkeys((1, 2, 3), 2000.0)

    with flexor.connect(
        "sim:", session=without_prediction("hamana_exp4_two_point_finger"), limb=limb
    ) as dev:
        dev.arm()
        dev.start()
        dev.set(angle_deg=20)
        dev.wait(6)
        assert last(dev, "true_deg") == pytest.approx(state["angle"], abs=0.5)
        assert last(dev, "true_deg") > 8


@pytest.mark.parametrize("address", ["sim:", "sim:realtime"])
def test_a_limb_that_raises(address: str) -> None:
    """The call that let time pass raises the exception; stimulation has stopped."""
    error = RuntimeError("boom")

    def limb(pulses: list[flexor.Pulse], t_s: float) -> float:
        if t_s > 0.2:
            raise error
        return 0.0

    with running(address, limb=limb) as dev:
        dev.set(ma={1: 8})
        with pytest.raises(RuntimeError) as caught:
            dev.wait(1)
        assert caught.value is error
        assert dev.state == "idle"
        record = dev.stop()
    assert record is not None
    assert record.duration_s < 1
    assert record.events[-1].text == "stopped: Request"


def test_a_limb_that_raises_at_once() -> None:
    """Arming raises it, and nothing is armed."""
    with prepared(limb=lambda pulses, t_s: 1 / 0) as dev:
        with pytest.raises(ZeroDivisionError):
            dev.arm()
        assert dev.state == "idle"


@pytest.mark.parametrize(
    ("result", "kind", "message"),
    [
        (float("nan"), ValueError, "must be finite"),
        (float("inf"), ValueError, "must be finite"),
        ("10", TypeError, "must be a number, not '10'"),
        (None, TypeError, "must be a number, not None"),
        (True, TypeError, "must be a number, not True"),
        ((1, 2, 3), TypeError, "must be a number"),
        (np.ones(2), TypeError, "must be a number"),
        ((0.0, [1000]), TypeError, "a pair of the angle and a dictionary"),
        ((0.0, {1: -5}), ValueError, "above 0 Ω"),
        ((0.0, {1: float("nan")}), ValueError, "above 0 Ω"),
        ((0.0, {11: 500}), ValueError, "numbered 1 to 10"),
        ((0.0, {0: 500}), ValueError, "numbered 1 to 10"),
    ],
    ids=repr,
)
def test_a_limb_that_returns_something_else(result: Any, kind: type, message: str) -> None:
    """The message says what a limb returns; the device has stopped."""

    def limb(pulses: list[flexor.Pulse], t_s: float) -> Any:
        return result if t_s > 0.1 else 0.0

    with running(limb=limb) as dev:
        dev.set(ma={1: 8})
        with pytest.raises(kind, match=message):
            dev.wait(1)
        assert dev.state == "idle"
        record = dev.stop()
    assert record is not None
    assert record.duration_s < 0.3


@pytest.mark.parametrize("result", [3, 3.0, np.float32(3), np.array(3.0), (3.0, {}), (3, {1: 900})])
def test_what_a_limb_may_return(result: Any) -> None:
    """A number, or a number and loads."""
    with running(limb=lambda pulses, t_s: result) as dev:
        dev.wait(0.1)
        assert last(dev, "true_deg") == 3


def test_the_load_of_an_electrode() -> None:
    """The load that a limb returns is what the electrode check measures."""
    with flexor.connect("sim:", limb=lambda pulses, t_s: (0.0, {1: 750.0})) as dev:
        dev.channel(1, flexor.Train(rate_hz=30, width_us=200), limit_v=5)
        assert dev.arm()[1].load_ohm == pytest.approx(750, rel=0.05)


@pytest.mark.parametrize("name", ["stop", "close", "time_s", "record", "angle_deg"])
def test_a_limb_that_calls_its_own_device(name: str) -> None:
    """It is refused by name, does not hang, and stimulation stops."""
    devices: list[flexor.Device] = []

    def limb(pulses: list[flexor.Pulse], t_s: float) -> float:
        if t_s > 0.1:
            value = getattr(devices[0], name)
            if callable(value):
                value()
        return 0.0

    with running(limb=limb) as dev:
        devices.append(dev)
        dev.set(ma={1: 8})
        with pytest.raises(RuntimeError, match="a limb cannot call the device that it is part of"):
            dev.wait(1)
        assert dev.state == "idle"


def test_a_limb_in_real_time_that_calls_its_own_device() -> None:
    """It is refused as in simulated time."""
    code = """
import threading, os, flexor
threading.Timer(1.5, lambda: os._exit(9)).start()
dev = None
def limb(pulses, t_s):
    if dev is not None and t_s > 0.1:
        dev.time_s
    return 0.0
dev = flexor.connect("sim:realtime", limb=limb)
dev.channel(1, flexor.Train(rate_hz=30, width_us=200), limit_ma=12)
dev.arm()
dev.start()
try:
    dev.wait(1)
except RuntimeError as error:
    print(error, flush=True)
os._exit(0)
"""
    done = run_python(code)
    assert done.returncode == 0
    assert "cannot call the device" in done.stdout


@pytest.mark.parametrize("address", ["serial:/dev/ttyACM0", "tcp:127.0.0.1:4242"])
def test_a_limb_for_a_real_device(address: str) -> None:
    """A real device has a real limb."""
    with pytest.raises(ValueError, match="needs the address sim: or sim:realtime"):
        flexor.connect(address, limb=lambda pulses, t_s: 0.0)


@pytest.mark.parametrize("period_s", [0, -1, 2, float("nan")])
def test_a_period_out_of_range(period_s: float) -> None:
    """The message has the range."""
    with pytest.raises(ValueError, match="between 0.0001 and 1 s"):
        flexor.connect("sim:", limb=lambda pulses, t_s: 0.0, limb_period_s=period_s)


def test_a_limb_cannot_be_copied() -> None:
    """A snapshot refuses it by name."""
    with running(limb=lambda pulses, t_s: 0.0) as dev:
        with pytest.raises(flexor.FlexorError, match="E779 .*limb that a program computes"):
            dev.snapshot()
        assert dev.state == "running"


def test_a_reset_limb_begins_at_zero() -> None:
    """After a reset the limb's first call has no pulses, at time 0."""
    times: list[float] = []

    def limb(pulses: list[flexor.Pulse], t_s: float) -> float:
        times.append(t_s)
        return 0.0

    with running(limb=limb) as dev:
        dev.wait(0.1)
        dev.stop()
        times.clear()
        dev.reset()
        dev.arm()
        assert times[0] == 0
