"""Errors: the order of calls, a closed device, pickling, and copies."""

import copy
import json
import pickle
import re
from collections.abc import Callable
from pathlib import Path

import flexor
import pytest
from helpers import TRAIN, prepared, running

Call = Callable[[flexor.Device], object]

NEEDS_ARMED: dict[str, Call] = {
    "set": lambda dev: dev.set(ma={1: 8}),
    "mark": lambda dev: dev.mark("x"),
    "trigger": lambda dev: dev.trigger(),
    "measure": lambda dev: dev.measure(10),
    "start": lambda dev: dev.start(),
}
CALLS: dict[str, Call] = {
    **NEEDS_ARMED,
    "arm": lambda dev: dev.arm(),
    "wait": lambda dev: dev.wait(1),
    "reset": lambda dev: dev.reset(),
    "snapshot": lambda dev: dev.snapshot(),
    "events": lambda dev: list(dev.events()),
    "stream": lambda dev: list(dev.stream(1)),
    "time_s": lambda dev: dev.time_s,
    "angle_deg": lambda dev: dev.angle_deg,
}


@pytest.mark.parametrize("name", NEEDS_ARMED)
def test_a_call_before_arming(idle: flexor.Device, name: str) -> None:
    """The message names the call and the one that is missing."""
    with pytest.raises(flexor.FlexorError, match=rf"{name}\(\) .*call arm\(\) first") as caught:
        NEEDS_ARMED[name](idle)
    assert caught.value.number == 772
    assert idle.state == "idle"


def test_waiting_before_the_start(idle: flexor.Device) -> None:
    """Time passes only while trains play."""
    for _ in range(2):
        advice = "arm() and start()" if idle.state == "idle" else "start()"
        with pytest.raises(flexor.FlexorError, match=f"E772 .*call {re.escape(advice)} first"):
            idle.wait(1)
        if idle.state == "idle":
            idle.arm()
    assert idle.state == "armed"


@pytest.mark.parametrize("name", ["arm", "reset"])
def test_a_call_that_needs_a_stop(dev: flexor.Device, name: str) -> None:
    """Arming and resetting need an idle device; stimulation goes on."""
    with pytest.raises(flexor.FlexorError, match=r"E772 .*call stop\(\) first"):
        CALLS[name](dev)
    dev.wait(0.1)
    assert dev.state == "running"


def test_starting_twice(dev: flexor.Device) -> None:
    """The second start changes nothing."""
    with pytest.raises(flexor.FlexorError, match="E772 .*stimulating"):
        dev.start()
    assert dev.state == "running"


def test_starting_twice_advises_what_is_possible(dev: flexor.Device) -> None:
    """The advice is a call that the state allows."""
    error = pytest.raises(flexor.FlexorError, dev.start)
    assert "call arm() first" not in str(error.value)


def test_stopping_is_never_refused(idle: flexor.Device) -> None:
    """In every state, and as often as wanted."""
    assert idle.stop() is None
    idle.arm()
    armed = idle.stop()
    assert armed is not None
    assert (armed.duration_s, idle.state) == (0, "idle")
    idle.arm()
    idle.start()
    idle.wait(0.5)
    first, again = idle.stop(), idle.stop()
    assert first is not None
    assert again is not None
    assert first.duration_s == again.duration_s > 0.5
    idle.close()
    last = idle.stop()
    assert last is not None
    assert last.duration_s == again.duration_s


@pytest.mark.parametrize("name", CALLS)
def test_a_closed_device(name: str) -> None:
    """Every call says that the device is closed, and none hangs."""
    dev = running()
    dev.close()
    dev.close()
    assert dev.state == "closed"
    assert repr(dev) == "<flexor.Device sim: closed>"
    with pytest.raises(flexor.FlexorError, match="E775 the device is closed; connect again"):
        CALLS[name](dev)


def test_the_record_after_the_block() -> None:
    """Leaving the block stops, so the record of the trial is there."""
    with running() as dev:
        dev.wait(0.5)
    assert dev.record is not None
    assert dev.record.duration_s > 0.5


def test_the_length_of_a_record_so_far(dev: flexor.Device) -> None:
    """The length is what has passed."""
    dev.wait(0.5)
    assert dev.record is not None
    assert dev.record.duration_s == pytest.approx(0.5, abs=0.1)


def test_arming_without_a_channel() -> None:
    """Nothing to stimulate is a mistake of the setup."""
    with flexor.connect("sim:") as dev:
        with pytest.raises(flexor.Refused, match="E404 `channel` is missing"):
            dev.arm()
        assert dev.state == "idle"


def test_arming_without_electrodes() -> None:
    """The electrode check refuses, and says which channel."""

    def detached(pulses: list[flexor.Pulse], t_s: float) -> tuple[float, dict[int, float]]:
        return 0.0, {1: float("inf")}

    with prepared(limb=detached) as dev:
        with pytest.raises(flexor.ArmRefused, match="channel 1") as caught:
            dev.arm()
        assert caught.value.number is not None
        assert dev.state == "idle"
        record = dev.stop()
    assert record is None or record.pulses in (0, None)


def test_an_electrode_that_comes_off(tmp_path: Path) -> None:
    """The device stops by itself; the record on disk says why."""

    def comes_off(pulses: list[flexor.Pulse], t_s: float) -> tuple[float, dict[int, float]]:
        return 0.0, {1: float("inf") if t_s > 0.5 else 1000.0}

    with running(limb=comes_off, record=tmp_path / "out") as dev:
        dev.set(ma={1: 8})
        with pytest.raises(flexor.DeviceFault, match="ElectrodeOff") as caught:
            dev.wait(5)
        assert caught.value.number == 512
        assert dev.state == "idle"
        record = dev.stop()
        assert record is not None
        with pytest.raises(flexor.FlexorError, match="E772"):
            dev.set(ma={1: 8})
    (loaded,) = flexor.Record.load(tmp_path / "out")
    assert loaded.error is not None
    assert "ElectrodeOff" in loaded.error


def test_a_fault_stays_until_it_is_acknowledged() -> None:
    """A device with a latched fault arms only after `acknowledge`, which needs an idle device."""

    def comes_off(pulses: list[flexor.Pulse], t_s: float) -> tuple[float, dict[int, float]]:
        return 0.0, {1: float("inf") if 0.5 < t_s < 0.6 else 1000.0}

    with running(limb=comes_off) as dev:
        dev.set(ma={1: 8})
        with pytest.raises(flexor.DeviceFault, match=r"acknowledge\(\)"):
            dev.wait(5)
        with pytest.raises(flexor.ArmRefused, match=r"acknowledge\(\)") as caught:
            dev.arm()
        assert "--" not in str(caught.value)
        dev.acknowledge()
        dev.acknowledge()  # a second time does nothing
        dev.arm()
        with pytest.raises(flexor.FlexorError, match="E772"):
            dev.acknowledge()


def test_a_record_keeps_the_reason_of_its_end() -> None:
    """`Record.error` does not depend on which call raised the reason."""

    def comes_off(pulses: list[flexor.Pulse], t_s: float) -> tuple[float, dict[int, float]]:
        return 0.0, {1: float("inf") if t_s > 0.2 else 1000.0}

    with running(limb=comes_off) as dev:
        dev.set(ma={1: 8})
        with pytest.raises(flexor.DeviceFault):
            dev.wait(2)
        assert dev.record is not None
        assert dev.record.error is not None


def test_trains_that_have_played_their_pulses() -> None:
    """A fixed number of pulses ends the trial."""
    with flexor.connect("sim:") as dev:
        dev.channel(1, flexor.Train(rate_hz=30, width_us=200, repeats=5), limit_ma=12, start_ma=5)
        dev.arm()
        dev.set(ma={1: 5})
        dev.start()
        with pytest.raises(flexor.FlexorError, match=r"E778 .*call stop\(\) for its record"):
            dev.wait(5)
        record = dev.stop()
    assert record is not None
    assert record.pulses == 5


@pytest.mark.parametrize(
    "kind",
    [
        flexor.FlexorError,
        flexor.Refused,
        flexor.ArmRefused,
        flexor.DeviceFault,
        flexor.LeaseExpired,
        flexor.ConnectionLost,
    ],
)
def test_errors_are_picklable(kind: type[flexor.FlexorError]) -> None:
    """Class, text and every mistake come back, for multiprocessing."""
    mistakes = [
        flexor.Mistake("E793 ma: 13", 793, "ma", "13", "0 to 12 mA", "lower it"),
        flexor.Mistake("a second one"),
    ]
    error = kind(*mistakes)
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is kind
    assert again.mistakes == tuple(mistakes)
    assert str(again) == str(error) == "E793 ma: 13\na second one"
    assert (again.number, again.field, again.value) == (793, "ma", "13")
    assert (again.allowed, again.remedy) == ("0 to 12 mA", "lower it")


def test_a_raised_error_is_picklable(dev: flexor.Device) -> None:
    """So is one that the extension made."""
    error = pytest.raises(flexor.Refused, dev.set, ma={1: 99}).value
    again = pickle.loads(pickle.dumps(error))
    assert again.mistakes == error.mistakes
    assert str(again) == str(error)


def test_an_error_of_a_text() -> None:
    """A text is a mistake without a field."""
    error = flexor.Refused("no limit")
    assert (str(error), error.number, error.field) == ("no limit", None, None)
    assert str(flexor.FlexorError()) == "FlexorError"


@pytest.mark.parametrize("action", [pickle.dumps, copy.copy, copy.deepcopy])
def test_a_device_is_not_picklable(dev: flexor.Device, action: Callable[[object], object]) -> None:
    """The message says what to do instead."""
    with pytest.raises(TypeError, match="connect in the process that uses it"):
        action(dev)
    assert dev.state == "running"


@pytest.mark.parametrize("action", [pickle.dumps, copy.copy, copy.deepcopy])
def test_a_record_is_not_picklable(action: Callable[[object], object]) -> None:
    """The message says what to do instead; its samples are."""
    record = flexor.run("open_finger")
    with pytest.raises(TypeError, match="pickle its samples, or write it"):
        action(record)
    assert len(pickle.loads(pickle.dumps(record.samples))) == len(record)


def test_a_folder_that_is_not_empty(tmp_path: Path) -> None:
    """Nothing is overwritten, and no device is opened."""
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(flexor.FlexorError, match="E590 .*it contains notes.txt"):
        flexor.connect("sim:", record=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_a_folder_in_use(tmp_path: Path) -> None:
    """Two devices do not write one record."""
    with running(record=tmp_path / "out") as dev:
        with pytest.raises(flexor.FlexorError, match="E59"):
            flexor.connect("sim:", record=tmp_path / "out")
        dev.wait(0.1)
        assert dev.state == "running"


def test_a_device_that_was_not_there_leaves_no_record(tmp_path: Path) -> None:
    """The second attempt can use the same folder."""
    out = tmp_path / "out"
    for _ in range(2):
        with pytest.raises(flexor.ConnectionLost, match="E504"):
            flexor.connect("tcp:127.0.0.1:1", record=out)


def test_a_record_while_it_runs(tmp_path: Path) -> None:
    """The record is on disk while it runs, and says that it is incomplete and simulated."""
    with running(record=tmp_path / "out") as dev:
        dev.set(ma={1: 8})
        dev.wait(5)
        summary = json.loads((tmp_path / "out" / "summary.json").read_text())
        assert "incomplete" in json.dumps(summary)
        (loaded,) = flexor.Record.load(tmp_path / "out")
        assert loaded.simulated
        assert len(loaded) > 100


def test_an_incomplete_record_says_so(tmp_path: Path) -> None:
    """Until the device is closed, a record that is read is incomplete."""
    with running(record=tmp_path / "out") as dev:
        dev.wait(5)
        (loaded,) = flexor.Record.load(tmp_path / "out")
        assert loaded.error is not None


def test_a_refused_setup_changes_nothing(idle: flexor.Device) -> None:
    """Each call that sets up is all or none."""
    before = idle.session_text
    calls: list[Callable[[], object]] = [
        lambda: idle.channel(2, TRAIN, limit_ma=200),
        lambda: idle.joint(flexors=[1]),
        lambda: idle.wall(at_deg=1),
        lambda: idle.modulation(joint="x"),
        lambda: idle.program(kind="on-off"),
        lambda: idle.body(kind="robot"),
        lambda: idle.group([1, 2], "conducted"),
        lambda: idle.sync(3),
    ]
    for call in calls:
        with pytest.raises(flexor.Refused) as caught:
            call()
        assert all(mistake.number for mistake in caught.value.mistakes)
        assert idle.session_text == before
