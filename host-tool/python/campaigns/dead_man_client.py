"""Client of the dead man's campaign: stimulates until it fails, or until it is made to fail.

`dead_man_client.py SETUP.json`. Prints one JSON object per line: `running` when the board
stimulates, `failed` with the wall-clock time at which the last call returned, and `error` with the
exceptions that later calls raised. Times are in µs after 1970.
"""

import code
import ctypes
import json
import random
import sys
import time
from typing import Any

import flexor

LONGEST_S = 30.0  # life of a client that nobody ends
RETRY_S = 0.3  # time for which a client keeps calling a device that has stopped


def report(event: str, **fields: Any) -> None:
    """Print an event."""
    print(json.dumps({"event": event, "unix_us": time.time_ns() // 1000, **fields}), flush=True)


def begin(setup: dict[str, Any]) -> flexor.Device:
    """Connect, set up, arm and start the board, and raise the amplitudes."""
    limits = flexor.Limits(
        host_timeout_ms=setup["host_timeout_ms"], fall_ms=setup["fall_ms"], rise_ms=50
    )
    dev = flexor.connect(
        setup["address"], record=setup["record"], lease_s=setup["lease_s"], limits=limits
    )
    for channel in setup["channels"]:
        train = flexor.Train(
            rate_hz=channel["rate_hz"], width_us=channel["width_us"], offset_us=channel["offset_us"]
        )
        dev.channel(channel["number"], train, limit_ma=channel["limit_ma"])
        if channel["duty"] is not None:
            dev.duty(channel["number"], **channel["duty"])
    dev.arm()
    dev.start()
    dev.set(ma=amplitudes(setup, 1.0))
    report("running")
    return dev


def amplitudes(setup: dict[str, Any], share: float) -> dict[int, float]:
    """Return a share of the amplitudes by channel, mA."""
    return {c["number"]: round(c["ma"] * share, 3) for c in setup["channels"]}


def stimulate(dev: flexor.Device, setup: dict[str, Any], seconds: float) -> int:
    """Stimulate with changing amplitudes. Return the time at which the last call returned, µs."""
    randomness = random.Random(setup["seed"])
    last_us, until = time.time_ns() // 1000, time.monotonic() + seconds
    while time.monotonic() < until:
        if randomness.random() < 0.3:
            dev.set(ma=amplitudes(setup, randomness.uniform(0.7, 1.0)))
        else:
            dev.wait(randomness.uniform(0.002, 0.05))
        last_us = time.time_ns() // 1000
    return last_us


def call_again(dev: flexor.Device, setup: dict[str, Any]) -> None:
    """Keep calling for a while, as a program that ignores exceptions does, and close."""
    errors: list[str] = []
    until = time.monotonic() + RETRY_S
    while time.monotonic() < until:
        try:
            dev.set(ma=amplitudes(setup, 1.0))
            dev.wait(0.01)
        except flexor.FlexorError as error:
            if len(errors) < 4:
                errors.append(f"{type(error).__name__}: {error}")
            time.sleep(0.01)
    report("error", errors=errors)
    dev.close()


def failed_cell(setup: dict[str, Any]) -> None:
    """Run cells as a notebook does: an exception ends a cell, and the process goes on."""
    notebook = code.InteractiveInterpreter({"setup": setup, "client": sys.modules[__name__]})
    notebook.runcode(compile("dev = client.begin(setup)", "cell 1", "exec"))
    cell = "last_us = client.stimulate(dev, setup, setup['fail_after_s'])\nreading = 1 / 0"
    notebook.runcode(compile(cell, "cell 2", "exec"))
    if "last_us" not in notebook.locals:
        return  # the board had stopped before; the exception is on standard error
    report("failed", last_us=notebook.locals["last_us"])
    sys.stdin.readline()  # the notebook waits for its user
    notebook.runcode(compile("client.call_again(dev, setup)", "cell 3", "exec"))


def main() -> None:
    """Fail in the way that the setup names; the campaign does the rest."""
    with open(sys.argv[1], encoding="utf-8") as file:
        setup = json.load(file)
    if setup["way"] == "failed cell":
        failed_cell(setup)
        return
    dev = begin(setup)
    if setup["way"] == "GIL held":
        hold = ctypes.PyDLL(None).sleep  # a C function that is called without releasing the GIL
        last_us = stimulate(dev, setup, setup["fail_after_s"])
        report("failed", last_us=last_us)
        hold(5)
    else:
        try:
            stimulate(dev, setup, LONGEST_S)
        except flexor.FlexorError as error:
            report("error", errors=[f"{type(error).__name__}: {error}"])
    call_again(dev, setup)


if __name__ == "__main__":
    main()
