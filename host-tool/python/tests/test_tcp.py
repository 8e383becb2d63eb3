"""A simulated board behind a TCP port, in a process of its own."""

import socket
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import flexor
import numpy as np
import pytest
from helpers import ROOT, TRAIN, attempt, last, prepared, running


@contextmanager
def served(
    program: Path, session: str | None = None, waits: bool = True
) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Serve a simulated board on a free port until the block ends.

    Its wearer is that of a shipped session. If it `waits`, its time stands while the client is
    late, so that a busy computer ends nothing.
    """
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    place = f"127.0.0.1:{port}"
    command = [program, "serve", "--device", "native", "--tcp", place]
    if waits:
        command += ["--wait-for-host"]
    if session is not None:
        command += ["--body", ROOT / f"host-tool/sessions/{session}.toml"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        assert process.stdout is not None
        first = process.stdout.readline()  # printed when the port is open
        assert place in first, first
        drain = threading.Thread(target=process.stdout.read, daemon=True)
        drain.start()
        try:
            yield f"tcp:{place}", process
        finally:
            process.kill()
            drain.join(10)


@pytest.fixture
def address(program: Path) -> Iterator[str]:
    """Return the address of a simulated board."""
    with served(program) as (address, _):
        yield address


def script(address: str, record: Path) -> flexor.Record:
    """Play two amplitudes and a mark."""
    with prepared(address, record=record, telemetry_ms=10) as dev:
        assert dev.arm()[1].current_ma == pytest.approx(1, rel=0.05)
        dev.start()
        dev.set(ma={1: 8})
        dev.wait(0.8)
        assert last(dev, "amplitude_1_ma") == 8
        dev.mark("eight")
        dev.set(ma={1: 4})
        dev.wait(0.4)
        assert last(dev, "amplitude_1_ma") == 4
        returned = dev.stop()
    assert returned is not None
    return returned


def test_the_script_of_the_simulator(address: str, tmp_path: Path) -> None:
    """The same lines give the same columns, amplitudes, events and pulse rate."""
    there, here = script(address, tmp_path / "there"), script("sim:", tmp_path / "here")
    assert there.samples.dtype == here.samples.dtype
    for record in (there, here):
        assert [event.text for event in record.events] == ["stopping: Request", "stopped: Request"]
        assert record.error is None
        assert record.simulated
        # Calls of a board take time of their own, so the number of pulses is that of the length.
        assert record.pulses == pytest.approx(30 * record.duration_s, abs=4)
    (loaded,) = flexor.Record.load(tmp_path / "there")
    assert (loaded.error, len(loaded)) == (None, len(there))


def test_what_the_board_says_of_itself(address: str) -> None:
    """A simulated board says that it is simulated."""
    with flexor.connect(address) as dev:
        assert dev.info is not None
        assert dev.info["simulated"] is True
        assert dev.info["firmware"]
        assert dev.state == "idle"


def test_what_a_board_cannot(address: str) -> None:
    """Calls that need the simulator say so."""
    with running(address) as dev:
        for call in (dev.trigger, dev.snapshot):
            with pytest.raises(flexor.FlexorError, match="E77[69]"):
                call()
        dev.wait(0.05)
        assert dev.state == "running"
        dev.stop()
        with pytest.raises(flexor.FlexorError, match="E776 .*sim:"):
            dev.reset()


def test_two_trials_without_a_new_connection(address: str) -> None:
    """The connection stays open between trials."""
    with prepared(address) as dev:
        for amplitude in (4, 6):
            dev.arm()
            dev.start()
            dev.set(ma={1: amplitude})
            dev.wait(0.7)
            assert last(dev, "amplitude_1_ma") == amplitude
            record = dev.stop()
            assert record is not None
            assert record.pulses


def test_a_refused_value(address: str) -> None:
    """A refusal does not end stimulation."""
    with running(address) as dev:
        dev.set(ma={1: 5})
        with pytest.raises(flexor.Refused, match="E793"):
            dev.set(ma={1: 99})
        dev.wait(0.7)
        assert last(dev, "amplitude_1_ma") == 5


def test_a_server_that_is_killed(program: Path, tmp_path: Path) -> None:
    """The call says that the device is gone; what was recorded is readable."""
    with served(program) as (address, process):
        dev = running(address, record=tmp_path / "out")
        dev.set(ma={1: 8})
        dev.wait(0.5)
        process.kill()
        errors = [attempt(lambda: dev.wait(30)), attempt(lambda: dev.wait(30))]
        lost = next(error for error in errors if isinstance(error, flexor.ConnectionLost))
        assert isinstance(lost, ConnectionError)
        assert lost.number == 502
        assert "reconnect" in str(lost)
        assert dev.state == "idle"
        dev.close()
        (loaded,) = flexor.Record.load(tmp_path / "out")
        assert loaded.error is not None
        assert loaded.error.startswith("E5")
        assert len(loaded) > 30
        assert np.nanmax(loaded.samples["amplitude_1_ma"]) > 0
        with pytest.raises(flexor.ConnectionLost, match="E504"):
            flexor.connect(address)


def test_the_first_call_says_that_the_server_is_gone(program: Path) -> None:
    """No other error comes before the reason."""
    for _ in range(4):
        with served(program) as (address, process):
            dev = running(address)
            dev.wait(0.1)
            process.kill()
            error = attempt(lambda dev=dev: dev.wait(30))  # type: ignore[misc]
            dev.close()
        assert isinstance(error, flexor.ConnectionLost)


def test_a_second_device_on_a_port(address: str) -> None:
    """The second one does not get in, and the first goes on."""
    with running(address) as dev:
        dev.set(ma={1: 5})
        errors: list[BaseException] = []

        def second() -> None:
            try:
                flexor.connect(address).close()
            except BaseException as error:
                errors.append(error)

        thread = threading.Thread(target=second, daemon=True)
        thread.start()
        for _ in range(300):
            dev.wait(0.1)
            if not thread.is_alive():
                break
        assert not thread.is_alive()
        assert [type(error) for error in errors] == [flexor.ConnectionLost]
        assert "E112" in str(errors[0])
        assert "close the other program" in str(errors[0])
        assert dev.state == "running"


def test_a_connection_never_starts(address: str) -> None:
    """After a device was left running, a new connection is idle and outputs nothing."""
    first = running(address)
    first.set(ma={1: 8})
    first.wait(0.1)
    first.close()
    with flexor.connect(address) as dev:
        assert dev.state == "idle"
        dev.channel(1, TRAIN, limit_ma=12)
        dev.arm()
        dev.start()
        dev.wait(0.1)
        record = dev.stop()
    assert record is not None
    assert record.pulses == 0
