"""What the tests share: a small setup, the program, and comparisons."""

import csv
import os
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import flexor
import numpy as np

ROOT = Path(__file__).resolve().parents[3]
PROGRAM = Path(os.environ.get("FLEXOR_PROGRAM", ROOT / "target/debug/flexor"))
TRAIN = flexor.Train(rate_hz=30, width_us=200)


def without_prediction(name: str) -> dict[str, Any]:
    """Return the fields of a shipped session without muscle models, which arms at once."""
    fields = tomllib.loads((ROOT / "host-tool/sessions" / f"{name}.toml").read_text())
    for channel in fields["channel"]:
        if "muscle" in channel:
            channel["muscle"]["model"] = "none"
    return fields


def prepared(address: str = "sim:", **arguments: Any) -> flexor.Device:
    """Return a device with channel 1 set up, up to 12 mA."""
    dev = flexor.connect(address, **arguments)
    dev.channel(1, TRAIN, limit_ma=12)
    return dev


def running(address: str = "sim:", **arguments: Any) -> flexor.Device:
    """Return a device whose channel 1 plays, at 0 mA."""
    dev = prepared(address, **arguments)
    dev.arm()
    dev.start()
    return dev


def playing(session: str | dict[str, Any], **arguments: Any) -> flexor.Device:
    """Return a simulator that plays the setup of a shipped session."""
    dev = flexor.connect("sim:", session=session, **arguments)
    dev.arm()
    dev.start()
    return dev


def last(dev: flexor.Device, column: str) -> float:
    """Return the latest value of a column of the samples."""
    assert dev.record is not None
    return float(dev.record.samples[column][-1])


def read_samples(path: Path) -> dict[str, list[Any]]:
    """Return the columns of samples.csv: floats, NaN for a blank, and the texts of `state`."""
    with path.open(newline="") as file:
        names, *rows = csv.reader(file)

    def value(name: str, text: str) -> Any:
        return text if name == "state" else float(text or "nan")

    return {name: [value(name, row[i]) for row in rows] for i, name in enumerate(names)}


def assert_same_samples(record: flexor.Record, path: Path) -> None:
    """Compare the samples of a record with a file, number by number."""
    wanted = read_samples(path)
    assert list(record.samples.dtype.names or ()) == list(wanted)
    for name, values in wanted.items():
        np.testing.assert_array_equal(record.samples[name], values, err_msg=name)


def table(folder: Path, name: str, trial: int = 1) -> Path:
    """Return the path of a table of a trial in a record."""
    return next(folder.glob(f"{trial:02}-*")) / name


def assert_equal_tables(actual: Any, wanted: Any) -> None:
    """Compare two structured arrays. NaN equals NaN."""
    assert actual.dtype == wanted.dtype
    for name in wanted.dtype.names:
        np.testing.assert_array_equal(actual[name], wanted[name], err_msg=name)


def run_python(
    code: str, *arguments: str, timeout_s: float = 30
) -> subprocess.CompletedProcess[str]:
    """Run a program in a process of its own; a hang ends the test."""
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout_s, check=False)


def attempt(call: Callable[[], Any]) -> BaseException | None:
    """Return the exception that a call raises; None if there is none."""
    try:
        call()
    except BaseException as error:
        return error
    return None
