"""The simulator in real time: the lease, setpoints, and closing. Only device time is judged."""

import time
import warnings
from pathlib import Path

import flexor
import numpy as np
import pytest
from helpers import last, prepared, running


def overslept(tmp_path: Path | None = None) -> flexor.Device:
    """Return a device whose lease has run out while it played 8 mA."""
    dev = running("sim:realtime", lease_s=0.05, record=tmp_path)
    dev.set(ma={1: 8})
    while dev.state == "running":  # looking at the state renews nothing
        time.sleep(0.02)
    return dev


def test_the_lease_of_a_program_that_sleeps() -> None:
    """The next call says what to use instead; the one after that, what to do."""
    with overslept() as dev:
        with pytest.raises(flexor.LeaseExpired) as caught:
            dev.set(ma={1: 8})
        assert caught.value.number == 773
        assert "0.05 s, the lease" in str(caught.value)
        assert "use dev.wait(5) instead of time.sleep(5)" in str(caught.value)
        assert dev.state == "idle"
        with pytest.raises(flexor.FlexorError, match=r"E772 .*call arm\(\) first"):
            dev.set(ma={1: 8})
        assert dev.state == "idle"


@pytest.mark.parametrize("name", ["wait", "start", "mark", "arm"])
def test_every_call_says_that_the_lease_ran_out(name: str) -> None:
    """Whatever comes first after it."""
    arguments: dict[str, list[object]] = {"wait": [1], "mark": ["x"]}
    with overslept() as dev, pytest.raises(flexor.LeaseExpired):
        getattr(dev, name)(*arguments.get(name, []))
    assert dev.state == "closed"


def test_stopping_after_the_lease(tmp_path: Path) -> None:
    """`stop` is never refused: it returns the record, and warns."""
    with overslept(tmp_path / "out") as dev:
        with pytest.warns(RuntimeWarning, match="E773 .*dev.wait"):
            record = dev.stop()
        assert record is not None
        assert record.error is not None
        assert record.error.startswith("E773")
        assert [event.text for event in record.events] == ["stopping: Request", "stopped: Request"]
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            again = dev.stop()
        assert again is not None
        assert len(again) == len(record)


def test_closing_after_the_lease() -> None:
    """Leaving the block is the next call, which raises what no call has raised yet."""
    with pytest.raises(flexor.LeaseExpired), overslept() as dev:
        pass
    dev.close()  # a second time does nothing
    assert dev.state == "closed"


def test_the_record_says_that_the_lease_ran_out(tmp_path: Path) -> None:
    """The reason of the end is on disk too."""
    with pytest.raises(flexor.LeaseExpired), overslept(tmp_path / "out"):
        pass
    (loaded,) = flexor.Record.load(tmp_path / "out")
    assert loaded.error is not None


def test_the_device_can_be_armed_again() -> None:
    """An expired lease ends one trial, not the device; nothing starts by itself."""
    with overslept() as dev:
        with pytest.raises(flexor.LeaseExpired):
            dev.wait(1)
        dev.arm()
        assert dev.state == "armed"
        assert dev.time_s == 0
        dev.start()
        assert dev.wait(0.02) >= 0.02
        record = dev.stop()
    assert record is not None
    assert record.pulses == 0


def test_an_armed_device_needs_no_lease() -> None:
    """Nothing is stimulated, so nothing expires."""
    with prepared("sim:realtime", lease_s=0.05) as dev:
        time.sleep(0.2)
        dev.arm()
        time.sleep(0.2)
        assert dev.state == "armed"
        dev.start()
        assert dev.state == "running"


def test_waiting_renews_the_lease() -> None:
    """A wait may be longer than the lease."""
    with running("sim:realtime", lease_s=0.5) as dev:
        before = dev.time_s
        assert dev.wait(0.8) >= before + 0.8
        assert dev.state == "running"


def test_a_stream_renews_the_lease() -> None:
    """Every turn does, and each sample comes once."""
    with running("sim:realtime", lease_s=0.5) as dev:
        dev.set(ma={1: 8})
        times = [row["t_s"] for row in dev.stream(0.8)]
        assert dev.state == "running"
    assert len(times) >= 75
    np.testing.assert_allclose(np.diff(times), 0.01, atol=1e-6)


def test_time_passes_by_itself() -> None:
    """Without a call the device goes on, within the lease."""
    with running("sim:realtime", lease_s=10) as dev:
        before = dev.time_s
        time.sleep(0.1)
        assert dev.time_s > before


def test_setpoints_play() -> None:
    """Values take effect while time passes."""
    with running("sim:realtime", all_edges=True) as dev:
        dev.set(ma={1: 8})
        dev.wait(0.7)
        assert last(dev, "amplitude_1_ma") == 8
        dev.set(ma={1: 0})
        dev.wait(0.3)
        assert np.isnan(last(dev, "amplitude_1_ma"))
        with pytest.raises(flexor.Refused, match="E793"):
            dev.set(ma={1: 13})
        assert dev.state == "running"
        record = dev.stop()
    assert record is not None
    assert record.pulses is not None
    assert record.pulses > 15
    assert len(record.edges) >= 4 * record.pulses - 4


def test_closing_stops(tmp_path: Path) -> None:
    """The last event of the record is the stop."""
    dev = running("sim:realtime", record=tmp_path / "out")
    dev.set(ma={1: 8})
    dev.wait(0.2)
    dev.close()
    assert dev.state == "closed"
    (loaded,) = flexor.Record.load(tmp_path / "out")
    assert loaded.events[-1].text == "stopped: Request"
    assert loaded.error is None


def test_a_limb_in_real_time() -> None:
    """A limb is called from the device's thread, in order."""
    times: list[float] = []

    def limb(pulses: list[flexor.Pulse], t_s: float) -> float:
        times.append(t_s)
        return 7.0

    with running("sim:realtime", limb=limb) as dev:
        dev.wait(0.2)
        assert last(dev, "true_deg") == 7
    assert times == sorted(times)
    assert len(times) >= 200


def test_a_snapshot_in_real_time() -> None:
    """A device in real time is refused, or copied into simulated time; it plays on."""
    with running("sim:realtime") as dev:
        dev.wait(0.05)
        try:
            copy = dev.snapshot()
        except flexor.FlexorError as error:
            assert error.number == 779
        else:
            assert copy.state == "running"
            assert copy.wait(1) >= 1
            copy.close()
        assert dev.state == "running"
