"""Simulated board of the dead man's campaign: process, trace, judge, and debugger halt."""

import ctypes
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

ROOT = Path(__file__).resolve().parents[3]
JUDGE = ROOT / "tests/judge/judge.py"
LOAD_OHM = 1000.0
CHANNELS = 10
FULL_SCALE_MA = 100.0
CHECK_PULSES = 8  # of an electrode check on each channel
OUTPUTS = (1 << 2 * CHANNELS) - 1  # bits of the outputs in a word of levels; 0: all isolated
CHANNEL = """[[channel]]
number = {number}
name = "channel {number}"
stage = {{ kind = "current", full_scale_ma = 100.0 }}
limit = 12.0
train = {{ shape = "biphasic-cathodic-first", width_us = 200, frequency_hz = 50.0 }}
"""
BODY = f"""title = "dummy loads"
duration_s = 60.0
[body]
kind = "still"
load_ohm = {LOAD_OHM:.0f}
[setpoints]
kind = "amplitudes"
values = [{{ channel = 1, value = 0.0 }}]
rate_hz = 50
"""


class Board:
    """`flexor serve` in a process of its own, which writes what it receives and outputs."""

    def __init__(self, program: Path, folder: Path, seed: int) -> None:
        """Start the board; `address` is where a client connects."""
        body = folder / "body.toml"
        body.write_text(BODY + "".join(CHANNEL.format(number=1 + n) for n in range(CHANNELS)))
        self._trace = folder / "trace.jsonl"
        arguments = ["--tcp", "127.0.0.1:0", "--seed", str(seed), "--seconds", "90"]
        arguments += ["--body", str(body), "--trace", str(self._trace)]
        self._process = subprocess.Popen(
            [program, "--json", "serve", *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            start_new_session=True,  # Ctrl-C is the campaign's
        )
        assert self._process.stdout is not None
        self.address: str = json.loads(self._process.stdout.readline())["at"]

    def __enter__(self) -> Self:
        """Return the board."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the board's process."""
        self._process.kill()
        self._process.wait()

    def wait_until(self, unix_us: int, device_ms: float, seconds: float) -> None:
        """Wait until so much device time has passed since a wall-clock time."""
        until = time.monotonic() + seconds
        since_us = None
        while time.monotonic() < until:
            with self._trace.open(encoding="utf-8") as file:
                lines = [json.loads(line) for line in file if line.endswith("\n")]
            if since_us is None:
                since_us = next((n["device_us"] for n in lines if n["unix_us"] > unix_us), None)
            if since_us is not None and lines[-1]["device_us"] > since_us + 1000 * device_ms:
                return
            time.sleep(0.1)

    def end(self) -> "Trace":
        """End the board in order and return its trace."""
        self._process.send_signal(signal.SIGTERM)
        self._process.wait(10)
        with self._trace.open(encoding="utf-8") as lines:
            return Trace([json.loads(line) for line in lines])


class Trace:
    """What a board received and output, in device time."""

    def __init__(self, lines: list[dict[str, Any]]) -> None:
        """Join the lines of the board's file."""
        self.lines = lines
        self.end_us: int = lines[-1]["device_us"]
        self.output: dict[str, list[Any]] = {"levels": [], "dac": [], "trips": []}
        for line in lines:
            for name, values in line.get("output", {}).items():
                self.output[name] += values

    def device_us(self, unix_us: int) -> int:
        """Return the device time of the last line that was written by a wall-clock time."""
        return int(max(n["device_us"] for n in self.lines if n["unix_us"] <= unix_us))

    def requests(self, from_us: int, until_us: int) -> list[tuple[int, str]]:
        """Return the requests received after one device time and by another: time, name."""
        return [
            (line["device_us"], request if isinstance(request, str) else next(iter(request)))
            for line in self.lines
            if from_us < line["device_us"] <= until_us
            for request in line.get("requests", [])
        ]

    def isolated_us(self) -> int:
        """Return the device time since which all channels are isolated; the end if they are not."""
        since_us, is_isolated = 0, True
        for t_us, word in self.output["levels"]:
            if is_isolated != (word & OUTPUTS == 0):
                is_isolated = not is_isolated
                since_us = t_us
        return since_us if is_isolated else self.end_us

    def has_output(self, from_us: int, until_us: int) -> bool:
        """Return whether a channel was driven or grounded in a stretch of device time."""
        levels = self.output["levels"]
        return any(from_us <= t_us <= until_us and word & OUTPUTS for t_us, word in levels)

    def clock_us(self, from_us: int, until_us: int) -> tuple[int, int, int]:
        """Return by how much the board's clock lagged and gained, and its longest pause, µs."""
        part = [n for n in self.lines if from_us <= n["device_us"] <= until_us]
        if len(part) < 2:
            return 0, 0, 0
        gains = [n["device_us"] - n["unix_us"] - part[0]["device_us"] for n in part]
        gains = [gain + part[0]["unix_us"] for gain in gains]
        pauses = [b["unix_us"] - a["unix_us"] for a, b in zip(part, part[1:], strict=False)]
        return -gains[-1], max(gains), max(pauses)

    def findings(self, channels: list[dict[str, Any]], quiet_from_us: int) -> list[dict[str, Any]]:
        """Judge the output at the electrodes by tests/judge; nothing may flow from a time on."""
        truth = {
            "channels": [_truth(channels, 1 + index) for index in range(CHANNELS)],
            "hardware": HARDWARE,
            "stuck": [],
            "faults": [],
            "quiet": [{"from_us": quiet_from_us, "until_us": self.end_us}],
        }
        case = {"trace": self.output, "pump": "Throughout", "truth": truth, "end_us": self.end_us}
        judge = subprocess.run(
            ["nice", "-n", "19", sys.executable, "-B", JUDGE],
            input=json.dumps(case) + "\n",
            stdout=subprocess.PIPE,
            text=True,
            check=True,
            start_new_session=True,
        )
        verdict = json.loads(judge.stdout)
        return [
            {**finding, "stage": stage}
            for stage, account in verdict.items()
            for finding in account["findings"]
        ]


HARDWARE = {  # docs/reference/hardware.md, as hal_sim::trace::judge::Hardware::REFERENCE
    "logic": "Interlocked",
    "one_shot_us": 600,
    "capacitor_f": 4e-6,
    "bleed_ohm": 10e6,
    "compliance_v": 120.0,
    "limiter_ma": 20.0,
    "pump_hold_us": 300,
    "latch_clear_us": 10_000,
    "comparator_us": 1,
    "bank_comparator_us": 10,
    "bank_full_scale_ma": 125.0,
}


def _truth(channels: list[dict[str, Any]], number: int) -> dict[str, Any]:
    used = next((c for c in channels if c["number"] == number), None)
    pulses = 0 if used is None else CHECK_PULSES + -(-1_000_000 // int(1e6 / used["rate_hz"]))
    return {
        "stage": {"Current": {"full_scale_ma": FULL_SCALE_MA}},
        "loads": [[0, LOAD_OHM]],
        "limit_ma": 0.0 if used is None else used["limit_ma"],
        "pulses_per_s": pulses,
        "mismatch": 0.0,
        "trip_ma": 120.0,
    }


_PTRACE = ctypes.CDLL(None, use_errno=True).ptrace
_PTRACE.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
_PTRACE.restype = ctypes.c_long
_SEIZE, _INTERRUPT, _DETACH, _WALL = 0x4206, 0x4207, 17, 0x40000000


class DebuggerHalt:
    """Halts every thread of a child process by ptrace, as gdb's `attach` and `interrupt` do."""

    def __init__(self, process: int) -> None:
        """Halt the process; `resume` must be called by the same thread."""
        self._threads: list[int] = []
        self._caller = threading.get_ident()
        while new := [t for t in _threads_of(process) if t not in self._threads]:
            for thread in new:
                _ptrace(_SEIZE, thread)
                _ptrace(_INTERRUPT, thread)
                os.waitpid(thread, _WALL)
                self._threads.append(thread)

    def resume(self) -> None:
        """Let the process go on, and detach."""
        assert self._caller == threading.get_ident()
        for thread in self._threads:
            _ptrace(_DETACH, thread)


def is_stopped(process: int) -> bool:
    """Return whether every thread of a process is stopped by a signal."""
    for thread in _threads_of(process):
        stat = Path(f"/proc/{process}/task/{thread}/stat").read_text()
        if stat.rpartition(")")[2].split()[0] not in "TZ":
            return False
    return True


def _threads_of(process: int) -> list[int]:
    return [int(name) for name in os.listdir(f"/proc/{process}/task")]


def _ptrace(request: int, thread: int) -> None:
    if _PTRACE(request, thread, None, None) != 0:
        raise OSError(ctypes.get_errno(), f"ptrace {request:#x} of thread {thread}")
