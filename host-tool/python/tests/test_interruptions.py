"""Exceptions, Ctrl-C, threads and forks: the device stops first, and nothing hangs."""

import os
import threading
from pathlib import Path

import flexor
import pytest
from helpers import run_python, running

SETUP = """
import os, signal, sys, threading, time
# A shell ignores Ctrl-C for a command in the background, and the tests inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)
import flexor
def running(address="sim:", **arguments):
    dev = flexor.connect(address, **arguments)
    dev.channel(1, flexor.Train(rate_hz=30, width_us=200), limit_ma=12)
    dev.arm()
    dev.start()
    dev.set(ma={1: 8})
    return dev
"""

LONG = """
LONG = {
    "title": "long",
    "duration_s": 80_000,
    "channel": [{
        "number": 1, "name": "one", "limit": 12.0,
        "stage": {"kind": "current", "full_scale_ma": 100.0},
        "train": {"shape": "biphasic-cathodic-first", "width_us": 200, "frequency_hz": 50.0},
    }],
    "setpoints": {"kind": "amplitudes", "values": [{"channel": 1, "value": 8.0}], "rate_hz": 50},
}
"""


def test_an_exception_leaves_the_block(tmp_path: Path) -> None:
    """It is not replaced, and the device has stopped."""
    error = KeyError("mine")
    with pytest.raises(KeyError) as caught, running(record=tmp_path / "out") as dev:
        dev.set(ma={1: 8})
        dev.wait(0.5)
        raise error
    assert caught.value is error
    assert dev.state == "closed"
    (loaded,) = flexor.Record.load(tmp_path / "out")
    assert loaded.events[-1].text == "stopped: Request"
    assert loaded.duration_s == pytest.approx(0.55, abs=0.05)


def test_a_refused_value_leaves_the_block() -> None:
    """An uncaught refusal stops too."""
    with pytest.raises(flexor.Refused), running() as dev:
        dev.set(ma={1: 99})
    assert dev.state == "closed"


def test_a_system_exit_leaves_the_block() -> None:
    """So does the end of the program."""
    with pytest.raises(SystemExit), running() as dev:
        raise SystemExit(3)
    assert dev.state == "closed"


@pytest.mark.parametrize("address", ["sim:", "sim:realtime"])
def test_ctrl_c_stops_first(address: str) -> None:
    """Ctrl-C during a wait: the device is idle when the exception arrives."""
    code = f"""
threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
dev = running({address!r})
try:
    while True:
        dev.wait(60)
except KeyboardInterrupt:
    print(dev.state, dev.stop().events[-1].text)
"""
    done = run_python(SETUP + code)
    assert done.stdout.strip() == "idle stopped: Request", done.stderr


def test_ctrl_c_in_a_limb() -> None:
    """A signal that arrives at a known device time stops there."""
    code = """
def limb(pulses, t_s):
    if abs(t_s - 0.25) < 1e-6:
        signal.raise_signal(signal.SIGINT)
    return 0.0
dev = running(limb=limb)
try:
    dev.wait(5)
except KeyboardInterrupt:
    print(dev.state, round(dev.stop().duration_s, 1))
"""
    done = run_python(SETUP + code)
    assert done.stdout.strip() == "idle 0.3", done.stderr


def test_ctrl_c_in_a_run() -> None:
    """A session that runs ends too, and its record is readable."""
    code = """
threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    while True:
        flexor.run("ten_channels_and_hand")
except KeyboardInterrupt:
    print("interrupted")
"""
    done = run_python(SETUP + code)
    assert done.stdout.strip() == "interrupted", done.stderr


@pytest.mark.parametrize("address", ["sim:", "sim:realtime"])
def test_threads_share_a_device(address: str) -> None:
    """Calls of several threads take turns."""
    errors: list[BaseException] = []
    with running(address) as dev:

        def work(amplitude: float) -> None:
            try:
                for _ in range(20):
                    dev.set(ma={1: amplitude})
                    dev.wait(0.01)
            except BaseException as error:
                errors.append(error)

        threads = [threading.Thread(target=work, args=(ma,), daemon=True) for ma in (4, 5, 6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(20)
        assert not any(thread.is_alive() for thread in threads)
        assert errors == []
        assert dev.state == "running"
        if address == "sim:":
            assert 0.6 <= dev.time_s < 0.7


def test_closing_while_another_thread_waits() -> None:
    """The thread that waits learns that the device is closed."""
    caught: list[BaseException] = []
    dev = running("sim:realtime")
    is_waiting = threading.Event()

    def wait() -> None:
        is_waiting.set()
        try:
            dev.wait(30)
        except flexor.FlexorError as error:
            caught.append(error)

    thread = threading.Thread(target=wait, daemon=True)
    thread.start()
    is_waiting.wait()
    dev.close()
    thread.join(20)
    assert not thread.is_alive()
    assert [type(error) for error in caught] == [flexor.FlexorError]
    assert caught[0].args
    assert dev.state == "closed"


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.parametrize("address", ["sim:", "sim:realtime"])
def test_a_forked_child_has_no_device(address: str, tmp_path: Path) -> None:
    """In the child the device is closed; the parent goes on, and its record is whole."""
    code = f"""
dev = running({address!r}, record=sys.argv[1])
dev.wait(0.1)
child = os.fork()
if child == 0:
    said = [dev.state]
    for call in (lambda: dev.set(ma={{1: 2}}), lambda: dev.wait(1), dev.stop, dev.arm):
        try:
            call()
        except flexor.FlexorError as error:
            said.append(str(error.number))
    dev.close()
    print(*said, flush=True)
    del dev
    os._exit(0)
os.waitpid(child, 0)
before = dev.time_s
assert dev.wait(0.2) >= before + 0.2
print(dev.state, dev.record.samples["amplitude_1_ma"][-1] > 0)
record = dev.stop()
dev.close()
(loaded,) = flexor.Record.load(sys.argv[1])
print(len(loaded) == len(record), loaded.error)
"""
    done = run_python(SETUP + code, str(tmp_path / "out"))
    lines = done.stdout.splitlines()
    wanted = ["closed 775 775 775 775", "running True", "True None"]
    assert lines == wanted, done.stderr


@pytest.mark.parametrize("limb", ["", ", limb=lambda pulses, t_s: 0.0"])
@pytest.mark.parametrize("address", ["sim:", "sim:realtime"])
def test_a_device_that_nobody_closes(address: str, limb: str) -> None:
    """A dropped device stops, also at the end of the program; nothing hangs."""
    code = f"""
dev = running({address!r}{limb})
dev = running({address!r}{limb})
import gc
gc.collect()
print("end")
"""
    done = run_python(SETUP + code)
    assert (done.stdout, done.returncode) == ("end\n", 0), done.stderr


def test_a_device_in_a_cycle() -> None:
    """A device that the garbage collector finds stops too."""
    code = """
import gc
class Owner: pass
owner = Owner()
owner.me, owner.dev = owner, running("sim:realtime", limb=lambda pulses, t_s: 0.0)
del owner
gc.collect()
print("end")
"""
    done = run_python(SETUP + code)
    assert (done.stdout, done.returncode) == ("end\n", 0), done.stderr


@pytest.mark.parametrize("address", ["sim:", "sim:realtime"])
def test_ctrl_c_during_setpoints_stops_first(address: str) -> None:
    """A loop that runs within C sees signals in the calls of the device only."""
    code = f"""
import collections, functools
dev = running({address!r})
threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
send = functools.partial(dev._native.send, ma={{1: 7}})
try:
    collections.deque(iter(send, "never"), maxlen=0)
except KeyboardInterrupt:
    assert dev.state == "idle", dev.state
    assert "KeyboardInterrupt" in dev.record.error, dev.record.error
    print("stopped")
"""
    done = run_python(SETUP + code)
    assert (done.stdout.strip(), done.returncode) == ("stopped", 0), done.stderr


def test_ctrl_c_in_a_limb_ends_its_calls() -> None:
    """After its exception a limb is not called again, so the stop does not depend on it."""
    code = """
calls = []
def limb(pulses, t_s):
    calls.append(t_s)
    if t_s > 0.3:
        signal.raise_signal(signal.SIGINT)
    return 5.0
try:
    dev = running(limb=limb)
    dev.wait(5)
except KeyboardInterrupt:
    print("stopped", sum(t_s > 0.3 for t_s in calls))
"""
    done = run_python(SETUP + code)
    assert (done.stdout.split(), done.returncode) == (["stopped", "1"], 0), done.stderr


def test_ctrl_c_during_many_sessions() -> None:
    """A session of hours does not hold it up."""
    code = """
threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    flexor.run_many(LONG, range(4))
except KeyboardInterrupt:
    print("stopped")
"""
    done = run_python(SETUP + LONG + code)
    assert (done.stdout.strip(), done.returncode) == ("stopped", 0), done.stderr


def test_many_sessions_in_a_forked_process() -> None:
    """A child of a process that ran sessions can run some of its own."""
    code = """
pulses = [record.pulses for record in flexor.run_many("trigger", [1, 2])]
if (child := os.fork()) == 0:
    os._exit(0 if [r.pulses for r in flexor.run_many("trigger", [1, 2])] == pulses else 1)
print(os.waitpid(child, 0)[1])
"""
    done = run_python(SETUP + code)
    assert (done.stdout.strip(), done.returncode) == ("0", 0), done.stderr


def test_an_interrupted_run_is_not_complete(tmp_path: Path) -> None:
    """Its record says why, and how long it lasted."""
    code = """
threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    flexor.run(LONG, out=sys.argv[1])
except KeyboardInterrupt:
    (record,) = flexor.Record.load(sys.argv[1])
    assert record.duration_s < 80_000, record.duration_s
    print(record.error)
"""
    done = run_python(SETUP + LONG + code, str(tmp_path / "out"))
    assert done.stdout.startswith("KeyboardInterrupt ended"), done.stderr


def test_a_damaged_record_is_refused(tmp_path: Path) -> None:
    """A closed record that has lost rows is not loaded as if it were whole."""
    flexor.run("trigger", out=tmp_path / "out")
    (samples,) = (tmp_path / "out").glob("*/samples.csv")
    samples.write_text("\n".join(samples.read_text().splitlines()[:20]) + "\n")
    with pytest.raises(flexor.FlexorError, match="E585"):
        flexor.Record.load(tmp_path / "out")
