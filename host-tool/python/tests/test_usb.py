"""The same script on a chip behind USB CDC, and on the simulator in this process."""

import json
import signal
import subprocess
from pathlib import Path
from typing import Any

import flexor
import numpy as np
from helpers import ROOT

CHANNELS = 10
ISOLATED, CATHODIC, ANODIC = 0, 1, 2
NAMES = {0: "isolated", CATHODIC: "cathodic", ANODIC: "anodic", 3: "grounded"}
PLAYED_S = 2.0
STOP_US = 300_000  # before the end, the moment of the stop decides on the edges

Row = tuple[int, int, str, int]


def script(address: str) -> flexor.Record:
    """Play two channels in duty cycles; the device times their amplitudes, not this computer."""
    limits = flexor.Limits(rise_ms=100)
    with flexor.connect(address, all_edges=True, limits=limits) as dev:
        dev.channel(1, flexor.Train(rate_hz=30, width_us=200), limit_ma=12, full_scale_ma=50)
        train = flexor.Train(rate_hz=50, width_us=300, offset_us=4000)
        dev.channel(2, train, limit_ma=10, full_scale_ma=50)
        dev.duty(1, on_s=0.6, off_s=0.4, ramp_s=0.2)
        dev.duty(2, on_s=0.8, off_s=0.3, ramp_s=0.15, delay_s=0.3)
        dev.arm()
        dev.set(ma={1: 8, 2: 5})
        dev.start()
        dev.wait(PLAYED_S)
        record = dev.stop()
    assert record is not None
    return record


def edges_of(lines: list[dict[str, Any]]) -> list[Row]:
    """Return the edges after the start, from the pins and DAC of a served board."""
    requests = [
        (line["device_us"], request) for line in lines for request in line.get("requests", [])
    ]
    start_us = next(t_us for t_us, request in requests if request == "Start")
    codes, before, rows = [0] * CHANNELS, 0, list[Row]()
    # A write in the same microsecond does not count yet.
    writes = [(w["t_us"], 1, w) for line in lines for w in line.get("output", {}).get("dac", [])]
    levels = [(t, 0, w) for line in lines for t, w in line.get("output", {}).get("levels", [])]
    for t_us, is_write, entry in sorted([*writes, *levels], key=lambda event: event[:2]):
        if is_write:
            codes[entry["channel"]] = entry["code"]
            continue
        for channel in range(CHANNELS):
            state = entry >> 2 * channel & 3
            if state != before >> 2 * channel & 3 and t_us > start_us:
                rows.append((t_us, channel + 1, NAMES[state], codes[channel]))
        before = entry
    return rows


def from_first_pulse(rows: list[Row]) -> list[Row]:
    """Return rows with times since the first phase that is driven, without the stop."""
    first_us = next(t_us for t_us, _, state, _ in rows if state in ("cathodic", "anodic"))
    moved = [(t_us - first_us, *rest) for t_us, *rest in rows]
    return [row for row in moved if 0 <= row[0] < PLAYED_S * 1e6 - STOP_US]  # type: ignore[misc]


def test_a_chip_behind_usb_gives_the_edges_of_the_simulator(program: Path, tmp_path: Path) -> None:
    """Every edge of both channels is the same to the microsecond, with the same DAC code."""
    port, trace = tmp_path / "board", tmp_path / "trace.jsonl"
    session = ROOT / "host-tool/sessions/reciprocal.toml"
    command = [program, "--json", "serve", "--device", "chip", "--pty", port, "--trace", trace]
    command += ["--wait-for-host", "--body", session]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as board:
        try:
            assert board.stdout is not None
            assert json.loads(board.stdout.readline())["at"] == str(port)
            there = script(f"serial:{port}")
        finally:
            board.send_signal(signal.SIGTERM)
            board.wait(30)
    lines = [json.loads(line) for line in trace.read_text().splitlines()]
    there_rows = from_first_pulse(edges_of(lines))
    here = script("sim:").edges
    rows = [(int(e["t_us"]), int(e["channel"]), str(e["state"]), int(e["dac_code"])) for e in here]
    here_rows = from_first_pulse(rows)
    np.testing.assert_array_equal(there_rows[:10], here_rows[:10])
    assert there_rows == here_rows
    assert {channel for _, channel, *_ in here_rows} == {1, 2}
    assert len(here_rows) > 200
    assert there.simulated
