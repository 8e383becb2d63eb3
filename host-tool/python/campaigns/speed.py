"""Speed of the package beside the same loops in Rust, and how long a user waits.

    python speed.py [--wheel WHEEL] [--rounds 15] [--out FILE.json]

Run it with a release build of the package (`cargo verify release` builds the wheel). Each ratio is
the median over rounds; a round runs the loop of Python and the loop of Rust one after the other, in
an order that alternates, so that both see the same computer.

- *step*: ``dev.wait(0.02)`` on the finger of Hamana's experiment 4 with the record on disk, beside
  `Drive::wait` with the record on disk. Limit 1.25.
- *environment*: `flexor.gym.FingerEnv.step`, beside a loop in Rust that sends the same amplitudes,
  waits for a step and looks at the newest sample. Both record in memory, which is stricter than a
  record on disk. Limit 1.5.
- *import*: ``import flexor`` beyond ``import numpy``, in fresh processes. Limit 50 ms.
- *MyoElbow* (with the extra `myo`): share of the time that is not MuJoCo's. Limit 30 %.
- *first plot* (with `--wheel`): an empty virtual environment, the wheel with the extra `plot`, a
  session and a picture of it. Limit 60 s; most of it is the download of numpy and matplotlib.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import flexor
import numpy as np
from flexor import _native

STEP_S, STEPS = 0.02, 400
EXAMPLES = Path(__file__).parents[1] / "examples"
FIRST_PLOT = """
import flexor
import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt
record = flexor.run("reciprocal", seed=1)
plt.plot(record.samples["t_s"], record.samples["amplitude_1_ma"])
plt.savefig("first.png")
"""


def ratios(
    rounds: int, python: Callable[[], float], rust: Callable[[], float]
) -> dict[str, float | list[float]]:
    """Return the median ratio of both times and its quartiles, and the median time of a step."""
    found, steps_us = [], []
    for index in range(rounds):
        pair = [(python, 0), (rust, 1)]
        times = [0.0, 0.0]
        for call, place in pair if index % 2 else pair[::-1]:
            times[place] = call()
        found.append(times[0] / times[1])
        steps_us.append(1e6 * times[0] / STEPS)
    quartiles = statistics.quantiles(found, n=4)
    return {
        "ratio": statistics.median(found),
        "quartiles": [quartiles[0], quartiles[2]],
        "python_step_us": statistics.median(steps_us),
    }


def step_ratio(rounds: int, folder: Path) -> dict[str, Any]:
    """Compare `wait` on a recorded device."""
    env = flexor_env()
    env.reset(seed=1)
    session = session_of(env)
    count = iter(range(2 * rounds))

    def python() -> float:
        with flexor.connect(
            "sim:", session=session, record=folder / f"step-{next(count)}", telemetry_ms=10
        ) as dev:
            dev.arm()
            dev.start()
            begin = time.perf_counter()
            for _ in range(STEPS):
                dev.wait(STEP_S)
            return time.perf_counter() - begin

    def rust() -> float:
        record = folder / f"step-{next(count)}"
        return _native.time_steps(session, record, STEPS, round(1e6 * STEP_S), None)

    return ratios(rounds, python, rust)


def environment_ratio(rounds: int) -> dict[str, Any]:
    """Compare `FingerEnv.step` with fixed amplitudes."""
    env = flexor_env()
    env.reset(seed=1)
    session = session_of(env)
    action = np.array([0.5, 0.0], dtype=np.float32)
    played = {p.channel: p.threshold + 0.5 * (p.limit - p.threshold) for p in env._points[0]}
    played |= {p.channel: 0.0 for p in env._points[1]}

    def python() -> float:
        env.reset(seed=1)
        begin = time.perf_counter()
        for _ in range(STEPS):
            env.step(action)
        return time.perf_counter() - begin

    def rust() -> float:
        values = {env._unit: played}
        return _native.time_steps(session, None, STEPS, round(1e6 * STEP_S), values)

    return ratios(rounds, python, rust)


def flexor_env() -> Any:
    """Return the environment of the comparison."""
    from flexor.gym import FingerEnv

    return FingerEnv(step_s=STEP_S, duration_s=STEP_S * STEPS)


def session_of(env: Any) -> dict[str, Any]:
    """Return the session with which the environment connected."""
    return dict(env._device._complete(env._device._fields))


def import_ms(rounds: int) -> dict[str, float]:
    """Return the medians of the times that imports take in fresh processes."""
    code = "import time; b = time.perf_counter(); import {}; print(time.perf_counter() - b)"
    times: dict[str, list[float]] = {"numpy": [], "flexor": []}
    for _ in range(rounds):
        for name, found in times.items():
            done = subprocess.run(
                [sys.executable, "-c", code.format(name)],
                capture_output=True,
                text=True,
                check=True,
            )
            found.append(1000 * float(done.stdout))
    medians = {name: statistics.median(found) for name, found in times.items()}
    return {**medians, "beyond_numpy": medians["flexor"] - medians["numpy"]}


def elbow_share(seconds: float = 4.0) -> float | None:
    """Return the share of the time that is not MyoElbow's; None without MuJoCo."""
    sys.path.insert(0, str(EXAMPLES))
    try:
        import mujoco  # noqa: F401
        import myo_elbow
    except (ImportError, SystemExit):
        return None
    limb = myo_elbow.MyoElbow(1, 0.0)
    spent_s = 0.0

    def timed(pulses: list[flexor.Pulse], t_s: float) -> float:
        nonlocal spent_s
        begin = time.perf_counter()
        angle = limb(pulses, t_s)
        spent_s += time.perf_counter() - begin
        return float(angle)

    with flexor.connect("sim:", limb=timed, limb_period_s=myo_elbow.PERIOD_S) as dev:
        dev.channel(1, flexor.Train(rate_hz=50, width_us=35), limit_ma=80)
        dev.arm()
        dev.start()
        dev.set(ma={1: 60})
        spent_s, begin = 0.0, time.perf_counter()
        dev.wait(seconds)
        passed_s = time.perf_counter() - begin
    return 1 - spent_s / passed_s


def first_plot_s(wheel: Path, folder: Path) -> float:
    """Return the time from an empty folder to a picture of a session."""
    begin = time.perf_counter()
    venv = folder / "venv"
    python = str(venv / "bin/python")
    for command in (
        [sys.executable, "-m", "venv", str(venv)],
        [python, "-m", "pip", "install", "-q", f"{wheel.resolve()}[plot]"],
        [python, "-c", FIRST_PLOT],
    ):
        subprocess.run(command, check=True, cwd=folder)
    return time.perf_counter() - begin


def main() -> None:
    """Measure, and print what was asked beside what was found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--wheel", type=Path)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        report = {
            "step": step_ratio(arguments.rounds, folder),
            "environment": environment_ratio(arguments.rounds),
            "import_ms": import_ms(arguments.rounds),
            "flexor_share_with_myo_elbow": elbow_share(),
        }
        if arguments.wheel is not None:
            report["first_plot_s"] = first_plot_s(arguments.wheel, folder)
            report["wheel_bytes"] = arguments.wheel.stat().st_size
    text = json.dumps(report, indent=2)
    print(text)
    if arguments.out is not None:
        arguments.out.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
