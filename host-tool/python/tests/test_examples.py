"""Examples: they run, and print tables of at most 80 columns with the expected content."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"


def load(name: str) -> ModuleType:
    """Import an example without running it."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run(name: str) -> list[str]:
    """Run an example as a user does, and return the lines that it prints."""
    done = subprocess.run(
        [sys.executable, EXAMPLES / f"{name}.py"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    lines = done.stdout.splitlines()
    assert all(len(line) <= 80 for line in lines)
    return lines


def test_own_finger_tracks() -> None:
    """Each controller has its row; all but the paper's track on both fingers."""
    rows = [re.findall(r"\d+\.\d+", line) for line in run("own_finger")[2:]]
    assert [len(row) for row in rows] == [4, 4, 4]
    default, pid, paper = ([float(value) for value in row] for row in rows)
    for rms in (default[0], default[2], pid[0], pid[2]):
        assert rms < 3.0
    assert paper[0] > pid[0] and paper[2] > pid[2]


def test_own_finger_is_short() -> None:
    """The limb is a finger in 40 lines."""
    text = (EXAMPLES / "own_finger.py").read_text()
    limb = text[text.index("class Finger") : text.index("def set_up")].strip()
    assert len(limb.splitlines()) <= 40


@pytest.fixture(scope="module")
def myo() -> ModuleType:
    """Return the example of MyoElbow, or skip."""
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    pytest.importorskip("myo_sim", reason="myo-sim is not installed")
    return load("myo_elbow")


def test_myo_elbow_has_the_preregistered_torques(myo: ModuleType) -> None:
    """Full recruitment holds 5 and 6 N·m at 90°, and the passive joint is as reported."""
    elbow = myo.MyoElbow(1, 0.0)
    passive_nm = elbow.torque_nm(90.0, {})
    for channel, signed_nm in ((myo.TRICEPS, -5.0), (myo.BICEPS, 6.0)):
        full_nm = elbow.torque_nm(90.0, {channel: elbow.scales[channel]})
        assert full_nm - passive_nm == pytest.approx(signed_nm)
    assert passive_nm == pytest.approx(-3.6, abs=0.1)


def test_myo_elbow_rests_on_a_soft_wall(myo: ModuleType) -> None:
    """A soft wall holds the arm, the same seed gives the same angles, and limbs differ."""
    approach = [{"at_s": 0.5, "speed_deg_per_s": 55.0, "for_s": 60.0}]
    wall = {"stiffness_per_deg": 2.0}
    record, again = (myo.run("MyoElbow", 1, 6.0, approach, wall=wall) for _ in range(2))
    assert (record.samples["true_deg"] == again.samples["true_deg"]).all()
    assert myo.swing_deg(record, 5.0, 6.0) < 1.0
    assert 95.0 < myo.furthest_deg(record, 5.0, 6.0) < 125.0


def test_myo_elbow_follows_the_default_controller(myo: ModuleType) -> None:
    """With the limb's own file, the default controller tracks."""
    torques = {"flexion_nm": 6.0, "extension_nm": 5.0}
    wearer = {**myo.MyoElbow(1, 0.0).wearer(), **torques}
    record = myo.run("MyoElbow", 1, 20.0, [], joint={"law": "recommended", "wearer": wearer})
    samples = record.samples[record.samples["t_s"] > 10.0]
    assert abs(samples["target_deg"] - samples["true_deg"]).mean() < 3.0
